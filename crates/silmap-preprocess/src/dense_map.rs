//! The dense silhouette map: every captured view, on the polytope that connects them.
//!
//! Source: Silhouette Mapping, sections 3 and 4.

use glam::{DVec2, DVec3};
use silmap_geometry::CoverageRule;
use silmap_map::{CapturedView, SilhouetteMap};
use spade::{DelaunayTriangulation, Point2, Triangulation};
use thiserror::Error;

/// Why viewpoints cannot be connected to a polytope.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DenseMapError {
    /// Fewer viewpoints than a polytope has corners.
    #[error("{views} views cannot surround a model: at least 4 are needed")]
    TooFewViews {
        /// How many there are.
        views: usize,
    },
    /// The viewpoints do not surround the center.
    #[error("the {views} views do not surround the center of the model")]
    CenterOutside {
        /// How many there are.
        views: usize,
    },
}

/// Triangulates viewpoints on a sphere about `center` by the Delaunay criterion: the triangles, counter-clockwise seen from
/// outside, in a fixed order.
///
/// One viewpoint is the pole of a stereographic projection, which takes circles on the sphere to circles in the plane, so
/// the planar Delaunay triangulation of the others is the spherical one, and the edges of its convex hull belong to
/// triangles with the pole.
///
/// # Errors
/// When there are fewer than four viewpoints or the center lies outside their hull.
pub fn triangulate_view_sphere(
    center: DVec3,
    eyes: &[DVec3],
) -> Result<Vec<[u32; 3]>, DenseMapError> {
    let views = eyes.len();
    if views < 4 {
        return Err(DenseMapError::TooFewViews { views });
    }
    let directions: Vec<DVec3> = eyes
        .iter()
        .map(|e| (*e - center).normalize_or_zero())
        .collect();
    let pole = directions[0];
    let side = pole.any_orthonormal_vector();
    let other = pole.cross(side);
    let vertices: Vec<Point2<f64>> = directions[1..]
        .iter()
        .map(|d| {
            let scale = 1.0 / (1.0 - d.dot(pole)).max(f64::MIN_POSITIVE);
            let flat = DVec2::new(d.dot(side), d.dot(other)) * scale;
            Point2::new(flat.x, flat.y)
        })
        .collect();
    let outside = DenseMapError::CenterOutside { views };
    let plane = DelaunayTriangulation::<Point2<f64>>::bulk_load_stable(vertices)
        .map_err(|_| outside.clone())?;
    if plane.num_vertices() + 1 != views {
        return Err(outside);
    }
    let id = |index: usize| index as u32 + 1;
    let mut triangles: Vec<[u32; 3]> = plane
        .inner_faces()
        .map(|face| face.vertices().map(|v| id(v.fix().index())))
        .chain(plane.convex_hull().map(|edge| {
            [
                id(edge.from().fix().index()),
                id(edge.to().fix().index()),
                0,
            ]
        }))
        .collect();
    for triangle in &mut triangles {
        let [a, b, c] = triangle.map(|v| directions[v as usize]);
        if a.dot(b.cross(c)) < 0.0 {
            triangle.swap(1, 2);
        }
        let first = (0..3).min_by_key(|&k| triangle[k]).unwrap_or(0);
        triangle.rotate_left(first);
    }
    triangles.sort_unstable();
    let arms = eyes.iter().map(|e| *e - center).collect();
    match silmap_map::Polytope::from_parts(center, arms, triangles.clone()) {
        Ok(_) => Ok(triangles),
        Err(_) => Err(outside),
    }
}

/// What all views of a map have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseMapParams {
    /// Middle of the model's box.
    pub center: DVec3,
    /// Radius of its bounding sphere.
    pub radius: f64,
    /// Side of the square captures, pixels.
    pub resolution_px: u32,
    /// Tolerance of the contours, pixels.
    pub tolerance_px: f64,
    /// The rule the masks were drawn by.
    pub coverage: CoverageRule,
}

/// Connects all captured views to one map.
///
/// # Errors
/// When the viewpoints do not surround the center.
pub fn build(
    views: Vec<CapturedView>,
    params: &DenseMapParams,
) -> Result<SilhouetteMap, DenseMapError> {
    let all: Vec<u32> = (0..views.len() as u32).collect();
    build_on(views, &all, params)
}

/// Connects those captured views to one map that `corners` names, in ascending order: the others are in it, but not on its polytope.
///
/// # Errors
/// When the viewpoints connected do not surround the center.
pub fn build_on(
    views: Vec<CapturedView>,
    corners: &[u32],
    params: &DenseMapParams,
) -> Result<SilhouetteMap, DenseMapError> {
    let eye = |&v: &u32| views[v as usize].camera.eye;
    let eyes: Vec<DVec3> = corners.iter().map(eye).collect();
    let mut triangles = triangulate_view_sphere(params.center, &eyes)?;
    for corner in triangles.iter_mut().flatten() {
        *corner = corners[*corner as usize];
    }
    Ok(SilhouetteMap {
        center: params.center,
        radius: params.radius,
        resolution_px: params.resolution_px,
        tolerance_px: params.tolerance_px,
        coverage: params.coverage,
        views,
        triangles,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spiral(n: usize) -> Vec<DVec3> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..n)
            .map(|i| {
                let z = 1.0 - (2 * i + 1) as f64 / n as f64;
                let (sin, cos) = (golden * i as f64).sin_cos();
                DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
            })
            .collect()
    }

    #[test]
    fn the_triangulation_is_the_hull_of_the_points() {
        let center = DVec3::new(3.0, -1.0, 20.0);
        for n in [4, 5, 12, 100, 333] {
            let eyes: Vec<DVec3> = spiral(n).iter().map(|d| center + *d * 2.5).collect();
            let triangles = triangulate_view_sphere(center, &eyes).unwrap();
            assert_eq!(triangles.len(), 2 * n - 4, "Euler's formula for {n} views");
            for t in &triangles {
                let [a, b, c] = t.map(|v| eyes[v as usize]);
                let normal = (b - a).cross(c - a);
                for p in &eyes {
                    assert!(
                        normal.dot(*p - a) < 1e-9,
                        "a viewpoint lies outside a triangle"
                    );
                }
            }
        }
    }

    #[test]
    fn views_on_one_side_are_refused() {
        let eyes: Vec<DVec3> = spiral(200).into_iter().filter(|d| d.z > 0.2).collect();
        let made = triangulate_view_sphere(DVec3::ZERO, &eyes);
        assert!(matches!(made, Err(DenseMapError::CenterOutside { .. })));
        assert!(matches!(
            triangulate_view_sphere(DVec3::ZERO, &eyes[..3]),
            Err(DenseMapError::TooFewViews { views: 3 })
        ));
    }
}
