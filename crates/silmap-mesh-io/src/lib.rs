//! Meshes in and out of files.
//!
#![doc = include_str!("../README.md")]

mod content;
mod error;
mod gltf;
mod guard;
pub mod input;
mod mtl;
mod obj;
mod off;
mod origin;
mod painted;
mod ply;
mod raw;
mod seams;
mod stl;
#[cfg(test)]
mod tests;
mod text;
mod warning;
mod weld;
mod write;

use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use silmap_geometry::defects::counted;
use silmap_geometry::{ClosedMesh, MeshDefects, TriangleMesh, diagonals, holes, repair};

pub use self::error::{GltfFault, HeaderFault, LineFault, MeshFault, MeshIoError};
pub use self::painted::{PaintedFiles, encode_painted};
use self::raw::RawMesh;
pub use self::warning::MeshWarning;
use self::weld::{Welded, weld};
pub use self::write::{check_output, encode, encode_about, holds_colours, write};

/// What to mend in a mesh that is not closed and oriented.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoadOptions {
    /// Fill holes.
    pub close_holes: bool,
    /// Remove degenerate and duplicate faces, take sheets apart that touch in edges or vertices, and turn all faces
    /// outward.
    pub repair: bool,
    /// What materials do that cut out by their alpha.
    pub alpha: AlphaUse,
    /// Join open edges that lie within this distance of each other, model units. `None`: within a few units in the last
    /// place of the file's numbers, which is also the least.
    pub weld: Option<f64>,
}

/// What becomes of faces whose material cuts out what its alpha says is not there (`alphaMode` MASK in glTF).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlphaUse {
    /// They stay, with a warning.
    #[default]
    Opaque,
    /// Those of which nothing shows go: none of the texels they cover is as opaque as the material asks for. What shows in
    /// part stays whole, with a warning. Where this opens the mesh, the other options close it, or it is refused.
    Mask,
}

/// A mesh that is ready for everything.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh, in coordinates about [`ClosedMesh::origin`].
    pub mesh: ClosedMesh,
    /// The file's name without folder and extension.
    pub name: String,
    /// What was odd, or changed.
    pub warnings: Vec<MeshWarning>,
}

/// Triangles as a file has them.
#[derive(Clone, Debug)]
pub struct LoadedTriangles {
    /// The mesh, in coordinates about `origin`.
    pub mesh: TriangleMesh,
    /// Where the origin of its coordinates lies in those of the file.
    pub origin: DVec3,
    /// What was odd.
    pub warnings: Vec<MeshWarning>,
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
/// The coordinates of a model far from the file's origin are relative to a point near it, see [`ClosedMesh::origin`].
/// Parts that face inward without lying in another part are turned, with a warning, whatever the options.
///
/// # Errors
/// When the file cannot be read or understood; when the mesh is not closed and oriented and the options do not allow to
/// mend it; when mending fails. One sentence that names the file and the first offending element.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, MeshIoError> {
    load_bytes(path, &read_whole(path)?, options)
}

/// The bytes behind a path, which may be a pipe: so they are read once, whatever they turn out to be.
///
/// # Errors
/// When they cannot be read.
pub fn read_whole(path: &Path) -> Result<Vec<u8>, MeshIoError> {
    crate::input::read(path).map_err(|source| at(path, MeshFault::Unreadable { source }))
}

/// As [`load`], of bytes that were read from `path` before.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Loaded, MeshIoError> {
    let raw = read_named(path, bytes)?;
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
    let mut raw = read_file(path)?;
    raw.cut_out(AlphaUse::Opaque);
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
    read_named(path, &read_whole(path)?)
}

/// Reads a file's content by its name.
fn read_named(path: &Path, bytes: &[u8]) -> Result<RawMesh, MeshIoError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let folder = path.parent().unwrap_or(Path::new(""));
    read_bytes(bytes, extension.as_deref().unwrap_or_default(), folder)
        .map_err(|fault| at(path, fault))
}

/// Reads a file's content; `extension` is in lower case, `folder` is where further files lie that it names.
fn read_bytes(bytes: &[u8], extension: &str, folder: &Path) -> Result<RawMesh, MeshFault> {
    if bytes.is_empty() {
        return Err(MeshFault::Empty);
    }
    let named = match extension {
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        "off" => Some(Format::Off),
        "gltf" => Some(Format::Gltf),
        "glb" => Some(Format::Glb),
        _ => None,
    };
    let is_stl = named == Some(Format::Stl) && stl::has_binary_length(bytes);
    if let Some(foreign) = content::foreign(bytes).filter(|_| !is_stl) {
        return Err(MeshFault::Foreign {
            what: foreign.what,
            way_out: foreign.way_out,
        });
    }
    let found = match named {
        Some(named) => content::contradicts(bytes, named),
        None => content::sniff(bytes),
    };
    let mut raw = match found.or(named) {
        Some(Format::Obj) => obj::read(bytes, folder),
        Some(Format::Ply) => ply::read(bytes, folder),
        Some(Format::Stl) => stl::read(bytes),
        Some(Format::Off) => off::read(bytes),
        Some(format @ (Format::Gltf | Format::Glb)) => {
            let is_binary = format == Format::Glb || bytes.starts_with(b"glTF");
            let mut raw = gltf::read(bytes, is_binary, folder)?;
            raw.is_single = true;
            Ok(raw)
        }
        None => Err(MeshFault::UnknownFormat {
            known: KNOWN_INPUTS,
        }),
    }?;
    if let (Some(found), Some(named)) = (found, named) {
        raw.ignore(format!(
            "called {}, but its content is {}: read as that",
            named.name(),
            found.name()
        ));
    }
    Ok(raw)
}

impl Format {
    fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf | Self::Glb => "glTF",
        }
    }
}

/// Whether a file is, by its name or its first bytes, a mesh in a format that no asset is in.
#[must_use]
pub fn is_plain_mesh(path: &Path, bytes: &[u8]) -> bool {
    const NAMES: [&str; 5] = ["obj", "ply", "stl", "off", "gltf"];
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_named = (extension.as_deref()).is_some_and(|e| NAMES.contains(&e));
    let sniffed = content::sniff(bytes);
    sniffed != Some(Format::Glb) && (is_named || sniffed.is_some())
}

/// Sizes that single precision holds with all that is made of it, model units: the asset and the device count in that.
const SIZES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

fn check_size(mesh: &TriangleMesh) -> Result<(), MeshFault> {
    let places = || {
        mesh.faces
            .iter()
            .flatten()
            .map(|&v| mesh.positions[v as usize])
    };
    let low = places().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let high = places().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    // Halves, as the difference may be too large to be a number.
    let half = (0.5 * high - 0.5 * low).max_element();
    let size = 2.0 * half;
    if half > 0.0 && !SIZES.contains(&size) {
        return Err(MeshFault::Size {
            size,
            least: *SIZES.start(),
            most: *SIZES.end(),
        });
    }
    Ok(())
}

/// Welds, mends and checks.
fn close(
    mut raw: RawMesh,
    options: &LoadOptions,
) -> Result<(ClosedMesh, Vec<MeshWarning>), MeshFault> {
    raw.cut_out(options.alpha);
    let rounding = seams::rounding_distance(&raw);
    let Welded {
        mut mesh,
        mut vertex_of,
        mut face_of,
        dropped,
    } = weld(&raw);
    // What faces are once their vertices are merged, as long as none is lost.
    let welded_faces = if dropped == 0 {
        mesh.faces.clone()
    } else {
        Vec::new()
    };
    let first_number = raw.first_number;
    let mut warnings = std::mem::take(&mut raw.warnings);
    if mesh.faces.is_empty() {
        return Err(match dropped {
            0 => MeshFault::NoFaces,
            faces => MeshFault::NoArea { faces },
        });
    }
    check_size(&mesh)?;
    let mut repaired = |what: String| warnings.push(MeshWarning::Repaired { what });
    if dropped > 0 {
        repaired(format!(
            "{} with corners at the same place: left out",
            counted(dropped, "face")
        ));
    }
    let distance = options.weld.unwrap_or(0.0).max(rounding);
    let joined = seams::join(&mut mesh, &mut vertex_of, &mut face_of, distance);
    if joined.vertices > 0 {
        let lost = match joined.faces {
            0 => String::new(),
            faces => format!(", by which {} vanished", counted(faces, "face")),
        };
        repaired(format!(
            "{} of open edges joined to others at most {:.1e} away{lost}",
            counted(joined.vertices, "vertex"),
            joined.widest
        ));
        if mesh.faces.is_empty() {
            return Err(MeshFault::NoArea {
                faces: joined.faces,
            });
        }
    }
    let moved = diagonals::separate_diagonals(&mut mesh, &mut face_of, &mut vertex_of);
    if moved != diagonals::MovedDiagonals::default() {
        repaired(format!(
            "{} of polygons moved off edges that were there already",
            counted(moved.turned + moved.split, "diagonal")
        ));
    }
    // Numbers of the file are compared with each other before this, and never after.
    let (origin, coarse) = origin::localise(&mut mesh)?;
    warnings.extend(coarse);
    if options.repair {
        let report = repair::repair(&mut mesh)?;
        vertex_of = through(&report.vertex_of, &vertex_of);
        face_of = through(&report.face_of, &face_of);
        warnings.extend(report.changes().map(|what| MeshWarning::Repaired { what }));
    }
    if options.close_holes {
        let first_fill = mesh.faces.len();
        let report = holes::close_holes(&mut mesh);
        vertex_of = through(&report.vertex_of, &vertex_of);
        warnings.extend(report.changes().map(|what| MeshWarning::Repaired { what }));
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
        warnings.push(MeshWarning::Repaired { what });
    }
    let vertex_count = mesh.positions.len();
    vertex_of = through(&mesh.drop_unused_vertices(), &vertex_of);
    let unused = vertex_count - vertex_of.len();
    if unused > 0 {
        let what = format!("{} used by no face: left out", counted(unused, "vertex"));
        warnings.push(MeshWarning::Ignored { what });
    }
    let defects = match ClosedMesh::try_from(mesh) {
        Ok(mesh) => return Ok((mesh.with_origin(origin), warnings)),
        Err(defects) => defects,
    };
    if let Some((mesh, copies)) = close_without_copies(&raw.mesh, &welded_faces, origin) {
        let what = format!(
            "{} on the same vertices as others: removed",
            counted(copies, "face")
        );
        warnings.push(MeshWarning::Repaired { what });
        return Ok((mesh, warnings));
    }
    let wider = (defects.is_open())
        .then(|| seams::wider_distance(&weld(&raw).mesh, distance))
        .flatten();
    if let Some(mesh) = close_unwelded(raw.mesh, origin) {
        let what = "sheets touch where the file keeps vertices apart: its vertices were not merged";
        warnings.push(MeshWarning::Ignored {
            what: what.to_owned(),
        });
        return Ok((mesh.with_origin(origin), warnings));
    }
    Err(MeshFault::NotClosed {
        hint: hint(&defects, options, wider),
        defects: defects.renumber(&vertex_of, &face_of, first_number),
    })
}

/// The mesh with the vertices the file distinguishes and without bodies given again, if that is closed already; and how many
/// faces were given again. `welded` are its faces by merged vertices.
fn close_without_copies(
    mesh: &TriangleMesh,
    welded: &[[u32; 3]],
    origin: DVec3,
) -> Option<(ClosedMesh, usize)> {
    if welded.len() != mesh.faces.len() {
        return None;
    }
    let is_copy = repair::find_copies(welded);
    let count = is_copy.iter().filter(|&&is_copy| is_copy).count();
    if count == 0 {
        return None;
    }
    let mut mesh = mesh.clone();
    mesh.retain_faces(|f| !is_copy[f]);
    close_unwelded(mesh, origin).map(|mesh| (mesh, count))
}

/// The mesh with the vertices the file distinguishes, if that is closed already.
fn close_unwelded(mut mesh: TriangleMesh, origin: DVec3) -> Option<ClosedMesh> {
    origin::tell_about(&mut mesh, origin);
    repair::turn_outward(&mut mesh);
    ClosedMesh::try_from(mesh).ok()
}

/// The numbers `names` of things that `of` picks out.
fn through(of: &[u32], names: &[u32]) -> Vec<u32> {
    of.iter().map(|&i| names[i as usize]).collect()
}

/// Which options would help; `wider` is a distance at which open edges could be joined.
fn hint(defects: &MeshDefects, options: &LoadOptions, wider: Option<f64>) -> String {
    let mut helpful = Vec::new();
    if defects.is_repairable() && !options.repair {
        helpful.push("--repair".to_owned());
    }
    if let Some(distance) = wider {
        // Filling would leave slivers where edges should meet.
        helpful.push(format!("--weld {distance:e}"));
    } else if defects.is_open() && !options.close_holes {
        helpful.push("--close-holes".to_owned());
    }
    if helpful.is_empty() {
        return String::new();
    }
    format!(" ({} may help)", helpful.join(" and "))
}
