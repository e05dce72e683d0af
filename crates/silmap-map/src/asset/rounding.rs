//! What contours and depths are rounded to in a file, and the cameras that follow from its numbers.

use glam::DVec3;
use silmap_geometry::{Camera, CoverageRule};

use super::AssetError;
use crate::{CapturedView, SilhouetteMap};

/// Contour points are rounded to this fraction of a pixel, so each moves by at most 1/32 pixel along x and y.
pub const POINT_STEPS_PER_PX: f64 = 16.0;

/// Largest point coordinate or depth in steps: differences stay far from overflow and products with the step are exact.
pub(super) const MAX_STEPS: f64 = (1_u64 << 40) as f64;

/// How far a camera may be from the rebuilt one, relative to unit vectors and tangents.
const CAMERA_SLACK: f64 = 1e-9;

/// What the document says about the map, next to the binary part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapHeader {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    pub(super) resolution_px: u32,
    pub(super) tolerance_px: f64,
    pub(super) coverage: CoverageRule,
}

impl MapHeader {
    pub(super) fn of(map: &SilhouetteMap) -> Self {
        Self {
            center: map.center,
            radius: map.radius,
            resolution_px: map.resolution_px,
            tolerance_px: map.tolerance_px,
            coverage: map.coverage,
        }
    }

    /// The map of these views and triangles.
    pub(super) fn map(&self, views: Vec<CapturedView>, triangles: Vec<[u32; 3]>) -> SilhouetteMap {
        SilhouetteMap {
            center: self.center,
            radius: self.radius,
            resolution_px: self.resolution_px,
            tolerance_px: self.tolerance_px,
            coverage: self.coverage,
            views,
            triangles,
        }
    }

    pub(super) fn check(&self) -> Result<(), AssetError> {
        let numbers = self.center.to_array().map(|x| ("center coordinate", x));
        for (what, value) in numbers
            .into_iter()
            .chain([("radius", self.radius), ("tolerance", self.tolerance_px)])
        {
            if !value.is_finite() {
                return Err(AssetError::OutOfRange {
                    what,
                    value,
                    limit: f64::MAX,
                });
            }
        }
        Ok(())
    }

    pub(super) fn camera(&self, view: usize, eye: DVec3) -> Result<Camera, AssetError> {
        let size = (self.resolution_px, self.resolution_px);
        Camera::fit_sphere(eye, self.center, self.radius, None, size)
            .map_err(|source| AssetError::Camera { view, source })
    }

    /// Depths from an eye, in 2ᵇⁱᵗˢ steps to the radius.
    pub(super) fn depth_grid(&self, eye: DVec3, bits: u32) -> Grid {
        Grid {
            what: "depth",
            origin: eye.distance(self.center),
            step: self.radius / f64::from(1_u32 << bits),
        }
    }
}

/// Numbers origin + step · integer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    what: &'static str,
    origin: f64,
    step: f64,
}

pub(super) const POINT_GRID: Grid = Grid {
    what: "contour coordinate",
    origin: 0.0,
    step: 1.0 / POINT_STEPS_PER_PX,
};

impl Grid {
    pub(super) fn steps(&self, value: f64) -> Result<i64, AssetError> {
        let steps = ((value - self.origin) / self.step).round();
        let far = self.origin.abs() / self.step;
        if steps.abs() <= MAX_STEPS && far <= MAX_STEPS {
            return Ok(steps as i64);
        }
        Err(AssetError::OutOfRange {
            what: self.what,
            value,
            limit: MAX_STEPS * self.step,
        })
    }

    pub(super) fn value(&self, steps: i64) -> Result<f64, AssetError> {
        let value = self.origin + steps as f64 * self.step;
        // Reading holds to the same limits as writing, so that what is read can be written.
        self.steps(value).map(|_| value)
    }
}

pub(super) fn check_camera(
    header: &MapHeader,
    view: usize,
    camera: &Camera,
) -> Result<(), AssetError> {
    let rebuilt = header.camera(view, camera.eye)?;
    let near = |a: DVec3, b: DVec3| a.distance(b) <= CAMERA_SLACK;
    let tangent_gap = camera.half_tangent.distance(rebuilt.half_tangent);
    if near(camera.right, rebuilt.right)
        && near(camera.up, rebuilt.up)
        && near(camera.forward, rebuilt.forward)
        && tangent_gap <= CAMERA_SLACK * rebuilt.half_tangent.x
        && camera.center_offset == rebuilt.center_offset
        && (camera.width_px, camera.height_px) == (rebuilt.width_px, rebuilt.height_px)
    {
        return Ok(());
    }
    Err(AssetError::ForeignCamera { view })
}
