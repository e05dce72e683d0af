//! What the outline of a cell of eyes is interpolated for, and how finely it is sorted.

use silmap_geometry::{Camera, CameraError};
use silmap_map::BoundingSphere;

use crate::bands::BandParams;
use crate::cells::{Cell, ReuseError, SIZE_STEP};
use crate::curve::{ROOM, Sorting};

/// Pixels beyond the outline that coverage and rounding reach.
const BEYOND_PX: f64 = 1.5;

/// How far points that are left out may be from the outline, pixels, where it need not be exact.
const THINNED_PX: f64 = 0.1;

/// How finely a cell's outline is sorted: it may move by as much as the eye does within twice the cell, and pictures may be smaller by
/// [`SIZE_STEP`] than the largest.
#[must_use]
pub fn sorting_of(cell: &Cell, error: &ReuseError) -> Sorting {
    let turn = if error.allowed_px > 0.0 {
        let twice = ReuseError {
            allowed_px: 2.0 * error.allowed_px,
        };
        twice.reach(cell.radius_px).sin()
    } else {
        0.0
    };
    let smallest_px = cell.radius_px / SIZE_STEP;
    Sorting {
        bands: BandParams::for_size(2.0 * cell.radius_px, turn + BEYOND_PX / smallest_px),
        tolerance: THINNED_PX.min(0.5 * error.allowed_px) / cell.radius_px,
        turn,
    }
}

/// The camera that an outline is interpolated for, of a model in a sphere.
///
/// # Errors
/// When the sphere has no radius, or a number is not finite.
pub fn camera_of(sphere: &BoundingSphere, cell: &Cell) -> Result<Camera, CameraError> {
    let side_px = (2.0 * ROOM * cell.radius_px).ceil() as u32;
    let eye = cell.middle.eye(sphere.center, sphere.radius);
    Camera::fit_sphere(eye, sphere.center, sphere.radius, None, (side_px, side_px))
}
