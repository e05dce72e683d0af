//! `silmap bench`: interpolation, extraction and frames side by side.

use anyhow::Context;
use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_exact::{ExtractionMethod, SimplifyParams, Viewpoint, simplify, walk_around};
use silmap_geometry::Camera;
use silmap_gpu::Gpu;
use silmap_map::{Asset, asset};
use silmap_measure::{
    Bench, Row, SceneBench, SceneParams, SceneResults, compare, machine, subdivide,
};
use silmap_mesh_io::Loaded;
use silmap_preprocess::pipeline::{BuildParams, Photographed};

use crate::args::{BenchArgs, usage_error};
use crate::commands::build::build_watched;
use crate::commands::open_gpu;
use crate::files::{load_model, load_model_of, read_asset};
use crate::output;
use crate::progress::Progress;

/// From where the walk starts, and how far away it leads, in radii.
const START: DVec3 = DVec3::new(0.45, 0.35, 1.0);
const DISTANCE_RADII: f64 = 3.0;

/// The row whose time the others' is compared with.
const COMPARED_WITH: &str = "full";

#[derive(Serialize)]
struct BenchJson {
    adapter: String,
    /// Where the device's times are from: `timestamps` or `submit-to-idle`.
    timing: &'static str,
    machine: String,
    rows: Vec<Row>,
    /// How many times longer a frame of the full mesh takes, processor and device together.
    ratios: serde_json::Map<String, serde_json::Value>,
    /// Over the model's resolution, as in a report.
    #[serde(skip_serializing_if = "Option::is_none")]
    comparison: Option<serde_json::Value>,
}

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    if args.pixels.is_some() && args.size.width != args.size.height {
        usage_error(
            ErrorKind::InvalidValue,
            "--size: with --pixels the picture is square",
        );
    }
    // First, so that a missing adapter is known before the work.
    let gpu = open_gpu()?;
    let read = args.asset.as_deref().map(read_asset).transpose()?;
    let model = match &read {
        Some((asset, _)) => load_model_of(asset, &args.model.path, args.model.mending)?,
        None => load_model(&args.model.path, args.model.mending)?,
    };
    let named = || args.model.path.display().to_string();
    let (asset, bytes) = match read {
        Some(read) => read,
        None => {
            let (asset, _) =
                build_watched(&model, &Photographed::default(), &BuildParams::default())
                    .with_context(named)?;
            let bytes = asset::write(&asset).with_context(named)?;
            (asset, bytes)
        }
    };
    if let Some(pixels) = args.pixels {
        return scene(args, pixels, &gpu, &model, (&asset, &bytes));
    }
    let params = SimplifyParams {
        target_faces: asset.hull.faces.len() as u32,
        ..SimplifyParams::default()
    };
    let simplified = Progress::new()
        .watch(|watch| simplify(&model.mesh, &[], &params, watch))
        .with_context(named)?
        .mesh;
    let full = subdivide(model.mesh.mesh(), args.faces_full as usize);
    let sizes = asset::sizes(&bytes).with_context(named)?;
    let cameras = cameras(args, asset.map.center, asset.map.radius)?;
    let (rows, has_timestamps) = Progress::new()
        .watch(|watch| {
            let bench = Bench {
                full: &full,
                simplified: Some(&simplified),
                asset: &asset,
                sizes,
                cameras,
                instances: args.instances as usize,
                extractions: extractions(args),
                watch,
            };
            bench.run(&gpu)
        })
        .with_context(named)?;
    let comparison = (args.comparison)
        .then(|| {
            Progress::new().watch(|watch| compare(&asset, &bytes, &model.mesh, Some(&gpu), watch))
        })
        .transpose()
        .with_context(named)?
        .map(|comparison| silmap_report::comparison_numbers(&comparison));
    let result = BenchJson {
        adapter: gpu.adapter_name(),
        timing: machine::timing(has_timestamps),
        machine: machine::describe(),
        ratios: ratios(&rows),
        rows,
        comparison,
    };
    if args.output.json {
        return output::print_json(&result);
    }
    output::print_bytes(table(&result).as_bytes())
}

/// One scene in one pass.
fn scene(
    args: &BenchArgs,
    pixels: f64,
    gpu: &Gpu,
    model: &Loaded,
    (asset, bytes): (&Asset, &[u8]),
) -> anyhow::Result<()> {
    let named = || args.model.path.display().to_string();
    let full = subdivide(model.mesh.mesh(), args.faces_full as usize);
    let sizes = asset::sizes(bytes).with_context(named)?;
    let params = SceneParams {
        instances: args.instances as usize,
        pixels,
        side_px: args.size.width,
        is_still: args.still,
        frames: args.repeat as usize,
    };
    let result = Progress::new()
        .watch(|watch| {
            let bench = SceneBench {
                full: &full,
                asset,
                sizes,
                params,
                watch,
            };
            bench.run(gpu)
        })
        .with_context(named)?;
    if args.output.json {
        return output::print_json(&result);
    }
    output::print_bytes(scene_table(&result).as_bytes())
}

fn scene_table(result: &SceneResults) -> String {
    let mut text = format!(
        "{} instances of {} px on {} px, drawn by {}, device timed by {}\n\
         {:<18} {:>8} {:>10} {:>8} {:>8} {:>9} {:>9} {:>9} {:>10}\n",
        result.instances,
        result.pixels,
        result.side_px,
        result.adapter,
        result.timing,
        "",
        "faces",
        "device ms",
        "cpu ms",
        "most ms",
        "mean px",
        "thick px",
        "most px",
        "bytes",
    );
    for row in &result.rows {
        let error = &row.outline_error_px;
        text.push_str(&format!(
            "{:<18} {:>8} {:>10.2} {:>8.3} {:>8.3} {:>9.3} {:>9.2} {:>9.2} {:>10}\n",
            row.name,
            row.faces,
            1e3 * row.seconds_median,
            1e3 * row.cpu_seconds_mean,
            1e3 * row.cpu_seconds_max,
            error.mean,
            error.thickest,
            error.largest,
            row.bytes,
        ));
    }
    if let Some(advice) = result.advice() {
        text.push_str(&format!("{advice}\n"));
    }
    text
}

/// The viewpoints of all frames, one walk.
fn cameras(args: &BenchArgs, center: DVec3, radius: f64) -> anyhow::Result<Vec<Camera>> {
    let start = center + START.normalize_or_zero() * (DISTANCE_RADII * radius);
    let count = args.repeat as usize * args.instances as usize;
    let size = (args.size.width, args.size.height);
    walk_around(Viewpoint::Eye(start), center, count)
        .map(|viewpoint| {
            let (Viewpoint::Eye(eye) | Viewpoint::Direction(eye)) = viewpoint;
            Ok(Camera::fit_sphere(eye, center, radius, None, size)?)
        })
        .collect()
}

fn extractions(args: &BenchArgs) -> Vec<ExtractionMethod> {
    let is_asked = |method: &ExtractionMethod| {
        args.edges.is_empty()
            || args
                .edges
                .iter()
                .any(|&e| ExtractionMethod::from(e) == *method)
    };
    ExtractionMethod::ALL
        .iter()
        .copied()
        .filter(is_asked)
        .collect()
}

fn ratios(rows: &[Row]) -> serde_json::Map<String, serde_json::Value> {
    let full = rows.iter().find(|r| r.name == COMPARED_WITH);
    let full = full.map_or(0.0, Row::frame_seconds);
    let is_drawn =
        |row: &&Row| !row.name.starts_with("edges-") && !row.name.starts_with("contour-");
    (rows.iter().filter(is_drawn))
        .filter(|row| row.name != COMPARED_WITH)
        .map(|row| {
            let name = format!("{COMPARED_WITH}/{}", row.name);
            (name, (full / row.frame_seconds()).into())
        })
        .collect()
}

fn table(result: &BenchJson) -> String {
    let mut text = format!(
        "drawn by {}, device timed by {}\n{:<22} {:>9} {:>10} {:>10} {:>9} {:>11}\n",
        result.adapter, result.timing, "", "faces", "device ms", "cpu ms", "error px", "bytes"
    );
    for row in &result.rows {
        let faces = row.faces.map_or(String::new(), |n| n.to_string());
        let error = row
            .outline_error
            .map_or(String::new(), |e| format!("{e:.4}"));
        let is_drawn = !row.name.starts_with("edges-") && !row.name.starts_with("contour-");
        let device = if is_drawn {
            format!("{:.3}", 1e3 * row.seconds_median)
        } else {
            String::new()
        };
        text.push_str(&format!(
            "{:<22} {faces:>9} {device:>10} {:>10.4} {error:>9} {:>11}\n",
            row.name,
            1e3 * row.cpu_seconds_median,
            row.bytes
        ));
    }
    if let Some(comparison) = &result.comparison {
        text.push_str(&resolutions(comparison));
    }
    text
}

/// What figures 9 and 11 of the 2000 paper show, as lines.
fn resolutions(comparison: &serde_json::Value) -> String {
    let mut text = format!(
        "\n{:>9} {:<16} {:>10} {:>10} {:>13} {:>13} {:>16}\n",
        "faces", "", "edges", "walk µs", "scattered µs", "frame ms", "same-time faces"
    );
    let list = |pointer: &str| comparison.pointer(pointer).and_then(|v| v.as_array());
    for (k, level) in list("/levels").into_iter().flatten().enumerate() {
        let Some(methods) = level["methods"].as_object() else {
            continue;
        };
        for (name, method) in methods {
            let number = |pointer: &str, factor: f64, digits: usize| {
                let value = method.pointer(pointer).and_then(serde_json::Value::as_f64);
                value.map_or(String::new(), |v| format!("{:.digits$}", factor * v))
            };
            let same = format!("/frames/faces_in_the_same_time/{name}/{k}/1");
            let same = comparison.pointer(&same).and_then(|v| v.as_f64());
            text.push_str(&format!(
                "{:>9} {name:<16} {:>10} {:>10} {:>13} {:>13} {:>16}\n",
                level["faces"].to_string(),
                number("/scattered/silhouette_edges", 1.0, 0),
                number("/walk/seconds_median", 1e6, 1),
                number("/scattered/seconds_median", 1e6, 1),
                number("/frame_seconds", 1e3, 2),
                same.map_or(String::new(), |faces| format!("{faces:.0}")),
            ));
        }
    }
    text
}
