//! Why a capture cannot be read: one sentence that names the file, and the view where there is one.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::mask_image::MaskFault;
use crate::pinhole::PinholeFault;

/// Why there is no capture.
#[derive(Debug, Error)]
#[error("{}: {fault}", path.display())]
pub struct CaptureError {
    /// The file or folder at fault.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: Box<CaptureFault>,
}

/// What is wrong with a capture's file or folder.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaptureFault {
    /// The operating system refused.
    #[error("it cannot be read: {0}")]
    Unreadable(#[source] io::Error),
    /// A folder without cameras.
    #[error("the folder has no camera file: {known} is needed")]
    NoCameraFile {
        /// Names that are looked for.
        known: &'static str,
    },
    /// A JSON file that is none of those that are known.
    #[error(
        "it is JSON, but no camera file that is known here: neither \"views\" (cameras.json) nor \"frames\" (transforms.json) is in it"
    )]
    OtherJson,
    /// A damaged file.
    #[error("it is damaged: {reason}")]
    Damaged {
        /// What is wrong with it.
        reason: String,
    },
    /// NaN or infinity in JSON, which has no such numbers.
    #[error("line {line}, column {column}: a number is NaN or infinite")]
    NotFinite {
        /// Line, from one.
        line: usize,
        /// Column, from one.
        column: usize,
    },
    /// A line of a file of text that cannot be understood.
    #[error("line {line}: {reason}")]
    Line {
        /// Its number, from one.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A list of views with nothing in it.
    #[error("it has no views")]
    NoViews,
    /// Views none of which can be used.
    #[error("none of its views can be used: {first}")]
    NoUsableView {
        /// The first of them, and why not.
        first: String,
    },
    /// A field that is missing or of another shape.
    #[error("{place}{field} must be {shape}{}", found.as_deref().map(|f| format!(", and is {f}")).unwrap_or_default())]
    Field {
        /// `"view X: "`, or nothing for the file itself.
        place: String,
        /// Its name.
        field: &'static str,
        /// What it must be.
        shape: &'static str,
        /// What it is.
        found: Option<String>,
    },
    /// A camera that is none.
    #[error("view {view}: {fault}")]
    Camera {
        /// The view's name.
        view: String,
        /// What is wrong with it.
        fault: PinholeFault,
    },
    /// The matrix and its parts do not agree.
    #[error(
        "view {view}: P is not K·[R t]: they differ by {difference:.1e} of the largest element{hint}"
    )]
    Disagreement {
        /// The view's name.
        view: String,
        /// Largest difference of an element, both scaled alike.
        difference: f64,
        /// What would agree, if anything known.
        hint: &'static str,
    },
    /// A lens model that is not taken out.
    #[error(
        "view {view}: its lens has the model {what}, which is not taken out here: undistort the pictures first"
    )]
    LensModel {
        /// The view's name.
        view: String,
        /// The model's name.
        what: String,
    },
    /// A lens whose numbers mean nothing.
    #[error("view {view}: {reason}")]
    Lens {
        /// The view's name.
        view: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Cameras up to a projectivity.
    #[error(
        "its cameras are projective only (\"metric\": false): distances and angles mean nothing in such a frame, and an asset needs them"
    )]
    Projective,
    /// A mask's file cannot be understood.
    #[error("view {view}: the mask {}: {fault}", mask.display())]
    Mask {
        /// The view's name.
        view: String,
        /// The mask's file.
        mask: PathBuf,
        /// What is wrong with it.
        fault: Box<MaskFault>,
    },
    /// Neither camera file nor pictures say how large the image is.
    #[error("view {view}: the size of its image is in neither the camera file nor a picture")]
    NoSize {
        /// The view's name.
        view: String,
    },
    /// A photograph that is needed and cannot be used.
    #[error("view {view}: the photograph {}: {reason}", photo.display())]
    Photograph {
        /// The view's name.
        view: String,
        /// The photograph's file.
        photo: PathBuf,
        /// Why not.
        reason: String,
    },
    /// No view is called so.
    #[error("it has no view {wanted}; {}", near(nearest, *views))]
    NoView {
        /// What was asked for.
        wanted: String,
        /// The names most like it.
        nearest: Vec<String>,
        /// Views in the file.
        views: usize,
    },
    /// Several views begin so, or are called so.
    #[error("{count} views may be meant by {wanted}: {}{}", names.join(", "), if *count > names.len() { ", …" } else { "" })]
    AmbiguousView {
        /// What was asked for.
        wanted: String,
        /// The first of them.
        names: Vec<String>,
        /// How many.
        count: usize,
    },
    /// So few masks that they bound nothing.
    #[error(
        "{count} of {views} views {} a mask, and a hull needs two at least, from different sides",
        if *count == 1 { "has" } else { "have" }
    )]
    TooFewMasks {
        /// Views with a mask.
        count: usize,
        /// Views.
        views: usize,
    },
}

impl CaptureFault {
    /// The error of a file.
    pub(crate) fn at(self, path: &Path) -> CaptureError {
        CaptureError {
            path: path.to_owned(),
            fault: Box::new(self),
        }
    }
}

/// Names to choose from, as the end of a sentence.
fn near(nearest: &[String], views: usize) -> String {
    match (nearest.len(), nearest.join(", ")) {
        (count, names) if count == views => format!("it has {names}"),
        (_, names) => format!("of its {views}, the names most like it are {names}"),
    }
}
