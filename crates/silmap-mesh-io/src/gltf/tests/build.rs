//! Makes small binary glTF files: a unit cube about the origin, dressed up as each test needs it.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::MeshFault;
use crate::raw::RawMesh;

pub(super) const FLOAT: u32 = 5126;

/// A document under construction: JSON, and one buffer.
#[derive(Clone)]
pub(super) struct Builder {
    pub(super) json: Value,
    pub(super) data: Vec<u8>,
}

/// The corners of the cube, and its sides as quadrilaterals.
pub(super) fn corner(i: usize) -> [f32; 3] {
    [i >> 2, i >> 1, i].map(|bit| (bit & 1) as f32 - 0.5)
}

pub(super) const SIDES: [[usize; 4]; 6] = [
    [0, 1, 3, 2],
    [4, 6, 7, 5],
    [0, 4, 5, 1],
    [2, 3, 7, 6],
    [0, 2, 6, 4],
    [1, 5, 7, 3],
];

pub(super) fn corners() -> Vec<f32> {
    (0..8).flat_map(corner).collect()
}

pub(super) fn cube_indices() -> Vec<u16> {
    let triangles = SIDES.map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]].map(|i| i as u16));
    triangles.into_iter().flatten().collect()
}

pub(super) fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

pub(super) fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

impl Builder {
    /// A document without anything in its one scene but node 0.
    pub(super) fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "bufferViews": [], "accessors": [],
        });
        Self {
            json,
            data: Vec::new(),
        }
    }

    /// Adds bytes as a buffer view, with what else is to be said of it.
    pub(super) fn view(&mut self, bytes: &[u8], more: Value) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let mut view =
            json!({"buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len()});
        merge(&mut view, more);
        self.data.extend(bytes);
        self.push("bufferViews", view)
    }

    /// Adds an accessor over bytes of its own.
    pub(super) fn accessor(
        &mut self,
        bytes: &[u8],
        (element, component, count): (&str, u32, usize),
        more: Value,
    ) -> usize {
        let view = self.view(bytes, json!({}));
        let mut accessor = json!({"bufferView": view, "type": element, "componentType": component, "count": count});
        merge(&mut accessor, more);
        self.push("accessors", accessor)
    }

    pub(super) fn floats(&mut self, element: &str, values: &[f32]) -> usize {
        let width = ["SCALAR", "VEC2", "VEC3", "VEC4"]
            .iter()
            .position(|&e| e == element)
            .map_or(16, |k| k + 1);
        let shape = (element, FLOAT, values.len() / width);
        self.accessor(&floats(values), shape, json!({}))
    }

    pub(super) fn indices(&mut self, indices: &[u16]) -> usize {
        let shape = ("SCALAR", 5123, indices.len());
        self.accessor(&shorts(indices), shape, json!({}))
    }

    /// Appends to one of the document's lists.
    pub(super) fn push(&mut self, list: &str, element: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(element);
        list.len() - 1
    }

    /// Adds a mesh of one primitive.
    pub(super) fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        let mut data = self.data.clone();
        data.resize(data.len().next_multiple_of(4), 0);
        if document["buffers"].is_null() && !data.is_empty() {
            document["buffers"] = json!([{"byteLength": data.len()}]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + data.len();
        let mut bytes = b"glTF".to_vec();
        for word in [2, length as u32, text.len() as u32, 0x4E4F_534A] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(text);
        for word in [data.len() as u32, 0x004E_4942] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(data);
        bytes
    }

    pub(super) fn read(&self) -> Result<RawMesh, MeshFault> {
        super::super::read(&self.glb(), true, Path::new("no such folder"))
    }

    /// What comes out, with its volume and its warnings.
    pub(super) fn shape(&self) -> (RawMesh, f64, Vec<String>) {
        let raw = self.read().unwrap();
        let volume = raw.mesh.volume();
        let warnings = raw.warnings.iter().map(ToString::to_string).collect();
        (raw, volume, warnings)
    }

    /// The one sentence that refuses it.
    pub(super) fn refusal(&self) -> String {
        self.read().unwrap_err().to_string()
    }
}

/// The unit cube about the origin, with shared corners.
pub(super) fn cube() -> Builder {
    let mut builder = Builder::new();
    let positions = builder.floats("VEC3", &corners());
    let indices = builder.indices(&cube_indices());
    builder.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    builder
}

/// Four colours as a picture of 16 × 16 pixels: red and green above blue and yellow.
pub(super) fn quarters() -> image::RgbaImage {
    image::RgbaImage::from_fn(16, 16, |x, y| {
        image::Rgba(match (x < 8, y < 8) {
            (true, true) => [255, 0, 0, 255],
            (false, true) => [0, 255, 0, 255],
            (true, false) => [0, 0, 255, 255],
            (false, false) => [255, 255, 0, 255],
        })
    })
}

pub(super) fn encoded(picture: &image::RgbaImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// The cube with corners of its own for each side and a texture; seen from +z the picture stands upright on that side.
pub(super) fn textured(uv: impl Fn(f32, f32) -> [f32; 2], picture: &image::RgbaImage) -> Builder {
    let mut builder = Builder::new();
    let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for side in SIDES {
        let first = (positions.len() / 3) as u16;
        for (i, (u, v)) in side
            .into_iter()
            .zip([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])
        {
            positions.extend(corner(i));
            uvs.extend(uv(u, v));
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
    }
    let positions = builder.floats("VEC3", &positions);
    let uvs = builder.floats("VEC2", &uvs);
    let indices = builder.indices(&indices);
    let png = encoded(picture, image::ImageFormat::Png);
    let view = builder.view(&png, json!({}));
    builder.push(
        "images",
        json!({"bufferView": view, "mimeType": "image/png"}),
    );
    builder.push("textures", json!({"source": 0}));
    builder.push(
        "materials",
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
    );
    builder.mesh(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices, "material": 0}));
    builder
}

fn merge(into: &mut Value, more: Value) {
    if let (Some(into), Value::Object(more)) = (into.as_object_mut(), more) {
        into.extend(more);
    }
}

/// The colours seen from +z on the side there: upper left, upper right, lower left, lower right, as `r`, `g`, `b`, `y`, `w`.
pub(super) fn seen(raw: &RawMesh) -> String {
    let quarter = |x: f64, y: f64| {
        let mesh = &raw.mesh;
        let at = glam::DVec2::new(x, y);
        for face in 0..mesh.faces.len() {
            let [a, b, c] = mesh.corners(face);
            if [a, b, c].iter().any(|p| p.z < 0.49) {
                continue;
            }
            let [a, b, c] = [a, b, c].map(|p| p.truncate());
            let area = (b - a).perp_dot(c - a);
            let weights = [
                (c - b).perp_dot(at - b) / area,
                (a - c).perp_dot(at - c) / area,
                (b - a).perp_dot(at - a) / area,
            ];
            if weights.iter().all(|&w| w >= 0.0) {
                let colour = mesh.appearance.albedo(face, weights.map(|w| w as f32));
                return match colour.map(|c| c > 0.5) {
                    [true, false, false] => 'r',
                    [false, true, false] => 'g',
                    [false, false, true] => 'b',
                    [true, true, false] => 'y',
                    [true, true, true] => 'w',
                    _ => '?',
                };
            }
        }
        '-'
    };
    [(-0.2, 0.2), (0.22, 0.2), (-0.2, -0.22), (0.22, -0.22)]
        .into_iter()
        .map(|(x, y)| quarter(x, y))
        .collect()
}
