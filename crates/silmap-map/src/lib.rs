//! The silhouette map: a model's outline from a few dozen viewpoints, and how it is read from any other.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, sections 4 and 5.

pub mod asset;
pub mod epipolar;
mod interpolation;
mod loops;
mod off_polytope;
mod pair_cache;
pub mod polytope;
mod project;
mod reader;
mod rule;
pub mod silhouette_map;
#[doc(hidden)]
pub mod stages;
mod sweep;
mod tidy;
mod triangle;

pub use asset::{
    Asset, AssetError, Atlas, BuildRecord, CapturedErrors, CoarseHull, CollapseOrder, CollapseStep,
    EncodedImage, Placement, TextureSet, TextureView,
};
pub use interpolation::{DETAIL_BOUND_PX, Detail, Interpolation, Method, Transfer};
pub use loops::{FlatLoops, Loops};

pub use polytope::{Location, Polytope, PolytopeError};
pub use reader::{InterpolateError, Outline, Scratch, outline};
pub use silhouette_map::{BoundingSphere, CapturedView, SilhouetteMap, ViewContour};
pub use triangle::TriangleInterpolator;
