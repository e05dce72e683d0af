//! A coarse hull of a mesh file: a mesh of few faces that holds the whole model inside.
//!
//! `cargo run --release -p silmap-hull --example hull -- MODEL FACES OUT`: model and hull as OBJ, PLY, STL, OFF or (hull: binary) glTF.

#![expect(clippy::print_stdout, reason = "an example says what it did")]

use std::error::Error;
use std::path::Path;

use silmap_geometry::Watch;
use silmap_hull::{HullParams, Tightening, VerifyParams, build, verify};
use silmap_mesh_io::{LoadOptions, encode_about, load};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, faces, out] = arguments.as_slice() else {
        return Err("usage: hull MODEL FACES OUT".into());
    };
    let model = load(Path::new(model), &LoadOptions::default())?.mesh;
    let params = HullParams {
        target_faces: faces.parse()?,
        ..HullParams::default()
    };
    let sequence = build(&model, &params, &Watch::silent())?;
    let level = sequence.tightened_level(faces.parse()?, Tightening::Fast, &Watch::silent())?;
    let report = verify(model.mesh(), &level.mesh, &VerifyParams::default());

    let out = Path::new(out);
    let (bytes, _) = encode_about(out, &level.mesh, model.origin())?;
    std::fs::write(out, bytes)?;
    println!(
        "{} faces hold {:.4} times the model's volume; nothing outside: {}",
        level.mesh.faces.len(),
        level.volume_ratio,
        report.encloses
    );
    Ok(())
}
