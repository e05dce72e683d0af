//! `silmap align`: the camera from which a model fits an outline in an image.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use glam::DVec3;
use serde::Serialize;
use silmap_capture::mask_image::{self, MaskImage};
use silmap_exact::{AlignParams, angle_between, refine_pose};
use silmap_geometry::camera::in_short;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, ClosedMesh};

use crate::args::AlignArgs;
use crate::camera::CameraJson;
use crate::files::{load_model, read_text};
use crate::interrupt;
use crate::output::{self, OutputFile};
use crate::pose_file;
use crate::progress::Progress;

#[derive(Serialize)]
struct AlignJson {
    camera: CameraJson,
    /// Whether the outlines fit: `distance_px` is at most `fits_within_px`.
    converged: bool,
    /// Mean distance between the outlines, pixels.
    distance_px: f64,
    fits_within_px: f64,
    rounds: u32,
    /// How far the pose is from that at the start: of the model as the camera sees it.
    turned_degrees: f64,
    /// Model units.
    moved: f64,
    seconds: f64,
}

pub(crate) fn run(args: &AlignArgs) -> anyhow::Result<()> {
    let file = args.out.as_deref().map(OutputFile::check).transpose()?;
    if let Some(file) = &file {
        file.refuse_to_replace(&args.model.path);
        file.refuse_to_replace(&args.mask);
    }
    let mask_path = args.mask.clone();
    let MaskImage { mask, notes } =
        interrupt::unless_stopped(move || mask_image::read(&mask_path))??;
    for note in &notes {
        output::warn(&format!("{}: {note}", args.mask.display()));
    }
    let outline = trace_contours(&mask);
    let model = load_model(&args.model.path, args.model.mending)?.mesh;
    let bounds = model.bounds();
    let start = read_pose(&args.start, (mask.width(), mask.height()), &model)?;
    let since = Instant::now();
    let params = AlignParams {
        fits_within_px: args.within,
        ..AlignParams::default()
    };
    let pose = Progress::new()
        .watch(|watch| refine_pose(&model, &outline, &start, &params, watch))
        .with_context(|| args.mask.display().to_string())?;
    let seconds = since.elapsed().as_secs_f64();
    let camera = pose.camera;
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
        converged: pose.fits(),
        distance_px: pose.distance_px,
        fits_within_px: pose.fits_within_px,
        rounds: pose.rounds,
        turned_degrees: angle_between(&camera, &start).to_degrees(),
        moved: seen(&camera).distance(seen(&start)),
        seconds,
    };
    if let Some(file) = file.as_ref().filter(|_| result.converged) {
        let mut text = serde_json::to_vec_pretty(&result)?;
        text.push(b'\n');
        file.write(&text)?;
    }
    let is_printed = args.output.json || file.is_none();
    if is_printed {
        output::print_json(&result)?;
    }
    if !result.converged {
        bail!(
            "{}: no pose was found that fits: the outlines stay {} pixels apart on average, and at most {} would do (--within); start from a closer pose",
            args.mask.display(),
            in_short(result.distance_px),
            in_short(result.fits_within_px)
        );
    }
    if is_printed {
        return Ok(());
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

fn read_pose(path: &Path, size: (u32, u32), model: &ClosedMesh) -> anyhow::Result<Camera> {
    let shown = || path.display().to_string();
    let text = read_text(path)?;
    let bounds = model.bounds();
    let sphere = (bounds.center, bounds.radius);
    pose_file::parse(&text, size, model.origin(), sphere).with_context(shown)
}
