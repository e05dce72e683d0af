//! Silhouette capture: viewpoints, masks, and depths of the contour generator.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. TR-1-99, Harvard University, 1999, section 3.
//! Deviations: the paper reads masks back from a graphics board; here a processor rasteriser of integer arithmetic gives
//! the same mask on every machine. Depth at the rim ([`tangent_depths`]) is not in the paper.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use silmap_geometry::raster::RasterError;
use silmap_geometry::{Bounds, Camera, CameraError, ClosedMesh, CoverageRule, Mask};
#[cfg(feature = "gpu")]
use silmap_gpu::{Gpu, GpuError};
use thiserror::Error;

use crate::progress;
use silmap_geometry::watch::{Interrupted, Watch};

pub mod cpu;
mod depth;
#[cfg(feature = "gpu")]
pub mod gpu;
mod rim;
mod rim_edges;

pub(crate) use depth::edge_depths;
pub use depth::tangent_depths;
pub use rim::{LoopsWithDepths, RimSearch, deep_contours};
pub use rim_edges::{MeshEdges, RimEdges};

/// The backend that draws the masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// Whatever suits the machine; today the processor, whose masks are the same everywhere.
    #[default]
    Auto,
    /// The processor: the same masks on every machine and for every number of threads.
    Cpu,
    /// The graphics device, for [`CoverageRule::Center`]; other rules are drawn by the processor all the same.
    Gpu,
}

/// How to capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CaptureParams {
    /// Which pixels count as covered.
    #[serde(with = "crate::recipe::CoverageName")]
    pub coverage: CoverageRule,
    /// The backend that draws.
    pub backend: Backend,
}

/// Why a view cannot be captured.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CaptureError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// An eye from which the graphics device cannot draw the whole model.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The graphics device is missing or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// This library was built without graphics devices.
    #[error(
        "views cannot be captured on a graphics adapter: this program was built without them (feature `gpu`)"
    )]
    NoGpu,
    /// The graphics device cannot draw images of this size.
    #[error(
        "an image of {width} × {height} pixels is over this graphics adapter's limit of {limit} a side"
    )]
    ImageTooLarge {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
        /// The adapter's limit.
        limit: u32,
    },
    /// The processor cannot draw the whole model.
    #[error(transparent)]
    Raster(#[from] RasterError),
}

/// Cameras spread evenly on the sphere of radius `distance` about the model's center, all looking at it.
///
/// The eyes follow a Fibonacci spiral about the Y axis; they depend on nothing but the arguments (no trigonometric function
/// of the system is used). Images are square, `resolution_px` wide, and just hold the bounding sphere.
///
/// # Errors
/// When `distance` is not greater than the bounding radius, or the resolution is zero or too large.
pub fn view_sphere(
    bounds: &Bounds,
    distance: f64,
    count: u32,
    resolution_px: u32,
) -> Result<Vec<Camera>, CameraError> {
    spiral_directions(count)
        .into_iter()
        .map(|direction| {
            Camera::fit_sphere(
                bounds.center + direction * distance,
                bounds.center,
                bounds.radius,
                None,
                (resolution_px, resolution_px),
            )
        })
        .collect()
}

/// `count` unit vectors spread evenly over the sphere.
#[must_use]
pub fn spiral_directions(count: u32) -> Vec<DVec3> {
    // Cosine and sine of the golden angle π(3 − √5), by which each point is turned from the last.
    const TURN: (f64, f64) = (-0.737_368_878_078_319_9, 0.675_490_294_261_523_6);
    let (mut x, mut z) = (1.0_f64, 0.0_f64);
    (0..count)
        .map(|k| {
            let y = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
            let ring = (1.0 - y * y).max(0.0).sqrt();
            let direction = DVec3::new(x * ring, y, z * ring);
            (x, z) = (x * TURN.0 - z * TURN.1, x * TURN.1 + z * TURN.0);
            let length = (x * x + z * z).sqrt();
            (x, z) = (x / length, z / length);
            direction.normalize_or_zero()
        })
        .collect()
}

/// The pixels that `mesh` covers from each camera, in the order of the cameras, whatever the number of threads.
///
///
/// # Errors
/// When the caller asked to stop, or a view cannot hold the model (see [`CaptureError`]).
pub fn capture(
    mesh: &ClosedMesh,
    cameras: &[Camera],
    params: &CaptureParams,
    watch: &Watch<'_>,
) -> Result<Vec<Mask>, CaptureError> {
    watch.start(progress::CAPTURE, cameras.len() as u64);
    let masks = match (params.backend, params.coverage) {
        (Backend::Gpu, CoverageRule::Center) => capture_by_device(mesh, cameras, watch)?,
        (Backend::Auto | Backend::Cpu | Backend::Gpu, _) => cameras
            .par_iter()
            .map(|camera| {
                watch.check()?;
                let mut mask = Mask::new(camera.width_px, camera.height_px);
                cpu::rasterise(mesh.mesh(), camera, params.coverage, &mut mask)?;
                watch.advance(progress::CAPTURE, 1);
                Ok(mask)
            })
            .collect::<Result<Vec<_>, CaptureError>>()?,
    };
    watch.finish(progress::CAPTURE);
    Ok(masks)
}

#[cfg(not(feature = "gpu"))]
fn capture_by_device(
    _: &ClosedMesh,
    _: &[Camera],
    _: &Watch<'_>,
) -> Result<Vec<Mask>, CaptureError> {
    Err(CaptureError::NoGpu)
}

/// All masks from a device of their own.
#[cfg(feature = "gpu")]
fn capture_by_device(
    mesh: &ClosedMesh,
    cameras: &[Camera],
    watch: &Watch<'_>,
) -> Result<Vec<Mask>, CaptureError> {
    let gpu = Gpu::new()?;
    let mut masks = Vec::with_capacity(cameras.len());
    gpu::GpuCapture::new(&gpu, mesh.mesh())?.capture(cameras, &mut |_, mask| {
        watch.check()?;
        masks.push(mask);
        watch.advance(progress::CAPTURE, 1);
        Ok(())
    })?;
    Ok(masks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_even() {
        let directions = spiral_directions(1024);
        let sum: DVec3 = directions.iter().copied().sum();
        assert!(sum.length() < 0.5, "off balance by {sum}");
        // A hexagonal packing of n points on the sphere has spacing √(8π/(√3·n)).
        let ideal = (8.0 * std::f64::consts::PI / (3.0_f64.sqrt() * 1024.0)).sqrt();
        for (i, a) in directions.iter().enumerate() {
            assert!((a.length() - 1.0).abs() < 1e-12);
            let nearest = directions
                .iter()
                .enumerate()
                .filter(|&(j, _)| j != i)
                .map(|(_, b)| a.distance(*b))
                .fold(f64::INFINITY, f64::min);
            assert!(
                nearest > 0.7 * ideal && nearest < 1.1 * ideal,
                "point {i} is {nearest} from its neighbour, {ideal} is ideal"
            );
        }
    }

    #[test]
    fn the_spiral_does_not_drift() {
        let angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let last = spiral_directions(4096)[4095];
        let ring = last.x.hypot(last.z);
        let expected = (angle * 4095.0).sin_cos();
        assert!((last.x / ring - expected.1).abs() < 1e-9);
        assert!((last.z / ring - expected.0).abs() < 1e-9);
    }

    #[test]
    fn eyes_lie_on_the_sphere_and_an_eye_inside_is_refused() {
        let bounds = Bounds::of_points([DVec3::ZERO, DVec3::new(2.0, 1.0, 4.0)].into_iter());
        let cameras = view_sphere(&bounds, 3.0 * bounds.radius, 50, 64).unwrap();
        for camera in &cameras {
            let distance = camera.eye.distance(bounds.center);
            assert!((distance / bounds.radius - 3.0).abs() < 1e-12);
        }
        assert!(view_sphere(&bounds, 0.9 * bounds.radius, 50, 64).is_err());
    }
}
