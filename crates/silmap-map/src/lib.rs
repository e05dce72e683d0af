//! The silhouette map: a model's outline from a few dozen viewpoints, and how it is read from any other.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, sections 4 and 5.

pub mod asset;
mod chains;
mod clique;
mod connect;
pub mod epipolar;
mod follow;
pub mod interpolate;
mod intersect;
mod linear;
mod loops;
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

pub use asset::{
    Asset, AssetError, Atlas, BuildRecord, CapturedErrors, CoarseHull, CollapseOrder, CollapseStep,
    EncodedImage, TextureSet, TextureView,
};
pub use interpolate::{
    DETAIL_BOUND_PX, Detail, InterpolateError, Interpolation, Method, Outline, Scratch, Transfer,
    TriangleInterpolator, outline,
};
pub use loops::{FlatLoops, Loops};
pub use polytope::{Location, Polytope, PolytopeError};
pub use silhouette_map::{BoundingSphere, CapturedView, SilhouetteMap, ViewContour};
