//! What a camera file says, before any picture is opened.

use std::path::PathBuf;

use glam::DVec3;

use crate::lens::Distortion;
use crate::pinhole::Pinhole;
use crate::view::CaptureWarning;

/// Where the mask of a view is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum MaskPlace {
    /// The file names it.
    Named(PathBuf),
    /// The file says that there is none.
    None,
    /// By convention, beside the photograph.
    ByConvention,
    /// The first of these that is there, or the photograph's alpha channel.
    OneOf(Vec<PathBuf>),
}

/// A view of a camera file.
#[derive(Clone, Debug)]
pub(crate) struct DeclaredView {
    pub(crate) name: String,
    /// With the photograph's size.
    pub(crate) camera: Pinhole,
    pub(crate) distortion: Distortion,
    pub(crate) mask: MaskPlace,
    /// The photograph's path; it need not be there.
    pub(crate) photo: Option<PathBuf>,
}

/// A camera file.
#[derive(Clone, Debug)]
pub(crate) struct Declared {
    pub(crate) name: Option<String>,
    pub(crate) pixel_centre: f64,
    pub(crate) object_bounds: Option<[DVec3; 2]>,
    pub(crate) is_metric: bool,
    pub(crate) views: Vec<DeclaredView>,
    /// Views that are listed and cannot be used.
    pub(crate) warnings: Vec<CaptureWarning>,
}

impl Declared {
    /// What files say that have no more than metric cameras.
    pub(crate) fn of(
        views: Vec<DeclaredView>,
        pixel_centre: f64,
        warnings: Vec<CaptureWarning>,
    ) -> Self {
        Self {
            name: None,
            pixel_centre,
            object_bounds: None,
            is_metric: true,
            views,
            warnings,
        }
    }
}
