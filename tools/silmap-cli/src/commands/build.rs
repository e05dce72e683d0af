//! `silmap build`: from a mesh, or a capture, to an asset.

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use clap::error::ErrorKind;
use serde::Serialize;
use silmap_geometry::CoverageRule;
use silmap_map::fewer_views::{ViewGoal, keep_fewer_views};
use silmap_map::{Asset, CapturedErrors, asset};
use silmap_measure::painting;
use silmap_measure::uniform::uniform_curve;
use silmap_mesh_io::{LoadOptions, Loaded};
use silmap_preprocess::capture::{Backend, CaptureParams};
use silmap_preprocess::parts::PartParams;
use silmap_preprocess::pipeline::{self, BuildParams, BuildReport, Photographed};
use silmap_preprocess::recipe::Recipe;
use silmap_preprocess::simplify_contour::SimplifyContourParams;

use crate::args::{BackendArg, BuildArgs, CarveArgs, CoverageArg, usage_error};
use crate::commands::captured::{CaptureJson, CarvedCapture};
use crate::commands::{capture_check, capture_page, manifest, open_gpu};
use crate::files::{check_model_of, load_model_with, load_options, read_asset};
use crate::machine;
use crate::names;
use crate::output::{self, OutputFile};
use crate::progress::Progress;
use crate::values::Length;

#[derive(Serialize)]
struct BuildJson<'a> {
    out: &'a Path,
    bytes: usize,
    seconds: SecondsJson,
    views: u32,
    kept: usize,
    hull_faces: usize,
    volume_ratio: f64,
    /// Whether the hull, as it is stored, encloses the model; null where no mesh was read.
    hull_verified: Option<bool>,
    textures: TextureJson,
    error: ErrorJson,
    warnings: Vec<String>,
    /// The most memory that was in use at once; null where the system does not report it.
    peak_bytes: Option<u64>,
    /// About the capture, where one was built.
    #[serde(flatten)]
    capture: Option<CaptureJson>,
}

/// How well the hull is painted; also a part of what `inspect` prints.
#[derive(Serialize)]
pub(crate) struct TextureJson {
    pub(crate) views: u32,
    /// Side of the texture views, pixels.
    pub(crate) size: u32,
    /// Columns and rows of the atlas; null when there is none.
    atlas_size: Option<[u32; 2]>,
    /// Whether the atlas has normals.
    has_normals: bool,
    /// Bytes of all pictures.
    picture_bytes: u64,
    /// Share of the hull's area that some texture view sees.
    seen_share: f64,
    /// Share of the hull's area that falls to the atlas.
    atlas_share: f64,
    /// Σ area × cosine over Σ area, each face with the view that sees it most squarely.
    merit: f64,
    /// Texture views that see a face, on average over the area.
    views_per_face: f64,
    /// Texels along the model's bounding radius, on average over the area: of the texture views, and of the atlas.
    view_texels_per_radius: f64,
    atlas_texels_per_radius: f64,
}

impl TextureJson {
    pub(crate) fn of(asset: &Asset) -> Self {
        let textures = &asset.textures;
        let found = painting(&asset.hull, textures, asset.map.radius);
        let atlas = textures.atlas.as_ref();
        Self {
            views: found.views,
            size: textures.views.first().map_or(0, |v| v.camera.width_px),
            atlas_size: atlas.map(|a| a.size_px),
            has_normals: atlas.is_some_and(|a| a.normals.is_some()),
            picture_bytes: found.bytes,
            seen_share: found.seen_share,
            atlas_share: found.atlas_share,
            merit: found.merit,
            views_per_face: found.views_per_face,
            view_texels_per_radius: found.view_texels_per_radius,
            atlas_texels_per_radius: found.atlas_texels_per_radius,
        }
    }

    /// What the atlas is, in a few words.
    pub(crate) fn atlas(&self) -> String {
        match self.atlas_size {
            Some([width, height]) if self.has_normals => {
                format!("atlas and normals of {width} × {height}")
            }
            Some([width, height]) => format!("atlas of {width} × {height}"),
            None => "no atlas".to_owned(),
        }
    }

    /// The same for people, without the sizes.
    pub(crate) fn describe(&self) -> String {
        format!(
            "{:.1} % of the hull seen, {:.1} % falls to the atlas, {:.0} texels a radius in views and {:.0} in the atlas",
            100.0 * self.seen_share,
            100.0 * self.atlas_share,
            self.view_texels_per_radius,
            self.atlas_texels_per_radius,
        )
    }
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

/// Over all captured views, as shares of the pixels inside; a view that was kept is right.
#[derive(Serialize)]
struct ErrorJson {
    misclassified_mean: f64,
    misclassified_max: f64,
    /// What they are over, and that kept views count as right.
    over: &'static str,
    /// Views that they are over.
    views: u32,
}

const ERROR_OVER: &str = "captured views, kept ones counted as right";

pub(crate) fn run(args: &BuildArgs) -> anyhow::Result<()> {
    let started = Instant::now();
    if let Some(list) = &args.list.manifest {
        return manifest::run(list, &args.list);
    }
    manifest::end_with_reader(&args.list)?;
    check_usage(args);
    if let Some(capture) = args.model.as_ref().filter(|_| args.carving.check) {
        return capture_check::check(capture, &args.carving, args.output.json);
    }
    let file = OutputFile::check(args.out())?;
    if let Some(model) = &args.model {
        file.refuse_to_replace(model);
    }
    names::check_asset(args.out())?;
    let beside = [&args.carving.page, &args.carving.carved];
    let beside = beside
        .into_iter()
        .flatten()
        .map(|path| OutputFile::check(path));
    let beside = beside.collect::<anyhow::Result<Vec<_>>>()?;
    output::refuse_same_file(beside.iter().chain([&file]));
    let Some(model_path) = &args.model else {
        return run_from(args, file, started);
    };
    let recorded = args.params_from.as_deref().map(recorded).transpose()?;
    let (recipe, load_options) = match &recorded {
        Some((_, recipe)) => (Some(recipe), recipe.build.load),
        None => (None, load_options(args.mending)),
    };
    let is_by_device = recipe.map_or(args.capture.backend == BackendArg::Gpu, |recipe| {
        recipe.build.capture.backend == Backend::Gpu
    });
    if is_by_device {
        // So that a missing adapter is known before the work, and by its own exit code.
        open_gpu()?;
    }
    let asked_px = args
        .textures
        .params(args.capture.defaults().textures)
        .size_px;
    let texture_px = recipe.map_or(asked_px, |recipe| recipe.build.textures.size_px);
    let mut carved = silmap_capture::is_capture(model_path)
        .then(|| CarvedCapture::of(model_path, &args.carving, texture_px))
        .transpose()?;
    if let Some(carved) = &mut carved {
        carved.write_mesh()?;
        capture_page::write(carved)?;
    }
    let model = match &carved {
        Some(carved) => carved.model(),
        None => load_model_with(model_path, &load_options)?,
    };
    if let Some((asset, _)) = &recorded {
        check_model_of(asset, model_path, &model);
    }
    let params = recipe.map_or_else(
        || {
            let fitting =
                (carved.as_ref()).map(|c| silmap_capture::fitting_resolution_px(&c.capture));
            // What it is for is said, or else the photographs say it.
            let asked = args.capture.defaults();
            let fitting = fitting.filter(|_| asked.for_height_px.is_none());
            let resolution_px = fitting.unwrap_or(asked.resolution_px);
            params_from_args(args, model.mesh.bounds().radius, resolution_px)
        },
        |recipe| recipe.build.clone(),
    );
    let named = || model_path.display().to_string();
    let seen = (carved.as_mut())
        .map(CarvedCapture::photographed)
        .transpose()?
        .unwrap_or_default();
    let load = started.elapsed().as_secs_f64();
    let (mut asset, report) = build_watched(&model, &seen, &params).with_context(named)?;
    if let Some(views) = recipe.and_then(|recipe| recipe.fewer_views) {
        asset = keep_fewer_views(&asset, ViewGoal::Keep(views)).with_context(named)?;
    }
    if args.uniform_curve {
        add_uniform_curve(&mut asset, &model, &params).with_context(named)?;
    }
    let writing = Instant::now();
    let bytes = asset::write(&asset).with_context(|| args.out().display().to_string())?;
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
    let of_capture = carved.iter().flat_map(|c| c.warnings.iter().cloned());
    let of_mesh = model.warnings.iter().map(ToString::to_string);
    let of_build = report.warnings.iter().map(ToString::to_string);
    let found = Found {
        hull_verified: Some(report.hull_check.encloses),
        warnings: of_capture.chain(of_mesh).chain(of_build).collect(),
        carved: carved.as_ref(),
    };
    tell(args, &asset, (bytes.len(), seconds), found)
}

/// An asset, and how it was built.
fn recorded(path: &Path) -> anyhow::Result<(Asset, Recipe)> {
    let (asset, _) = read_asset(path)?;
    let recipe = Recipe::from_record(&asset.record);
    let recipe = recipe.with_context(|| path.display().to_string())?;
    Ok((asset, recipe))
}

/// Makes an asset with fewer views of one that is there.
fn run_from(args: &BuildArgs, file: OutputFile, started: Instant) -> anyhow::Result<()> {
    let goal = match (args.map.keep, args.map.max_error, &args.from) {
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
    let bytes = asset::write(&asset).with_context(|| args.out().display().to_string())?;
    file.write(&bytes)?;
    let seconds = SecondsJson {
        load,
        map,
        write: writing.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
        ..SecondsJson::default()
    };
    let found = Found {
        hull_verified: None,
        warnings: Vec::new(),
        carved: None,
    };
    tell(args, &asset, (bytes.len(), seconds), found)
}

/// Options that are wrong together.
fn check_usage(args: &BuildArgs) {
    if args.from.is_none() && args.map.keep.is_some_and(|keep| keep > args.capture.views) {
        usage_error(
            ErrorKind::ValueValidation,
            "--keep cannot be more than --views",
        );
    }
    let model = args.model.as_deref();
    let is_capture = model.is_some_and(silmap_capture::is_capture);
    if args.carving != CarveArgs::default() && model.is_some_and(Path::is_file) && !is_capture {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--check, --voxels, --outvoted, --no-photographs, --mask-inverted, --mask-rule, --page and --carved are for captures, and this is neither a folder nor a camera file",
        );
    }
    let is_mending = load_options(args.mending) != LoadOptions::default();
    if is_mending && is_capture {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--close-holes, --repair, --alpha and --weld mend a mesh, and a capture's carved hull is closed",
        );
    }
    let captured = &args.capture;
    let is_of_meshes = captured.radius != Length::Radii(BuildParams::default().view_radius_rel)
        || captured.coverage == CoverageArg::Any
        || args.uniform_curve;
    if is_of_meshes && is_capture {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--radius, --coverage any and --uniform-curve are for meshes: a capture's views are where the photographs were taken",
        );
    }
}

/// Builds with progress bars and prints the warnings.
///
/// # Errors
/// As [`pipeline::build`].
pub(crate) fn build_watched(
    model: &Loaded,
    seen: &Photographed,
    params: &BuildParams,
) -> anyhow::Result<(Asset, BuildReport)> {
    let built = Progress::new().watch(|watch| {
        pipeline::build_photographed(&model.mesh, seen, &model.name, params, watch)
    })?;
    for warning in &built.1.warnings {
        output::warn(&format!("{}: {warning}", model.name));
    }
    Ok(built)
}

/// Measures maps of evenly spread views as well, and notes their errors in the asset.
///
/// # Errors
/// When interrupted, or a view cannot be drawn.
pub(crate) fn add_uniform_curve(
    asset: &mut Asset,
    model: &Loaded,
    params: &BuildParams,
) -> anyhow::Result<()> {
    asset.record.uniform_curve =
        Progress::new().watch(|watch| uniform_curve(&model.mesh, params, watch))?;
    *asset = asset::quantise(asset)?;
    Ok(())
}

/// What there is to tell besides the asset.
struct Found<'a> {
    hull_verified: Option<bool>,
    warnings: Vec<String>,
    carved: Option<&'a CarvedCapture>,
}

fn tell(
    args: &BuildArgs,
    asset: &Asset,
    (bytes, seconds): (usize, SecondsJson),
    found: Found<'_>,
) -> anyhow::Result<()> {
    let record = &asset.record;
    let errors = record
        .order
        .as_ref()
        .map_or_else(CapturedErrors::default, |o| o.errors);
    if !args.output.json {
        output::say(&format!(
            "{}: {} of {} views, {} hull faces, {bytes} bytes, {:.2} % misclassified on average over the captured views, kept ones counted as right, {:.1} s; {}",
            args.out().display(),
            asset.map.views.len(),
            record.captured_views,
            asset.hull.faces.len(),
            100.0 * errors.mean,
            seconds.total,
            TextureJson::of(asset).describe(),
        ));
        if let Some(carved) = found.carved {
            output::say(&carved.describe());
        }
        return Ok(());
    }
    output::print_json(&BuildJson {
        out: args.out(),
        bytes,
        seconds,
        views: record.captured_views,
        kept: asset.map.views.len(),
        hull_faces: asset.hull.faces.len(),
        volume_ratio: asset.hull.volume_ratio,
        hull_verified: found.hull_verified,
        textures: TextureJson::of(asset),
        error: ErrorJson {
            misclassified_mean: errors.mean,
            misclassified_max: errors.max,
            over: ERROR_OVER,
            views: record.captured_views,
        },
        warnings: found.warnings,
        peak_bytes: machine::peak_bytes(None),
        capture: found.carved.map(|c| c.json(&asset.map)),
    })
}

/// The options as params, for a model of this bounding-sphere radius.
fn params_from_args(args: &BuildArgs, model_radius: f64, resolution_px: u32) -> BuildParams {
    let (captured, kept) = (&args.capture, &args.map);
    let coverage = CoverageRule::from(captured.coverage);
    let default_tolerance = SimplifyContourParams::for_coverage(coverage).tolerance_px;
    let defaults = captured.defaults();
    let mut params = BuildParams {
        load: load_options(args.mending),
        views: captured.views,
        view_radius_rel: captured.radius.in_radii(model_radius),
        resolution_px: captured.resolution.unwrap_or(resolution_px),
        capture: CaptureParams {
            coverage,
            backend: captured.backend.into(),
        },
        tolerance_px: captured.tolerance.unwrap_or(default_tolerance),
        keep_cavities: args.parts.keep_cavities,
        parts: PartParams {
            most: captured.parts,
            ..PartParams::default()
        },
        textures: args.textures.params(defaults.textures),
        ..defaults
    };
    params.map.keep = kept.keep.unwrap_or(params.map.keep).min(captured.views);
    params.map.max_error = kept.max_error.map(|share| share.0);
    params.map.method = kept.choose_by.into();
    params.hull.target_faces = args.faces;
    params
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use silmap_map::Method;
    use silmap_preprocess::texture;

    use crate::args::{Cli, Command};

    fn params_of(options: &[&str]) -> BuildParams {
        let words = ["silmap", "build", "m.ply", "-o", "m.glb"];
        let cli = Cli::try_parse_from(words.iter().chain(options)).unwrap();
        let Command::Build(args) = cli.command else {
            panic!("build is not build");
        };
        params_from_args(&args, 2.0, args.capture.defaults().resolution_px)
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
            ("--choose-by hull", |p| p.map.method == Method::Hull),
            ("--method paper", |p| p.map.method == Method::Paper),
            ("--max-error 0.5%", |p| p.map.max_error == Some(0.005)),
            ("--for-height 512", |p| {
                (p.for_height_px, p.resolution_px, p.textures.size_px) == (Some(512), 256, 256)
            }),
            ("--resolution 64", |p| p.resolution_px == 64),
            ("--tolerance 1.5", |p| p.tolerance_px == 1.5),
            ("--parts 3", |p| p.parts.most == 3),
            ("--coverage any", |p| {
                p.capture.coverage == CoverageRule::Any && p.tolerance_px == 0.75
            }),
            ("--coverage any --tolerance 0.5", |p| {
                p.capture.coverage == CoverageRule::Any && p.tolerance_px == 0.5
            }),
            ("--radius 8", |p| p.view_radius_rel == 4.0),
            ("--radius 5R", |p| p.view_radius_rel == 5.0),
            ("--faces 60", |p| p.hull.target_faces == 60),
            ("--texture-views 3", |p| p.textures.views == 3),
            ("--texture-size 32", |p| p.textures.size_px == 32),
            ("--texture-format webp", |p| {
                p.textures.format == texture::PictureFormat::Webp
            }),
            ("--texture-quality 70", |p| p.textures.quality == 70),
            ("--relief off", |p| {
                let plain = &p.textures;
                (plain.relief_px, plain.detailed, plain.quality) == (0, false, 88)
            }),
            ("--relief 100", |p| p.textures.relief_px == 100),
            ("--relief-bits 12", |p| p.textures.relief_bits == 12),
            ("--texture-bytes 3K", |p| {
                p.textures.budget_bytes == Some(3072)
            }),
            ("--atlas-size 100", |p| p.textures.atlas_px == 100),
            ("--tiles fixed", |p| {
                p.textures.tiles == texture::TileSizes::Fixed
            }),
            ("--parametrisation closest-point", |p| {
                p.textures.parametrisation == texture::Parametrisation::ClosestPoint
            }),
            ("--no-normals", |p| !p.textures.normals),
            ("--keep-cavities", |p| p.keep_cavities),
            ("--backend cpu", |p| p.capture.backend == Backend::Cpu),
            ("--close-holes", |p| p.load.close_holes),
            ("--repair", |p| p.load.repair),
        ] {
            let words: Vec<&str> = options.split(' ').collect();
            assert!(heard(&params_of(&words)), "{options} is not heard");
            assert!(!heard(&plain), "{options} is what happens anyway");
        }
    }

    #[test]
    fn options_that_are_given_win_over_the_height() {
        let plain = params_of(&["--for-height", "2048"]);
        assert_eq!(plain, BuildParams::for_height(2048));
        let height = ["--for-height", "2048", "--resolution", "300", "--relief"];
        let given = params_of(&[&height[..], &["100", "--atlas-size", "64"]].concat());
        let mut wanted = plain;
        wanted.resolution_px = 300;
        (wanted.textures.relief_px, wanted.textures.atlas_px) = (100, 64);
        assert_eq!(given, wanted);
    }

    #[test]
    fn heights_out_of_range_are_refused_by_name() {
        for height in ["255", "4097", "-1", "0", "tall"] {
            let words = ["silmap", "build", "m.ply", "-o", "m.glb"];
            let option = format!("--for-height={height}");
            let refused = Cli::try_parse_from(words.into_iter().chain([option.as_str()]));
            let error = refused.unwrap_err().to_string();
            assert!(
                error.contains("--for-height") && error.contains(height),
                "{error}"
            );
        }
    }
}
