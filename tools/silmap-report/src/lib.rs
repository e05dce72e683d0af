//! One HTML page about an asset: its pictures, its errors, its sizes and how long it took, with nothing to load from
//! anywhere else.
//!
//! The page is a pure function of [`Report`]; who fills that in decides what is measured.

mod page;
mod plot;

use silmap_map::Asset;

/// Everything the page shows.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// What the page is about, a few words.
    pub title: String,
    /// The asset.
    pub asset: &'a Asset,
    /// Size of its file and of the parts in it: name and bytes.
    pub bytes: Vec<(String, u64)>,
    /// Stages of the build and their seconds, in order.
    pub seconds: Vec<(String, f64)>,
    /// One row of pictures for each viewpoint.
    pub rows: Vec<PictureRow>,
    /// Errors of each method.
    pub errors: Vec<MethodErrors>,
    /// Sentences on where and how this was measured.
    pub notes: Vec<String>,
}

/// Pictures side by side.
#[derive(Clone, Debug)]
pub struct PictureRow {
    /// What they have in common.
    pub caption: String,
    /// From left to right.
    pub pictures: Vec<Picture>,
}

/// A picture with a word under it.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The word.
    pub label: String,
    /// The bytes of a PNG file.
    pub png: Vec<u8>,
}

/// Errors of one interpolation method over test viewpoints, as shares of the pixels inside the true outline.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodErrors {
    /// The method.
    pub method: String,
    /// How many viewpoints.
    pub viewpoints: u32,
    /// Mean, median and largest share of wrong pixels.
    pub misclassified: [f64; 3],
    /// Mean and largest share of pixels that are inside but predicted outside.
    pub escaped: [f64; 2],
}

/// The page as HTML.
#[must_use]
pub fn html(report: &Report<'_>) -> String {
    page::page(report).into_string()
}
