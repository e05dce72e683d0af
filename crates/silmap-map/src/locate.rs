//! Which triangle of the polytope faces an eye (section 4).
//!
//! Source: Silhouette Mapping, section 4: the segment from the center through the eye, or its backward extension, meets
//! exactly one triangle; it is tracked by searching the neighbourhood of the previous one.

use glam::DVec3;

use crate::polytope::{Polytope, det};

/// Where a ray from the center meets the polytope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of its three views, non-negative, sum 1.
    pub barycentric: [f64; 3],
    /// The point p_t on the triangle, object space.
    pub point: DVec3,
}

/// With a weight this small a direction is on an edge, by rounding.
const ON_EDGE: f64 = 1e-12;

impl Polytope {
    /// Finds the triangle that faces `eye`, walking from triangle `start`; `None` when the eye is the center itself.
    #[must_use]
    pub fn locate(&self, eye: DVec3, start: u32) -> Option<Location> {
        let direction = (eye - self.center).try_normalize()?;
        let mut triangle = if (start as usize) < self.triangles.len() {
            start
        } else {
            0
        };
        // A walk visits each triangle at most once on a star-shaped polytope, up to ties; past that, look at all.
        for _ in 0..self.triangles.len() {
            let signs = self.signs(triangle, direction);
            let worst = (0..3)
                .min_by(|&i, &j| signs[i].total_cmp(&signs[j]))
                .unwrap_or(0);
            if signs[worst] > ON_EDGE * signs.iter().sum::<f64>() {
                return self.location(triangle, direction);
            }
            if signs[worst] >= 0.0 {
                // Whichever way it was come to, the same triangle of those that meet there.
                let is_there = |t: &u32| self.signs(*t, direction).iter().all(|&s| s >= 0.0);
                let first = (0..triangle).find(is_there).unwrap_or(triangle);
                return self.location(first, direction);
            }
            triangle = self.neighbours[triangle as usize][worst];
        }
        let inside = |t: &u32| {
            self.signs(*t, direction)
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min)
        };
        let best =
            (0..self.triangles.len() as u32).max_by(|a, b| inside(a).total_cmp(&inside(b)))?;
        self.location(best, direction)
    }

    /// For each corner: the volume over the opposite edge and `direction`; all are non-negative inside the cone.
    fn signs(&self, triangle: u32, direction: DVec3) -> [f64; 3] {
        let [a, b, c] = self.triangles[triangle as usize].map(|v| self.arms[v as usize]);
        [
            det(direction, b, c),
            det(direction, c, a),
            det(direction, a, b),
        ]
    }

    fn location(&self, triangle: u32, direction: DVec3) -> Option<Location> {
        let weights = self.signs(triangle, direction).map(|s| s.max(0.0));
        let sum: f64 = weights.iter().sum();
        if sum <= 0.0 || sum.is_nan() {
            return None;
        }
        let barycentric = weights.map(|w| w / sum);
        let corners = self.triangles[triangle as usize].map(|v| self.arms[v as usize]);
        let arm = (0..3).map(|k| corners[k] * barycentric[k]).sum::<DVec3>();
        Some(Location {
            triangle,
            barycentric,
            point: self.center + arm,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::tests::octahedron;

    /// On edges and corners of an octahedron several triangles are as good: it is the same one from wherever the walk begins.
    #[test]
    fn ties_do_not_depend_on_the_start() {
        let (arms, triangles) = octahedron();
        let polytope = Polytope::from_parts(DVec3::ZERO, arms, triangles).unwrap();
        let steps = [-1.0, -0.3, 0.0, 0.3, 1.0];
        let all = steps.iter().flat_map(|&x| {
            steps
                .iter()
                .flat_map(move |&y| steps.map(|z| DVec3::new(x, y, z)))
        });
        for eye in all.filter(|eye| *eye != DVec3::ZERO) {
            let found: Vec<_> = (0..8)
                .map(|start| polytope.locate(eye, start).unwrap())
                .collect();
            assert!(found.iter().all(|f| *f == found[0]), "{eye}: {found:?}");
        }
    }
}
