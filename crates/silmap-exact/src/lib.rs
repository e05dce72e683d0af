//! Exact silhouettes from the full mesh: the comparison mode.
//!
//! A directed edge is on the silhouette of a viewpoint when the face on its left is front-facing and the one on its right
//! is not. [`silhouette_edges`] finds these edges, [`chain_loops`] joins them into closed loops, and [`outline_loops`]
//! projects the loops: filled by non-zero winding they are exactly the pixels that the mesh covers.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, sections 5 and 6.

mod brute;
mod facing;
mod loops;

pub use brute::{DirectedEdge, EdgeList, silhouette_edges};
pub use facing::is_front_facing;
pub use loops::{ChainError, OutlineError, chain_loops, outline_loops};

#[cfg(test)]
mod test_meshes;
