//! Meshes into files.
//!
//! Positions are written with all their digits in OBJ and OFF, as double precision in PLY, and rounded to single
//! precision in STL and GLB, which hold nothing else. Of a mesh far from the origin a GLB holds the coordinates about a
//! point near it, and the translation of its node that point, which loses nothing; for an STL there is a warning. Vertex
//! colours go along but into STL, in sRGB, as fractions in OBJ and as bytes in PLY and OFF, and linear in GLB; where the
//! corners at a vertex differ, it gets their mean. A file appears whole or not at all.

pub(super) mod glb;

use std::fs;
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_geometry::lighting::srgb_from_linear;

use super::at;
use super::error::{MeshFault, MeshIoError};
use super::origin::rounding;
use crate::warning::MeshWarning;

const KNOWN_OUTPUTS: &str = ".obj, .ply, .off, .stl, .glb";

/// What makes a file's bytes of a mesh.
type Encoder = fn(&TriangleMesh, DVec3) -> Result<Vec<u8>, MeshFault>;

/// Writes a mesh in the format that the file's extension names.
///
/// # Errors
/// When the extension is not one of those written, or the file cannot be written; no file is left then.
pub fn write(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshIoError> {
    let bytes = encode(path, mesh)?;
    write_whole(path, &bytes).map_err(|fault| at(path, fault))
}

/// The bytes of a mesh in the format that the file's extension names.
///
/// # Errors
/// When the extension is not one of those written, or the format cannot hold the mesh.
pub fn encode(path: &Path, mesh: &TriangleMesh) -> Result<Vec<u8>, MeshIoError> {
    encode_about(path, mesh, DVec3::ZERO).map(|(bytes, _)| bytes)
}

/// The same for a mesh in coordinates about `origin`: in the file it stands there. Also says when the format cannot hold that.
///
/// # Errors
/// As [`encode`].
pub fn encode_about(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> Result<(Vec<u8>, Option<MeshWarning>), MeshIoError> {
    let bytes = encoder(path)
        .and_then(|encode| encode(mesh, origin))
        .map_err(|fault| at(path, fault))?;
    let is_rounded = origin != DVec3::ZERO && extension(path).as_deref() == Some("stl");
    let warning = is_rounded.then(|| rounding(mesh, origin)).flatten();
    Ok((bytes, warning))
}

/// Makes sure that the file's extension names a format that is written: before long work, whose end would be too late.
///
/// # Errors
/// When it is not.
pub fn check_output(path: &Path) -> Result<(), MeshIoError> {
    encoder(path).map(drop).map_err(|fault| at(path, fault))
}

/// Whether the format that the file's extension names is written with colours.
#[must_use]
pub fn holds_colours(path: &Path) -> bool {
    let is_stl = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("stl");
    !path.extension().is_some_and(is_stl)
}

fn encoder(path: &Path) -> Result<Encoder, MeshFault> {
    match extension(path).as_deref() {
        Some("obj") => Ok(|mesh, origin| Ok(obj(mesh, origin).into_bytes())),
        Some("off") => Ok(|mesh, origin| Ok(off(mesh, origin).into_bytes())),
        Some("ply") => Ok(|mesh, origin| Ok(ply(mesh, origin))),
        Some("stl") => Ok(stl),
        Some("glb") => Ok(glb::encode),
        _ => Err(MeshFault::UnknownOutput {
            known: KNOWN_OUTPUTS,
        }),
    }
}

/// In lower case.
fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

/// Writes beside the file first, then renames.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), MeshFault> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = fs::File::create(&part)
        .and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&part, path));
    written.map_err(|source| {
        // The half-written part is of no use; if it cannot be removed either, the first error is the one to report.
        let _ = fs::remove_file(&part);
        MeshFault::Unwritable { source }
    })
}

/// Linear colour of every vertex, where the mesh has such; white for vertices that no face uses.
pub(super) fn vertex_colours(mesh: &TriangleMesh) -> Option<Vec<[f32; 3]>> {
    let corner_colours = &mesh.appearance.corner_colours;
    if corner_colours.is_empty() {
        return None;
    }
    let mut sums = vec![([0.0_f64; 3], 0_u32); mesh.positions.len()];
    for (face, colours) in mesh.faces.iter().zip(corner_colours) {
        for (&v, colour) in face.iter().zip(colours) {
            let (sum, count) = &mut sums[v as usize];
            (0..3).for_each(|c| sum[c] += f64::from(colour[c]));
            *count += 1;
        }
    }
    let mean = |(sum, count): ([f64; 3], u32)| match count {
        0 => [1.0; 3],
        _ => sum.map(|s| (s / f64::from(count)) as f32),
    };
    Some(sums.into_iter().map(mean).collect())
}

/// A linear colour as sRGB bytes.
fn srgb_bytes(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|c| (srgb_from_linear(c) * 255.0).round() as u8)
}

/// Positions in the coordinates of the file.
fn placed(mesh: &TriangleMesh, origin: DVec3) -> impl Iterator<Item = DVec3> {
    let is_moved = origin != DVec3::ZERO;
    // Adding zero would turn −0 into 0.
    let place = move |&p: &DVec3| if is_moved { p + origin } else { p };
    mesh.positions.iter().map(place)
}

/// The vertices of an OBJ, with their colours where there are some.
pub(super) fn push_obj_vertices(text: &mut String, mesh: &TriangleMesh, origin: DVec3) {
    let colours = vertex_colours(mesh);
    for (v, p) in placed(mesh, origin).enumerate() {
        text.push_str(&format!("v {} {} {}", p.x, p.y, p.z));
        if let Some(colours) = &colours {
            // More than 1 would mean a scale to 255.
            let [r, g, b] = colours[v].map(|c| srgb_from_linear(c).min(1.0));
            text.push_str(&format!(" {r:.5} {g:.5} {b:.5}"));
        }
        text.push('\n');
    }
}

fn obj(mesh: &TriangleMesh, origin: DVec3) -> String {
    let mut text = String::new();
    push_obj_vertices(&mut text, mesh, origin);
    for [a, b, c] in &mesh.faces {
        text.push_str(&format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    }
    text
}

fn off(mesh: &TriangleMesh, origin: DVec3) -> String {
    let colours = vertex_colours(mesh);
    let keyword = if colours.is_some() { "COFF" } else { "OFF" };
    let mut text = format!(
        "{keyword}\n{} {} 0\n",
        mesh.positions.len(),
        mesh.faces.len()
    );
    for (v, p) in placed(mesh, origin).enumerate() {
        text.push_str(&format!("{} {} {}", p.x, p.y, p.z));
        if let Some(colours) = &colours {
            let [r, g, b] = srgb_bytes(colours[v]);
            text.push_str(&format!(" {r} {g} {b} 255"));
        }
        text.push('\n');
    }
    for [a, b, c] in &mesh.faces {
        text.push_str(&format!("3 {a} {b} {c}\n"));
    }
    text
}

/// What the header of a PLY says of vertex colours.
pub(super) fn ply_colour_properties(colours: Option<&[[f32; 3]]>) -> &'static str {
    match colours {
        Some(_) => "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        None => "",
    }
}

/// The vertices of a binary PLY: positions as doubles, and colours where there are some.
pub(super) fn push_ply_vertices(
    bytes: &mut Vec<u8>,
    mesh: &TriangleMesh,
    origin: DVec3,
    colours: Option<&[[f32; 3]]>,
) {
    for (v, p) in placed(mesh, origin).enumerate() {
        for x in p.to_array() {
            bytes.extend(x.to_le_bytes());
        }
        if let Some(colours) = colours {
            bytes.extend(srgb_bytes(colours[v]));
        }
    }
}

fn ply(mesh: &TriangleMesh, origin: DVec3) -> Vec<u8> {
    let colours = vertex_colours(mesh);
    let colour_properties = ply_colour_properties(colours.as_deref());
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\n{colour_properties}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.faces.len()
    )
    .into_bytes();
    push_ply_vertices(&mut bytes, mesh, origin, colours.as_deref());
    for face in &mesh.faces {
        bytes.push(3);
        for v in face {
            bytes.extend(v.to_le_bytes());
        }
    }
    bytes
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn stl(mesh: &TriangleMesh, origin: DVec3) -> Result<Vec<u8>, MeshFault> {
    let is_moved = origin != DVec3::ZERO;
    let triangles: Vec<stl_io::Triangle> = (0..mesh.faces.len())
        .map(|f| stl_io::Triangle {
            normal: stl_io::Normal::new(single(mesh.face_cross(f).normalize_or_zero())),
            vertices: mesh
                .corners(f)
                .map(|p| stl_io::Vertex::new(single(if is_moved { p + origin } else { p }))),
        })
        .collect();
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, triangles.iter())
        .map_err(|source| MeshFault::Unwritable { source })?;
    Ok(bytes)
}
