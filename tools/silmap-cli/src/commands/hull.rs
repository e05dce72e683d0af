//! `silmap hull`: a coarse enclosing mesh alone.

use std::time::Instant;

use anyhow::Context;
use glam::Vec3;
use serde::Serialize;
use silmap_geometry::{Appearance, Bvh, TriangleMesh};
use silmap_preprocess::hull::{self, HullLevel, HullParams, VerifyParams};
use silmap_preprocess::mesh_io;

use crate::args::HullArgs;
use crate::files::load_model;
use crate::output::{self, OutputFile};
use crate::progress::Progress;

/// Fewest faces of a closed mesh: the goal when only another limit was given.
const FEWEST_FACES: u32 = 4;

#[derive(Serialize)]
struct HullJson {
    faces: usize,
    vertices: usize,
    volume: f64,
    original_volume: f64,
    volume_ratio: f64,
    /// Of growing the hull alone.
    seconds: f64,
    /// Null when it was not checked.
    verified: Option<bool>,
    /// How far the model pokes out of the hull (or an inner hull out of the model), model units; null when not checked.
    escaped_distance: Option<f64>,
}

pub(crate) fn run(args: &HullArgs) -> anyhow::Result<()> {
    mesh_io::check_output(&args.out)?;
    let file = OutputFile::check(&args.out)?;
    let model = load_model(&args.model, args.mending)?;
    let params = params_from_args(args, model.mesh.bounds().radius);
    let named = || args.model.display().to_string();
    let since = Instant::now();
    let sequence = Progress::new()
        .watch(|monitor| hull::build(&model.mesh, &params, monitor))
        .with_context(named)?;
    // In single precision, as every format can hold it: what is verified is what is written.
    let level = sequence.level(params.target_faces as usize);
    let hull = in_single_precision(&level, model.mesh.mesh());
    let seconds = since.elapsed().as_secs_f64();
    let check = args.verify.then(|| {
        let (enclosed, enclosing) = if args.inner {
            (&hull, model.mesh.mesh())
        } else {
            (model.mesh.mesh(), &hull)
        };
        hull::verify(enclosed, enclosing, &VerifyParams::default())
    });
    file.write(&mesh_io::encode(&args.out, &hull)?)?;
    let (volume, original_volume) = (hull.volume(), model.mesh.mesh().volume());
    let result = HullJson {
        faces: hull.faces.len(),
        vertices: hull.positions.len(),
        volume,
        original_volume,
        volume_ratio: volume / original_volume,
        seconds,
        verified: check.as_ref().map(|c| c.encloses),
        escaped_distance: check.as_ref().map(|c| c.escaped_distance),
    };
    if args.output.json {
        return output::print_json(&result);
    }
    tell(args, &result);
    Ok(())
}

/// The level as it is written, with the colours of the model's vertices where it has such.
fn in_single_precision(level: &HullLevel, model: &TriangleMesh) -> TriangleMesh {
    let rounded = level.round().hull;
    let double = |p: [f32; 3]| Vec3::from_array(p).as_dvec3();
    let mut appearance = Appearance::default();
    if !model.appearance.corner_colours.is_empty() {
        let bvh = Bvh::new(model);
        let colour = |&p: &[f32; 3]| {
            let (_, face, weights) = bvh.closest_point(double(p));
            let weights = weights.map(|w| w as f32);
            model.appearance.albedo(face as usize, weights)
        };
        let colours: Vec<[f32; 3]> = rounded.surface_points.iter().map(colour).collect();
        let of_corners = |face: &[u32; 3]| face.map(|v| colours[v as usize]);
        appearance.corner_colours = rounded.faces.iter().map(of_corners).collect();
    }
    TriangleMesh {
        appearance,
        positions: rounded.positions.into_iter().map(double).collect(),
        faces: rounded.faces,
    }
}

fn tell(args: &HullArgs, result: &HullJson) {
    let verdict = match result.verified {
        None => "",
        Some(true) => ", verified",
        Some(false) => ", NOT verified",
    };
    output::say(&format!(
        "{}: {} faces, {:.4} times the model's volume, {:.2} s{verdict}",
        args.out.display(),
        result.faces,
        result.volume_ratio,
        result.seconds
    ));
}

/// The options as params, for a model of this bounding-sphere radius.
fn params_from_args(args: &HullArgs, model_radius: f64) -> HullParams {
    let defaults = HullParams::default();
    let has_other_limit = args.volume_ratio.is_some() || args.max_distance.is_some();
    let target_faces = match args.faces {
        Some(faces) => faces,
        None if has_other_limit => FEWEST_FACES,
        None => defaults.target_faces,
    };
    HullParams {
        target_faces,
        volume_ratio: args.volume_ratio,
        max_distance: args.max_distance.map(|d| d.in_units(model_radius)),
        inner: args.inner,
        ..defaults
    }
}
