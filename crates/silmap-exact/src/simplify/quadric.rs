//! Quadric error: area-weighted squared distances of a point to planes.
//!
//! Source: M. Garland, P. Heckbert. Surface Simplification Using Quadric Error Metrics. SIGGRAPH 1997, section 3.

use glam::{DMat3, DVec3};

/// pᵀ·`a`·p + 2·`b`·p + `c`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    a: DMat3Zero,
    b: DVec3,
    c: f64,
}

/// A matrix that begins as zero.
#[derive(Clone, Copy, Debug)]
struct DMat3Zero(DMat3);

impl Default for DMat3Zero {
    fn default() -> Self {
        Self(DMat3::ZERO)
    }
}

/// With a determinant below this share of the cube of the trace there is no one optimum.
const FLAT_REL: f64 = 1e-6;

impl Quadric {
    /// The squared distance to a face's plane, times its area.
    pub(super) fn of_face([a, b, c]: [DVec3; 3]) -> Self {
        let cross = (b - a).cross(c - a);
        let area = 0.5 * cross.length();
        let normal = cross.normalize_or_zero();
        let offset = -normal.dot(a);
        let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self {
            a: DMat3Zero(outer * area),
            b: normal * (offset * area),
            c: offset * offset * area,
        }
    }

    /// The squared distance to the plane that holds an edge of a face and stands at right angles on it, times the area of a square on
    /// the edge. Zero where the face has no normal.
    pub(super) fn of_edge([a, b]: [DVec3; 2], face_cross: DVec3) -> Self {
        let away = (b - a).cross(face_cross).normalize_or_zero();
        let offset = -away.dot(a);
        let area = a.distance_squared(b);
        let outer = DMat3::from_cols(away * away.x, away * away.y, away * away.z);
        Self {
            a: DMat3Zero(outer * area),
            b: away * (offset * area),
            c: offset * offset * area,
        }
    }

    pub(super) fn add(&mut self, other: &Self, weight: f64) {
        self.a.0 += other.a.0 * weight;
        self.b += other.b * weight;
        self.c += other.c * weight;
    }

    pub(super) fn sum(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.add(other, 1.0);
        sum
    }

    /// The error at a place; not negative.
    pub(super) fn error(&self, p: DVec3) -> f64 {
        (p.dot(self.a.0 * p) + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// The place of least error, where there is only one.
    pub(super) fn optimum(&self) -> Option<DVec3> {
        let a = self.a.0;
        let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
        let is_clear = a.determinant() > FLAT_REL * trace * trace * trace;
        is_clear.then(|| -(a.inverse() * self.b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optimum_is_where_the_planes_meet() {
        let corner = DVec3::new(0.3, -0.2, 0.5);
        let mut quadric = Quadric::default();
        for (u, v) in [
            (DVec3::X, DVec3::Y),
            (DVec3::Y, DVec3::Z),
            (DVec3::Z, DVec3::X),
        ] {
            quadric.add(&Quadric::of_face([corner, corner + u, corner + v]), 2.0);
        }
        assert!(quadric.optimum().unwrap().distance(corner) < 1e-12);
        assert!(quadric.error(corner) < 1e-15);
        // Each of three planes has area one half, twice.
        let off = quadric.error(corner + DVec3::new(0.1, 0.2, 0.0));
        assert!((off - 0.05).abs() < 1e-12, "{off}");
    }

    #[test]
    fn a_flat_place_has_no_one_optimum() {
        let face = Quadric::of_face([DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!(face.optimum(), None);
        assert!((face.error(DVec3::new(5.0, -3.0, 2.0)) - 2.0).abs() < 1e-12);
    }
}
