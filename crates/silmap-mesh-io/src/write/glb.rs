//! Meshes as binary glTF: the JSON and the data of a plain mesh, and both as one file.

use glam::DVec3;
use serde_json::{Value, json};
use silmap_geometry::TriangleMesh;

use super::{single, vertex_colours};
use crate::error::MeshFault;

pub(crate) const FLOAT: u32 = 5126;
pub(crate) const UNSIGNED_INT: u32 = 5125;
pub(crate) const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The file of a plain mesh.
pub(super) fn encode(mesh: &TriangleMesh, origin: DVec3) -> Result<Vec<u8>, MeshFault> {
    let (json, data) = parts(mesh, origin);
    assemble(&json, data)
}

/// The JSON and the data of one mesh: positions, normals, colours where there are some, indices, and a plain material.
pub(crate) fn parts(mesh: &TriangleMesh, origin: DVec3) -> (Value, Vec<u8>) {
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|&p| single(p)).collect();
    // Every normal has to be of unit length, also where there is no face.
    let normals: Vec<[f32; 3]> = mesh
        .vertex_normals()
        .iter()
        .map(|&n| single(if n == DVec3::ZERO { DVec3::Z } else { n }))
        .collect();
    let mut data: Vec<u8> = bytemuck::cast_slice(&positions).to_vec();
    data.extend_from_slice(bytemuck::cast_slice(&normals));
    data.extend_from_slice(bytemuck::cast_slice(&mesh.faces));
    let index_end = data.len();
    // Last, so that nothing else depends on whether there are any.
    let colours = vertex_colours(mesh);
    let colour_bytes = colours.as_deref().map_or(&[][..], bytemuck::cast_slice);
    data.extend_from_slice(colour_bytes);
    let (vertex_count, face_count) = (mesh.positions.len(), mesh.faces.len());
    let ends = |pick: fn(f32, f32) -> f32| {
        let first = positions.first().copied().unwrap_or_default();
        positions
            .iter()
            .fold(first, |m, p| [0, 1, 2].map(|k| pick(m[k], p[k])))
    };
    let vertex_bytes = vertex_count * 12;
    let mut json = json!({
        "asset": {"version": "2.0", "generator": "silmap"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0
        }]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0}}],
        "buffers": [{"byteLength": data.len()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": vertex_bytes, "target": VERTICES},
            {"buffer": 0, "byteOffset": vertex_bytes, "byteLength": vertex_bytes, "target": VERTICES},
            {"buffer": 0, "byteOffset": 2 * vertex_bytes, "byteLength": face_count * 12, "target": INDICES},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": vertex_count, "type": "VEC3",
             "min": ends(f32::min), "max": ends(f32::max)},
            {"bufferView": 1, "componentType": FLOAT, "count": vertex_count, "type": "VEC3"},
            {"bufferView": 2, "componentType": UNSIGNED_INT, "count": face_count * 3, "type": "SCALAR"},
        ],
    });
    if origin != DVec3::ZERO {
        json["nodes"][0]["translation"] = json!(origin.to_array());
    }
    if colours.is_some() {
        json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(3);
        push(
            &mut json["bufferViews"],
            json!({"buffer": 0, "byteOffset": index_end, "byteLength": vertex_bytes, "target": VERTICES}),
        );
        push(
            &mut json["accessors"],
            json!({"bufferView": 3, "componentType": FLOAT, "count": vertex_count, "type": "VEC3"}),
        );
    }
    (json, data)
}

/// Adds to a list, which begins where there is none; gives the item's place.
pub(crate) fn push(list: &mut Value, item: Value) -> usize {
    if !list.is_array() {
        *list = json!([]);
    }
    let Some(items) = list.as_array_mut() else {
        return 0;
    };
    items.push(item);
    items.len() - 1
}

/// Adds bytes to the data, with a view of them; gives the view's place.
pub(crate) fn push_view(
    json: &mut Value,
    data: &mut Vec<u8>,
    bytes: &[u8],
    target: Option<u32>,
) -> usize {
    data.resize(data.len().next_multiple_of(4), 0);
    let mut view = json!({"buffer": 0, "byteOffset": data.len(), "byteLength": bytes.len()});
    if let Some(target) = target {
        view["target"] = json!(target);
    }
    data.extend_from_slice(bytes);
    push(&mut json["bufferViews"], view)
}

/// The file that holds both.
///
/// # Errors
/// When it would be larger than the format allows.
pub(crate) fn assemble(json: &Value, mut data: Vec<u8>) -> Result<Vec<u8>, MeshFault> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| MeshFault::Unwritable {
            source: std::io::Error::other("a binary glTF file holds at most 4 GiB"),
        })
    };
    let total = length(12 + 8 + json.len() + 8 + data.len())?;
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(total.to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        bytes.extend(length(chunk.len())?.to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    Ok(bytes)
}
