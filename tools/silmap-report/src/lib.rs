//! One HTML page about an asset: its errors, pictures, curves, sizes and times, with nothing to load from anywhere else;
//! and the same numbers as JSON.
//!
//! Page and numbers are pure functions of [`Report`]; the caller that fills it in decides what is measured. Plots are drawn as SVG in
//! `charts`, pictures of things in space on the CPU in `canvas`.

pub mod animation;
mod canvas;
mod capture_page;
mod charts;
mod comparison;
mod contour_generator;
mod coverage_map;
mod difference;
mod direction_map;
mod epipolar_picture;
mod globe;
mod numbers;
mod page;
mod palette;
mod plot;
mod png;
mod polytope_picture;
mod scale;
mod scene_section;
mod stray_picture;
mod texture_section;
mod turntable_section;
mod words;

use silmap_geometry::{ColourImage, TriangleMesh};
use silmap_map::Asset;
use silmap_measure::{Comparison, Measured, SceneResults};

pub use capture_page::{CapturePage, CapturePageView, capture_page};
pub use comparison::numbers as comparison_numbers;
pub use coverage_map::coverage_map;

/// Everything the page shows.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// What the page is about, a few words.
    pub title: String,
    /// The asset.
    pub asset: &'a Asset,
    /// The model that it was made from.
    pub model: &'a TriangleMesh,
    /// What was measured of both.
    pub measured: Measured,
    /// Stages of the build and their seconds, in order; empty when unknown.
    pub seconds: Vec<(String, f64)>,
    /// One row of pictures for each viewpoint that the user chose.
    pub rows: Vec<PictureRow>,
    /// Exact extraction beside it, where it was measured.
    pub comparison: Option<Comparison>,
    /// Frames of many instances, as far as they were measured.
    pub scenes: Vec<SceneResults>,
    /// More sentences on where and how this was measured.
    pub notes: Vec<String>,
}

impl<'a> Report<'a> {
    /// What was measured of an asset and its model, without pictures, build times, comparison and scenes; a note says how the asset was made.
    #[must_use]
    pub fn new(asset: &'a Asset, model: &'a TriangleMesh, measured: Measured) -> Self {
        let record = &asset.record;
        Self {
            title: format!("Outline of {}", record.name),
            asset,
            model,
            seconds: Vec::new(),
            rows: Vec::new(),
            measured,
            comparison: None,
            scenes: Vec::new(),
            notes: vec![format!(
                "The asset was made by {} with {}.",
                record.generator, record.options
            )],
        }
    }
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
    /// The picture.
    pub image: ColourImage,
}

/// The page as HTML.
#[must_use]
pub fn html(report: &Report<'_>) -> String {
    page::page(report).into_string()
}

/// All numbers of the page as JSON text, one object.
#[must_use]
pub fn json(report: &Report<'_>) -> String {
    numbers::numbers(report).to_string()
}
