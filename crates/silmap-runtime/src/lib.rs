//! Middleware for wgpu: many instances of assets, hulls clipped by their outlines, in a render pass of the caller's.
//!
//! [`Renderer::new`] takes the formats of the pass, [`Renderer::load`] an asset, [`Renderer::prepare`] the camera and the instances of a
//! frame, and [`Renderer::draw`] the pass. It opens no device, no pass and no encoder, and submits nothing. For shadows a second renderer
//! draws depths alone, from a light: [`View::directional`], [`View::spot`].
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University, 1999, section 8.

mod asset;
mod batches;
mod depths;
mod draws;
mod facing;
mod instance;
mod interpolate;
mod light;
mod mips;
mod normals;
mod options;
mod pipelines;
mod plan;
mod polytope_cache;
mod renderer;
pub mod shaders;
mod textures;
mod view;
mod worker;

pub use asset::LoadedAsset;
pub use instance::{Instance, Outline, Paint, SpaceLoops, Transform, TransformError};
pub use light::LightError;
pub use options::{
    Antialias, ClipBy, DepthDirection, DepthTarget, LoadError, OptionsError, PrepareError,
    ReliefQuality, RendererOptions, TargetFormats,
};
pub use plan::FrameStats;
pub use renderer::Renderer;
pub use silmap_gpu::wgpu;
pub use view::View;
