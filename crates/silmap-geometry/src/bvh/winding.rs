//! Winding numbers of points.
//!
//! Source: section 7 of the 1999 silhouette-mapping paper (signed ray crossings); the solid angle is that of A. van
//! Oosterom, J. Strackee. The Solid Angle of a Plane Triangle. IEEE Transactions on Biomedical Engineering, 1983.

use std::collections::BTreeMap;

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

    /// The same for groups of faces, each closed: those that wind around `p`, by rising number. `group_of_face` has the group
    /// of every face of the mesh.
    #[must_use]
    pub fn windings_by_group(&self, p: DVec3, group_of_face: &[u32]) -> Vec<(u32, i32)> {
        let group = |i: usize| group_of_face[self.face_ids[i] as usize];
        let mut sums: BTreeMap<u32, i32> = BTreeMap::new();
        let is_known = DIRECTIONS.iter().any(|&direction| {
            sums.clear();
            let add = |i: usize, crossing: i32| *sums.entry(group(i)).or_default() += crossing;
            self.visit_crossings(p, direction, add)
        });
        if !is_known {
            let mut angles: BTreeMap<u32, f64> = BTreeMap::new();
            for (i, corners) in self.triangles.iter().enumerate() {
                *angles.entry(group(i)).or_default() += self.half_angle(corners, p);
            }
            let rounded =
                |(group, sum): (u32, f64)| (group, (sum / std::f64::consts::TAU).round() as i32);
            sums = angles.into_iter().map(rounded).collect();
        }
        sums.into_iter().filter(|&(_, sum)| sum != 0).collect()
    }

    /// Leaving minus entering faces along a ray; `None` when it runs exactly through an edge.
    fn ray_crossings(&self, p: DVec3, direction: DVec3) -> Option<i32> {
        let mut crossings = 0;
        self.visit_crossings(p, direction, |_, crossing| crossings += crossing)
            .then_some(crossings)
    }

    /// Shows 1 for every face that a ray leaves through and −1 for every face it enters; `false` when it runs exactly through an
    /// edge, so that nothing follows from them.
    fn visit_crossings(
        &self,
        p: DVec3,
        direction: DVec3,
        mut visit: impl FnMut(usize, i32),
    ) -> bool {
        let Some(ray) = Ray::new(p, direction, self.scale) else {
            return false;
        };
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
                visit(i, if hit.enters { -1 } else { 1 });
            }
            is_clean = !hit.on_rim;
            is_clean
        });
        is_clean
    }

    /// The sum of the faces' solid angles over 4π, rounded.
    pub(super) fn solid_angle_number(&self, p: DVec3) -> i32 {
        let half_angles: f64 = self
            .triangles
            .iter()
            .map(|corners| self.half_angle(corners, p))
            .sum();
        (half_angles / std::f64::consts::TAU).round() as i32
    }

    /// Half the solid angle of a face.
    fn half_angle(&self, corners: &[DVec3; 3], p: DVec3) -> f64 {
        let [a, b, c] = corners.map(|corner| ((corner - p) * self.scale).normalize_or_zero());
        let triple = a.dot(b.cross(c));
        triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }
}
