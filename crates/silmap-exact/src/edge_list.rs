//! The classical method: a list of candidate edges that front faces toggle.
//!
//! Every edge of a front face is looked for in the list in its other direction: when it is there, both its faces show
//! their front and it leaves the list; otherwise it joins. What stays is the silhouette. Time grows with the product of
//! front faces and candidates.
//!
//! Source: Stencil shadows: silhouette determination. 2011, "Classical approach".
//! Deviation: the list is an array that is searched from its newest end, where neighbours of the current face are likely.

use crate::edge_mesh::EdgeMesh;
use crate::{DirectedEdge, Viewpoint, Work};

pub(crate) fn extract(mesh: &EdgeMesh, viewpoint: &Viewpoint, out: &mut Vec<DirectedEdge>) -> Work {
    let query = mesh.query(viewpoint);
    let start = out.len();
    let mut toggled = 0;
    for (face, corners) in (0..).zip(mesh.faces()) {
        if !mesh.is_front(face, viewpoint, &query) {
            continue;
        }
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            toggled += 1;
            let reversed = DirectedEdge { from: to, to: from };
            match out[start..].iter().rposition(|&e| e == reversed) {
                Some(place) => {
                    out.swap_remove(start + place);
                }
                None => out.push(DirectedEdge { from, to }),
            }
        }
    }
    Work::of_edges(toggled)
}
