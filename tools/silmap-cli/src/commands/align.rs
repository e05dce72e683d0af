//! `silmap align`: the camera from which a model fits an outline in an image.

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_exact::{AlignParams, Pose, angle_between, refine_pose};
use silmap_geometry::mesh::Bounds;
use silmap_geometry::{Camera, Mask};
use silmap_preprocess::trace::trace_contours;

use crate::args::AlignArgs;
use crate::camera::CameraJson;
use crate::files::load_model;
use crate::output::{self, OutputFile};
use crate::pose_file;
use crate::progress::Progress;

/// Pixels brighter than this are inside.
const INSIDE_LUMA: u8 = 127;

#[derive(Serialize)]
struct AlignJson {
    camera: CameraJson,
    /// Mean distance between the outlines, pixels.
    distance_px: f64,
    rounds: u32,
    /// How far the pose is from that at the start: of the model as the camera sees it.
    turned_degrees: f64,
    /// Model units.
    moved: f64,
    seconds: f64,
}

pub(crate) fn run(args: &AlignArgs) -> anyhow::Result<()> {
    let file = args.out.as_deref().map(OutputFile::check).transpose()?;
    let mask = read_mask(&args.mask)?;
    let outline = trace_contours(&mask);
    let model = load_model(&args.model, args.mending)?.mesh;
    let bounds = model.bounds();
    let start = read_pose(&args.start, (mask.width(), mask.height()), bounds)?;
    let since = Instant::now();
    let params = AlignParams::default();
    let pose = Progress::new()
        .count("fitting outlines", |watch| {
            refine_pose(&model, &outline, &start, &params, watch)
        })
        .with_context(|| args.mask.display().to_string())?;
    let seconds = since.elapsed().as_secs_f64();
    let Pose {
        camera,
        distance_px,
        rounds,
    } = pose;
    let seen = |camera: &Camera| {
        let offset = bounds.center - camera.eye;
        DVec3::new(
            offset.dot(camera.right),
            offset.dot(camera.up),
            offset.dot(camera.forward),
        )
    };
    let result = AlignJson {
        camera: CameraJson::new(&camera, camera.eye.distance(bounds.center)),
        distance_px,
        rounds,
        turned_degrees: angle_between(&camera, &start).to_degrees(),
        moved: seen(&camera).distance(seen(&start)),
        seconds,
    };
    if let Some(file) = &file {
        let mut text = serde_json::to_vec_pretty(&result)?;
        text.push(b'\n');
        file.write(&text)?;
    }
    if args.output.json || file.is_none() {
        return output::print_json(&result);
    }
    output::say(&format!(
        "outlines {:.2} pixels apart after {} rounds: turned by {:.2}°, moved by {:.4} of the radius",
        result.distance_px,
        result.rounds,
        result.turned_degrees,
        result.moved / bounds.radius
    ));
    Ok(())
}

fn read_mask(path: &Path) -> anyhow::Result<Mask> {
    let shown = || path.display().to_string();
    let bytes = std::fs::read(path).with_context(shown)?;
    let image = image::load_from_memory(&bytes)
        .with_context(shown)?
        .into_luma8();
    let mut mask = Mask::new(image.width(), image.height());
    for (x, y, luma) in image.enumerate_pixels() {
        if luma.0[0] > INSIDE_LUMA {
            mask.set(x, y, true);
        }
    }
    Ok(mask)
}

fn read_pose(path: &Path, size: (u32, u32), bounds: &Bounds) -> anyhow::Result<Camera> {
    let shown = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(shown)?;
    pose_file::parse(&text, size, (bounds.center, bounds.radius)).with_context(shown)
}
