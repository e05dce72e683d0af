//! A capture as it was understood.

use std::path::PathBuf;

use glam::DVec2;
use silmap_geometry::{Loop, Mask};

use crate::lens::Lens;
use crate::pinhole::Pinhole;
use crate::reading::Misread;
use crate::shift::{ImageShift, ShiftKind};
use crate::signed_distance::bounds_of;

/// A kind of camera file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraFormat {
    /// `cameras.json`: matrices and paths.
    CamerasJson,
    /// `transforms.json` of NeRF, instant-ngp and nerfstudio.
    TransformsJson,
    /// `*_par.txt` of Middlebury's multi-view stereo sets.
    Middlebury,
    /// A COLMAP model, binary or text.
    Colmap,
    /// `cameras.xml` of Agisoft Metashape.
    Metashape,
    /// `txt/%08d.txt` of PMVS.
    Pmvs,
    /// Plain 3×4 matrices: a file for each view, or one for all, of text or of OpenCV.
    Matrices,
}

impl CameraFormat {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CamerasJson => "cameras.json (matrices)",
            Self::TransformsJson => "transforms.json (NeRF)",
            Self::Middlebury => "*_par.txt (Middlebury)",
            Self::Colmap => "COLMAP model",
            Self::Metashape => "cameras.xml (Metashape)",
            Self::Pmvs => "txt/*.txt (PMVS)",
            Self::Matrices => "3×4 matrices",
        }
    }

    /// Its conventions, for people.
    #[must_use]
    pub fn conventions(self) -> &'static str {
        match self {
            Self::CamerasJson | Self::Middlebury | Self::Colmap | Self::Pmvs | Self::Matrices => {
                "world to camera, x right, y down, z forward"
            }
            Self::TransformsJson => "camera to world, x right, y up, z backward",
            Self::Metashape => "camera to world, x right, y down, z forward",
        }
    }
}

/// A photograph's camera and mask.
#[derive(Clone, Debug)]
pub struct CaptureView {
    /// Its name in the camera file.
    pub name: String,
    /// Its camera; image coordinates from the top-left corner. A lens is taken out: the camera is a pinhole, and its image need not
    /// have the photograph's size.
    pub camera: Pinhole,
    /// Where the object is seen; what lies outside the image is unknown.
    pub mask: Mask,
    /// The outline of the object where the image shows it, in pixels of the camera: outer loops have positive area, holes negative.
    pub outline: Vec<Loop>,
    /// The photograph, if there is one. [`CaptureView::photograph`] reads it as the camera sees it.
    pub photo: Option<PathBuf>,
    /// The photograph's lens, where it has distortion.
    pub lens: Option<Lens>,
    /// The mask of the photograph as it was taken, where a lens was taken out.
    pub taken: Option<Mask>,
    /// Pixels of the camera's image that the photograph shows; the others are unknown. `None`: all.
    pub known: Option<Mask>,
}

impl CaptureView {
    /// Width and height of the mask's inside, pixels.
    #[must_use]
    pub fn extent_px(&self) -> Option<DVec2> {
        let (low, high) = bounds_of(&self.mask)?;
        Some(DVec2::new(
            f64::from(high[0] - low[0]),
            f64::from(high[1] - low[1]),
        ))
    }
}

/// Views of one object.
#[derive(Clone, Debug)]
pub struct Capture {
    /// What it is called: by the file, or by its folder.
    pub name: String,
    /// The camera file.
    pub path: PathBuf,
    /// Its kind.
    pub format: CameraFormat,
    /// Where the file's image coordinates have the first pixel's centre.
    pub pixel_centre: f64,
    /// A box around the object, where the file has one.
    pub object_bounds: Option<[glam::DVec3; 2]>,
    /// Views with a mask, in the order of the file.
    pub views: Vec<CaptureView>,
    /// Views that the file lists, those without a mask included.
    pub listed: usize,
    /// What was odd.
    pub warnings: Vec<CaptureWarning>,
}

/// Something odd that did not stop the reading or carving.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CaptureWarning {
    /// A view without a mask is not used.
    NoMask {
        /// The view's name.
        view: String,
    },
    /// A view that is listed, and cannot be used for what the camera file says about it.
    Unused {
        /// The view's name.
        view: String,
        /// Why.
        reason: String,
    },
    /// Projective cameras that turn about one line were made metric.
    MadeMetric {
        /// Focal length that was found, pixels.
        focal_px: f64,
        /// Principal point that was found, pixels from the top-left corner.
        principal_px: [f64; 2],
    },
    /// Photographs that were given to cameras in the order of their names, as no name says which belongs to which.
    InOrder {
        /// How many.
        count: usize,
    },
    /// A mask whose picture is unusual.
    Mask {
        /// The view's name.
        view: String,
        /// What is unusual about it.
        note: String,
    },
    /// A photograph that is named and not there, or not of its camera's size.
    Photo {
        /// The view's name.
        view: String,
        /// Why its photograph is not used.
        reason: String,
    },
    /// A photograph much darker or brighter than the rest, or of another tint.
    Exposure {
        /// The view's name.
        view: String,
        /// Factors on linear red, green and blue that even it out.
        gain: [f64; 3],
    },
    /// Masks that disagree with the rest.
    Disagrees {
        /// The view's name.
        view: String,
        /// Intersection over union with the carved hull.
        overlap: f64,
        /// The median over all views.
        median: f64,
    },
    /// A view that alone carves away much of what all others keep has no vote.
    LeftOut {
        /// The view's name.
        view: String,
    },
    /// A hull that agrees badly with most masks.
    PoorOverlap {
        /// Median of intersection over union.
        median: f64,
    },
    /// Another reading of the cameras agrees better with the masks.
    Misread(Misread),
    /// All image coordinates are off by a step.
    Shifted(ImageShift),
    /// Small pieces beside the largest were left out.
    Pieces {
        /// How many.
        count: usize,
    },
    /// The hull reaches the box that the file says the object is in.
    AtBounds,
}

impl std::fmt::Display for CaptureWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoMask { view } => write!(f, "view {view} has no mask: it is not used"),
            Self::Unused { view, reason } => write!(f, "view {view} is not used: {reason}"),
            Self::MadeMetric {
                focal_px,
                principal_px: [x, y],
            } => write!(
                f,
                "its cameras are projective only; as they turn about one line, they are made metric by square pixels and a principal point near \
                 the middle (found: {focal_px:.0} pixels of focal length, {x:.0}, {y:.0}); the unit is the radius of their circle"
            ),
            Self::InOrder { count } => write!(
                f,
                "no photograph has the name of a camera: the {count} photographs are taken in the order of the numbers in their names"
            ),
            Self::Mask { view, note } => write!(f, "view {view}: its mask: {note}"),
            Self::Photo { view, reason } => {
                write!(f, "view {view}: its photograph is not used: {reason}")
            }
            Self::Exposure {
                view,
                gain: [r, g, b],
            } => write!(
                f,
                "view {view} is exposed unlike the rest: its red, green and blue are evened out by {r:.2}, {g:.2} and {b:.2}"
            ),
            Self::Disagrees {
                view,
                overlap,
                median,
            } => write!(
                f,
                "view {view} disagrees with the rest: its mask overlaps the carved hull by {overlap:.3}, the median is {median:.3}; \
                 its mask or its camera may be wrong"
            ),
            Self::LeftOut { view } => write!(
                f,
                "view {view} is left out: it alone carves away much of what all other masks keep"
            ),
            Self::PoorOverlap { median } => write!(
                f,
                "the hull overlaps the masks by {median:.3} only, in the median: the cameras may be mirrored, have y up for y down or another \
                 principal point, or be inexact"
            ),
            Self::Misread(misread) => write!(f, "{misread}"),
            Self::Shifted(shift) => match shift.kind() {
                ShiftKind::HalfPixel { is_forward } => write!(
                    f,
                    "{shift}: where the file has the first pixel's centre is half a pixel too {}, or the principal point is off",
                    if is_forward { "large" } else { "small" }
                ),
                _ => write!(f, "{shift}: the principal point may be off"),
            },
            Self::Pieces { count } => write!(
                f,
                "{count} {} beside the object {} left out: what masks leave by accident, or what few images show",
                if *count == 1 { "piece" } else { "pieces" },
                if *count == 1 { "was" } else { "were" }
            ),
            Self::AtBounds => write!(
                f,
                "the hull reaches the box that the camera file has for the object: it is cut off there"
            ),
        }
    }
}
