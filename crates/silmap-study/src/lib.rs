//! Single pictures of an asset and its model, for looking and comparing: the hull whole or clipped, its shadow, the full mesh, the outline,
//! differences, silhouette edges. Hulls are drawn by `silmap-runtime`.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, section 8. Lines of the full mesh: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999.

mod clip;
mod colour_difference;
mod depth_range;
mod frame;
mod hulls;
mod image_precision;
mod layouts;
mod model;
mod passes;
mod picture;
mod pipelines;
mod renderer;
mod shadow;
mod targets;

pub use colour_difference::ColourDifference;
pub use frame::{
    Antialias, Background, ClipShape, EdgeParams, EdgeStyle, FrameParams, Mode, PictureOptions,
    RenderError, ShadowParams,
};
pub use image_precision::EdgeLinesUniform;
pub use layouts::{MaterialUniform, TintUniform, ViewUniform};
pub use renderer::PictureRenderer;
pub use shadow::GroundUniform;
pub use silmap_runtime::Paint;
