//! `silmap simplify`: fewer faces, the same silhouettes from some viewpoints.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use glam::DVec3;
use serde::Serialize;
use silmap_exact::{Simplified, SimplifyParams, simplify};
use silmap_geometry::{Camera, ClosedMesh, CoverageRule, Mask, TriangleMesh};
use silmap_measure::evaluate::compare;
use silmap_mesh_io as mesh_io;
use silmap_preprocess::capture::cpu::rasterise;

use crate::args::SimplifyArgs;
use crate::files::{load_model, read_text};
use crate::interrupt;
use crate::output::{self, OutputFile, Staging};
use crate::progress::Progress;
use crate::values::{parse_point, point_text};

/// Silhouettes are compared in pictures of this side, pixels.
const COMPARED_PX: u32 = 512;

#[derive(Serialize)]
struct SimplifyJson<'a> {
    out: &'a Path,
    faces: usize,
    vertices: usize,
    original_faces: usize,
    viewpoints: usize,
    /// Pixels that are wrong as seen from the viewpoints, over those inside.
    error: ErrorJson,
    /// The same for as many faces when no viewpoint guides the collapses.
    unguided_error: ErrorJson,
    /// Of simplifying alone.
    seconds: f64,
    /// What was left out, or came out otherwise than one would expect.
    warnings: Vec<String>,
}

#[derive(Clone, Copy, Serialize)]
struct ErrorJson {
    misclassified_mean: f64,
    misclassified_max: f64,
}

pub(crate) fn run(args: &SimplifyArgs) -> anyhow::Result<()> {
    mesh_io::check_output(&args.mesh.out)?;
    let file = OutputFile::check(&args.mesh.out)?;
    let mut eyes = args.eye.clone();
    if let Some(path) = &args.eyes {
        eyes.extend(read_eyes(path)?);
    }
    let named = || args.model.path.display().to_string();
    let model = load_model(&args.model.path, args.model.mending)?.mesh;
    let cameras = eyes
        .iter()
        .map(|&eye| camera_at(eye, &model))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let eyes: Vec<DVec3> = cameras.iter().map(|camera| camera.eye).collect();
    let params = SimplifyParams {
        target_faces: args.faces,
        band_rad: args.band.to_radians(),
        ..SimplifyParams::default()
    };
    let progress = Progress::new();
    let simplified = |eyes| {
        progress
            .watch(|watch| simplify(&model, eyes, &params, watch))
            .with_context(named)
    };
    let since = Instant::now();
    let Simplified {
        mesh: simple,
        stretched,
    } = simplified(&eyes[..])?;
    let seconds = since.elapsed().as_secs_f64();
    let plain = simplified(&[])?.mesh;
    let files = mesh_io::encode_painted(&args.mesh.out, &simple, model.origin())?;
    let mut staging = Staging::default();
    for (path, bytes) in &files.beside {
        let beside = OutputFile::check(path)?;
        beside.refuse_to_replace(&args.model.path);
        staging.add(&beside, bytes)?;
    }
    staging.add(&file, &files.bytes)?;
    let mut warnings = warnings_about(args, simple.faces.len(), stretched);
    warnings.extend(files.warnings());
    let error = |mesh| error_of(mesh, model.mesh(), &cameras).with_context(named);
    let result = SimplifyJson {
        out: &args.mesh.out,
        faces: simple.faces.len(),
        vertices: simple.positions.len(),
        original_faces: model.mesh().faces.len(),
        viewpoints: eyes.len(),
        error: error(&simple)?,
        unguided_error: error(&plain)?,
        seconds,
        warnings,
    };
    staging.publish()?;
    for warning in &result.warnings {
        output::warn(&format!("{}: {warning}", args.mesh.out.display()));
    }
    if args.output.json {
        return output::print_json(&result);
    }
    output::say(&format!(
        "{}: {} of {} faces; from {} viewpoints {:.3} % of the pixels inside are wrong, {:.3} % without guidance",
        args.mesh.out.display(),
        result.faces,
        result.original_faces,
        result.viewpoints,
        100.0 * result.error.misclassified_mean,
        100.0 * result.unguided_error.misclassified_mean,
    ));
    Ok(())
}

/// What the user should know about the mesh that was written.
fn warnings_about(args: &SimplifyArgs, faces: usize, stretched: u32) -> Vec<String> {
    let mut warnings = Vec::new();
    if faces > args.faces as usize {
        warnings.push(format!(
            "simplifying stopped at {faces} faces: no edge can be collapsed any more ({} asked for)",
            args.faces
        ));
    }
    if stretched > 0 {
        warnings.push(format!(
            "seams of the texture or of colours had to be moved {stretched} times to get so coarse: they are stretched there"
        ));
    }
    warnings
}

/// The viewpoints of a text file: one a line; empty lines and those that begin with # say nothing.
fn read_eyes(path: &Path) -> anyhow::Result<Vec<DVec3>> {
    let shown = path.display();
    let text = read_text(path)?;
    let mut eyes = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let parsed = parse_point(line).map_err(anyhow::Error::msg);
        eyes.push(parsed.with_context(|| format!("{shown}: line {number}"))?);
    }
    if eyes.is_empty() {
        bail!("{shown}: there is no viewpoint in it");
    }
    Ok(eyes)
}

fn camera_at(eye: DVec3, model: &ClosedMesh) -> anyhow::Result<Camera> {
    let bounds = model.bounds();
    let size = (COMPARED_PX, COMPARED_PX);
    Camera::fit_sphere(
        eye - model.origin(),
        bounds.center,
        bounds.radius,
        None,
        size,
    )
    .with_context(|| format!("viewpoint {}", point_text(eye)))
}

fn error_of(
    simple: &TriangleMesh,
    model: &TriangleMesh,
    cameras: &[Camera],
) -> anyhow::Result<ErrorJson> {
    let mut masks = [(); 2].map(|()| Mask::new(COMPARED_PX, COMPARED_PX));
    let (mut sum, mut most) = (0.0, 0.0_f64);
    for camera in cameras {
        interrupt::check()?;
        for (mesh, mask) in [simple, model].into_iter().zip(&mut masks) {
            rasterise(mesh, camera, CoverageRule::Center, mask)?;
        }
        let (misclassified, _) = compare(&masks[0], &masks[1]);
        sum += misclassified;
        most = most.max(misclassified);
    }
    Ok(ErrorJson {
        misclassified_mean: sum / cameras.len().max(1) as f64,
        misclassified_max: most,
    })
}
