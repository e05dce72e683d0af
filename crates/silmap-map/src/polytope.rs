//! The star-shaped polytope whose vertices are the viewpoints (section 4).

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

/// The polytope prepared for walking.
#[derive(Clone, Debug)]
pub struct Polytope {
    pub(crate) center: DVec3,
    /// Eyes relative to the center.
    pub(crate) arms: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Triangle across the edge opposite to corner k.
    pub(crate) neighbours: Vec<[u32; 3]>,
}

/// Six times the volume of the tetrahedron over the origin.
pub(crate) fn det(a: DVec3, b: DVec3, c: DVec3) -> f64 {
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
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Corners and triangles of an octahedron.
    pub(crate) fn octahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
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
