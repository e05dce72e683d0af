//! Which triangle of the star-shaped polytope faces an eye (section 4).
//!
//! Source: Silhouette Mapping, section 4: the segment from the center through the eye, or its backward extension, meets
//! exactly one triangle; it is tracked by searching the neighbourhood of the previous one.

use glam::DVec3;
use thiserror::Error;

use crate::SilhouetteMap;

/// Why triangles do not form a star-shaped polytope around the center.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum PolytopeError {
    /// A triangle names a view that does not exist.
    #[error("polytope triangle {triangle} uses view {view}, but there are only {views}")]
    ViewOutOfRange {
        /// Index of the triangle.
        triangle: u32,
        /// The view it names.
        view: u32,
        /// How many views there are.
        views: u32,
    },
    /// An edge does not have exactly one triangle on each side.
    #[error("the polytope is not closed at the edge between views {from} and {to}")]
    NotClosed {
        /// One end of the edge.
        from: u32,
        /// The other end.
        to: u32,
    },
    /// A triangle has no positive volume with the center.
    #[error("polytope triangle {triangle} does not face away from the center")]
    NotStarShaped {
        /// Index of the triangle.
        triangle: u32,
    },
}

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

/// The polytope prepared for walking.
#[derive(Clone, Debug)]
pub struct Polytope {
    center: DVec3,
    /// Eyes relative to the center.
    arms: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Triangle across the edge opposite to corner k.
    neighbours: Vec<[u32; 3]>,
}

/// Six times the volume of the tetrahedron over the origin.
fn det(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    a.dot(b.cross(c))
}

impl Polytope {
    /// Checks that the triangles of `map` form a closed polytope that is star-shaped about the center, and links them.
    ///
    /// # Errors
    /// Names the first triangle or edge that breaks this.
    pub fn new(map: &SilhouetteMap) -> Result<Self, PolytopeError> {
        let arms: Vec<DVec3> = map
            .views
            .iter()
            .map(|v| v.camera.eye - map.center)
            .collect();
        Self::from_parts(map.center, arms, map.triangles.clone())
    }

    /// As [`Polytope::new`], from eyes relative to the center.
    ///
    /// # Errors
    /// As [`Polytope::new`].
    pub fn from_parts(
        center: DVec3,
        arms: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, PolytopeError> {
        let mut edges = Vec::with_capacity(triangles.len() * 3);
        for (t, triangle) in (0_u32..).zip(&triangles) {
            for k in 0..3_u32 {
                let view = triangle[k as usize];
                if view as usize >= arms.len() {
                    let views = arms.len() as u32;
                    return Err(PolytopeError::ViewOutOfRange {
                        triangle: t,
                        view,
                        views,
                    });
                }
                edges.push((
                    triangle[(k as usize + 1) % 3],
                    triangle[(k as usize + 2) % 3],
                    t,
                    k,
                ));
            }
            let [a, b, c] = triangle.map(|v| arms[v as usize]);
            let volume = det(a, b, c);
            if volume <= 0.0 || volume.is_nan() {
                return Err(PolytopeError::NotStarShaped { triangle: t });
            }
        }
        edges.sort_unstable();
        let mut neighbours = vec![[u32::MAX; 3]; triangles.len()];
        for (i, &(from, to, t, k)) in edges.iter().enumerate() {
            let doubled = i > 0 && (edges[i - 1].0, edges[i - 1].1) == (from, to);
            let twin = edges.partition_point(|e| (e.0, e.1) < (to, from));
            match edges.get(twin) {
                Some(&(f, g, other, _)) if (f, g) == (to, from) && !doubled => {
                    neighbours[t as usize][k as usize] = other;
                }
                _ => return Err(PolytopeError::NotClosed { from, to }),
            }
        }
        Ok(Self {
            center,
            arms,
            triangles,
            neighbours,
        })
    }

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
            if signs[worst] >= 0.0 {
                return self.location(triangle, direction);
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
    use proptest::prelude::*;

    fn octahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let arms = vec![
            DVec3::X,
            DVec3::Y,
            DVec3::NEG_X,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z,
        ];
        let mut triangles = Vec::new();
        for k in 0..4 {
            triangles.push([k, (k + 1) % 4, 4]);
            triangles.push([(k + 1) % 4, k, 5]);
        }
        (arms, triangles)
    }

    proptest! {
        #[test]
        fn the_located_point_lies_on_the_ray(x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, start in 0_u32..9) {
            let (arms, triangles) = octahedron();
            let center = DVec3::new(10.0, -3.0, 0.5);
            let polytope = Polytope::from_parts(center, arms, triangles).unwrap();
            let eye = center + DVec3::new(x, y, z);
            prop_assume!(eye != center);
            let at = polytope.locate(eye, start).unwrap();
            let (ray, hit) = (eye - center, at.point - center);
            prop_assert!(ray.cross(hit).length() < 1e-9 && ray.dot(hit) > 0.0);
            prop_assert!((hit.abs().element_sum() - 1.0).abs() < 1e-9, "not on the octahedron");
        }
    }

    #[test]
    fn broken_polytopes_are_named() {
        let (arms, triangles) = octahedron();
        let open = triangles[1..].to_vec();
        assert!(matches!(
            Polytope::from_parts(DVec3::ZERO, arms.clone(), open),
            Err(PolytopeError::NotClosed { .. })
        ));
        let mut inverted = triangles.clone();
        inverted[3].swap(0, 1);
        let made = Polytope::from_parts(DVec3::ZERO, arms.clone(), inverted);
        assert_eq!(
            made.err(),
            Some(PolytopeError::NotStarShaped { triangle: 3 })
        );
        let mut dangling = triangles;
        dangling[0][0] = 6;
        let made = Polytope::from_parts(DVec3::ZERO, arms, dangling);
        assert!(matches!(
            made,
            Err(PolytopeError::ViewOutOfRange { view: 6, .. })
        ));
    }

    #[test]
    fn the_center_itself_has_no_triangle() {
        let (arms, triangles) = octahedron();
        let polytope = Polytope::from_parts(DVec3::ZERO, arms, triangles).unwrap();
        assert_eq!(polytope.locate(DVec3::ZERO, 0), None);
    }
}
