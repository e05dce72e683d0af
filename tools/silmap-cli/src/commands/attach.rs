//! `silmap attach`: restores an asset's data in a file that another program wrote without them.

use std::fs;
use std::path::Path;

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_map::asset::{self, Triangles};
use silmap_mesh_io as mesh_io;

use crate::args::AttachArgs;
use crate::names;
use crate::output::{self, OutputFile};

#[derive(Serialize)]
struct AttachJson<'a> {
    out: &'a Path,
    bytes: usize,
    /// Bytes that were added to the plain file.
    added_bytes: u64,
    /// What the plain file calls the mesh that is the hull.
    mesh: &'a str,
    hull_faces: usize,
    views: usize,
}

pub(crate) fn run(args: &AttachArgs) -> anyhow::Result<()> {
    let out = args.out.as_deref().unwrap_or(&args.plain);
    names::check_asset(out)?;
    let named = |path: &Path| path.display().to_string();
    let plain = fs::read(&args.plain).with_context(|| named(&args.plain))?;
    let from = fs::read(&args.from).with_context(|| named(&args.from))?;
    let file = OutputFile::check(out)?;
    let original = asset::read(&from).with_context(|| named(&args.from))?;
    let attached = asset::attach(
        &plain,
        &from,
        scene(&args.plain, original.placement.in_scene),
    );
    let attached = attached.with_context(|| named(&args.plain))?;
    // What is written is read once before.
    let asset = asset::read(&attached.file).with_context(|| named(out))?;
    anyhow::ensure!(
        asset.map == original.map,
        "{}: what was put back is not what was taken",
        named(out)
    );
    file.write(&attached.file)?;
    if args.output.json {
        return output::print_json(&AttachJson {
            out,
            bytes: attached.file.len(),
            added_bytes: attached.added_bytes,
            mesh: &attached.mesh,
            hull_faces: asset.hull.faces.len(),
            views: asset.map.views.len(),
        });
    }
    output::say(&format!(
        "{}: {} views put back beside mesh {:?}, {} bytes",
        out.display(),
        asset.map.views.len(),
        attached.mesh,
        attached.file.len(),
    ));
    Ok(())
}

/// All triangles of a file about the place of an asset's hull, where the reader of meshes can read it: it knows more ways of storing
/// them.
fn scene(path: &Path, hull_origin: DVec3) -> Option<Triangles> {
    let mesh_io::LoadedTriangles {
        mut mesh, origin, ..
    } = mesh_io::read_triangles(path).ok()?;
    mesh.positions
        .iter_mut()
        .for_each(|p| *p += origin - hull_origin);
    Some(Triangles {
        name: "all of the scene".to_owned(),
        positions: mesh.positions,
        faces: mesh.faces,
    })
}
