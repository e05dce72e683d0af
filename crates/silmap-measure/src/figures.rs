//! What is measured of an asset, as data.

use glam::DVec3;
use silmap_geometry::{Camera, ColourImage, Loop, Mask};

use crate::{Straying, StrayingSummary};

/// Errors of one interpolation method over test viewpoints, as shares of the pixels inside the true outline.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodErrors {
    /// The method, with what else distinguishes the row.
    pub method: String,
    /// Mean, median and largest share of wrong pixels.
    pub misclassified: [f64; 3],
    /// Mean and largest share of pixels that are inside but predicted outside.
    pub escaped: [f64; 2],
    /// How far outlines stray from the exact ones, where that is measured.
    pub straying: Option<StrayingSummary>,
}

/// The error of one method at one viewpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSample {
    /// The method, as in [`MethodErrors`].
    pub method: String,
    /// The viewpoint, in the asset's coordinates.
    pub eye: DVec3,
    /// Share of wrong pixels.
    pub misclassified: f64,
    /// Share of pixels that are inside but predicted outside.
    pub escaped: f64,
    /// How far the outline strays from the exact one, where that is measured.
    pub straying: Option<Straying>,
}

/// Errors at test viewpoints of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceErrors {
    /// The place as users type it.
    pub place: String,
    /// Where that is, half a sentence.
    pub description: String,
    /// How many viewpoints.
    pub viewpoints: u32,
    /// A summary of each method.
    pub methods: Vec<MethodErrors>,
    /// Every viewpoint and method.
    pub samples: Vec<ErrorSample>,
}

/// Errors of one method at directions spread evenly over the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionErrors {
    /// The method.
    pub method: String,
    /// Unit vectors from the center to the eye, and the misclassified share there.
    pub samples: Vec<(DVec3, f64)>,
}

/// A viewpoint, and what is true and predicted there.
#[derive(Clone, Debug)]
pub struct WorstView {
    /// The error, and whose it is.
    pub sample: ErrorSample,
    /// The camera of the masks.
    pub camera: Camera,
    /// The model's pixels.
    pub truth: Mask,
    /// The pixels inside the interpolated outline.
    pub predicted: Mask,
}

/// A viewpoint, and both outlines there.
#[derive(Clone, Debug)]
pub struct StrayView {
    /// How far the outline strays, and whose it is.
    pub sample: ErrorSample,
    /// The camera of the picture.
    pub camera: Camera,
    /// The exact outline, pixels.
    pub truth: Vec<Loop>,
    /// The interpolated one.
    pub predicted: Vec<Loop>,
    /// The hull, clipped to the interpolated one; `None` where there was nothing to draw with.
    pub drawn: Option<ColourImage>,
}

/// How well the hull is painted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureFigures {
    /// Texture views.
    pub views: u32,
    /// Share of the hull's area that some view sees.
    pub seen_share: f64,
    /// Share of the hull's area that falls to the atlas.
    pub atlas_share: f64,
    /// Σ area × cosine over Σ area, each face with the view that sees it most squarely.
    pub merit: f64,
    /// Views that see a face, on average over the area.
    pub views_per_face: f64,
    /// Texels of the views along the model's bounding radius.
    pub view_texels_per_radius: f64,
    /// The same of the atlas.
    pub atlas_texels_per_radius: f64,
    /// Bytes of all pictures.
    pub bytes: u64,
    /// Parametrisations, and how many of 1,000 texels of the atlas are beside a jump of each.
    pub discontinuities: Vec<(String, f64)>,
    /// Eyes that colours were compared at.
    pub viewpoints: u32,
    /// Differences from the full mesh; empty where there was nothing to draw with.
    pub colours: Vec<ColourRow>,
}

/// How far the colours are from the full mesh's with one way of painting, in steps of 255.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColourRow {
    /// What the hull shows.
    pub paint: String,
    /// Mean of red, green and blue over all eyes.
    pub mean: [f64; 3],
    /// The largest channel's at the worst eye.
    pub worst: f64,
}

/// How long one method takes for an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourTime {
    /// The method.
    pub method: String,
    /// Median over the calls, seconds.
    pub median: f64,
    /// Nineteen of twenty calls take less, seconds.
    pub most: f64,
    /// Number of calls.
    pub calls: u32,
}

/// What was measured on, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Processor and system.
    pub machine: String,
    /// Threads that errors were measured with; times of outlines are those of one.
    pub threads: u32,
    /// Whether the program was optimised.
    pub is_optimised: bool,
    /// Side of the test pictures, pixels.
    pub resolution_px: u32,
    /// Seed of the test viewpoints.
    pub seed: u64,
    /// Seconds that measuring took.
    pub seconds: f64,
}

/// The polytope when some of the views are left.
#[derive(Clone, Debug, PartialEq)]
pub struct PolytopeLevel {
    /// What it is, a few words.
    pub label: String,
    /// The viewpoints, object space.
    pub eyes: Vec<DVec3>,
    /// Triangles over them, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}
