//! `silmap generate`: a generated model.

use std::path::Path;

use serde::Serialize;
use silmap_geometry::TriangleMesh;
use silmap_mesh_io as mesh_io;
use silmap_models as models;

use crate::args::{GenerateArgs, ModelKind};
use crate::interrupt;
use crate::output::{self, OutputFile};

#[derive(Serialize)]
struct Generated<'a> {
    out: &'a Path,
    faces: usize,
    vertices: usize,
}

pub(crate) fn run(args: &GenerateArgs) -> anyhow::Result<()> {
    mesh_io::check_output(&args.mesh.out)?;
    let file = OutputFile::check(&args.mesh.out)?;
    let (kind, faces) = (args.kind, args.faces as usize);
    // Millions of faces take long, and nothing on the way looks whether to stop.
    let mesh = interrupt::unless_stopped(move || generate(kind, faces))?;
    file.write(&mesh_io::encode(&args.mesh.out, &mesh)?)?;
    if args.output.json {
        return output::print_json(&Generated {
            out: &args.mesh.out,
            faces: mesh.faces.len(),
            vertices: mesh.positions.len(),
        });
    }
    output::say(&format!(
        "{}: {} faces, {} vertices",
        args.mesh.out.display(),
        mesh.faces.len(),
        mesh.positions.len()
    ));
    Ok(())
}

/// The model of a kind with about this many faces.
pub(crate) fn generate(kind: ModelKind, faces: usize) -> TriangleMesh {
    match kind {
        ModelKind::Torus => models::torus(faces),
        ModelKind::TrefoilKnot => models::trefoil_knot(faces),
        ModelKind::ThreeHoledTorus => models::three_holed_torus(faces),
        ModelKind::Organic => models::organic(faces),
    }
}
