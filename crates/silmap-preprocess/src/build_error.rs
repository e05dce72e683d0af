//! Why there is no asset.

use silmap_geometry::CameraError;
use silmap_geometry::watch::Interrupted;
use silmap_hull::HullError;
use silmap_map::AssetError;
use thiserror::Error;

use crate::capture::CaptureError;
use crate::dense_map::DenseMapError;
use crate::simplify_map::SimplifyMapError;
use crate::texture::TextureError;

/// Why there is no asset.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The view sphere does not surround the model.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A view could not be drawn.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// A captured view shows nothing: the model is thinner than a pixel.
    #[error(
        "nothing of the model is seen from view {view}: it is thinner than a pixel there; a higher resolution or coverage `any` may help"
    )]
    NothingSeen {
        /// The first such view.
        view: u32,
    },
    /// The views do not make a polytope.
    #[error(transparent)]
    DenseMap(#[from] DenseMapError),
    /// The polytope of all views cuts into what it should surround.
    #[error(
        "{views} views at {radius_rel} times the model's radius are too few: flat between them, the model cannot be looked at from \
         everywhere; more views (--views), a larger --radius or a higher --resolution help"
    )]
    TooFewViews {
        /// Views captured.
        views: u32,
        /// Radius of their sphere, in radii of the model.
        radius_rel: f64,
    },
    /// The map cannot be simplified.
    #[error(transparent)]
    SimplifyMap(#[from] SimplifyMapError),
    /// There is no hull.
    #[error(transparent)]
    Hull(#[from] HullError),
    /// The hull cannot be painted.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// The parts cannot be stored.
    #[error(transparent)]
    Asset(#[from] AssetError),
}
