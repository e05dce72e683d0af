//! How often the mesh winds around a point.
//!
//! Source: section 7 of the 1999 silhouette-mapping paper (signed ray crossings); the solid angle is that of A. van
//! Oosterom, J. Strackee. The Solid Angle of a Plane Triangle. IEEE Transactions on Biomedical Engineering, 1983.

use glam::DVec3;

use super::{Bvh, ray::Ray};
use crate::predicates::side_of_plane;

/// Ray directions, tried in turn when a ray runs exactly through an edge. Nothing about them matters but that no model
/// has many edges in line with them.
const DIRECTIONS: [DVec3; 6] = [
    DVec3::new(0.480_721, 0.763_217, 0.431_903),
    DVec3::new(-0.812_339, 0.291_713, 0.505_021),
    DVec3::new(0.217_907, -0.543_391, 0.810_711),
    DVec3::new(-0.391_523, -0.613_049, -0.686_197),
    DVec3::new(0.902_141, -0.173_209, -0.395_107),
    DVec3::new(0.119_633, 0.352_817, -0.928_003),
];

/// Nearer to a face than this share of the mesh's extent, an exact predicate decides on which side the point is.
const SURFACE_SLACK_REL: f64 = 1e-12;

impl Bvh {
    /// How often a closed mesh winds around `p`: one inside an outward surface, zero outside, two where two parts
    /// overlap, negative inside an inside-out part. On the surface itself it is the number of one of the two sides.
    ///
    /// The answer rests on exact signs: next to a face, the last digit of `p` decides.
    #[must_use]
    pub fn winding_number(&self, p: DVec3) -> i32 {
        DIRECTIONS
            .iter()
            .find_map(|&direction| self.ray_crossings(p, direction))
            .unwrap_or_else(|| self.solid_angle_number(p))
    }

    /// Leaving minus entering faces along a ray; `None` when it runs exactly through an edge.
    fn ray_crossings(&self, p: DVec3, direction: DVec3) -> Option<i32> {
        let ray = Ray::new(p, direction, self.scale)?;
        let mut crossings = 0;
        let mut is_clean = true;
        let surface_slack = SURFACE_SLACK_REL / self.scale;
        self.visit_hits(&ray, -surface_slack, |i, hit| {
            let is_ahead = if hit.t.abs() > surface_slack {
                hit.t > 0.0
            } else {
                let [a, b, c] = self.triangles[i];
                let side = side_of_plane(a, b, c, p);
                if hit.enters { side > 0.0 } else { side < 0.0 }
            };
            if is_ahead {
                crossings += if hit.enters { -1 } else { 1 };
            }
            is_clean = !hit.on_rim;
            is_clean
        });
        is_clean.then_some(crossings)
    }

    /// The sum of the faces' solid angles over 4π, rounded.
    pub(super) fn solid_angle_number(&self, p: DVec3) -> i32 {
        let half_angles: f64 = self
            .triangles
            .iter()
            .map(|corners| {
                let [a, b, c] =
                    corners.map(|corner| ((corner - p) * self.scale).normalize_or_zero());
                let triple = a.dot(b.cross(c));
                triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
            })
            .sum();
        (half_angles / std::f64::consts::TAU).round() as i32
    }
}
