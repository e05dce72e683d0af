//! `silmap hull`: a coarse enclosing mesh alone.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use glam::{DVec3, Vec3};
use serde::Serialize;
use silmap_geometry::{Appearance, Bvh, ColourImage, TriangleMesh, without_hidden_parts};
use silmap_preprocess::PrepWarning;
use silmap_preprocess::hull::{self, HullLevel, HullParams, ProgressiveHull, VerifyParams};
use silmap_preprocess::mesh_io;

use crate::args::HullArgs;
use crate::files::{encode_mesh, load_model};
use crate::output::{self, OutputFile};
use crate::pictures::encode_png;
use crate::progress::Progress;
use crate::strip;

/// Fewest faces of a closed mesh: the goal when only another limit was given.
const FEWEST_FACES: u32 = 4;
/// Pictures in a strip beside the hull itself, the model's included.
const STRIP_LEVELS: u32 = 4;

#[derive(Serialize)]
struct HullJson {
    faces: usize,
    vertices: usize,
    volume: f64,
    original_volume: f64,
    volume_ratio: f64,
    /// Of making the hull alone, out of the model or of a saved sequence.
    seconds: f64,
    /// Null when it was not checked.
    verified: Option<bool>,
    /// How far the model pokes out of the hull (or an inner hull out of the model), model units; null when not checked.
    escaped_distance: Option<f64>,
    /// Pairs of the hull's faces that pass through one another; null when not checked.
    self_intersections: Option<u32>,
}

pub(crate) fn run(args: &HullArgs) -> anyhow::Result<()> {
    mesh_io::check_output(&args.out)?;
    let file = OutputFile::check(&args.out)?;
    let of_option = |path: &Option<PathBuf>| path.as_deref().map(OutputFile::check).transpose();
    let (sequence_file, strip_file) = (of_option(&args.sequence)?, of_option(&args.strip)?);
    let named = || args.model.display().to_string();
    let progress = Progress::new();
    let Given {
        model,
        origin,
        sequence,
        faces,
        since,
    } = take_in(args, &progress)?;
    let level = progress
        .watch(|monitor| sequence.tightened_level(faces, args.tighten.into(), monitor))
        .with_context(named)?;
    // What is verified is what is written.
    let hull = as_written(&level, (&model, origin), &args.out);
    let seconds = since.elapsed().as_secs_f64();
    let check = args.verify.then(|| {
        let (enclosed, enclosing) = if level.is_inner {
            (&hull, &model)
        } else {
            (&model, &hull)
        };
        hull::verify(enclosed, enclosing, &VerifyParams::default())
    });
    file.write(&encode_mesh(&args.out, &hull, origin)?)?;
    if let Some(file) = sequence_file {
        file.write(&sequence.to_bytes())?;
    }
    if let Some(file) = strip_file {
        file.write(&encode_png(&strip_of(&sequence, &hull)?)?)?;
    }
    let (volume, original_volume) = (hull.volume(), model.volume());
    let result = HullJson {
        faces: hull.faces.len(),
        vertices: hull.positions.len(),
        volume,
        original_volume,
        volume_ratio: volume / original_volume,
        seconds,
        verified: check.as_ref().map(|c| c.encloses),
        escaped_distance: check.as_ref().map(|c| c.escaped_distance),
        self_intersections: (args.verify).then(|| hull::count_self_crossings(&hull)),
    };
    if args.output.json {
        return output::print_json(&result);
    }
    tell(args, &result);
    Ok(())
}

/// What the hull is taken out of.
struct Given {
    model: TriangleMesh,
    /// Where the origin of its coordinates lies in the file's.
    origin: DVec3,
    sequence: ProgressiveHull,
    /// Faces of the level to take.
    faces: usize,
    /// When the model was there.
    since: Instant,
}

/// Reads a model and collapses it, or reads a sequence.
fn take_in(args: &HullArgs, progress: &Progress) -> anyhow::Result<Given> {
    let named = || args.model.display().to_string();
    if let Some(bytes) = saved_sequence(&args.model).with_context(named)? {
        let since = Instant::now();
        let sequence = ProgressiveHull::from_bytes(&bytes).with_context(named)?;
        if args.inner && !sequence.is_inner() {
            anyhow::bail!("{}: the hulls in it are outer ones", named());
        }
        if args.no_self_intersections && sequence.may_cross_itself() {
            anyhow::bail!(
                "{}: its hulls may pass through themselves: make it again with --no-self-intersections",
                named()
            );
        }
        let model = sequence.model();
        let params = params_from_args(args, model.bounds().radius);
        let least = sequence.faces_within(params.volume_ratio, params.max_distance);
        return Ok(Given {
            model,
            origin: sequence.origin(),
            sequence,
            faces: least.max(params.target_faces as usize),
            since,
        });
    }
    let mut model = load_model(&args.model, args.mending)?;
    if !args.keep_cavities
        && let Some((seen, hidden)) = without_hidden_parts(&model.mesh)
    {
        let warning = PrepWarning::HiddenParts(hidden);
        output::warn(&format!("{}: {warning}", args.model.display()));
        model.mesh = seen;
    }
    let params = params_from_args(args, model.mesh.bounds().radius);
    let since = Instant::now();
    let sequence = progress
        .watch(|monitor| hull::build(&model.mesh, &params, monitor))
        .with_context(named)?;
    Ok(Given {
        origin: model.mesh.origin(),
        model: model.mesh.into_mesh(),
        sequence,
        faces: params.target_faces as usize,
        since,
    })
}

/// The bytes of a file that begins as a sequence does.
fn saved_sequence(path: &Path) -> std::io::Result<Option<Vec<u8>>> {
    let mut first = [0; hull::SEQUENCE_MAGIC.len()];
    // Whatever else is wrong with the file is for the reader of meshes to say.
    let Ok(mut file) = File::open(path) else {
        return Ok(None);
    };
    if file.read_exact(&mut first).is_err() || first != hull::SEQUENCE_MAGIC {
        return Ok(None);
    }
    std::fs::read(path).map(Some)
}

/// The model, levels between, and the hull as it was written.
fn strip_of(sequence: &ProgressiveHull, hull: &TriangleMesh) -> anyhow::Result<ColourImage> {
    let model = sequence.model();
    let mut meshes: Vec<TriangleMesh> =
        (strip::face_counts(model.faces.len(), hull.faces.len(), STRIP_LEVELS).into_iter())
            .map(|faces| sequence.level(faces).mesh)
            .collect();
    meshes.push(hull.clone());
    strip::draw(&meshes)
}

/// The level as it is written, with the colours of the model's vertices where it has such: in single precision, as readers mostly
/// take it in, unless the model is so far from the origin that too much would poke out, and the format holds more.
fn as_written(
    level: &HullLevel,
    (model, origin): (&TriangleMesh, DVec3),
    path: &Path,
) -> TriangleMesh {
    let rounded = level.round();
    let most = VerifyParams::default().tolerance_rel * model.bounds().radius;
    let is_glb = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    let double = |p: [f32; 3]| Vec3::from_array(p).as_dvec3();
    let mut positions: Vec<DVec3> = if rounded.leak <= most || is_glb {
        rounded.hull.positions.into_iter().map(double).collect()
    } else {
        level.mesh.positions.clone()
    };
    if !is_glb && origin != DVec3::ZERO {
        // As its reader finds them again.
        let is_stl = (path.extension()).is_some_and(|e| e.eq_ignore_ascii_case("stl"));
        for position in &mut positions {
            let written = *position + origin;
            let held = if is_stl {
                written.as_vec3().as_dvec3()
            } else {
                written
            };
            *position = held - origin;
        }
    }
    let mut appearance = Appearance::default();
    if !model.appearance.corner_colours.is_empty() {
        let bvh = Bvh::new(model);
        let colour = |&p: &DVec3| {
            let (_, face, weights) = bvh.closest_point(p);
            let weights = weights.map(|w| w as f32);
            model.appearance.albedo(face as usize, weights)
        };
        let colours: Vec<[f32; 3]> = level.surface_points.iter().map(colour).collect();
        let of_corners = |face: &[u32; 3]| face.map(|v| colours[v as usize]);
        appearance.corner_colours = level.mesh.faces.iter().map(of_corners).collect();
    }
    TriangleMesh {
        appearance,
        positions,
        faces: level.mesh.faces.clone(),
    }
}

fn tell(args: &HullArgs, result: &HullJson) {
    let verdict = match result.verified {
        None => "",
        Some(true) => ", verified",
        Some(false) => ", NOT verified",
    };
    let crossings = match result.self_intersections {
        None | Some(0) => String::new(),
        Some(1) => ", passes through itself at one pair of faces".to_owned(),
        Some(n) => format!(", passes through itself at {n} pairs of faces"),
    };
    output::say(&format!(
        "{}: {} faces, {:.4} times the model's volume, {:.2} s{verdict}{crossings}",
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
        no_self_intersections: args.no_self_intersections,
        ..defaults
    }
}
