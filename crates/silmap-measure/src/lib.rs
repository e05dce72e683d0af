//! How good an asset is, and how fast: errors of outlines and of textures beside the model they were made from, and times of
//! outlines, of exact extraction and of frames, side by side.
//!
//! Nothing that makes or draws an asset depends on this crate. What needs several crates that may not know of each other is
//! measured here: [`ExactShape`] hands exact loops to the renderer, [`Bench`] times extraction, interpolation and frames, and
//! [`compare`] does so over the model's resolution. [`measure()`] is all that a report shows.

mod bench;
mod comparison;
mod depth_errors;
mod deviation;
mod discontinuities;
mod error;
pub mod evaluate;
mod exact_outlines;
mod exact_shape;
mod figures;
mod leave_one_out;
pub mod machine;
mod masked_views;
mod measure;
mod median;
mod nearest;
mod painting;
mod scene;
mod stray_views;
mod straying;
mod subdivide;
mod texture_errors;
#[cfg(test)]
mod texture_tests;
mod turntable;
pub mod uniform;

pub use bench::{Bench, Row};
pub use comparison::{
    BRUTE, Comparison, ComparisonLevel, ContourResult, Extracted, ExtractionResult, FrameResults,
    Motion, PARALLEL, compare,
};
pub use depth_errors::{DepthErrors, OFF_REL, depth_errors};
pub use deviation::{Deviation, deviation};
pub use discontinuities::{Discontinuities, discontinuities};
pub use error::MeasureError;
pub use exact_shape::ExactShape;
pub use figures::{
    ColourRow, Conditions, ContourTime, DirectionErrors, ErrorSample, MethodErrors, PlaceErrors,
    PolytopeLevel, StrayView, TextureFigures, WorstView,
};
pub use leave_one_out::{
    LEAVE_OUT, LeaveOneOutError, LeaveOneOutParams, LeftOutError, Predictor, leave_one_out,
};
pub use masked_views::{MaskError, MaskedView, PlaceLoops, evaluate_masks};
pub use measure::{MeasureParams, Measured, measure};
pub use painting::{Painting, painting};
pub use scene::{CpuParts, OutlineErrorPx, SceneBench, SceneParams, SceneResults, SceneRow};
pub use straying::{Straying, StrayingSummary, straying};
pub use subdivide::subdivide;
pub use texture_errors::{
    ColourErrors, TextureErrorParams, TextureErrors, colour_errors, discontinuities_per_1000,
};
pub use turntable::{TurntableFrame, turntable};
