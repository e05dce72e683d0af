//! `silmap evaluate`: how wrong an asset's outlines are.

use std::collections::BTreeMap;

use anyhow::Context;
use serde::Serialize;
use silmap_map::Method;
use silmap_preprocess::evaluate::{
    EvaluateParams, MethodErrors, Place, ViewpointError, evaluate, summarise,
};

use crate::args::{EvaluateArgs, WhereArg};
use crate::files::{load_model_of, read_asset};
use crate::output;
use crate::progress::Progress;

#[derive(Serialize)]
struct EvaluateJson {
    viewpoints: u32,
    r#where: &'static str,
    methods: BTreeMap<&'static str, MethodJson>,
    per_viewpoint: Vec<ViewpointJson>,
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
}

pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let (asset, _) = read_asset(&args.asset)?;
    let model = load_model_of(&asset, &args.model, args.mending)?;
    let params = EvaluateParams {
        viewpoints: args.viewpoints,
        seed: args.seed,
        place: args.placement.into(),
        methods: args.method.map_or_else(
            || Method::all_for(&asset.map).collect(),
            |method| vec![method.into()],
        ),
        size_px: args.resolution,
        ..EvaluateParams::default()
    };
    let errors = Progress::new()
        .watch(|monitor| evaluate(&asset.map, model.mesh.mesh(), &params, monitor))
        .with_context(|| args.asset.display().to_string())?;
    let methods = summarise(&errors);
    if args.output.json {
        return output::print_json(&as_json(&params, &methods, &errors));
    }
    output::print_bytes(table(&params, &methods).as_bytes())
}

fn as_json(
    params: &EvaluateParams,
    methods: &[MethodErrors],
    errors: &[ViewpointError],
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
                eye: e.eye.to_array(),
                method: e.method.name(),
                misclassified: e.misclassified,
                escaped: e.escaped,
            })
            .collect(),
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

impl From<WhereArg> for Place {
    fn from(place: WhereArg) -> Self {
        match place {
            WhereArg::Polytope => Self::Polytope,
            WhereArg::Sphere => Self::Sphere,
            WhereArg::Shell => Self::Shell,
        }
    }
}
