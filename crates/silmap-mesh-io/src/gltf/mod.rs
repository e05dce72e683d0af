//! glTF 2.0 and binary glTF.
//!
//! The JSON goes through serde into [`document`], which checks nothing; buffers, accessors and indices are read with every
//! range checked. All triangles of the scene are taken in its rest pose, moved by their nodes, instances, skins and default
//! morph weights, with base colour, its texture, and vertex colours. [`extensions`] says what becomes of extensions.

mod accessor;
mod alpha;
mod attribute;
mod buffers;
mod container;
mod document;
mod draco;
mod extensions;
mod material;
mod meshopt;
mod primitive;
mod scene;
mod skin;
#[cfg(test)]
mod tests;

use std::path::Path;

use self::buffers::Buffers;
use self::document::{Document, Preamble};
use self::material::Materials;
use self::scene::Scene;
use super::error::{GltfFault, MeshFault, excerpt};
use super::raw::RawMesh;

/// Reads a `.gltf` or `.glb` file; `folder` is where its buffers and images lie.
pub(super) fn read(bytes: &[u8], is_binary: bool, folder: &Path) -> Result<RawMesh, MeshFault> {
    let (json, blob) = if is_binary {
        container::split_chunks(bytes).map_err(MeshFault::Gltf)?
    } else {
        (bytes, None)
    };
    let part = if is_binary { "chunk " } else { "" };
    let document = parse(json, part).map_err(MeshFault::Gltf)?;
    let mut raw = RawMesh::counting_from(0);
    extensions::check(&document, &mut raw).map_err(MeshFault::Gltf)?;
    if !document.animations.is_empty() {
        raw.ignore("animations were left out: the model is taken as the file poses it".to_owned());
    }
    let buffers = Buffers::load(&document, blob, folder).map_err(MeshFault::Gltf)?;
    let scene = Scene::new(&document, buffers, folder).map_err(MeshFault::Gltf)?;
    let mut materials = Materials::new(document.materials.len());
    for shown in scene.shown(&mut raw)? {
        primitive::read_mesh(&scene, &shown, &mut materials, &mut raw)?;
    }
    if raw.mesh.faces.is_empty() {
        return Err(MeshFault::Gltf(GltfFault::NoMesh));
    }
    Ok(raw.finish())
}

/// Parses the JSON; files of other versions are reported as such.
fn parse(json: &[u8], part: &'static str) -> Result<Document, GltfFault> {
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let fault = |error: serde_json::Error| GltfFault::Json {
        part,
        reason: error.to_string(),
    };
    let preamble: Preamble = serde_json::from_slice(json).map_err(fault)?;
    let asset = preamble.asset.unwrap_or_default();
    for version in [Some(&asset.version), asset.min_version.as_ref()] {
        let Some(version) = version.filter(|v| !v.is_empty()) else {
            continue;
        };
        if version.split('.').next() != Some("2") {
            let version = excerpt(version);
            return Err(GltfFault::OtherVersion { version });
        }
    }
    serde_json::from_slice(json).map_err(fault)
}
