//! `silmap demo`: all stages on a generated model, with pictures and a report.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_geometry::{Camera, ClosedMesh, ColourImage, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_hull::HullParams;
use silmap_map::{Asset, Method, asset};
use silmap_measure::{MeasureParams, measure};
use silmap_mesh_io::{self as mesh_io, Loaded};
use silmap_preprocess::pipeline::{BuildParams, BuildReport, Photographed};
use silmap_preprocess::simplify_map::SimplifyMapParams;
use silmap_report::{Picture, PictureRow, Report};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};

use crate::args::{DemoArgs, ModelKind};
use crate::commands::build::{add_uniform_curve, build_watched};
use crate::commands::generate::generate;
use crate::commands::open_gpu;
use crate::interrupt;
use crate::output::{self, OutputFolder};
use crate::pictures::{beside, encode_png, stacked};
use crate::progress::Progress;

/// Faces of the demo's model: enough that the hull is a hundredth of it.
const MODEL_FACES: usize = 60_000;
/// Captured views, fewer than by default to end sooner.
const VIEWS: u32 = 640;
/// Views that are kept, more than by default: eight arms hide each other from many sides.
const KEEP: u32 = 192;
/// Faces of the hull, more than by default for the same reason.
const HULL_FACES: u32 = 1000;
/// What is measured, less than by default to end sooner.
const MEASURED: MeasureParams = MeasureParams {
    viewpoints: 60,
    seed: 1,
    directions: 300,
    resolution_px: 512,
    worst: 2,
    timed_calls: 101,
};
/// Side of the pictures, pixels.
const PICTURE_SIDE_PX: u32 = 512;
/// Distance of the pictures' eyes in bounding-sphere radii: nearer than the captured views, so that nothing is one of them.
const PICTURE_DISTANCE_RADII: f64 = 2.6;
/// Where the pictures are taken from: a word for the reader, and the direction from the center.
const PICTURE_EYES: [(&str, [f64; 3]); 4] = [
    ("from the front", [0.25, 0.3, 1.0]),
    ("from the right", [1.0, 0.15, 0.2]),
    ("from behind, below", [-0.4, -0.35, -0.9]),
    ("from above", [-0.5, 0.85, 0.35]),
];
/// What is drawn from each of them.
const PICTURE_MODES: [(&str, Mode); 5] = [
    ("original", Mode::Original),
    ("coarse", Mode::Coarse),
    ("textured", Mode::Textured),
    ("clipped", Mode::Clipped),
    ("difference", Mode::Difference),
];
/// The modes of the one picture that shows it all.
const COMPARED: [Mode; 3] = [Mode::Original, Mode::Coarse, Mode::Clipped];

#[derive(Serialize)]
struct DemoJson {
    report: PathBuf,
    comparison: PathBuf,
    asset: PathBuf,
    model: PathBuf,
    bytes: usize,
    seconds: f64,
}

/// The pictures of one viewpoint, in the order of [`PICTURE_MODES`].
type Row = (&'static str, Vec<ColourImage>);

pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<()> {
    let started = Instant::now();
    let folder = OutputFolder::check_with_parents(&args.out)?;
    let gpu = open_gpu()?;
    // All of them appear together at the end.
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut write = |name: &str, bytes: Vec<u8>| files.push((name.to_owned(), bytes));

    let model = make_model().context("the demo's model")?;
    let mesh = mesh_io::encode(Path::new("organic.ply"), model.mesh.mesh())?;
    write("organic.ply", mesh);
    let params = params(VIEWS, KEEP);
    let (mut asset, report) =
        build_watched(&model, &Photographed::default(), &params).context("the demo's model")?;
    add_uniform_curve(&mut asset, &model, &params)?;
    let bytes = asset::write(&asset)?;
    write("organic.glb", bytes.clone());

    let rows = draw(&gpu, &asset, model.mesh.mesh())?;
    for (caption, pictures) in &rows {
        for ((mode, _), picture) in PICTURE_MODES.iter().zip(pictures) {
            let name = format!("{} {mode}.png", caption.replace(',', "")).replace(' ', "-");
            write(&name, encode_png(picture)?);
        }
    }
    write("comparison.png", encode_png(&comparison(&rows))?);

    let measured = Progress::new().watch(|watch| {
        let how = (&MEASURED, Some(&gpu));
        measure(&asset, &bytes, &model.mesh, how, watch)
    })?;
    let mut page = Report::new(&asset, model.mesh.mesh(), measured);
    page.title = "silmap demo".to_owned();
    page.rows = picture_rows(&rows);
    page.seconds = second_rows(&report, started.elapsed().as_secs_f64());
    page.notes
        .push(format!("Pictures drawn by {}.", gpu.adapter_name()));
    let numbers = silmap_report::json(&page);
    write("report.json", numbers.into_bytes());
    write("report.html", silmap_report::html(&page).into_bytes());
    let files: Vec<(&str, &[u8])> = files.iter().map(|(n, b)| (n.as_str(), &b[..])).collect();
    folder.write(&files)?;
    tell(args, bytes.len(), started.elapsed().as_secs_f64())
}

/// A demo's assets: so many views, and so many that are kept.
pub(crate) fn params(views: u32, keep: u32) -> BuildParams {
    BuildParams {
        views,
        map: SimplifyMapParams {
            keep,
            ..SimplifyMapParams::default()
        },
        hull: HullParams {
            target_faces: HULL_FACES,
            ..HullParams::default()
        },
        ..BuildParams::default()
    }
}

fn make_model() -> anyhow::Result<Loaded> {
    let mesh = ClosedMesh::try_from(generate(ModelKind::Organic, MODEL_FACES))?;
    Ok(Loaded {
        mesh,
        name: "organic".to_owned(),
        warnings: Vec::new(),
    })
}

/// All pictures.
fn draw(gpu: &Gpu, asset: &Asset, model: &TriangleMesh) -> anyhow::Result<Vec<Row>> {
    let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
    renderer.load_asset(gpu, asset)?;
    renderer.load_model(gpu, model)?;
    let (center, radius) = (asset.map.center, asset.map.radius);
    PICTURE_EYES
        .iter()
        .map(|&(caption, direction)| {
            let away = DVec3::from_array(direction).normalize_or_zero();
            let camera = Camera::fit_sphere(
                center + away * (PICTURE_DISTANCE_RADII * radius),
                center,
                radius,
                None,
                (PICTURE_SIDE_PX, PICTURE_SIDE_PX),
            )?;
            let pictures = PICTURE_MODES
                .iter()
                .map(|&(_, mode)| {
                    interrupt::check()?;
                    let params = frame(asset, camera, mode);
                    Ok(renderer.render(gpu, &params)?)
                })
                .collect::<anyhow::Result<_>>()?;
            Ok((caption, pictures))
        })
        .collect()
}

/// How a demo's pictures are drawn: on white.
pub(crate) fn frame(asset: &Asset, camera: Camera, mode: Mode) -> FrameParams {
    FrameParams {
        camera,
        mode,
        method: Method::best_for(&asset.map),
        paint: Paint::default(),
        antialias: Antialias::Soft,
        background: Background::Colour([255; 3]),
        edges: EdgeParams::default(),
        light: None,
        shadow: None,
    }
}

/// One picture with a row for each viewpoint: the model, its bare hull, and what silmap makes of the hull.
fn comparison(rows: &[Row]) -> ColourImage {
    let sheets: Vec<ColourImage> = rows
        .iter()
        .map(|(_, pictures)| {
            let chosen: Vec<&ColourImage> = PICTURE_MODES
                .iter()
                .zip(pictures)
                .filter(|((_, mode), _)| COMPARED.contains(mode))
                .map(|(_, picture)| picture)
                .collect();
            beside(&chosen)
        })
        .collect();
    stacked(&sheets)
}

fn second_rows(report: &BuildReport, total: f64) -> Vec<(String, f64)> {
    let seconds = &report.seconds;
    [
        ("capture", seconds.capture),
        ("contours", seconds.contours),
        ("map", seconds.map),
        ("hull", seconds.hull),
        ("textures", seconds.textures),
        ("everything, with pictures and errors", total),
    ]
    .map(|(name, seconds)| (name.to_owned(), seconds))
    .to_vec()
}

fn picture_rows(rows: &[Row]) -> Vec<PictureRow> {
    rows.iter()
        .map(|(caption, pictures)| PictureRow {
            caption: (*caption).to_owned(),
            pictures: PICTURE_MODES
                .iter()
                .zip(pictures)
                .map(|((label, _), picture)| Picture {
                    label: (*label).to_owned(),
                    image: picture.clone(),
                })
                .collect(),
        })
        .collect()
}

fn tell(args: &DemoArgs, bytes: usize, seconds: f64) -> anyhow::Result<()> {
    // The full path, to be clicked on; as typed where the system does not know it.
    let folder = fs::canonicalize(&args.out).unwrap_or_else(|_| args.out.clone());
    let result = DemoJson {
        report: folder.join("report.html"),
        comparison: folder.join("comparison.png"),
        asset: folder.join("organic.glb"),
        model: folder.join("organic.ply"),
        bytes,
        seconds,
    };
    if args.output.json {
        return output::print_json(&result);
    }
    output::print_bytes(
        format!(
            "done in {seconds:.0} s; look at\n  {}\n  {}\n  {} (opens in any glTF viewer)\n",
            result.report.display(),
            result.comparison.display(),
            result.asset.display(),
        )
        .as_bytes(),
    )
}
