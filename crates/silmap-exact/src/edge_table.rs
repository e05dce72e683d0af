//! The connectivity table: for each edge of a face, the face on its other side.
//!
//! Every edge of a front face whose neighbour does not show its front is on the silhouette. Back faces cost one test.
//!
//! Source: Stencil shadows: silhouette determination. 2011, "Connectivity table". As there, neighbours are tested anew
//! each time.

use crate::edge_mesh::EdgeMesh;
use crate::{DirectedEdge, Viewpoint, Work};

/// For each face, its neighbours in the order of its corners.
#[derive(Clone, Debug)]
pub(crate) struct EdgeTable {
    neighbours: Vec<[u32; 3]>,
}

impl EdgeTable {
    pub(crate) fn new(mesh: &EdgeMesh) -> Self {
        let across = |(face, edges): (u32, &[u32; 3])| {
            edges.map(|e| {
                let [left, right] = mesh.edge_faces()[e as usize];
                if left == face { right } else { left }
            })
        };
        Self {
            neighbours: (0..).zip(mesh.face_edges()).map(across).collect(),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.neighbours)
    }

    pub(crate) fn extract(
        &self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        let mut front_faces = 0;
        for ((face, neighbours), corners) in (0..).zip(&self.neighbours).zip(mesh.faces()) {
            if !mesh.is_front(face, viewpoint, &query) {
                continue;
            }
            front_faces += 1;
            for k in 0..3 {
                if !mesh.is_front(neighbours[k], viewpoint, &query) {
                    let (from, to) = (corners[k], corners[(k + 1) % 3]);
                    out.push(DirectedEdge { from, to });
                }
            }
        }
        Work::of_edges(3 * front_faces)
    }
}
