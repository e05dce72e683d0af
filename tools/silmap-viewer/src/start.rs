//! What the program is started with.

use crate::look::Look;

/// What the program is started with.
#[derive(Debug, Default)]
pub struct Start {
    /// How it is looked at.
    pub look: Look,
    /// Whether a link or a command line said so; otherwise it opens as it was left.
    pub is_given: bool,
    /// Whether the picture is all there is, without a bar, controls and hints.
    pub is_bare: bool,
    /// What is opened.
    pub file: Option<Opened>,
}

/// Files to open.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opened {
    /// The asset, a mesh, or a capture.
    pub path: std::path::PathBuf,
    /// The full mesh of an asset, to compare with.
    pub model: Option<std::path::PathBuf>,
    /// The capture that an asset was built of, for its photographs.
    pub capture: Option<std::path::PathBuf>,
}

/// An address to open.
#[cfg(target_arch = "wasm32")]
pub type Opened = String;
