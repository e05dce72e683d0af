//! `silmap evaluate`: how wrong an asset's outlines are.

use std::collections::BTreeMap;

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_map::Method;
use silmap_measure::evaluate::{
    EvaluateParams, MethodErrors, Place, ViewpointError, evaluate, summarise,
};
use silmap_measure::{TextureErrorParams, TextureErrors, colour_errors, discontinuities_per_1000};

use crate::args::{EvaluateArgs, WhereArg};
use crate::commands::{leave_one_out, open_gpu};
use crate::files::{load_model_of, read_asset};
use crate::output;
use crate::progress::Progress;

#[derive(Serialize)]
struct EvaluateJson {
    viewpoints: u32,
    r#where: &'static str,
    methods: BTreeMap<&'static str, MethodJson>,
    per_viewpoint: Vec<ViewpointJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    textures: Option<TextureErrors>,
}

/// Shares of the pixels inside the true outline.
#[derive(Serialize)]
struct MethodJson {
    misclassified_mean: f64,
    misclassified_median: f64,
    misclassified_max: f64,
    escaped_mean: f64,
    escaped_max: f64,
}

#[derive(Serialize)]
struct ViewpointJson {
    eye: [f64; 3],
    method: &'static str,
    misclassified: f64,
    escaped: f64,
    /// Pixels inside the true outline, which both are shares of.
    inside_px: u64,
}

/// A share of fewer pixels than this says little: one pixel is a percent of them.
const FEW_PX: u64 = 100;

pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let Some(model) = &args.model else {
        return leave_one_out::run(&args.asset, args);
    };
    let (asset, _) = read_asset(&args.asset)?;
    let model = load_model_of(&asset, model, args.mending)?;
    // Before the long work, for it may not be there.
    let gpu = args.textures.map(|_| open_gpu()).transpose()?;
    let params = EvaluateParams {
        viewpoints: args.viewpoints,
        seed: args.pictures.seed,
        place: args.placement.into(),
        methods: args.method.map_or_else(
            || Method::all_for(&asset.map).collect(),
            |method| vec![method.into()],
        ),
        size_px: args.pictures.resolution,
        ..EvaluateParams::default()
    };
    let errors = Progress::new()
        .watch(|watch| evaluate(&asset.map, model.mesh.mesh(), &params, watch))
        .with_context(|| args.asset.display().to_string())?;
    warn_of_few_pixels(args, &errors);
    let methods = summarise(&errors);
    let textures = match (args.textures, &gpu) {
        (Some(viewpoints), Some(gpu)) => {
            let params = TextureErrorParams {
                viewpoints,
                seed: args.pictures.seed,
                size_px: args.pictures.resolution,
            };
            let mesh = model.mesh.mesh();
            Some(TextureErrors {
                viewpoints,
                colour_difference: Progress::new()
                    .watch(|watch| colour_errors(gpu, &asset, mesh, &params, watch))
                    .with_context(|| args.asset.display().to_string())?,
                discontinuities_per_1000: discontinuities_per_1000(&asset, mesh),
            })
        }
        _ => None,
    };
    if args.output.json {
        let mut json = as_json(&params, &methods, &errors, asset.placement.in_scene);
        json.textures = textures;
        return output::print_json(&json);
    }
    let mut text = table(&params, &methods);
    if let Some(textures) = &textures {
        text.push_str(&texture_table(textures));
    }
    output::print_bytes(text.as_bytes())
}

/// Says where shares are of a handful of pixels.
fn warn_of_few_pixels(args: &EvaluateArgs, errors: &[ViewpointError]) {
    // Each viewpoint is there once for every method.
    let Some(method) = errors.first().map(|e| e.method) else {
        return;
    };
    let inside = errors.iter().filter(|e| e.method == method);
    let few: Vec<u64> = inside
        .map(|e| e.inside_px)
        .filter(|&n| n < FEW_PX)
        .collect();
    if let Some(least) = few.iter().min() {
        output::warn(&format!(
            "{}: at {} of {} viewpoints fewer than {FEW_PX} pixels are inside the true outline, at one {least}: shares of so few say \
             little (--resolution makes them more)",
            args.asset.display(),
            few.len(),
            args.viewpoints,
        ));
    }
}

fn as_json(
    params: &EvaluateParams,
    methods: &[MethodErrors],
    errors: &[ViewpointError],
    origin: DVec3,
) -> EvaluateJson {
    EvaluateJson {
        viewpoints: params.viewpoints,
        r#where: params.place.name(),
        methods: methods
            .iter()
            .map(|m| {
                let row = MethodJson {
                    misclassified_mean: m.misclassified_mean,
                    misclassified_median: m.misclassified_median,
                    misclassified_max: m.misclassified_max,
                    escaped_mean: m.escaped_mean,
                    escaped_max: m.escaped_max,
                };
                (m.method.name(), row)
            })
            .collect(),
        per_viewpoint: errors
            .iter()
            .map(|e| ViewpointJson {
                eye: (e.eye + origin).to_array(),
                method: e.method.name(),
                misclassified: e.misclassified,
                escaped: e.escaped,
                inside_px: e.inside_px,
            })
            .collect(),
        textures: None,
    }
}

fn table(params: &EvaluateParams, methods: &[MethodErrors]) -> String {
    let mut text = format!(
        "{} viewpoints on the {}; shares of the pixels inside the true outline\n\
         method   misclassified mean  median   worst   escaped mean   worst\n",
        params.viewpoints,
        params.place.name()
    );
    for m in methods {
        text.push_str(&format!(
            "{:<8} {:>17.3} % {:>6.3} % {:>5.2} % {:>12.4} % {:>5.2} %\n",
            m.method.name(),
            100.0 * m.misclassified_mean,
            100.0 * m.misclassified_median,
            100.0 * m.misclassified_max,
            100.0 * m.escaped_mean,
            100.0 * m.escaped_max,
        ));
    }
    text
}

fn texture_table(textures: &TextureErrors) -> String {
    let mut text = format!(
        "{} viewpoints on the view sphere; mean difference of colours inside both outlines, in steps of 255\n\
         paint      red    green  blue   worst viewpoint\n",
        textures.viewpoints,
    );
    for (name, errors) in &textures.colour_difference {
        let [red, green, blue] = errors.mean;
        text.push_str(&format!(
            "{name:<8} {red:>6.2} {green:>6.2} {blue:>6.2} {:>6.2}\n",
            errors.worst_viewpoint
        ));
    }
    for (name, jumps) in &textures.discontinuities_per_1000 {
        text.push_str(&format!(
            "{jumps:.2} of 1,000 texels of the atlas are beside a jump by {name}\n"
        ));
    }
    text
}

impl From<WhereArg> for Place {
    fn from(place: WhereArg) -> Self {
        match place {
            WhereArg::Polytope => Self::Polytope,
            WhereArg::Sphere => Self::Sphere,
            WhereArg::Shell => Self::Shell,
        }
    }
}
