//! Further queries in dual space: back faces, near-silhouettes, and silhouettes from anywhere in a triangle of viewpoints.
//!
//! Source: as for the parent module, sections 2.2.1 to 2.2.3. Deviations: near-silhouettes are bounded by two planes parallel to the
//! viewplane of homogeneous dual space, which is a bound on the eye's distance from a face's plane; and of a triangle's multi-wedge
//! only edges of faces within it are reported, beside the silhouette from one corner, so that no whole region is ever listed.

use glam::DVec3;
use silmap_geometry::predicates::side_of_plane;

use super::partition::{Division, Partition};
use crate::brute::Brute;
use crate::edge_mesh::EdgeMesh;
use crate::{DirectedEdge, Viewpoint};

/// A mesh's faces in dual space, for questions that do not follow a moving viewpoint.
#[derive(Clone, Debug)]
pub struct DualSpace<'m> {
    mesh: &'m EdgeMesh,
    partition: Partition,
}

impl<'m> DualSpace<'m> {
    /// Puts the faces of `mesh` into an octree.
    #[must_use]
    pub fn new(mesh: &'m EdgeMesh) -> Self {
        Self {
            mesh,
            partition: Partition::new(mesh, Division::Octree),
        }
    }

    /// The faces that do not show their front to `viewpoint`, ascending: a half-space query, in which whole regions are taken in
    /// or passed over. Also returns how many regions were visited.
    #[must_use]
    pub fn back_faces(&self, viewpoint: &Viewpoint) -> (Vec<u32>, usize) {
        let query = self.mesh.query(viewpoint);
        let mut faces = Vec::new();
        let visited = self.partition.visit_by_facing(&[&query], |facing, some| {
            let is_back = |&face: &u32| !self.mesh.is_front(face, viewpoint, &query);
            match facing {
                Some(true) => {}
                Some(false) => faces.extend(some),
                None => faces.extend(some.filter(is_back)),
            }
        });
        faces.sort_unstable();
        (faces, visited)
    }

    /// The edges, ascending, with the front face on the left, that are on the silhouette from somewhere in the triangle of `eyes`, which
    /// may be a line or a point. An edge that is one in both directions is listed in both. Also returns how many regions were visited.
    ///
    /// Corners are decided exactly; between them, where both faces of an edge turn, to rounding.
    #[must_use]
    pub fn silhouettes_from_triangle(&self, eyes: [DVec3; 3]) -> (Vec<DirectedEdge>, usize) {
        let viewpoints = eyes.map(Viewpoint::Eye);
        let queries = viewpoints.map(|v| self.mesh.query(&v));
        let mut silhouette = Vec::new();
        Brute::default().extract(self.mesh, &viewpoints[0], &mut silhouette);
        let mut turning = Vec::new();
        let [a, b, c] = &queries;
        let visited = self.partition.visit_by_facing(&[a, b, c], |facing, some| {
            let turns = |&face: &u32| {
                let views = viewpoints.iter().zip(&queries);
                let n_front = views
                    .filter(|(v, q)| self.mesh.is_front(face, v, q))
                    .count();
                n_front == 1 || n_front == 2
            };
            if facing.is_none() {
                turning.extend(some.filter(turns));
            }
        });
        let mut edges = silhouette;
        for edge in self.edges_of(&turning) {
            let DirectedEdge { from, to } = self.mesh.edges()[edge as usize];
            let [left, right] = self.mesh.edge_faces()[edge as usize];
            let values = [left, right].map(|f| eyes.map(|eye| self.side(f, eye)));
            if has_silhouette(values[0], values[1]) {
                edges.push(DirectedEdge { from, to });
            }
            if has_silhouette(values[1], values[0]) {
                edges.push(DirectedEdge { from: to, to: from });
            }
        }
        edges.sort_unstable();
        edges.dedup();
        (edges, visited)
    }

    /// The numbers of edges, ascending, that are on the silhouette from `eye` or nearly so: of which a face is within `angle_rad` of being
    /// seen edge-on, where it is taken to be as far from the eye as the middle of the mesh. Also returns how many regions
    /// were visited.
    #[must_use]
    pub fn near_silhouettes(&self, eye: DVec3, angle_rad: f64) -> (Vec<u32>, usize) {
        let viewpoint = Viewpoint::Eye(eye);
        let query = self.mesh.query(&viewpoint);
        let sine = angle_rad.sin().max(0.0);
        let (reach, distance) = (
            sine * self.mesh.distance_from_center(eye),
            self.mesh.distance_in_ball(eye),
        );
        let mut near = Vec::new();
        // Queries are scaled so that the larger of distance and weight is one.
        let visited =
            self.partition
                .visit_near(&query, sine * distance / distance.max(1.0), |some| {
                    near.extend(some.filter(|&face| self.distance(face, eye) <= reach));
                });
        let mut edges = self.edges_of(&near);
        let is_silhouette = |edge: &u32| {
            let sides = self.mesh.edge_faces()[*edge as usize];
            let [left, right] = sides.map(|f| self.mesh.is_front(f, &viewpoint, &query));
            left != right
        };
        edges.extend((0..self.mesh.edges().len() as u32).filter(is_silhouette));
        edges.sort_unstable();
        edges.dedup();
        (edges, visited)
    }

    /// The edges of some faces, ascending.
    fn edges_of(&self, faces: &[u32]) -> Vec<u32> {
        let edges = faces
            .iter()
            .flat_map(|&f| self.mesh.face_edges()[f as usize]);
        let mut edges: Vec<u32> = edges.collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    fn corners(&self, face: u32) -> [DVec3; 3] {
        self.mesh.faces()[face as usize].map(|v| self.mesh.positions()[v as usize])
    }

    /// Positive in front of a face, and linear in the eye.
    fn side(&self, face: u32, eye: DVec3) -> f64 {
        let [a, b, c] = self.corners(face);
        side_of_plane(a, b, c, eye)
    }

    /// The eye's distance from a face's plane; infinite for a face without area.
    fn distance(&self, face: u32, eye: DVec3) -> f64 {
        let [a, b, c] = self.corners(face);
        let area = (b - a).cross(c - a).length();
        if area > 0.0 {
            (side_of_plane(a, b, c, eye) / area).abs()
        } else {
            f64::INFINITY
        }
    }
}

/// Whether somewhere in a triangle one linear function is positive and another is not, given their values at its corners.
///
/// Where they are so anywhere, they are at a corner or on a side: the corner of the quadrant is no island.
fn has_silhouette(front: [f64; 3], back: [f64; 3]) -> bool {
    let at_corner = (0..3).any(|k| front[k] > 0.0 && back[k] <= 0.0);
    at_corner
        || [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)]
            .into_iter()
            .any(|(i, j)| {
                // From both positive to both not: the second function must end to be so first.
                let falls = |v: [f64; 3]| v[i] > 0.0 && v[j] <= 0.0;
                let share = |v: [f64; 3]| v[i] / (v[i] - v[j]);
                falls(front) && falls(back) && share(back) < share(front)
            })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::test_meshes::{bumpy_torus, torus, voxel_shape};

    fn any_mesh() -> impl Strategy<Value = silmap_geometry::TriangleMesh> {
        prop_oneof![bumpy_torus(), voxel_shape()]
    }

    fn any_eye() -> impl Strategy<Value = DVec3> {
        let whole = prop::array::uniform3(-6_i32..7).prop_map(|p| DVec3::from(p.map(f64::from)));
        let free = prop::array::uniform3(-6.0..6.0_f64).prop_map(DVec3::from);
        prop_oneof![whole, free]
    }

    proptest! {
        #[test]
        fn back_faces_are_those_that_show_no_front(mesh in any_mesh(), eye in any_eye()) {
            let edge_mesh = EdgeMesh::new(&mesh).unwrap();
            let (found, _) = DualSpace::new(&edge_mesh).back_faces(&Viewpoint::Eye(eye));
            let is_back = |&f: &u32| !crate::is_front_facing(mesh.corners(f as usize), eye);
            let expected: Vec<u32> = (0..mesh.faces.len() as u32).filter(is_back).collect();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn near_silhouettes_are_edges_of_faces_seen_almost_edge_on(
            mesh in any_mesh(), eye in any_eye(), angle in prop_oneof![Just(0.0), 0.0..0.6_f64],
        ) {
            let edge_mesh = EdgeMesh::new(&mesh).unwrap();
            let (found, _) = DualSpace::new(&edge_mesh).near_silhouettes(eye, angle);
            let reach = angle.sin() * eye.distance(mesh.bounds().center);
            let expected: Vec<u32> = (0..edge_mesh.edges().len() as u32)
                .filter(|&edge| {
                    let sides = edge_mesh.edge_faces()[edge as usize];
                    let corners = sides.map(|f| mesh.corners(f as usize));
                    let [left, right] = corners.map(|c| crate::is_front_facing(c, eye));
                    let is_near = |[a, b, c]: [DVec3; 3]| {
                        let area = (b - a).cross(c - a).length();
                        area > 0.0 && (side_of_plane(a, b, c, eye) / area).abs() <= reach
                    };
                    left != right || corners.into_iter().any(is_near)
                })
                .collect();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn silhouettes_from_a_triangle_are_those_from_its_points(
            mesh in any_mesh(), eyes in prop::array::uniform3(any_eye()),
        ) {
            let edge_mesh = EdgeMesh::new(&mesh).unwrap();
            let (found, _) = DualSpace::new(&edge_mesh).silhouettes_from_triangle(eyes);
            // Whatever is a silhouette from some point of the triangle is found.
            for i in 0..=12 {
                for j in 0..=12 - i {
                    let (u, v) = (f64::from(i) / 12.0, f64::from(j) / 12.0);
                    let eye = match (i, j) {
                        (0, 0) => eyes[0],
                        (12, _) => eyes[1],
                        (_, 12) => eyes[2],
                        _ => eyes[0] + (eyes[1] - eyes[0]) * u + (eyes[2] - eyes[0]) * v,
                    };
                    // Points between are rounded: faces that such an eye grazes may look either way.
                    let is_clear = |f: usize| {
                        let [a, b, c] = mesh.corners(f);
                        let area = (b - a).cross(c - a).length();
                        let is_corner = (i, j) == (0, 0) || i == 12 || j == 12;
                        is_corner || side_of_plane(a, b, c, eye).abs() > 1e-9 * area
                    };
                    for (edge, sides) in edge_mesh.edges().iter().zip(edge_mesh.edge_faces()) {
                        let [left, right] = sides
                            .map(|f| crate::is_front_facing(mesh.corners(f as usize), eye));
                        if left == right || !sides.iter().all(|&f| is_clear(f as usize)) {
                            continue;
                        }
                        let directed = if left { *edge } else { edge.reversed() };
                        prop_assert!(found.binary_search(&directed).is_ok(), "{directed:?} from {eye}");
                    }
                }
            }
            // And what is found is what asking every edge finds.
            let mut expected = Vec::new();
            for (edge, sides) in edge_mesh.edges().iter().zip(edge_mesh.edge_faces()) {
                let values = sides.map(|f| {
                    let [a, b, c] = mesh.corners(f as usize);
                    eyes.map(|eye| side_of_plane(a, b, c, eye))
                });
                if has_silhouette(values[0], values[1]) {
                    expected.push(*edge);
                }
                if has_silhouette(values[1], values[0]) {
                    expected.push(edge.reversed());
                }
            }
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_point_has_the_plain_silhouette_and_a_triangle_more() {
        let mesh = torus(40, 24);
        let edge_mesh = EdgeMesh::new(&mesh).unwrap();
        let space = DualSpace::new(&edge_mesh);
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let mut plain = crate::silhouette_edges(&mesh, eye);
        plain.sort_unstable();
        assert_eq!(space.silhouettes_from_triangle([eye; 3]).0, plain);
        assert_eq!(space.near_silhouettes(eye, 0.0).0.len(), plain.len());
        let wide = [eye, eye + DVec3::X, eye + DVec3::Y];
        assert!(space.silhouettes_from_triangle(wide).0.len() > plain.len() + 20);
        assert!(space.near_silhouettes(eye, 0.1).0.len() > plain.len() + 20);
        // Whole regions are passed over.
        let fine = torus(200, 160);
        let edge_mesh = EdgeMesh::new(&fine).unwrap();
        let (faces, visited) = DualSpace::new(&edge_mesh).back_faces(&Viewpoint::Eye(eye));
        assert!(visited * 4 < faces.len(), "{visited} of {}", faces.len());
    }
}
