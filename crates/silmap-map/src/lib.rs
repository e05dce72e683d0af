//! The silhouette map: a model's outline from a few dozen viewpoints, and how it is read from any other.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, sections 4 and 5.

pub mod asset;
pub mod epipolar;
pub mod fewer_views;
mod interpolation;
mod levels;
mod locate;
mod loops;
mod off_polytope;
mod pair_cache;
pub mod polytope;
mod polytope_outline;
mod project;
mod reader;
pub mod replay;
mod rule;
pub mod silhouette_map;
pub mod simplified_polytope;
mod sweep;
mod tidy;
mod triangle;

pub use asset::{
    Asset, AssetError, Atlas, BuildRecord, CapturedErrors, CoarseHull, CollapseOrder, CollapseStep,
    DepthPicture, EncodedImage, Placement, Relief, TextureSet, TextureView,
};
pub use interpolation::{InterpolateError, Interpolation, Transfer};
pub use levels::{DETAIL_BOUND_PX, Detail};
pub use locate::Location;
pub use loops::{DeepLoops, FlatLoops, Loops, SeenLoops};
pub use pair_cache::RectifiedPair;

pub use polytope::{Polytope, PolytopeError};
pub use polytope_outline::PolytopeOutline;
pub use reader::{MapReader, Outline, outline};
pub use rule::PairInterpolator;
pub use rule::method::Method;
pub use rule::prepared_pair::PreparedPair;
pub use silhouette_map::{BoundingSphere, CapturedView, SilhouetteMap, ViewContour};
pub use sweep::intersection::RegionIntersection;
pub use triangle::TriangleInterpolator;
