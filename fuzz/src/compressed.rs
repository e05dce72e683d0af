//! glTF files of compressed meshes, which our own writers do not write: a tetrahedron in the encodings of meshopt and Draco.

use anyhow::Context as _;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

const FACES: [u32; 12] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
const POINTS: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];

/// As Draco's own encoder writes it with eight bits a coordinate, its unique number of positions 0.
const BY_DRACO: &str = "RFJBQ08CAgEBAAAABAQAAwAAAS8BARAB/wAAAQAJAwAAAgEBAQADAwEQATADAFCCJJEEAAAAAP8AAAAAAAAAAAAAAAAAAAAAAIA/CA==";

/// A document with one mesh of one primitive; accessor 0 has its positions, accessor 1 its indices.
fn document(primitive: Value, extension: &str, data: &str, length: usize, views: Value) -> Value {
    // Draco keeps everything in one view, to which no accessor refers.
    let has_both = views[1] != Value::Null;
    let of = |view: usize| has_both.then_some(view);
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": [extension], "extensionsRequired": [extension],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": of(0), "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": of(1), "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [
            {"byteLength": length, "uri": format!("data:application/octet-stream;base64,{data}")},
            {"byteLength": 96, "extensions": {extension: {"fallback": true}}},
        ],
    })
}

/// Positions and triangles in views of their own.
pub(crate) fn by_meshopt() -> anyhow::Result<String> {
    const EXTENSION: &str = "EXT_meshopt_compression";
    let points = meshopt::encode_vertex_buffer(&POINTS).context("points can be encoded")?;
    let faces = meshopt::encode_index_buffer(&FACES, 4).context("faces can be encoded")?;
    let view = |offset: usize,
                encoded: &[u8],
                at: usize,
                (count, stride, mode): (u64, u64, &str)| {
        json!({
            "buffer": 1, "byteOffset": offset, "byteLength": count * stride,
            "extensions": {EXTENSION: {
                "buffer": 0, "byteOffset": at, "byteLength": encoded.len(), "count": count, "byteStride": stride, "mode": mode,
            }},
        })
    };
    let views = json!([
        view(0, &points, 0, (4, 12, "ATTRIBUTES")),
        view(48, &faces, points.len(), (12, 4, "TRIANGLES")),
    ]);
    let data = [points, faces].concat();
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": 1});
    let text = STANDARD.encode(&data);
    Ok(document(primitive, EXTENSION, &text, data.len(), views).to_string())
}

/// The whole mesh.
pub(crate) fn by_draco() -> anyhow::Result<String> {
    const EXTENSION: &str = "KHR_draco_mesh_compression";
    let length = STANDARD.decode(BY_DRACO)?.len();
    let views = json!([{"buffer": 0, "byteLength": length}]);
    let primitive = json!({
        "attributes": {"POSITION": 0}, "indices": 1,
        "extensions": {EXTENSION: {"bufferView": 0, "attributes": {"POSITION": 0}}},
    });
    Ok(document(primitive, EXTENSION, BY_DRACO, length, views).to_string())
}
