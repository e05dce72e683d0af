//! Which pixels a mesh covers, on the processor: [`silmap_geometry::raster::cover`].

use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh, raster};

use super::CaptureError;

/// Sets the pixels of `mask` that the faces of `mesh` looking towards the camera cover; `mask` is overwritten.
///
/// # Errors
/// When a face reaches behind the eye or too far outside the image, or the mask does not have the camera's size.
pub fn rasterise(
    mesh: &TriangleMesh,
    camera: &Camera,
    rule: CoverageRule,
    mask: &mut Mask,
) -> Result<(), CaptureError> {
    Ok(raster::cover(mesh, camera, rule, mask)?)
}
