//! `silmap evaluate --camera`: how far an asset's outlines are from the masks of a capture.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, bail};
use serde::Serialize;
use silmap_capture::{Capture, CaptureView, Drawing, read_cameras};
use silmap_geometry::Loop;
use silmap_map::Asset;
use silmap_measure::evaluate::{EvaluateParams, Shares, ViewpointError};
use silmap_measure::{MaskError, MaskedView, evaluate_masks};

use crate::args::EvaluateArgs;
use crate::captured_camera;
use crate::commands::captured;
use crate::commands::evaluation::{
    METHOD, ViewpointJson, methods_of, of_methods, shares_of, table,
};
use crate::progress::Progress;
use crate::scene::Scene;
use crate::{interrupt, output};

#[derive(Serialize)]
struct EvaluateJson<'a> {
    viewpoints: usize,
    r#where: &'static str,
    /// The camera file.
    camera: &'a Path,
    methods: BTreeMap<&'static str, MaskMethodJson>,
    per_viewpoint: Vec<MaskViewJson<'a>>,
}

#[derive(Serialize)]
struct MaskMethodJson {
    #[serde(flatten)]
    shares: Shares,
    /// Of intersection over union.
    overlap_mean: f64,
    overlap_min: f64,
}

#[derive(Serialize)]
struct MaskViewJson<'a> {
    /// Its name.
    view: &'a str,
    #[serde(flatten)]
    shares: ViewpointJson,
    /// Intersection over union with its mask.
    overlap: f64,
}

/// Measures and prints.
///
/// # Errors
/// One sentence with the name of the asset's or the camera file.
pub(crate) fn run(args: &EvaluateArgs, asset: &Asset) -> anyhow::Result<()> {
    let Some(path) = &args.camera else {
        bail!("there is nothing to compare with");
    };
    let capture = captured::read(path, args.masks.options())?;
    let views = chosen(path, &args.views, &capture)?;
    let drawings = drawings(&capture, &views, &Scene::of(asset))?;
    let places: Vec<_> = (drawings.iter())
        .map(|drawing| move |loops: &[Loop]| drawing.loops_from_drawn(loops))
        .collect();
    let masked: Vec<MaskedView<'_>> = (views.iter().zip(&drawings).zip(&places))
        .map(|((view, drawing), place)| MaskedView {
            camera: drawing.camera,
            place,
            mask: &view.mask,
            known: view.known.as_ref(),
        })
        .collect();
    let params = EvaluateParams {
        methods: methods_of(args, &asset.map),
        ..EvaluateParams::default()
    };
    let errors = Progress::new()
        .watch(|watch| evaluate_masks(&asset.map, &masked, &params, watch))
        .with_context(|| args.asset.display().to_string())?;
    let shares: Vec<ViewpointError> = errors.iter().map(|e| e.error).collect();
    let methods = shares_of(&of_methods(&shares));
    if args.output.json {
        let view = |e: &MaskError| MaskViewJson {
            view: &views[e.view].name,
            shares: ViewpointJson::new(&e.error, asset.placement.in_scene),
            overlap: e.overlap,
        };
        return output::print_json(&EvaluateJson {
            viewpoints: views.len(),
            r#where: "capture",
            camera: &capture.path,
            methods: (methods.iter())
                .map(|&(name, shares)| (name, with_overlap((name, shares), &errors)))
                .collect(),
            per_viewpoint: errors.iter().map(view).collect(),
        });
    }
    let place = format!("{} views of the capture", views.len());
    let mut text = table(&place, METHOD, &methods);
    text.push_str(&per_view(&views, &errors));
    output::print_bytes(text.as_bytes())
}

fn with_overlap((method, shares): (&str, Shares), errors: &[MaskError]) -> MaskMethodJson {
    let own = || (errors.iter()).filter(|e| e.error.method.name() == method);
    MaskMethodJson {
        shares,
        overlap_mean: own().map(|e| e.overlap).sum::<f64>() / own().count().max(1) as f64,
        overlap_min: own().map(|e| e.overlap).fold(1.0, f64::min),
    }
}

/// The views that are named, in that order, or all.
fn chosen<'a>(
    path: &Path,
    names: &[String],
    capture: &'a Capture,
) -> anyhow::Result<Vec<&'a CaptureView>> {
    if names.is_empty() {
        return Ok(capture.views.iter().collect());
    }
    let owned = path.to_owned();
    let list = interrupt::unless_stopped(move || read_cameras(&owned))??;
    let mut found: Vec<&CaptureView> = Vec::with_capacity(names.len());
    for wanted in names {
        let name = &list.named(wanted)?.name;
        let view = capture.views.iter().find(|view| view.name == *name);
        let view = view.with_context(|| {
            let file = capture.path.display();
            format!("{file}: view {name} has no mask to compare with")
        })?;
        if !found.iter().any(|other| other.name == view.name) {
            found.push(view);
        }
    }
    Ok(found)
}

fn drawings(
    capture: &Capture,
    views: &[&CaptureView],
    scene: &Scene,
) -> anyhow::Result<Vec<Drawing>> {
    let drawing = |view: &&CaptureView| {
        let place = (capture.path.as_path(), view.name.as_str());
        captured_camera::drawing(place, Drawing::new(&view.camera), scene)
    };
    views.iter().map(drawing).collect()
}

/// A line for each view with what each method has.
fn per_view(views: &[&CaptureView], errors: &[MaskError]) -> String {
    let mut text = "misclassified and escaped in each view\n".to_owned();
    for (number, view) in views.iter().enumerate() {
        text.push_str(&view.name);
        for e in errors.iter().filter(|e| e.view == number) {
            let error = &e.error;
            text.push_str(&format!(
                "  {} {:.3} % {:.3} %",
                error.method.name(),
                100.0 * error.misclassified,
                100.0 * error.escaped
            ));
        }
        text.push('\n');
    }
    text
}
