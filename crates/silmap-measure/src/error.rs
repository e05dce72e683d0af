//! Why something could not be measured.

use std::error::Error;

use silmap_exact::{ChainError, EdgeMeshError, OutlineError};
use silmap_geometry::CameraError;
use silmap_geometry::Interrupted;
use silmap_gpu::GpuError;
use silmap_hull::HullError;
use silmap_map::{AssetError, InterpolateError, PolytopeError};
use silmap_preprocess::pipeline::BuildError;
use silmap_runtime::{LoadError, OptionsError, PrepareError};
use silmap_study::RenderError;
use thiserror::Error;

use crate::evaluate::EvaluateError;

/// Why something could not be measured: what the crate that failed says.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The file does not hold what an asset's does.
    #[error(transparent)]
    Asset(#[from] AssetError),
    /// The map is not a star-shaped polytope.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// An outline cannot be interpolated.
    #[error(transparent)]
    Interpolate(#[from] InterpolateError),
    /// Errors cannot be measured.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// A map to compare with cannot be made.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Coarser hulls cannot be made.
    #[error(transparent)]
    Hull(#[from] HullError),
    /// A camera cannot be made.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The mesh has no edges to search.
    #[error(transparent)]
    EdgeMesh(#[from] EdgeMeshError),
    /// Edges that were found do not close.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The exact outline cannot be made.
    #[error(transparent)]
    Outline(#[from] OutlineError),
    /// A frame cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A renderer cannot be made.
    #[error(transparent)]
    Renderer(#[from] OptionsError),
    /// The asset cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene cannot be drawn.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl MeasureError {
    /// The error of the crate that failed.
    #[must_use]
    pub fn cause(&self) -> &(dyn Error + 'static) {
        match self {
            Self::Interrupted(error) => error,
            Self::Asset(error) => error,
            Self::Polytope(error) => error,
            Self::Interpolate(error) => error,
            Self::Evaluate(error) => error,
            Self::Build(error) => error,
            Self::Hull(error) => error,
            Self::Camera(error) => error,
            Self::EdgeMesh(error) => error,
            Self::Chain(error) => error,
            Self::Outline(error) => error,
            Self::Render(error) => error,
            Self::Renderer(error) => error,
            Self::Load(error) => error,
            Self::Prepare(error) => error,
            Self::Gpu(error) => error,
        }
    }
}
