//! Meshes into files with all that they look like: texture coordinates, textures and materials too, where the format has a place.
//!
//! | format | vertex colours | texture coordinates | textures and materials |
//! |---|---|---|---|
//! | GLB | yes | yes | in the file |
//! | OBJ | yes | yes | a material library and PNG pictures beside the file |
//! | PLY | yes | of each face's corners | one PNG picture beside the file, without colour factors |
//! | OFF | yes | no | no |
//! | STL | no | no | no |
//!
//! What finds no place is named, for a warning.

mod glb;
mod obj;
mod ply;
#[cfg(test)]
mod tests;

use std::io::Cursor;
use std::path::{Path, PathBuf};

use glam::DVec3;
use image::{ImageFormat, RgbaImage};
use silmap_geometry::{ColourImage, TriangleMesh};

use super::at;
use super::error::{MeshFault, MeshIoError};
use super::write::encode_about;
use crate::warning::MeshWarning;

/// A mesh as files.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintedFiles {
    /// Of the file itself.
    pub bytes: Vec<u8>,
    /// Files that it names, which lie beside it.
    pub beside: Vec<(PathBuf, Vec<u8>)>,
    /// What the format has no place for.
    pub left_out: Vec<&'static str>,
    /// Set when the format cannot hold positions so far from zero.
    pub rounding: Option<MeshWarning>,
}

impl PaintedFiles {
    /// What the user should know about them, as sentences.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let left_out = match &self.left_out[..] {
            [] => None,
            [one] => Some((*one).to_owned()),
            [rest @ .., last] => Some(format!("{} and {last}", rest.join(", "))),
        };
        let left_out = left_out.map(|what| {
            format!("{what} left out: this kind of file has no place for them (.glb has)")
        });
        let rounding = self.rounding.as_ref().map(ToString::to_string);
        left_out.into_iter().chain(rounding)
    }
}

/// The files of a mesh in coordinates about `origin`, in the format that the extension of `path` names: in the files it stands there.
///
/// # Errors
/// As [`super::encode`]; when a material library of another program lies where one is to be written.
pub fn encode_painted(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> Result<PaintedFiles, MeshIoError> {
    let paint = &mesh.appearance;
    let has_uvs = !paint.corner_uvs.is_empty();
    let has_materials = !paint.face_materials.is_empty() && !paint.materials.is_empty();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_painted = has_uvs || has_materials;
    let result = match extension.as_deref() {
        Some("glb") if is_painted => glb::encode(mesh, origin).map(|bytes| PaintedFiles {
            bytes,
            beside: Vec::new(),
            left_out: Vec::new(),
            rounding: None,
        }),
        Some("obj") if is_painted => obj::encode(path, mesh, origin),
        Some("ply") if is_painted => ply::encode(path, mesh, origin),
        other => {
            let mut left_out = Vec::new();
            if other == Some("stl") && !paint.corner_colours.is_empty() {
                left_out.push("vertex colours");
            }
            if has_uvs {
                left_out.push("texture coordinates");
            }
            if has_materials {
                left_out.push("materials");
            }
            let (bytes, rounding) = encode_about(path, mesh, origin)?;
            return Ok(PaintedFiles {
                bytes,
                beside: Vec::new(),
                left_out,
                rounding,
            });
        }
    };
    result
        .map(|mut files| {
            files.left_out.dedup();
            files
        })
        .map_err(|fault| at(path, fault))
}

/// A name beside `path`: its own, with `ending` for the extension.
fn named_after(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// A path's last part as text.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn png(picture: &ColourImage) -> Result<Vec<u8>, MeshFault> {
    let cannot = |source| MeshFault::Unwritable { source };
    let rgba = picture.rgba.clone();
    let image = RgbaImage::from_raw(picture.width, picture.height, rgba).ok_or_else(|| {
        cannot(std::io::Error::other(
            "a texture has fewer pixels than its size says",
        ))
    })?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|e| cannot(std::io::Error::other(e)))?;
    Ok(bytes.into_inner())
}

/// Numbers of equal things, in the order in which they come first; and one of each.
fn numbered<T: Clone, K: Ord>(all: &[T], key: impl Fn(&T) -> K) -> (Vec<u32>, Vec<T>) {
    let mut known = std::collections::BTreeMap::new();
    let mut first = Vec::new();
    let numbers = (all.iter())
        .map(|item| {
            *known.entry(key(item)).or_insert_with(|| {
                first.push(item.clone());
                first.len() as u32 - 1
            })
        })
        .collect();
    (numbers, first)
}

/// Faces in runs of one material; those without one come under the number after the last.
fn by_material(mesh: &TriangleMesh) -> Vec<(usize, Vec<usize>)> {
    let paint = &mesh.appearance;
    let mut groups = vec![Vec::new(); paint.materials.len() + 1];
    for f in 0..mesh.faces.len() {
        let material = paint
            .face_materials
            .get(f)
            .map_or(usize::MAX, |&m| m.into());
        groups[material.min(paint.materials.len())].push(f);
    }
    let groups = groups.into_iter().enumerate();
    groups.filter(|(_, faces)| !faces.is_empty()).collect()
}
