//! Moving the diagonals of triangulated polygons.
//!
//! Polygons are cut one by one, and a diagonal of one may join two vertices that an edge, or another polygon's diagonal, joins
//! already: a surface that is closed as polygons then has edges with four faces. Such a diagonal is turned to the other two
//! corners of its two triangles, or, where those are joined too or the triangles would fold, gets a vertex in its middle.
//!
//! Only polygons whose own edges have no more than two polygons are touched. Bodies that are given twice, and walls that two
//! bodies share, are for [`crate::repair`], which finds them by their equal triangles.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::mesh::TriangleMesh;

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MovedDiagonals {
    /// Diagonals turned to the other two corners.
    pub turned: usize,
    /// Diagonals that got a vertex in their middle.
    pub split: usize,
}

/// Moves the diagonals at edges with more than two faces. `polygon_of` names the polygon of every face, `vertex_of` the
/// vertex of the file each vertex was; both follow what is added. Coordinates are finite and faces have three corners.
pub fn separate_diagonals(
    mesh: &mut TriangleMesh,
    polygon_of: &mut Vec<u32>,
    vertex_of: &mut Vec<u32>,
) -> MovedDiagonals {
    let mut moved = MovedDiagonals::default();
    if !has_crowded_edges(mesh) {
        return moved;
    }
    let mut edges = Edges::of(mesh);
    let crowded: Vec<[u32; 2]> = edges
        .faces_at
        .iter()
        .filter(|(_, faces)| faces.len() > 2)
        .map(|(&edge, _)| edge)
        .collect();
    for edge in crowded {
        while let Some(pair) = edges.movable_diagonal(mesh, polygon_of, edge) {
            if edges.turn(mesh, edge, pair) {
                moved.turned += 1;
            } else {
                edges.split(mesh, edge, pair);
                polygon_of.extend(pair.map(|f| polygon_of[f as usize]));
                vertex_of.push(vertex_of[edge[0] as usize]);
                moved.split += 1;
            }
        }
    }
    moved
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [key(a, b), key(b, c), key(c, a)]
}

fn has_crowded_edges(mesh: &TriangleMesh) -> bool {
    let mut edges: Vec<[u32; 2]> = mesh.faces.iter().flat_map(|&f| edges_of(f)).collect();
    edges.sort_unstable();
    edges.windows(3).any(|uses| uses[0] == uses[2])
}

/// The faces at every edge.
struct Edges {
    faces_at: BTreeMap<[u32; 2], Vec<u32>>,
}

impl Edges {
    fn of(mesh: &TriangleMesh) -> Self {
        let mut faces_at: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (f, &face) in (0..).zip(&mesh.faces) {
            for edge in edges_of(face) {
                faces_at.entry(edge).or_default().push(f);
            }
        }
        Self { faces_at }
    }

    fn faces(&self, edge: [u32; 2]) -> &[u32] {
        self.faces_at.get(&edge).map_or(&[], Vec::as_slice)
    }

    /// The two faces of one polygon at an edge that walk it in both directions: the edge is that polygon's diagonal. A polygon
    /// that touches itself may have several there; no face is in two pairs.
    fn diagonals(&self, mesh: &TriangleMesh, polygon_of: &[u32], edge: [u32; 2]) -> Vec<[u32; 2]> {
        let mut single: Vec<u32> = Vec::new();
        let mut pairs = Vec::new();
        for &g in self.faces(edge) {
            let is_other_side = |&f: &u32| {
                polygon_of[f as usize] == polygon_of[g as usize]
                    && walks(mesh, f, edge) != walks(mesh, g, edge)
            };
            match single.iter().position(is_other_side) {
                Some(at) => pairs.push([single.remove(at), g]),
                None => single.push(g),
            }
        }
        pairs
    }

    /// How many polygons have an edge as their own.
    fn polygons_at(&self, mesh: &TriangleMesh, polygon_of: &[u32], edge: [u32; 2]) -> usize {
        self.faces(edge).len() - 2 * self.diagonals(mesh, polygon_of, edge).len()
    }

    /// The last diagonal that may be moved from an edge with more than two faces.
    fn movable_diagonal(
        &self,
        mesh: &TriangleMesh,
        polygon_of: &[u32],
        edge: [u32; 2],
    ) -> Option<[u32; 2]> {
        /// More faces at an edge are no accident of cutting.
        const MOST_FACES: usize = 64;
        let count = self.faces(edge).len();
        if !(3..=MOST_FACES).contains(&count) {
            return None;
        }
        let is_plain = |face: u32| {
            edges_of(mesh.faces[face as usize]).into_iter().all(|e| {
                self.faces(e).len() <= MOST_FACES && self.polygons_at(mesh, polygon_of, e) <= 2
            })
        };
        let found = self.diagonals(mesh, polygon_of, edge);
        found
            .into_iter()
            .rev()
            .find(|pair| pair.iter().all(|&f| is_plain(f)))
    }

    fn replace(&mut self, face: u32, old: [u32; 3], new: [u32; 3]) {
        for edge in edges_of(old) {
            if let Some(faces) = self.faces_at.get_mut(&edge) {
                faces.retain(|&f| f != face);
            }
        }
        self.add(face, new);
    }

    fn add(&mut self, face: u32, corners: [u32; 3]) {
        for edge in edges_of(corners) {
            self.faces_at.entry(edge).or_default().push(face);
        }
    }

    /// Turns the diagonal of two faces to their other two corners, unless those are joined already or a face would turn over.
    fn turn(&mut self, mesh: &mut TriangleMesh, edge: [u32; 2], [f, g]: [u32; 2]) -> bool {
        let (at_f, at_g) = (corner_after(mesh, f, edge), corner_after(mesh, g, edge));
        let [from, to, c] = turned(mesh.faces[f as usize], at_f);
        let d = turned(mesh.faces[g as usize], at_g)[2];
        if c == d || !self.faces(key(c, d)).is_empty() {
            return false;
        }
        let place = |v: u32| mesh.positions[v as usize];
        let cross = |[a, b, c]: [u32; 3]| (place(b) - place(a)).cross(place(c) - place(a));
        let whole: DVec3 = cross(mesh.faces[f as usize]) + cross(mesh.faces[g as usize]);
        let new = [[from, d, c], [d, to, c]];
        if new.iter().any(|&face| cross(face).dot(whole) <= 0.0) {
            return false;
        }
        // Corners of f are from, to, c, and those of g are to, from, d.
        let look = &mut mesh.appearance;
        repaint(&mut look.corner_uvs, [f, g], [at_f, at_g]);
        repaint(&mut look.corner_colours, [f, g], [at_f, at_g]);
        for (face, corners) in [f, g].into_iter().zip(new) {
            let old = std::mem::replace(&mut mesh.faces[face as usize], corners);
            self.replace(face, old, corners);
        }
        true
    }

    /// Puts a vertex on the middle of the diagonal of two faces, which become four.
    fn split(&mut self, mesh: &mut TriangleMesh, edge: [u32; 2], pair: [u32; 2]) {
        let [a, b] = edge.map(|v| mesh.positions[v as usize]);
        let middle = mesh.positions.len() as u32;
        mesh.positions.push(a + (b - a) * 0.5);
        for face in pair {
            let from = corner_after(mesh, face, edge);
            let old = mesh.faces[face as usize];
            mesh.split_face_edge(face as usize, from, middle);
            self.replace(face, old, mesh.faces[face as usize]);
            let added = mesh.faces.len() as u32 - 1;
            self.add(added, mesh.faces[added as usize]);
        }
    }
}

/// Whether a face walks an edge from its lower to its higher vertex.
fn walks(mesh: &TriangleMesh, face: u32, [low, high]: [u32; 2]) -> bool {
    let corners = mesh.faces[face as usize];
    (0..3).any(|k| corners[k] == low && corners[(k + 1) % 3] == high)
}

/// The corner at which a face begins to walk along an edge.
fn corner_after(mesh: &TriangleMesh, face: u32, edge: [u32; 2]) -> usize {
    let corners = mesh.faces[face as usize];
    (0..3)
        .find(|&k| key(corners[k], corners[(k + 1) % 3]) == edge)
        .expect("the face lies at the edge")
}

fn turned<T: Copy>(all: [T; 3], first: usize) -> [T; 3] {
    [0, 1, 2].map(|k| all[(first + k) % 3])
}

/// Gives the looks at the corners of two faces to those they become.
fn repaint<T: Copy>(all: &mut [[T; 3]], [f, g]: [u32; 2], [at_f, at_g]: [usize; 2]) {
    if all.is_empty() {
        return;
    }
    let [from, to, c] = turned(all[f as usize], at_f);
    let d = turned(all[g as usize], at_g)[2];
    all[f as usize] = [from, d, c];
    all[g as usize] = [d, to, c];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_mesh::ClosedMesh;
    use crate::triangulate::triangulate_polygon;

    /// Cuts polygons into triangles, one by one.
    fn cut(positions: &[[f64; 3]], polygons: &[&[u32]]) -> (TriangleMesh, Vec<u32>) {
        let mut mesh = TriangleMesh {
            positions: positions.iter().map(|&p| DVec3::from(p)).collect(),
            ..TriangleMesh::default()
        };
        let mut polygon_of = Vec::new();
        for (p, polygon) in (0..).zip(polygons) {
            let points: Vec<DVec3> = polygon
                .iter()
                .map(|&v| mesh.positions[v as usize])
                .collect();
            for triangle in triangulate_polygon(&points) {
                mesh.faces.push(triangle.map(|k| polygon[k as usize]));
                polygon_of.push(p);
            }
        }
        (mesh, polygon_of)
    }

    #[test]
    fn two_bent_quadrilaterals_back_to_back_enclose_something() {
        let corners = [
            [0.0, 0.0, 0.2],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.2],
            [0.0, 1.0, 0.0],
        ];
        let (mut mesh, mut polygon_of) = cut(&corners, &[&[0, 1, 2, 3], &[0, 3, 2, 1]]);
        assert!(ClosedMesh::try_from(mesh.clone()).is_err());
        let mut vertex_of: Vec<u32> = (0..4).collect();
        let moved = separate_diagonals(&mut mesh, &mut polygon_of, &mut vertex_of);
        assert_eq!(
            moved,
            MovedDiagonals {
                turned: 1,
                split: 0
            }
        );
        assert!((mesh.volume().abs() - 0.2 / 3.0).abs() < 1e-12);
        crate::repair::turn_outward(&mut mesh);
        assert!(ClosedMesh::try_from(mesh).is_ok());
    }

    #[test]
    fn a_diagonal_beside_an_edge_gets_a_vertex_where_it_cannot_turn() {
        // A tetrahedron of which two faces are one quadrilateral whose both diagonals are edges of others: the second
        // quadrilateral lies behind it, over two further edges.
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, -1.0],
        ];
        // The front, and behind it faces to a tip; two of them are joined along 0–2 by a roof of zero height.
        let polygons: [&[u32]; 5] = [
            &[0, 1, 2, 3],
            &[1, 0, 4],
            &[2, 1, 4],
            &[3, 2, 4],
            &[0, 3, 4],
        ];
        let (mut mesh, mut polygon_of) = cut(&corners, &polygons);
        // Two more tetrahedra that have the front's diagonals as edges.
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([DVec3::new(0.5, 0.5, 3.0), DVec3::new(0.5, 0.6, 3.0)]);
        mesh.positions
            .extend([DVec3::new(0.5, 0.5, 5.0), DVec3::new(0.6, 0.5, 5.0)]);
        for (diagonal, tips) in [
            ([0, 2], [first, first + 1]),
            ([1, 3], [first + 2, first + 3]),
        ] {
            let ([a, b], [c, d]) = (diagonal, tips);
            for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
                mesh.faces.push(face);
                polygon_of.push(polygon_of.last().map_or(0, |p| p + 1));
            }
        }
        let mut vertex_of: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let volume = mesh.volume();
        let moved = separate_diagonals(&mut mesh, &mut polygon_of, &mut vertex_of);
        assert_eq!(
            moved,
            MovedDiagonals {
                turned: 0,
                split: 1
            }
        );
        assert!((mesh.volume() - volume).abs() < 1e-12);
        assert!(!has_crowded_edges(&mesh));
        assert_eq!(
            (polygon_of.len(), vertex_of.len()),
            (mesh.faces.len(), mesh.positions.len())
        );
    }

    #[test]
    fn a_polygon_that_walks_an_edge_there_and_back_twice_is_counted_once() {
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let mut mesh = TriangleMesh {
            positions: corners.map(DVec3::from).to_vec(),
            faces: vec![[0, 1, 2], [1, 0, 3], [0, 1, 3], [1, 0, 2]],
            ..TriangleMesh::default()
        };
        let mut polygon_of = vec![0; 4];
        let edges = Edges::of(&mesh);
        assert_eq!(
            edges.diagonals(&mesh, &polygon_of, [0, 1]),
            [[0, 1], [2, 3]]
        );
        assert_eq!(edges.polygons_at(&mesh, &polygon_of, [0, 1]), 0);
        let mut vertex_of: Vec<u32> = (0..4).collect();
        separate_diagonals(&mut mesh, &mut polygon_of, &mut vertex_of);
        assert!(!has_crowded_edges(&mesh), "{:?}", mesh.faces);
        // A third face on one side is the polygon's own.
        let third = TriangleMesh {
            faces: vec![[0, 1, 2], [1, 0, 3], [0, 1, 3]],
            ..mesh
        };
        assert_eq!(Edges::of(&third).polygons_at(&third, &[0; 3], [0, 1]), 1);
    }

    #[test]
    fn bodies_given_twice_are_left_to_repair() {
        let corners: Vec<[f64; 3]> = (0..8)
            .map(|v| [4, 2, 1].map(|bit| f64::from(u8::from(v & bit != 0))))
            .collect();
        let sides: [&[u32]; 6] = [
            &[0, 1, 3, 2],
            &[4, 6, 7, 5],
            &[0, 4, 5, 1],
            &[2, 3, 7, 6],
            &[0, 2, 6, 4],
            &[1, 5, 7, 3],
        ];
        for is_inside_out in [false, true] {
            let copies: Vec<Vec<u32>> = sides
                .iter()
                .map(|s| s.iter().copied())
                .map(|s| {
                    if is_inside_out {
                        s.rev().collect()
                    } else {
                        s.collect()
                    }
                })
                .collect();
            let all: Vec<&[u32]> = sides
                .iter()
                .copied()
                .chain(copies.iter().map(Vec::as_slice))
                .collect();
            let (mut mesh, mut polygon_of) = cut(&corners, &all);
            let before = mesh.clone();
            let mut vertex_of: Vec<u32> = (0..8).collect();
            let moved = separate_diagonals(&mut mesh, &mut polygon_of, &mut vertex_of);
            assert_eq!((moved, &mesh), (MovedDiagonals::default(), &before));
        }
    }
}
