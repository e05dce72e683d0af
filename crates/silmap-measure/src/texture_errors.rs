//! Measuring an asset's textures: how far its pictures are from the model's, and how often its parametrisations jump.

use std::collections::BTreeMap;

use serde::Serialize;
use silmap_geometry::Watch;
use silmap_geometry::{Bvh, Camera, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::{Asset, Method};
use silmap_preprocess::texture::Parametrisation;
use silmap_study::{
    Antialias, Background, ColourDifference, EdgeParams, FrameParams, Mode, Paint, PictureOptions,
    PictureRenderer,
};

use crate::evaluate::{EvaluateParams, Place, viewpoints};
use crate::{MeasureError, discontinuities};

/// What is compared with the model.
const PAINTS: [(&str, Paint); 5] = [
    ("relief", Paint::Relief),
    ("blended", Paint::Blended),
    ("nearest", Paint::Nearest),
    ("views", Paint::Views),
    ("tiles", Paint::Tiles),
];

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureErrors {
    /// Viewpoints that colours were compared at.
    pub viewpoints: u32,
    /// By what the hull shows; empty where there is nothing to draw with.
    pub colour_difference: BTreeMap<&'static str, ColourErrors>,
    /// By parametrisation.
    pub discontinuities_per_1000: BTreeMap<&'static str, f64>,
}

/// Differences of colours inside both outlines, in steps of 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColourErrors {
    /// Mean of red, green and blue over all viewpoints.
    pub mean: [f64; 3],
    /// The largest of the three.
    pub largest_channel: f64,
    /// The same at the viewpoint where it is largest.
    pub worst_viewpoint: f64,
}

/// Where and how finely is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureErrorParams {
    /// Random viewpoints on the sphere of the captured views.
    pub viewpoints: u32,
    /// Seed of their directions.
    pub seed: u64,
    /// Side of the pictures, pixels.
    pub size_px: u32,
}

/// How far pictures are from the model's, for everything that the hull can show.
///
/// # Errors
/// When interrupted, or something cannot be drawn.
pub fn colour_errors(
    gpu: &Gpu,
    asset: &Asset,
    model: &TriangleMesh,
    params: &TextureErrorParams,
    watch: &Watch<'_>,
) -> Result<BTreeMap<&'static str, ColourErrors>, MeasureError> {
    let map = &asset.map;
    let eyes = viewpoints(
        map,
        &EvaluateParams {
            viewpoints: params.viewpoints,
            seed: params.seed,
            place: Place::Sphere,
            ..EvaluateParams::default()
        },
    )?;
    let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
    renderer.load_asset(gpu, asset)?;
    renderer.load_model(gpu, model)?;
    let mut found: BTreeMap<&'static str, Vec<ColourDifference>> = BTreeMap::new();
    for eye in eyes {
        watch.check()?;
        let size = (params.size_px, params.size_px);
        let mut frame = FrameParams {
            camera: Camera::fit_sphere(eye, map.center, map.radius, None, size)?,
            mode: Mode::Original,
            method: Method::best_for(map),
            paint: Paint::default(),
            antialias: Antialias::None,
            background: Background::Transparent,
            edges: EdgeParams::default(),
            light: None,
            shadow: None,
        };
        let original = renderer.render(gpu, &frame)?;
        frame.mode = Mode::Clipped;
        for (name, paint) in PAINTS {
            frame.paint = paint;
            let clipped = renderer.render(gpu, &frame)?;
            let difference = ColourDifference::between(&original, &clipped);
            found.entry(name).or_default().extend(difference);
        }
    }
    Ok(found
        .into_iter()
        .map(|(name, all)| (name, summary(&all)))
        .collect())
}

fn summary(differences: &[ColourDifference]) -> ColourErrors {
    let count = differences.len().max(1) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|c| differences.iter().map(|d| d.mean[c]).sum::<f64>() / count);
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    ColourErrors {
        mean,
        largest_channel: largest(&mut mean.into_iter()),
        worst_viewpoint: largest(&mut differences.iter().map(ColourDifference::largest_channel)),
    }
}

/// Jumps among a thousand texels of the asset's atlas, for both parametrisations; nothing without an atlas.
#[must_use]
pub fn discontinuities_per_1000(
    asset: &Asset,
    model: &TriangleMesh,
) -> BTreeMap<&'static str, f64> {
    let bvh = Bvh::new(model);
    let atlas = asset.textures.atlas.iter();
    atlas
        .flat_map(|atlas| {
            Parametrisation::ALL.map(|how| {
                let found = discontinuities((model, &bvh), &asset.hull, atlas, how);
                (how.name(), found.per_thousand())
            })
        })
        .collect()
}
