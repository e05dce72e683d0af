//! `silmap evaluate`: how wrong an asset's outlines are.

use std::collections::BTreeMap;

use anyhow::Context;
use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_capture::MaskOptions;
use silmap_measure::evaluate::{EvaluateParams, MethodErrors, Place, ViewpointError, evaluate};
use silmap_measure::{TextureErrorParams, TextureErrors, colour_errors, discontinuities_per_1000};
use silmap_mesh_io::LoadOptions;

use crate::args::{EvaluateArgs, WhereArg, usage_error};
use crate::captured_camera;
use crate::commands::evaluation::{
    METHOD, MethodJson, ViewpointJson, methods_of, of_methods, shares_of, straying_table, table,
};
use crate::commands::{evaluate_captured, leave_one_out, open_gpu};
use crate::files::{load_model_of, load_options, read_asset};
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

/// A share of fewer pixels than this says little: one pixel is a percent of them.
const FEW_PX: u64 = 100;

pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    if !args.views.is_empty() && args.camera.is_none() {
        captured_camera::without_camera("--view <NAME>");
    }
    if args.model.is_none() && load_options(args.mending) != LoadOptions::default() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "--close-holes, --repair, --alpha and --weld mend the mesh of '--model <MODEL>', and there is none",
        );
    }
    if args.leave_one_out {
        return leave_one_out::run(args);
    }
    if args.every.is_some() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "'--every <N>' is of use with '--leave-one-out' only",
        );
    }
    if args.camera.is_none() && args.masks.options() != MaskOptions::default() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "'--mask-inverted' and '--mask-rule <RULE>' are of use with '--camera <FILE>' or '--leave-one-out' only",
        );
    }
    let (asset, _) = read_asset(&args.asset)?;
    let Some(model) = &args.model else {
        return evaluate_captured::run(args, &asset);
    };
    let model = load_model_of(&asset, model, args.mending)?;
    // Before the long work, for it may not be there.
    let gpu = args.textures.map(|_| open_gpu()).transpose()?;
    let params = EvaluateParams {
        viewpoints: args.viewpoints,
        seed: args.pictures.seed,
        place: args.placement.into(),
        methods: methods_of(args, &asset.map),
        size_px: args.pictures.resolution,
        ..EvaluateParams::default()
    };
    let errors = Progress::new()
        .watch(|watch| evaluate(&asset.map, model.mesh.mesh(), &params, watch))
        .with_context(|| args.asset.display().to_string())?;
    warn_of_few_pixels(args, &errors);
    let methods = of_methods(&errors);
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
    let place = format!(
        "{} viewpoints on the {}",
        params.viewpoints,
        params.place.name()
    );
    let mut text = table(&place, METHOD, &shares_of(&methods));
    text.push_str(&straying_table(params.size_px, &methods));
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
    methods: &[(&'static str, MethodErrors)],
    errors: &[ViewpointError],
    origin: DVec3,
) -> EvaluateJson {
    EvaluateJson {
        viewpoints: params.viewpoints,
        r#where: params.place.name(),
        methods: (methods.iter())
            .map(|(name, errors)| (*name, errors.into()))
            .collect(),
        per_viewpoint: errors
            .iter()
            .map(|e| ViewpointJson::new(e, origin))
            .collect(),
        textures: None,
    }
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
