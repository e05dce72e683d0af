//! `silmap build`: from a mesh to an asset.

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use clap::error::ErrorKind;
use serde::Serialize;
use silmap_geometry::CoverageRule;
use silmap_map::{Asset, CapturedErrors, asset};
use silmap_preprocess::capture::Backend;
use silmap_preprocess::fewer_views::{ViewGoal, keep_fewer_views};
use silmap_preprocess::mesh_io::Loaded;
use silmap_preprocess::pipeline::{self, BuildParams, BuildReport};

use crate::args::{BackendArg, BuildArgs, CoverageArg, usage_error};
use crate::commands::open_gpu;
use crate::files::{load_model, read_asset};
use crate::output::{self, OutputFile};
use crate::progress::Progress;

#[derive(Serialize)]
struct BuildJson<'a> {
    out: &'a Path,
    bytes: usize,
    seconds: SecondsJson,
    views: u32,
    kept: usize,
    hull_faces: usize,
    volume_ratio: f64,
    error: ErrorJson,
    warnings: Vec<String>,
}

#[derive(Default, Serialize)]
struct SecondsJson {
    load: f64,
    capture: f64,
    contours: f64,
    map: f64,
    hull: f64,
    textures: f64,
    write: f64,
    total: f64,
}

/// Over all captured views, as shares.
#[derive(Serialize)]
struct ErrorJson {
    misclassified_mean: f64,
    misclassified_max: f64,
}

pub(crate) fn run(args: &BuildArgs) -> anyhow::Result<()> {
    let started = Instant::now();
    check_usage(args);
    let file = OutputFile::check(&args.out)?;
    let Some(model_path) = &args.model else {
        return run_from(args, file, started);
    };
    if args.backend == BackendArg::Gpu {
        // So that a missing adapter is known before the work, and by its own exit code.
        open_gpu()?;
    }
    let model = load_model(model_path, args.mending)?;
    let load = started.elapsed().as_secs_f64();
    let params = params_from_args(args, model.mesh.bounds().radius);
    let (asset, report) =
        build_watched(&model, &params).with_context(|| model_path.display().to_string())?;
    let writing = Instant::now();
    let bytes = asset::write(&asset).with_context(|| args.out.display().to_string())?;
    file.write(&bytes)?;

    let seconds = SecondsJson {
        load,
        capture: report.seconds.capture,
        contours: report.seconds.contours,
        map: report.seconds.map,
        hull: report.seconds.hull,
        textures: report.seconds.textures,
        write: writing.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
    };
    let warnings = model.warnings.iter().chain(&report.warnings);
    let warnings = warnings.map(ToString::to_string).collect();
    tell(args, &asset, (bytes.len(), seconds), warnings)
}

/// Makes an asset with fewer views of one that is there.
fn run_from(args: &BuildArgs, file: OutputFile, started: Instant) -> anyhow::Result<()> {
    let goal = match (args.keep, args.max_error, &args.from) {
        (Some(keep), _, Some(from)) => (ViewGoal::Keep(keep), from),
        (_, Some(share), Some(from)) => (ViewGoal::MaxError(share.0), from),
        _ => usage_error(
            ErrorKind::MissingRequiredArgument,
            "--from needs --keep or --max-error",
        ),
    };
    let (goal, from) = goal;
    let (asset, _) = read_asset(from)?;
    let load = started.elapsed().as_secs_f64();
    let lowering = Instant::now();
    let asset = keep_fewer_views(&asset, goal).with_context(|| from.display().to_string())?;
    let map = lowering.elapsed().as_secs_f64();
    let writing = Instant::now();
    let bytes = asset::write(&asset).with_context(|| args.out.display().to_string())?;
    file.write(&bytes)?;
    let seconds = SecondsJson {
        load,
        map,
        write: writing.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
        ..SecondsJson::default()
    };
    tell(args, &asset, (bytes.len(), seconds), Vec::new())
}

/// Options that are wrong together.
fn check_usage(args: &BuildArgs) {
    if args.from.is_none() && args.keep.is_some_and(|keep| keep > args.views) {
        usage_error(
            ErrorKind::ValueValidation,
            "--keep cannot be more than --views",
        );
    }
}

/// Builds with progress bars and prints the warnings.
///
/// # Errors
/// As [`pipeline::build`].
pub(crate) fn build_watched(
    model: &Loaded,
    params: &BuildParams,
) -> anyhow::Result<(Asset, BuildReport)> {
    let built = Progress::new()
        .watch(|monitor| pipeline::build(&model.mesh, &model.name, params, monitor))?;
    for warning in &built.1.warnings {
        output::warn(&format!("{}: {warning}", model.name));
    }
    Ok(built)
}

fn tell(
    args: &BuildArgs,
    asset: &Asset,
    (bytes, seconds): (usize, SecondsJson),
    warnings: Vec<String>,
) -> anyhow::Result<()> {
    let record = &asset.record;
    let errors = record
        .order
        .as_ref()
        .map_or_else(CapturedErrors::default, |o| o.errors);
    if !args.output.json {
        output::say(&format!(
            "{}: {} of {} views, {} hull faces, {bytes} bytes, {:.2} % misclassified on average, {:.1} s",
            args.out.display(),
            asset.map.views.len(),
            record.captured_views,
            asset.hull.faces.len(),
            100.0 * errors.mean,
            seconds.total,
        ));
        return Ok(());
    }
    output::print_json(&BuildJson {
        out: &args.out,
        bytes,
        seconds,
        views: record.captured_views,
        kept: asset.map.views.len(),
        hull_faces: asset.hull.faces.len(),
        volume_ratio: asset.hull.volume_ratio,
        error: ErrorJson {
            misclassified_mean: errors.mean,
            misclassified_max: errors.max,
        },
        warnings,
    })
}

/// The options as params, for a model of this bounding-sphere radius.
fn params_from_args(args: &BuildArgs, model_radius: f64) -> BuildParams {
    let mut params = BuildParams {
        views: args.views,
        view_radius_rel: args.radius.in_radii(model_radius),
        resolution_px: args.resolution,
        tolerance_px: args.tolerance,
        ..BuildParams::default()
    };
    params.capture.coverage = match args.coverage {
        CoverageArg::Center => CoverageRule::Center,
        CoverageArg::Any => CoverageRule::Any,
    };
    params.capture.backend = match args.backend {
        BackendArg::Auto => Backend::Auto,
        BackendArg::Cpu => Backend::Cpu,
        BackendArg::Gpu => Backend::Gpu,
    };
    params.map.keep = args.keep.unwrap_or(params.map.keep).min(args.views);
    params.map.max_error = args.max_error.map(|share| share.0);
    params.map.method = args.method.into();
    params.hull.target_faces = args.faces;
    params.textures.views = args.texture_views;
    params.textures.size_px = args.texture_size;
    params
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use silmap_map::Method;

    use crate::args::{Cli, Command};

    fn params_of(options: &[&str]) -> BuildParams {
        let words = ["silmap", "build", "m.ply", "-o", "m.glb"];
        let cli = Cli::try_parse_from(words.iter().chain(options)).unwrap();
        let Command::Build(args) = cli.command else {
            panic!("build is not build");
        };
        params_from_args(&args, 2.0)
    }

    #[test]
    fn defaults_of_the_options_are_the_librarys() {
        assert_eq!(params_of(&[]), BuildParams::default());
    }

    #[test]
    fn every_option_is_heard() {
        let plain = BuildParams::default();
        for (options, heard) in [
            (
                "--views 99",
                (|p: &BuildParams| p.views == 99) as fn(&BuildParams) -> bool,
            ),
            ("--keep 50", |p| p.map.keep == 50),
            ("--method tight", |p| p.map.method == Method::Tight),
            ("--max-error 0.5%", |p| p.map.max_error == Some(0.005)),
            ("--resolution 64", |p| p.resolution_px == 64),
            ("--tolerance 1.5", |p| p.tolerance_px == 1.5),
            ("--coverage any", |p| {
                p.capture.coverage == CoverageRule::Any
            }),
            ("--radius 8", |p| p.view_radius_rel == 4.0),
            ("--radius 5R", |p| p.view_radius_rel == 5.0),
            ("--faces 60", |p| p.hull.target_faces == 60),
            ("--texture-views 3", |p| p.textures.views == 3),
            ("--texture-size 32", |p| p.textures.size_px == 32),
            ("--backend cpu", |p| p.capture.backend == Backend::Cpu),
        ] {
            let words: Vec<&str> = options.split(' ').collect();
            assert!(heard(&params_of(&words)), "{options} is not heard");
            assert!(!heard(&plain), "{options} is what happens anyway");
        }
    }
}
