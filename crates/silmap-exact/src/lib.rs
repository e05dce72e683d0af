//! Exact silhouettes from the full mesh: the comparison mode.
//!
//! A directed edge is on the silhouette of a viewpoint when the face on its left is front-facing and the one on its right
//! is not. [`Extractor`] finds these edges in a manifold mesh by one of several [`ExtractionMethod`]s, [`silhouette_edges`] in any
//! mesh. [`chain_loops`] joins them into closed loops, and [`outline_loops`] projects the loops: filled by non-zero
//! winding they are exactly the pixels that the mesh covers; [`decompose_loops`] cuts them to be drawn with less. [`Outliner`] makes polygons of them that do not cross.
//!
//! ```
//! use glam::DVec3;
//! use silmap_exact::{EdgeMesh, Extractor, ExtractionMethod, Viewpoint, chain_loops};
//! use silmap_geometry::TriangleMesh;
//!
//! let octahedron = TriangleMesh {
//!     positions: [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z].to_vec(),
//!     faces: vec![
//!         [0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
//!         [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5],
//!     ],
//!     ..TriangleMesh::default()
//! };
//! let mesh = EdgeMesh::new(&octahedron)?;
//! let mut edges = Vec::new();
//! Extractor::new(&mesh, ExtractionMethod::Table).extract(&Viewpoint::Eye(DVec3::Z * 9.0), &mut edges);
//! assert_eq!(chain_loops(&edges)?.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, sections 5 and 6.

mod align;
mod arrangement;
mod backface_regions;
mod boundary;
mod brute;
mod cluster_forest;
mod cones;
mod dual;
mod edge_group;
mod edge_hash;
mod edge_list;
mod edge_mesh;
mod edge_table;
mod extractor;
mod facing;
mod fans;
mod level_order;
mod loops;
mod outline;
mod plane_block;
mod simplify;
mod viewpoint;
mod walk;
mod watch;
mod work;

pub use align::{
    AlignError, AlignParams, FITS_WITHIN_PX, FITS_WITHIN_REL, Pose, angle_between, refine_pose,
};
pub use boundary::{BoundaryEdges, DirectedEdge, silhouette_edges};
pub use cones::{ConeForest, ForestError};
pub use dual::DualSpace;
pub use edge_mesh::{EdgeMesh, EdgeMeshError};
pub use extractor::{ExtractionMethod, Extractor};
pub use facing::is_front_facing;
pub use fans::{FanReport, decompose_loops, fan_area};
pub use loops::{ChainError, OutlineError, chain_loops, image_loops, outline_loops};
pub use outline::Outliner;
pub use simplify::{Simplified, SimplifyError, SimplifyParams, silhouette_nearness, simplify};
pub use viewpoint::Viewpoint;
pub use walk::{WALK_STEP_RAD, walk_around};
pub use watch::{FIT, SEARCH, SIMPLIFY};
pub use work::Work;

#[cfg(test)]
mod test_meshes;
#[cfg(test)]
mod tests;
