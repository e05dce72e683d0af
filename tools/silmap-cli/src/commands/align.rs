//! `silmap align`: the camera from which a model fits an outline in an image.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_capture::Drawing;
use silmap_capture::mask_image::{self, MaskImage};
use silmap_exact::{AlignParams, angle_between, refine_pose};
use silmap_geometry::camera::in_short;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, ClosedMesh, Loop, Watch};

use crate::args::{AlignArgs, usage_error};
use crate::camera::CameraJson;
use crate::captured_camera::{self, Captured};
use crate::files::{load_model, read_text};
use crate::interrupt;
use crate::output::{self, OutputFile};
use crate::pose_file;
use crate::progress::Progress;
use crate::scene::Scene;

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
    /// With a camera of a capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    captured: Option<CapturedJson>,
    seconds: f64,
}

/// The captured pose beside the refined one.
#[derive(Serialize)]
struct CapturedJson {
    view: String,
    /// Mean distance between the outlines from there, pixels; null where they are nowhere near each other.
    distance_px: Option<f64>,
    /// As those of the start.
    turned_degrees: f64,
    moved: f64,
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
    let size = (mask.width(), mask.height());
    let mut outline = trace_contours(&mask);
    let model = load_model(&args.model.path, args.model.mending)?.mesh;
    let bounds = model.bounds();
    let captured = captured_camera(args, size, &model)?;
    let intrinsics = captured.as_ref().map(|c| c.drawing.camera);
    if let Some(captured) = &captured {
        if let Some(file) = &file {
            captured.refuse_to_be_replaced_by(file);
        }
        outline = captured.drawing.drawn_from_loops(&outline);
    }
    let start = match (&args.start, intrinsics) {
        (Some(path), _) => read_pose(path, (size, intrinsics), &model)?,
        (None, Some(camera)) => camera,
        (None, None) => usage_error(
            ErrorKind::MissingRequiredArgument,
            "a camera to start from is needed: --start POSE, or --camera FILE --view NAME",
        ),
    };
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
    let apart = |from: &Camera| {
        (
            angle_between(&camera, from).to_degrees(),
            seen(&camera).distance(seen(from)),
        )
    };
    let json = CameraJson::new(&camera, camera.eye.distance(bounds.center), model.origin());
    let (turned_degrees, moved) = apart(&start);
    let result = AlignJson {
        camera: match &captured {
            Some(captured) => json.of_captured(captured),
            None => json,
        },
        converged: pose.fits(),
        distance_px: pose.distance_px,
        fits_within_px: pose.fits_within_px,
        rounds: pose.rounds,
        turned_degrees,
        moved,
        captured: captured.map(|captured| {
            let (turned_degrees, moved) = apart(&captured.drawing.camera);
            CapturedJson {
                view: captured.view.name,
                distance_px: distance_from(&captured.drawing.camera, &model, &outline),
                turned_degrees,
                moved,
            }
        }),
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
    if let Some(captured) = &result.captured {
        let before = captured.distance_px.map_or_else(
            || "nowhere near".to_owned(),
            |px| format!("{px:.2} pixels apart"),
        );
        output::say(&format!(
            "from the captured pose of view {}, where outlines are {before}: turned by {:.2}°, moved by {:.4} of the radius",
            captured.view,
            captured.turned_degrees,
            captured.moved / bounds.radius
        ));
    }
    Ok(())
}

/// The camera of a capture that the mask belongs to, in the mask's size.
fn captured_camera(
    args: &AlignArgs,
    size: (u32, u32),
    model: &ClosedMesh,
) -> anyhow::Result<Option<Captured>> {
    let Some((file, view)) = captured_camera::named(&args.captured)? else {
        return Ok(None);
    };
    let scene = Scene::of_mesh(model.origin(), model.bounds());
    let made = Drawing::of_size(&view.camera, view.lens.as_ref(), size);
    captured_camera::of_view((&file, &view), made, &scene)
        .map(Some)
        .with_context(|| args.mask.display().to_string())
}

/// Mean distance between the outlines as a camera sees them, pixels.
fn distance_from(camera: &Camera, model: &ClosedMesh, outline: &[Loop]) -> Option<f64> {
    let looked = AlignParams {
        rounds: 1,
        good_distance_px: f64::INFINITY,
        ..AlignParams::default()
    };
    let pose = refine_pose(model, outline, camera, &looked, &Watch::silent());
    pose.ok().map(|pose| pose.distance_px)
}

/// The camera of a file, with these intrinsics where there are some.
fn read_pose(
    path: &Path,
    (size, intrinsics): ((u32, u32), Option<Camera>),
    model: &ClosedMesh,
) -> anyhow::Result<Camera> {
    let shown = || path.display().to_string();
    let text = read_text(path)?;
    let bounds = model.bounds();
    let sphere = (bounds.center, bounds.radius);
    pose_file::parse(&text, (size, intrinsics), model.origin(), sphere).with_context(shown)
}
