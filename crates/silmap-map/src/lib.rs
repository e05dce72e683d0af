//! The silhouette map: a model's outline from a few dozen viewpoints, and how it is read from any other.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, sections 4 and 5.

pub mod asset;
mod chains;
mod clique;
mod connect;
mod cover;
pub mod epipolar;
mod follow;
mod interpolate;
mod intersect;
mod linear;
mod loops;
mod method;
mod outline;
pub mod polytope;
mod project;
mod rectified;
mod rows;
mod sectors;
mod side;
pub mod silhouette_map;
mod span;
#[doc(hidden)]
pub mod stages;
mod tidy;
mod tight;
mod wedges;
mod within;

pub use asset::{
    Asset, AssetError, Atlas, BuildRecord, CapturedErrors, CoarseHull, CollapseOrder, CollapseStep,
    EncodedImage, Placement, TextureSet, TextureView,
};
pub use interpolate::TriangleInterpolator;
pub use loops::{FlatLoops, Loops};
pub use method::{DETAIL_BOUND_PX, Detail, Interpolation, Method, Transfer};
pub use outline::{InterpolateError, Outline, Scratch, outline};
pub use polytope::{Location, Polytope, PolytopeError};
pub use silhouette_map::{BoundingSphere, CapturedView, SilhouetteMap, ViewContour};
