//! The words everything in silmap is said in: meshes, cameras, masks and polygons.
//!
//! No graphics device, no threads and no file paths live here, and everything builds for `wasm32`. Lengths are in the
//! model's own units and frame ("object space"), angles in radians, image coordinates in pixels with (0,0) at the
//! top-left *corner*, x right and y down, so that pixel (i, j) covers [i, i+1] × [j, j+1].

pub mod bvh;
pub mod camera;
pub mod lighting;
pub mod mask;
pub mod mesh;
pub mod polygon;
pub mod predicates;

pub use bvh::{Bvh, Hit};
pub use camera::{Camera, CameraError, CoverageRule};
pub use mask::Mask;
pub use mesh::{Appearance, Bounds, ColourImage, Material, TriangleMesh};
pub use polygon::Loop;
