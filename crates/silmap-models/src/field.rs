//! Building blocks of implicit shapes: distances to simple solids, and blends of them.

use glam::{DVec2, DVec3};

/// Signed distance to a torus about the z axis with the given core and tube radii.
pub(super) fn torus_distance(point: DVec3, core: f64, tube: f64) -> f64 {
    let ring = DVec2::new(point.x, point.y).length() - core;
    DVec2::new(ring, point.z).length() - tube
}

/// The smaller of two values, with a parabola over the last `width` before they are equal.
///
/// Source: Quilez. Smooth minimum, quadratic polynomial. The result is at most `width` / 4 below both.
pub(super) fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    if !a.is_finite() {
        return b;
    }
    let overlap = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - overlap * overlap * width * 0.25
}

/// Nearly the signed distance to an ellipsoid about the origin with the given half-axes: exact on its surface, right
/// slope there.
///
/// Source: Quilez. Ellipsoid distance functions, the bound k₀(k₀−1)/k₁.
pub(super) fn ellipsoid_distance(point: DVec3, radii: DVec3) -> f64 {
    let k0 = (point / radii).length();
    let k1 = (point / (radii * radii)).length();
    if k1 == 0.0 {
        return -radii.min_element();
    }
    k0 * (k0 - 1.0) / k1
}
