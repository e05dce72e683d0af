//! Depths between which a picture lies.

use glam::DVec3;
use silmap_geometry::Camera;

/// Nearest depth over farthest: 24 bits of depth keep a thousandth apart from its neighbours over this range.
const NEAREST_DEPTH_REL: f64 = 1e-3;

/// Margin before and behind the bounding sphere, as a factor on its radius: rounding must not clip what touches it.
const DEPTH_MARGIN: f64 = 1.01;

/// Depths between which a sphere lies as seen by a camera.
pub(crate) fn depth_range(camera: &Camera, center: DVec3, radius: f64) -> (f64, f64) {
    let depth = camera.depth(center);
    let room = (radius * DEPTH_MARGIN).max(f64::MIN_POSITIVE);
    let far = (depth + room).max(room);
    ((depth - room).max(far * NEAREST_DEPTH_REL), far)
}
