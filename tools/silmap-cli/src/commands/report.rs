//! `silmap report`: all measurements of an asset, as a page and as numbers.

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use serde::Serialize;
use silmap_map::asset;
use silmap_measure::{MeasureError, MeasureParams, SceneBench, SceneParams, compare, measure};
use silmap_report::Report;

use crate::args::ReportArgs;
use crate::commands::open_gpu;
use crate::files::{load_model_of, read_asset};
use crate::output::{self, OutputFolder};
use crate::progress::Progress;

/// The page and the numbers in the folder.
const PAGE: &str = "report.html";
const NUMBERS: &str = "report.json";

/// Pictures of scenes, and how many frames are timed.
const SCENE_SIDE_PX: u32 = 2048;
const SCENE_FRAMES: usize = 12;

#[derive(Serialize)]
struct ReportJson {
    report: PathBuf,
    numbers: PathBuf,
    /// Of measuring, without reading the model and drawing the page.
    seconds: f64,
}

pub(crate) fn run(args: &ReportArgs) -> anyhow::Result<()> {
    let folder = OutputFolder::check(&args.out)?;
    let (asset, bytes) = read_asset(&args.compared.asset)?;
    let model = load_model_of(&asset, &args.compared.model, args.compared.mending)?;
    let params = params_from_args(args);
    let sizes = asset::sizes(&bytes).with_context(|| args.compared.asset.display().to_string())?;
    // Only scenes cannot do without.
    let gpu = if args.scenes.is_empty() {
        open_gpu().ok()
    } else {
        Some(open_gpu()?)
    };
    let (measured, comparison, scenes) = Progress::new()
        .watch(|watch| {
            let how = (&params, gpu.as_ref());
            let measured = measure(&asset, &bytes, &model.mesh, how, watch)?;
            let comparison = (args.comparison)
                .then(|| compare(&asset, &bytes, &model.mesh, gpu.as_ref(), watch))
                .transpose()?;
            let scenes = gpu
                .iter()
                .flat_map(|gpu| args.scenes.iter().map(move |scene| (gpu, scene)));
            let scenes = scenes
                .map(|(gpu, &(instances, pixels))| {
                    let bench = SceneBench {
                        full: model.mesh.mesh(),
                        asset: &asset,
                        sizes,
                        params: SceneParams {
                            instances: instances as usize,
                            pixels,
                            side_px: SCENE_SIDE_PX,
                            is_still: false,
                            frames: SCENE_FRAMES,
                        },
                        watch,
                    };
                    bench.run(gpu)
                })
                .collect::<Result<Vec<_>, _>>()?;
            Ok::<_, MeasureError>((measured, comparison, scenes))
        })
        .with_context(|| args.compared.asset.display().to_string())?;
    let report = Report {
        comparison,
        scenes,
        ..Report::new(&asset, model.mesh.mesh(), measured)
    };
    let (html, json) = (silmap_report::html(&report), silmap_report::json(&report));
    folder.write(&[(NUMBERS, json.as_bytes()), (PAGE, html.as_bytes())])?;
    // The full path, to be clicked on; as typed where the system does not know it.
    let shown = fs::canonicalize(&args.out).unwrap_or_else(|_| args.out.clone());
    let result = ReportJson {
        report: shown.join(PAGE),
        numbers: shown.join(NUMBERS),
        seconds: report.measured.conditions.seconds,
    };
    if args.output.json {
        return output::print_json(&result);
    }
    let text = format!(
        "look at\n  {}\n  {}\n",
        result.report.display(),
        result.numbers.display()
    );
    output::print_bytes(text.as_bytes())
}

fn params_from_args(args: &ReportArgs) -> MeasureParams {
    MeasureParams {
        viewpoints: args.viewpoints,
        seed: args.pictures.seed,
        directions: args.directions,
        resolution_px: args.pictures.resolution,
        worst: args.worst as usize,
        ..MeasureParams::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    #[test]
    fn the_defaults_are_those_of_the_params() {
        let cli = Cli::parse_from(["silmap", "report", "a.glb", "--model", "m.ply", "-o", "d"]);
        let Command::Report(args) = cli.command else {
            panic!("another command was read");
        };
        assert_eq!(params_from_args(&args), MeasureParams::default());
    }
}
