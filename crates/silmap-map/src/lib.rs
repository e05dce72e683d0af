//! The silhouette map: a model's outline from a few dozen viewpoints, and how it is read from any other.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, sections 4 and 5.

pub mod asset;
pub mod silhouette_map;

pub use asset::{
    Asset, AssetError, Atlas, BuildRecord, CoarseHull, EncodedImage, TextureSet, TextureView,
};
pub use silhouette_map::{CapturedView, SilhouetteMap, ViewContour};
