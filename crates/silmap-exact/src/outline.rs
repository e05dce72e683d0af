//! The outline of a mesh in the image, as polygons that do not cross: the union of what its front faces cover.
//!
//! The projected loops of the silhouette wind about an image point once for each front-facing layer there, so the union is
//! where their winding number is not zero. Most of the silhouette lies within it; the polygons are what is left.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 6 (winding numbers). The border is
//! followed along the projected edges themselves; where these touch in a way that needs rounding, the union is that of
//! the crate `i_overlay`, on a grid of integers.

use glam::{DVec2, DVec3};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;
use silmap_geometry::Camera;
use silmap_geometry::polygon::Loop;

use crate::arrangement::{Segment, border};
use crate::loops::image_of_vertex;
use crate::{DirectedEdge, OutlineError};

/// Points nearer to each other than this share of the image's larger side are one: the grid of integers is still a
/// hundred times finer, and nothing that is nearly a line is left for the union to stumble over.
const SAME_POINT_REL: f64 = 1e-7;

/// No edge.
const NO_EDGE: u32 = u32::MAX;

/// Makes outlines of one mesh, and keeps the buffers for that.
#[derive(Clone, Debug)]
pub struct Outliner<'m> {
    positions: &'m [DVec3],
    /// Of each vertex: an edge that starts there and is on no loop yet.
    first_from: Vec<u32>,
    /// Of each edge: another that starts in the same vertex.
    next_from: Vec<u32>,
}

impl<'m> Outliner<'m> {
    /// For a mesh with these vertices.
    #[must_use]
    pub fn new(positions: &'m [DVec3]) -> Self {
        Self {
            positions,
            first_from: vec![NO_EDGE; positions.len()],
            next_from: Vec::new(),
        }
    }

    /// The outline, pixels: outer loops have positive area and holes negative; loops neither cross nor overlap.
    ///
    /// `edges` is the whole silhouette for the eye of `camera`.
    ///
    /// # Errors
    /// When a silhouette vertex does not lie in front of the eye, or is seen too far beside the image to be counted with.
    pub fn outline(
        &mut self,
        edges: &[DirectedEdge],
        camera: &Camera,
    ) -> Result<Vec<Loop>, OutlineError> {
        let (points, segments) = self.project_segments(edges, camera)?;
        if let Some(loops) = border(&points, &segments) {
            return Ok(loops);
        }
        let loops = self.project_loops(edges, camera)?;
        let shapes = loops.simplify_shape(FillRule::NonZero);
        let contours = shapes.into_iter().flatten();
        Ok(contours
            .map(|contour| contour.into_iter().map(Into::into).collect())
            .collect())
    }

    /// The silhouette's vertices in the image, and its edges between these, clockwise as seen, which is positive where y
    /// points down.
    fn project_segments(
        &mut self,
        edges: &[DirectedEdge],
        camera: &Camera,
    ) -> Result<(Vec<DVec2>, Vec<Segment>), OutlineError> {
        let mut points = Vec::with_capacity(edges.len());
        let mut vertices = Vec::with_capacity(edges.len());
        let mut segments = Vec::with_capacity(edges.len());
        for edge in edges {
            let [from, to] = [edge.to, edge.from].map(|v| {
                // Numbers of points, for now, in the place of edges.
                let number = &mut self.first_from[v as usize];
                if *number == NO_EDGE {
                    *number = vertices.len() as u32;
                    vertices.push(v);
                }
                *number
            });
            segments.push(Segment { from, to });
        }
        let mut fault = None;
        for &v in &vertices {
            self.first_from[v as usize] = NO_EDGE;
            match image_of_vertex(v, self.positions, camera) {
                Ok(point) => points.push(point),
                Err(error) => fault = fault.or(Some(error)),
            }
        }
        match fault {
            None => Ok((points, segments)),
            Some(error) => Err(error),
        }
    }

    /// The silhouette as closed loops in the image, without those that are but a point or a line there.
    fn project_loops(
        &mut self,
        edges: &[DirectedEdge],
        camera: &Camera,
    ) -> Result<Vec<Vec<[f64; 2]>>, OutlineError> {
        self.next_from.clear();
        for (e, edge) in (0..).zip(edges) {
            self.next_from.push(self.first_from[edge.from as usize]);
            self.first_from[edge.from as usize] = e;
        }
        let same_point = SAME_POINT_REL * camera.size().max_element();
        let mut fault = None;
        let mut loops = Vec::new();
        for edge in edges {
            let mut points: Vec<[f64; 2]> = Vec::new();
            let mut at = edge.from;
            loop {
                let e = self.first_from[at as usize];
                if e == NO_EDGE {
                    break;
                }
                self.first_from[at as usize] = self.next_from[e as usize];
                match image_of_vertex(at, self.positions, camera) {
                    Ok(point) => {
                        let is_new = points
                            .last()
                            .is_none_or(|&last| point.distance(last.into()) > same_point);
                        if is_new {
                            points.push(point.into());
                        }
                    }
                    Err(error) => fault = fault.or(Some(error)),
                }
                at = edges[e as usize].to;
            }
            if points.len() > 2 {
                // Front faces run counter-clockwise as seen, which is negative where y points down.
                points.reverse();
                loops.push(points);
            }
        }
        match fault {
            None => Ok(loops),
            Some(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{bumpy_torus, cube, torus, voxel_shape};
    use crate::{outline_loops, silhouette_edges};
    use proptest::prelude::*;
    use silmap_geometry::polygon::{fill_even_odd, fill_non_zero, signed_area};
    use silmap_geometry::{Mask, TriangleMesh};

    const SIDE_PX: u32 = 200;

    fn camera(mesh: &TriangleMesh, direction: DVec3, distance: f64) -> Camera {
        let bounds = mesh.bounds();
        let eye = bounds.center + direction.normalize_or_zero() * bounds.radius * distance;
        Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (SIDE_PX, SIDE_PX))
            .expect("the eye is outside")
    }

    fn outline(mesh: &TriangleMesh, camera: &Camera) -> Vec<Loop> {
        let edges = silhouette_edges(mesh, camera.eye);
        Outliner::new(&mesh.positions)
            .outline(&edges, camera)
            .expect("all in front")
    }

    /// Pixels that two masks disagree on.
    fn difference(a: &Mask, b: &Mask) -> u64 {
        a.count_missing_in(b) + b.count_missing_in(a)
    }

    #[test]
    fn a_torus_has_a_hole_or_none() {
        let torus = torus(40, 20);
        let above = outline(&torus, &camera(&torus, DVec3::new(0.1, 1.0, 0.2), 4.0));
        assert_eq!(above.len(), 2);
        let mut areas: Vec<f64> = above.iter().map(|l| signed_area(l)).collect();
        areas.sort_by(f64::total_cmp);
        assert!(areas[0] < -100.0 && areas[1] > 100.0, "{areas:?}");
        let beside = outline(&torus, &camera(&torus, DVec3::new(1.0, 0.05, 0.2), 4.0));
        assert_eq!(beside.len(), 1);
    }

    #[test]
    fn a_cube_far_away_has_the_area_of_its_shadow() {
        let cube = cube();
        let direction = DVec3::new(1.0, 2.0, 3.0);
        let camera = camera(&cube, direction, 1e5);
        let area: f64 = outline(&cube, &camera).iter().map(|l| signed_area(l)).sum();
        // Of an axis-parallel unit cube: the sum of the direction's coordinates.
        let shadow = (direction / direction.length()).element_sum();
        let unit_px = f64::from(SIDE_PX) * 0.5
            / (camera.half_tangent.y * (camera.eye - DVec3::splat(0.5)).length());
        assert!((area / (unit_px * unit_px) / shadow - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_point_behind_the_eye_is_refused_and_leaves_the_buffers_clean() {
        let cube = cube();
        let good = camera(&cube, DVec3::new(1.0, 2.0, 3.0), 3.0);
        let edges = silhouette_edges(&cube, good.eye);
        let mut outliner = Outliner::new(&cube.positions);
        let wanted = outliner.outline(&edges, &good);
        let away = Camera::look_at(good.eye, good.eye * 2.0, None, 1.0, (8, 8)).expect("a camera");
        assert!(matches!(
            outliner.outline(&edges, &away),
            Err(OutlineError::BehindEye { .. })
        ));
        assert_eq!(outliner.outline(&edges, &good), wanted);
    }

    #[test]
    fn what_is_seen_too_far_beside_the_image_is_refused() {
        let cube = cube();
        let eye = DVec3::new(0.5, 0.5, 3.0);
        let edges = silhouette_edges(&cube, eye);
        let mut outliner = Outliner::new(&cube.positions);
        let mut seen = |fov_y_rad: f64| {
            let camera = Camera::look_at(eye, DVec3::splat(0.5), None, fov_y_rad, (8, 8));
            outliner.outline(&edges, &camera.expect("a camera"))
        };
        let wanted = seen(1.0);
        assert!(wanted.is_ok() && seen(1e-6).is_ok());
        for narrow in [1e-10, 1e-15, 1e-100] {
            assert!(
                matches!(seen(narrow), Err(OutlineError::FarBesideImage { .. })),
                "{narrow}"
            );
        }
        // The buffers are clean again.
        assert_eq!(seen(1.0), wanted);
    }

    fn check(mesh: &TriangleMesh, direction: [f64; 3]) -> Result<(), TestCaseError> {
        let direction = DVec3::from(direction) + DVec3::new(0.01, 0.02, 0.03);
        let camera = camera(mesh, direction, 2.5);
        let polygons = outline(mesh, &camera);
        let loops = outline_loops(mesh, &camera).expect("all in front");
        let [mut wound, mut odd, mut unwound] = [(); 3].map(|()| Mask::new(SIDE_PX, SIDE_PX));
        fill_non_zero(&loops, &mut wound);
        fill_even_odd(&polygons, &mut odd);
        fill_non_zero(&polygons, &mut unwound);
        // Both fill rules agree on loops that do not cross. A centre of a pixel may lie on an edge to within the grid.
        prop_assert!(difference(&wound, &odd) <= 1);
        prop_assert_eq!(difference(&odd, &unwound), 0);
        let area: f64 = polygons.iter().map(|l| signed_area(l)).sum();
        prop_assert!(area > 0.0 && wound.count() > 0);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn outlines_cover_what_loops_wind_about(
            rough in bumpy_torus(),
            voxels in voxel_shape(),
            direction in prop::array::uniform3(-1.0..1.0),
        ) {
            check(&rough, direction)?;
            check(&voxels, direction)?;
        }
    }
}
