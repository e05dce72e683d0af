//! `silmap align`: the camera from which a model fits an outline in an image.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use silmap_exact::{AlignParams, Pose, angle_between, refine_pose};
use silmap_geometry::{Camera, ClosedMesh, Mask};
use silmap_preprocess::trace::trace_contours;

use crate::args::AlignArgs;
use crate::camera::CameraJson;
use crate::files::load_model;
use crate::output::{self, OutputFile};
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

/// A camera as `contour` prints it, alone or as a part of what it prints.
#[derive(Deserialize)]
#[serde(untagged)]
enum PoseFile {
    Whole { camera: PoseJson },
    Bare(PoseJson),
}

#[derive(Deserialize)]
struct PoseJson {
    eye: [f64; 3],
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov_y_degrees: Option<f64>,
}

pub(crate) fn run(args: &AlignArgs) -> anyhow::Result<()> {
    let file = args.out.as_deref().map(OutputFile::check).transpose()?;
    let mask = read_mask(&args.mask)?;
    let outline = trace_contours(&mask);
    let model = load_model(&args.model, args.mending)?.mesh;
    let bounds = model.bounds();
    let start = read_pose(&args.start, (mask.width(), mask.height()), &model)?;
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
        camera: CameraJson::new(&camera, camera.eye.distance(bounds.center), model.origin()),
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

fn read_pose(path: &Path, size: (u32, u32), model: &ClosedMesh) -> anyhow::Result<Camera> {
    let shown = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(shown)?;
    let Ok(file) = serde_json::from_str::<PoseFile>(&text) else {
        bail!(
            "{}: this is no camera: a JSON object with eye, and where wanted target, up and fov_y_degrees, is needed",
            path.display()
        );
    };
    let (PoseFile::Whole { camera: pose } | PoseFile::Bare(pose)) = file;
    let (bounds, origin) = (model.bounds(), model.origin());
    let eye = DVec3::from(pose.eye) - origin;
    let target = (pose.target).map_or(bounds.center, |target| DVec3::from(target) - origin);
    let up = pose.up.map(DVec3::from);
    let camera = match pose.fov_y_degrees {
        Some(degrees) => Camera::look_at(eye, target, up, degrees.to_radians(), size),
        None => Camera::fit_sphere(eye, bounds.center, bounds.radius, None, size)
            .and_then(|fit| Camera::with_half_tangent(eye, target, up, fit.half_tangent.y, size)),
    };
    camera.with_context(shown)
}
