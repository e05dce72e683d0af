//! A box around what the masks leave, found without knowing where to look.

use glam::{DMat3, DVec2, DVec3};
use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::field::Field;
use crate::octree::{Grid, LEAF, leaves};
use crate::residual::median;
use crate::signed_distance::bounds_of;
use crate::view::CaptureView;

/// Blocks along the side of a box while it is made smaller.
const BLOCKS: u32 = 48;

/// The box is looked at again as long as it becomes smaller by this factor, and so often at most.
const SMALLER: f64 = 0.9;
const MOST_ROUNDS: u32 = 12;

/// Half the side of the first box, in distances of the cameras from its middle.
const FIRST_REACH: f64 = 0.95;

/// How singular the equations for a point near all rays may be: rays that are parallel to a thousandth.
const LEAST_DETERMINANT: f64 = 1e-6;

/// The point nearest to the rays through the middles of all masks, and the median distance of the cameras from it; `None` where the
/// rays are parallel.
pub(crate) fn middle_of(views: &[CaptureView]) -> Option<(DVec3, f64)> {
    let (mut left, mut right) = (DMat3::ZERO, DVec3::ZERO);
    // About the first eye, which keeps the digits of cameras that are far from the origin.
    let origin = views.first()?.camera.eye;
    for view in views {
        let (low, high) = bounds_of(&view.mask)?;
        let half = |k: usize| 0.5 * (f64::from(low[k]) + f64::from(high[k]));
        let ray = view.camera.direction(DVec2::new(half(0), half(1)));
        let ray = ray.normalize_or_zero();
        let across = DMat3::IDENTITY - DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        left += across;
        right += across * (view.camera.eye - origin);
    }
    let count = views.len() as f64;
    if (left * (1.0 / count)).determinant() < LEAST_DETERMINANT {
        return None;
    }
    let middle = origin + left.inverse() * right;
    let distance = median(views.iter().map(|v| v.camera.eye.distance(middle)))?;
    (middle.is_finite() && distance > 0.0).then_some((middle, distance))
}

/// The first box: around the middle of all rays, almost as large as the ring of cameras.
pub(crate) fn first_box((middle, distance): (DVec3, f64)) -> [DVec3; 2] {
    let half = DVec3::splat(FIRST_REACH * distance);
    [middle - half, middle + half]
}

/// The smallest box of blocks around what is not outside in the box, with a margin; `None` where everything is.
pub(crate) fn shrink(
    field: &Field<'_>,
    mut around: [DVec3; 2],
    (stage, watch): (Stage, &Watch<'_>),
) -> Result<Option<[DVec3; 2]>, Interrupted> {
    let quiet = watch.quiet();
    let limits = around;
    for _ in 0..MOST_ROUNDS {
        let grid = Grid::over(around, BLOCKS * LEAF);
        let found = leaves(field, &grid, (stage, &quiet))?;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for leaf in &found {
            low = low.min(grid.point(leaf.first));
            high = high.max(grid.point(leaf.first) + f64::from(LEAF) * grid.cell);
        }
        if found.is_empty() {
            return Ok(None);
        }
        let before = (around[1] - around[0]).max_element();
        around = [low.max(limits[0]), high.min(limits[1])];
        if (around[1] - around[0]).max_element() > SMALLER * before {
            break;
        }
    }
    Ok(Some(around))
}
