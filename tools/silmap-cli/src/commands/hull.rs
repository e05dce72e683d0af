//! `silmap hull`: a coarse enclosing mesh alone.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_geometry::{Appearance, ColourImage, TriangleMesh, without_hidden_parts};
use silmap_hull::{
    self as hull, HullLevel, HullParams, ProgressiveHull, VerifyParams, VerifyReport,
};
use silmap_mesh_io as mesh_io;
use silmap_preprocess::PrepWarning;

use crate::args::HullArgs;
use crate::files::{encode_mesh, load_model_bytes, load_options, read};
use crate::output::{self, OutputFile, Staging};
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
    let sequence_file = of_option(&args.sequence)?;
    let strip_file = args
        .strip
        .as_deref()
        .map(OutputFile::check_png)
        .transpose()?;
    let written = [Some(&file), sequence_file.as_ref(), strip_file.as_ref()];
    output::refuse_same_file(written.into_iter().flatten());
    let named = || args.model.display().to_string();
    let progress = Progress::new();
    let Given {
        model,
        origin,
        sequence,
        is_saved,
        faces,
        since,
    } = take_in(args, &progress)?;
    let radius = model.bounds().radius;
    let distance = (args.max_distance).map_or(f64::INFINITY, |d| d.in_units(radius));
    let level = progress
        .watch(|watch| sequence.tightened_within(faces, args.tighten.into(), distance, watch))
        .with_context(named)?;
    // What is verified is what is written.
    let Written { given, hull, moved } = as_written(&level, (&model, origin), &args.out);
    let seconds = since.elapsed().as_secs_f64();
    let check = args.verify.then(|| {
        let params = VerifyParams::default();
        match level.is_inner {
            true => hull::verify_inner(&hull, &model, &params),
            false => hull::verify(&model, &hull, &params),
        }
    });
    let mut staging = Staging::default();
    staging.add(&file, &encode_mesh(&args.out, &given, origin)?)?;
    if let Some(file) = &sequence_file {
        staging.add(file, &sequence.to_bytes())?;
    }
    if let Some(file) = &strip_file {
        staging.add(file, &encode_png(&strip_of(&sequence, &hull)?)?)?;
    }
    staging.publish()?;
    let end = is_saved.then(|| sequence.least_faces());
    for sentence in what_fell_short(args, &level, moved, &model, end) {
        output::warn(&format!("{}: {sentence}", args.out.display()));
    }
    warn_of_what_is_left_out(args, &model.appearance);
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
        output::print_json(&result)?;
    } else {
        tell(args, &result);
    }
    match check {
        Some(check) if !check.encloses => Err(not_verified(args, &check, level.is_inner)),
        _ => Ok(()),
    }
}

/// The sentence that ends a command whose hull is written, and wrong.
fn not_verified(args: &HullArgs, check: &VerifyReport, is_inner: bool) -> anyhow::Error {
    let what = match is_inner {
        true => "it pokes out of the model",
        false => "the model pokes out of it",
    };
    anyhow::anyhow!(
        "{}: the hull is written but not verified: {what}, by up to {:.3e} units",
        args.out.display(),
        check.escaped_distance
    )
}

/// What was asked for and is not so in what is written; `end` has the fewest faces of a saved sequence.
fn what_fell_short(
    args: &HullArgs,
    level: &HullLevel,
    moved: f64,
    model: &TriangleMesh,
    end: Option<usize>,
) -> Vec<String> {
    let mut sentences = Vec::new();
    let distance = args.max_distance.map(|d| d.in_units(model.bounds().radius));
    let reached = level.mesh.faces.len();
    if let Some(wanted) = args.faces
        && reached > wanted as usize
    {
        let mut keeps = vec![match level.is_inner {
            true => "inside the model".to_owned(),
            false => "around the model".to_owned(),
        }];
        if let Some(ratio) = args.volume_ratio {
            keeps.push(format!("within {ratio} times its volume"));
        }
        if let Some(distance) = distance {
            keeps.push(format!("within {distance} units of it"));
        }
        if args.no_self_intersections {
            keeps.push("from passing through itself".to_owned());
        }
        sentences.push(match end == Some(reached) {
            true => format!("the saved hulls end at {reached} faces ({wanted} asked for)"),
            false => format!(
                "the hull stopped at {reached} faces: no further collapse keeps it {} ({wanted} asked for)",
                keeps.join(" and ")
            ),
        });
    }
    let rounding = VerifyParams::default().tolerance_rel;
    if let Some(wanted) = args.volume_ratio {
        let ratio = level.volume_ratio;
        let is_past = match level.is_inner {
            true => ratio < wanted * (1.0 - rounding),
            false => ratio > wanted * (1.0 + rounding),
        };
        if is_past {
            sentences.push(format!(
                "the hull has {ratio:.6} times the model's volume ({wanted} asked for)"
            ));
        }
    }
    if let Some(wanted) = distance
        && level.distance + moved > wanted + rounding * model.bounds().radius
    {
        sentences.push(format!(
            "the hull's vertices are up to {:.4e} units from the model ({wanted} asked for)",
            level.distance + moved
        ));
    }
    sentences
}

/// Says which parts of the model's looks are not in the files.
fn warn_of_what_is_left_out(args: &HullArgs, appearance: &Appearance) {
    let has_colour = !appearance.is_plain();
    if has_colour && let Some(file) = &args.sequence {
        let what = "a sequence of hulls holds no colours: the model's are left out";
        output::warn(&format!("{}: {what}", file.display()));
    }
    let mut left_out = Vec::new();
    if !appearance.corner_uvs.is_empty() {
        left_out.push("texture coordinates");
    }
    if appearance.materials.iter().any(|m| m.texture.is_some()) {
        left_out.push("textures");
    }
    if !appearance.materials.is_empty() {
        left_out.push("materials");
    }
    let holds_colours = mesh_io::holds_colours(&args.out);
    if has_colour && !holds_colours {
        left_out.push("colours");
    }
    let (last, first) = match left_out.split_last() {
        None => return,
        Some((last, [])) => (*last, String::new()),
        Some((last, first)) => (*last, format!("{} and ", first.join(", "))),
    };
    let instead = match has_colour && holds_colours {
        true => ": the hull has the model's colours at its vertices",
        false => "",
    };
    output::warn(&format!(
        "{}: the model's {first}{last} are left out{instead}",
        args.out.display()
    ));
}

/// What the hull is taken out of.
struct Given {
    model: TriangleMesh,
    /// Where the origin of its coordinates lies in the file's.
    origin: DVec3,
    sequence: ProgressiveHull,
    /// Whether it was read from a file.
    is_saved: bool,
    /// Faces of the level to take.
    faces: usize,
    /// When the model was there.
    since: Instant,
}

/// Reads a model and collapses it, or reads a sequence.
fn take_in(args: &HullArgs, progress: &Progress) -> anyhow::Result<Given> {
    let named = || args.model.display().to_string();
    // Once, as it may be a pipe.
    let bytes = read(&args.model)?;
    if bytes.starts_with(&hull::SEQUENCE_MAGIC) {
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
            is_saved: true,
            faces: least.max(params.target_faces as usize),
            since,
        });
    }
    let mut model = load_model_bytes(&args.model, &bytes, &load_options(args.mending))?;
    drop(bytes);
    if !args.parts.keep_cavities
        && let Some((seen, hidden)) = without_hidden_parts(&model.mesh)
    {
        let warning = PrepWarning::HiddenParts(hidden);
        output::warn(&format!("{}: {warning}", args.model.display()));
        model.mesh = seen;
    }
    let params = params_from_args(args, model.mesh.bounds().radius);
    let since = Instant::now();
    let sequence = progress
        .watch(|watch| hull::build(&model.mesh, &params, watch))
        .with_context(named)?;
    Ok(Given {
        origin: model.mesh.origin(),
        model: model.mesh.into_mesh(),
        sequence,
        is_saved: false,
        faces: params.target_faces as usize,
        since,
    })
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

/// A hull as it is written.
struct Written {
    /// What the writer is given.
    given: TriangleMesh,
    /// What a reader of the file finds.
    hull: TriangleMesh,
    /// Largest distance that rounding moved a vertex, in the model's units.
    moved: f64,
}

/// The level as it is written, with the model's colours at its vertices where it has such: in single precision, as readers mostly
/// take it in, unless the model is so far from the origin that too much would poke out, and the format holds more.
fn as_written(level: &HullLevel, (model, origin): (&TriangleMesh, DVec3), path: &Path) -> Written {
    let rounded = level.round();
    let most = VerifyParams::default().tolerance_rel * model.bounds().radius;
    let is_glb = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    let (mut positions, moved): (Vec<DVec3>, f64) = if rounded.leak <= most || is_glb {
        (rounded.mesh().positions, rounded.moved)
    } else {
        (level.mesh.positions.clone(), 0.0)
    };
    let given = TriangleMesh {
        appearance: level.appearance(model),
        positions: positions.clone(),
        faces: level.mesh.faces.clone(),
    };
    if !is_glb && origin != DVec3::ZERO {
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
    let hull = TriangleMesh {
        positions,
        ..given.clone()
    };
    Written { given, hull, moved }
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
