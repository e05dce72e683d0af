//! Geometry that all of silmap shares: meshes, cameras, masks and polygons.
//!
//! No graphics device, no threads and no file paths live here, and everything builds for `wasm32`. Lengths are in the
//! model's own units and frame ("object space"), angles in radians, image coordinates in pixels with (0,0) at the
//! top-left *corner*, x right and y down, so that pixel (i, j) covers [i, i+1] × [j, j+1].

pub mod bvh;
pub mod camera;
pub mod closed_mesh;
pub mod defects;
pub mod diagonals;
pub mod hidden_parts;
pub mod holes;
pub mod lighting;
pub mod lp;
pub mod mask;
pub mod mesh;
mod mesh_edit;
pub mod photograph;
pub mod polygon;
pub mod predicates;
mod queue;
pub mod raster;
pub mod repair;
mod seen_silhouette;
pub mod tetrahedra;
pub mod topology;
pub mod trace;
pub mod triangulate;
pub mod watch;

pub use bvh::{Bvh, Hit};
pub use camera::{Camera, CameraError, CoverageRule};
pub use closed_mesh::ClosedMesh;
pub use defects::{Defect, MeshDefects};
pub use hidden_parts::{HiddenParts, without_hidden_parts};
pub use mask::Mask;
pub use mesh::{Appearance, Bounds, ColourImage, Material, TextureWrap, TriangleMesh};
pub use photograph::Photograph;
pub use polygon::Loop;
pub use queue::CostQueue;
pub use seen_silhouette::SeenSilhouette;
pub use topology::Topology;
pub use watch::{Interrupted, Stage, StageEvent, Watch};
