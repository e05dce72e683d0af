//! Meshes in and out of files.
//!
//! [`load`] reads a file, welds it, mends what it is told to mend, and gives a [`ClosedMesh`] or one sentence about what
//! is wrong. No reader trusts a count or an index of the file: nothing is allocated for what a header merely claims.

mod error;
mod gltf;
mod gltf_data;
mod gltf_places;
mod mtl;
mod obj;
mod off;
mod origin;
mod ply;
mod ply_header;
mod raw;
mod stl;
#[cfg(test)]
mod tests;
mod text;
mod weld;
mod write;

use std::path::Path;

use glam::DVec3;
use silmap_geometry::defects::counted;
use silmap_geometry::{ClosedMesh, MeshDefects, TriangleMesh, holes, repair};

pub use self::error::{GltfFault, HeaderFault, LineFault, MeshFault, MeshIoError};
use self::raw::RawMesh;
use self::weld::{Welded, weld};
pub use self::write::{check_output, encode, encode_about, write};
use crate::progress::PrepWarning;

/// What to mend in a mesh that is not closed and oriented.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Fill holes.
    pub close_holes: bool,
    /// Remove degenerate and duplicate faces, take sheets apart that touch in edges or vertices, and turn all faces
    /// outward.
    pub repair: bool,
}

/// A mesh that is ready for everything.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh, in coordinates about [`ClosedMesh::origin`].
    pub mesh: ClosedMesh,
    /// The file's name without folder and extension.
    pub name: String,
    /// What was odd, or changed.
    pub warnings: Vec<PrepWarning>,
}

/// Triangles as a file has them.
#[derive(Clone, Debug)]
pub struct LoadedTriangles {
    /// The mesh, in coordinates about `origin`.
    pub mesh: TriangleMesh,
    /// Where the origin of its coordinates lies in those of the file.
    pub origin: DVec3,
    /// What was odd.
    pub warnings: Vec<PrepWarning>,
}

const KNOWN_INPUTS: &str = ".obj, .ply, .stl, .off, .gltf, .glb";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Obj,
    Ply,
    Stl,
    Off,
    Gltf,
    Glb,
}

/// Reads a mesh file and makes sure that it is a closed, oriented manifold that faces outward.
///
/// A model far from the file's origin is told in coordinates about a point near it, see [`ClosedMesh::origin`].
/// Parts that face inward without lying in another part are turned, with a warning, whatever the options.
///
/// # Errors
/// When the file cannot be read or understood; when the mesh is not closed and oriented and the options do not allow to
/// mend it; when mending fails. One sentence that names the file and the first offending element.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, MeshIoError> {
    let raw = read_file(path)?;
    let (mesh, warnings) = close(raw, options).map_err(|fault| at(path, fault))?;
    Ok(Loaded {
        mesh,
        name: path
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
            .unwrap_or_default(),
        warnings,
    })
}

/// Reads a mesh file: polygons cut into triangles, vertices at equal places merged, nothing else checked or changed.
///
/// # Errors
/// When the file cannot be read or understood, or is too far from its origin.
pub fn read_triangles(path: &Path) -> Result<LoadedTriangles, MeshIoError> {
    let raw = read_file(path)?;
    let mut mesh = weld(&raw).mesh;
    let mut warnings = raw.warnings;
    let (origin, coarse) = origin::localise(&mut mesh).map_err(|fault| at(path, fault))?;
    warnings.extend(coarse);
    Ok(LoadedTriangles {
        mesh,
        origin,
        warnings,
    })
}

fn at(path: &Path, fault: MeshFault) -> MeshIoError {
    MeshIoError {
        path: path.to_owned(),
        fault,
    }
}

fn read_file(path: &Path) -> Result<RawMesh, MeshIoError> {
    let bytes = std::fs::read(path).map_err(|source| at(path, MeshFault::Unreadable { source }))?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let folder = path.parent().unwrap_or(Path::new(""));
    read_bytes(&bytes, extension.as_deref().unwrap_or_default(), folder)
        .map_err(|fault| at(path, fault))
}

/// Reads a file's content; `extension` is in lower case, `folder` is where further files lie that it names.
fn read_bytes(bytes: &[u8], extension: &str, folder: &Path) -> Result<RawMesh, MeshFault> {
    if bytes.is_empty() {
        return Err(MeshFault::Empty);
    }
    let format = match extension {
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        "off" => Some(Format::Off),
        "gltf" => Some(Format::Gltf),
        "glb" => Some(Format::Glb),
        _ => sniff(bytes),
    };
    match format {
        Some(Format::Obj) => obj::read(bytes, folder),
        Some(Format::Ply) => ply::read(bytes, folder),
        Some(Format::Stl) => stl::read(bytes),
        Some(Format::Off) => off::read(bytes),
        Some(Format::Gltf) => gltf::read(bytes, bytes.starts_with(b"glTF"), folder),
        Some(Format::Glb) => gltf::read(bytes, true, folder),
        None => Err(MeshFault::UnknownFormat {
            known: KNOWN_INPUTS,
        }),
    }
}

/// The format by the first bytes, for files whose name does not tell it.
fn sniff(bytes: &[u8]) -> Option<Format> {
    const LOOKED_AT: usize = 1024;
    let start = bytes[..bytes.len().min(LOOKED_AT)].trim_ascii_start();
    if start.starts_with(b"glTF") {
        Some(Format::Glb)
    } else if start.starts_with(b"{") {
        Some(Format::Gltf)
    } else if start.starts_with(b"ply") {
        Some(Format::Ply)
    } else if start.starts_with(b"OFF") || start.starts_with(b"COFF") {
        Some(Format::Off)
    } else if start.starts_with(b"solid") {
        Some(Format::Stl)
    } else {
        let begins_as_obj = |line: &[u8]| line.starts_with(b"v ") || line.starts_with(b"mtllib ");
        start
            .split(|&b| b == b'\n')
            .any(|line| begins_as_obj(line.trim_ascii_start()))
            .then_some(Format::Obj)
    }
}

/// Welds, mends and checks.
fn close(raw: RawMesh, options: &LoadOptions) -> Result<(ClosedMesh, Vec<PrepWarning>), MeshFault> {
    let Welded {
        mut mesh,
        mut vertex_of,
        face_of,
        dropped,
    } = weld(&raw);
    let first_number = raw.first_number;
    let mut warnings = raw.warnings;
    if mesh.faces.is_empty() {
        return Err(match dropped {
            0 => MeshFault::NoFaces,
            faces => MeshFault::NoArea { faces },
        });
    }
    if dropped > 0 {
        let what = format!(
            "{} with corners at the same place: left out",
            counted(dropped, "face")
        );
        warnings.push(PrepWarning::Repaired { what });
    }
    // Numbers of the file are compared with each other before this, and never after.
    let (origin, coarse) = origin::localise(&mut mesh)?;
    warnings.extend(coarse);
    let mut face_of = face_of;
    if options.repair {
        let report = repair::repair(&mut mesh)?;
        vertex_of = through(&report.vertex_of, &vertex_of);
        face_of = through(&report.face_of, &face_of);
        warnings.extend(report.changes().map(|what| PrepWarning::Repaired { what }));
    }
    if options.close_holes {
        let first_fill = mesh.faces.len();
        let report = holes::close_holes(&mut mesh);
        vertex_of = through(&report.vertex_of, &vertex_of);
        warnings.extend(report.changes().map(|what| PrepWarning::Repaired { what }));
        // A slit is filled with faces on a line.
        let first = if options.repair { 0 } else { first_fill };
        repair::replace_zero_area(&mut mesh, &mut face_of, first);
    }
    let turned = repair::turn_outward(&mut mesh);
    if turned > 0 {
        let what = format!(
            "{} of parts that faced inward: turned outward",
            counted(turned, "face")
        );
        warnings.push(PrepWarning::Repaired { what });
    }
    let vertex_count = mesh.positions.len();
    vertex_of = through(&mesh.drop_unused_vertices(), &vertex_of);
    let unused = vertex_count - vertex_of.len();
    if unused > 0 {
        let what = format!("{} used by no face: left out", counted(unused, "vertex"));
        warnings.push(PrepWarning::Ignored { what });
    }
    let defects = match ClosedMesh::try_from(mesh) {
        Ok(mesh) => return Ok((mesh.with_origin(origin), warnings)),
        Err(defects) => defects,
    };
    if let Some(mesh) = close_unwelded(raw.mesh, origin) {
        let what = "sheets touch where the file keeps vertices apart: its vertices were not merged";
        warnings.push(PrepWarning::Ignored {
            what: what.to_owned(),
        });
        return Ok((mesh.with_origin(origin), warnings));
    }
    Err(MeshFault::NotClosed {
        hint: hint(&defects, options),
        defects: defects.renumber(&vertex_of, &face_of, first_number),
    })
}

/// The mesh with the vertices the file tells apart, if that is closed already.
fn close_unwelded(mut mesh: TriangleMesh, origin: DVec3) -> Option<ClosedMesh> {
    origin::tell_about(&mut mesh, origin);
    repair::turn_outward(&mut mesh);
    ClosedMesh::try_from(mesh).ok()
}

/// The numbers `names` of things that `of` picks out.
fn through(of: &[u32], names: &[u32]) -> Vec<u32> {
    of.iter().map(|&i| names[i as usize]).collect()
}

/// Which option would help.
fn hint(defects: &MeshDefects, options: &LoadOptions) -> &'static str {
    let wants_repair = defects.is_repairable() && !options.repair;
    let wants_closing = defects.is_open() && !options.close_holes;
    match (wants_repair, wants_closing) {
        (true, true) => " (--repair and --close-holes may help)",
        (true, false) => " (--repair may help)",
        (false, true) => " (--close-holes may help)",
        (false, false) => "",
    }
}
