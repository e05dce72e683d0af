//! Silhouette edges by testing every edge: the reference for all other methods.
//!
//! The edges are those of the boundary of the front-facing faces, as a sum of directed edges in which an edge and its
//! reverse cancel. On a closed manifold this is "front-facing face on the left, none on the right"; on anything else it
//! is still a sum of closed loops.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5 (definition).

use glam::DVec3;
use silmap_geometry::TriangleMesh;

use crate::is_front_facing;

/// An edge of a mesh with a direction, as vertex ids; the front-facing face is on its left, seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DirectedEdge {
    /// Where it starts.
    pub from: u32,
    /// Where it ends.
    pub to: u32,
}

impl DirectedEdge {
    /// The same edge the other way.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self {
            from: self.to,
            to: self.from,
        }
    }
}

/// One side of an edge: a face and the direction in which the edge goes round it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct EdgeSide {
    low: u32,
    high: u32,
    is_downward: bool,
    face: u32,
}

/// The edges of a mesh with the faces on their sides: what does not depend on the viewpoint.
#[derive(Clone, Debug)]
pub struct BoundaryEdges {
    /// Sorted, so that the sides of one edge are neighbours.
    sides: Vec<EdgeSide>,
}

impl BoundaryEdges {
    /// The edges of `mesh`.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut sides = Vec::with_capacity(3 * mesh.faces.len());
        for (face, corners) in mesh.faces.iter().enumerate() {
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                if from != to {
                    sides.push(EdgeSide {
                        low: from.min(to),
                        high: from.max(to),
                        is_downward: to < from,
                        face: face as u32,
                    });
                }
            }
        }
        sides.sort_unstable();
        Self { sides }
    }

    /// The silhouette edges of `mesh`, the mesh that this list was made of, for `eye`; ordered by their lower and then
    /// their higher vertex.
    #[must_use]
    pub fn silhouette_edges(&self, mesh: &TriangleMesh, eye: DVec3) -> Vec<DirectedEdge> {
        let is_front: Vec<bool> = (0..mesh.faces.len())
            .map(|f| is_front_facing(mesh.corners(f), eye))
            .collect();
        let mut found = Vec::new();
        let same_edge = |a: &EdgeSide, b: &EdgeSide| (a.low, a.high) == (b.low, b.high);
        for edge in self.sides.chunk_by(same_edge) {
            let upward: i64 = edge
                .iter()
                .filter(|side| is_front[side.face as usize])
                .map(|side| if side.is_downward { -1 } else { 1 })
                .sum();
            let EdgeSide { low, high, .. } = edge[0];
            let (from, to) = if upward > 0 { (low, high) } else { (high, low) };
            for _ in 0..upward.unsigned_abs() {
                found.push(DirectedEdge { from, to });
            }
        }
        found
    }
}

/// The silhouette edges of `mesh` for `eye`, with the sign of each face exact.
///
/// Make an [`BoundaryEdges`] when there is more than one eye.
#[must_use]
pub fn silhouette_edges(mesh: &TriangleMesh, eye: DVec3) -> Vec<DirectedEdge> {
    BoundaryEdges::new(mesh).silhouette_edges(mesh, eye)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, shaken_torus};
    use proptest::prelude::*;

    /// The definition, word by word: both faces of every edge, plain dot products.
    fn by_definition(mesh: &TriangleMesh, eye: DVec3) -> Vec<DirectedEdge> {
        let is_front = |f: usize| (eye - mesh.corners(f)[0]).dot(mesh.face_cross(f)) > 0.0;
        let mut found = Vec::new();
        for (left, a) in mesh.faces.iter().enumerate() {
            for (right, b) in mesh.faces.iter().enumerate() {
                for i in 0..3 {
                    for j in 0..3 {
                        let (from, to) = (a[i], a[(i + 1) % 3]);
                        let shared = b[j] == to && b[(j + 1) % 3] == from;
                        if shared && is_front(left) && !is_front(right) {
                            found.push(DirectedEdge { from, to });
                        }
                    }
                }
            }
        }
        found.sort_by_key(|e| (e.from.min(e.to), e.from.max(e.to)));
        found
    }

    proptest! {
        #[test]
        fn equals_the_definition(
            mesh in shaken_torus(),
            eye in prop::array::uniform3(-6_i32..6),
        ) {
            // Small whole numbers: plain products are exact, eyes in face planes and in the mesh are common.
            let eye = DVec3::from(eye.map(f64::from));
            prop_assert_eq!(silhouette_edges(&mesh, eye), by_definition(&mesh, eye));
        }
    }

    #[test]
    fn cube_from_afar_and_in_the_plane_of_a_side() {
        let cube = cube();
        let count = |x, y, z| silhouette_edges(&cube, DVec3::new(x, y, z)).len();
        assert_eq!(count(0.5, 0.5, 9.0), 4, "one side in front");
        assert_eq!(count(5.0, 0.5, 9.0), 6, "two sides in front");
        assert_eq!(count(5.0, 7.0, 9.0), 6, "three sides in front");
        assert_eq!(
            count(1.0, 0.5, 9.0),
            4,
            "a side seen edge-on is not in front"
        );
        assert_eq!(count(0.5, 0.5, 0.5), 0, "from inside nothing is in front");
    }

    #[test]
    fn an_open_mesh_still_gives_closed_loops() {
        let mut open = cube();
        open.faces.truncate(9);
        let edges = silhouette_edges(&open, DVec3::new(5.0, 7.0, 9.0));
        let mut balance = vec![0; open.positions.len()];
        for e in &edges {
            balance[e.from as usize] += 1;
            balance[e.to as usize] -= 1;
        }
        assert!(!edges.is_empty());
        assert!(balance.iter().all(|&b| b == 0));
    }
}
