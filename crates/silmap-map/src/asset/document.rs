//! The JSON half of the file: the plain glTF document, and the extension's part of it.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use silmap_geometry::CoverageRule;

use super::EncodedImage;
use super::hull_mesh::HullArrays;
use super::placement::PlainNode;

/// Name of the optional glTF extension that holds all but the plain model.
pub const EXTENSION_NAME: &str = "SILMAP_silhouette_map";

/// The version of the extension that this program writes; it reads this one and those before.
pub const FORMAT_VERSION: u32 = 3;

/// The version of files whose contours are all of one part, for programs that know no other.
pub(super) const ONE_PART_VERSION: u32 = 2;

/// The version whose checksum is over the whole file and whose hull is the document's first mesh.
pub(super) const WHOLE_FILE_VERSION: u32 = 1;

/// Name in the mesh's extras, which shows that the file was an asset when the extension is gone.
pub(super) const TRACE: &str = "silmap";

/// Component types and buffer view targets of glTF.
pub(super) const UNSIGNED_BYTE: u32 = 5121;
pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const UNSIGNED_INT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;

/// A type of picture that glTF itself does not know, and the extension that allows it.
pub(super) const WEBP: &str = "image/webp";
pub(super) const WEBP_EXTENSION: &str = "EXT_texture_webp";

/// Says that the light is in the colours already.
const UNLIT_EXTENSION: &str = "KHR_materials_unlit";

/// Sampler numbers of glTF: no mipmaps, because neighbouring tiles of the atlas would run into each other.
const LINEAR: u32 = 9729;
const CLAMP_TO_EDGE: u32 = 33_071;

/// The extension's object at the document's root. Numbers named `…View` are indices of buffer views, `…Accessor` of accessors,
/// `image`, `images` and `normals` of images: see [`references`](super::references).
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Extension {
    pub(super) format_version: u32,
    pub(super) checksum: String,
    /// Bytes of all that the extension refers to; not in files of version 1.
    #[serde(default)]
    pub(super) data_bytes: u64,
    pub(super) model: ModelPart,
    pub(super) build: BuildPart,
    pub(super) map: MapPart,
    pub(super) hull: HullPart,
    pub(super) textures: TexturePart,
}

/// The original.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ModelPart {
    pub(super) name: String,
    pub(super) faces: u64,
    pub(super) vertices: u64,
    pub(super) crc32: u32,
    /// Where the asset's origin lies in the model's coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) origin: Option<[f64; 3]>,
}

/// How the asset was made.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BuildPart {
    pub(super) generator: String,
    pub(super) options: String,
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub(super) params: Value,
    pub(super) captured_views: u32,
    pub(super) error_curve_view: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) uniform_curve_view: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) collapse_order_view: Option<usize>,
}

/// The silhouette map.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MapPart {
    pub(super) center: [f64; 3],
    pub(super) radius: f64,
    pub(super) resolution: u32,
    pub(super) tolerance: f64,
    pub(super) coverage: Coverage,
    pub(super) silhouettes_view: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) levels_view: Option<usize>,
    /// Per view: the share of its outline that a photograph shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) photographed: Option<Vec<f64>>,
}

/// [`CoverageRule`] in the document.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) enum Coverage {
    Center,
    Any,
}

impl From<CoverageRule> for Coverage {
    fn from(rule: CoverageRule) -> Self {
        match rule {
            CoverageRule::Center => Self::Center,
            CoverageRule::Any => Self::Any,
        }
    }
}

impl From<Coverage> for CoverageRule {
    fn from(rule: Coverage) -> Self {
        match rule {
            Coverage::Center => Self::Center,
            Coverage::Any => Self::Any,
        }
    }
}

/// What the glTF mesh does not say about the hull.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct HullPart {
    pub(super) volume_ratio: f64,
    pub(super) vertices_view: usize,
    /// Where the mesh's arrays are; not in files of version 1.
    #[serde(flatten)]
    pub(super) arrays: Option<ArrayPart>,
}

/// The hull's arrays. They are those of the document's mesh, unless another program has changed that.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ArrayPart {
    pub(super) positions_accessor: usize,
    pub(super) indices_accessor: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) uvs_accessor: Option<usize>,
}

/// Texture views and atlas; `images` are indices of glTF images.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TexturePart {
    pub(super) images: Vec<usize>,
    pub(super) cameras_view: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) atlas: Option<AtlasPart>,
    /// How deep the model lies in each picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) depths_view: Option<usize>,
}

/// The atlas.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct AtlasPart {
    pub(super) image: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) normals: Option<usize>,
    pub(super) size: [u32; 2],
}

/// The binary buffer while it grows.
#[derive(Debug, Default)]
pub(super) struct BufferViews {
    pub(super) binary: Vec<u8>,
    views: Vec<Value>,
}

impl BufferViews {
    /// Appends bytes as a buffer view of their own and returns its index.
    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": self.binary.len(),
            "byteLength": bytes.len(),
        }));
        self.binary.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn push_for(&mut self, bytes: &[u8], target: u32) -> usize {
        let index = self.push(bytes);
        self.views[index]["target"] = target.into();
        index
    }
}

/// The plain glTF document while it grows.
#[derive(Debug, Default)]
pub(super) struct Document {
    pub(super) buffers: BufferViews,
    accessors: Vec<Value>,
    images: Vec<Value>,
    primitive: Value,
    atlas_image: Option<usize>,
    normal_image: Option<usize>,
    has_webp: bool,
    /// Where the node puts the mesh; without it the node says nothing.
    pub(super) translation: Option<[f64; 3]>,
}

impl Document {
    pub(super) fn push_image(&mut self, image: &EncodedImage, name: &str) -> usize {
        let view = self.buffers.push(&image.bytes);
        self.has_webp |= image.mime_type == WEBP;
        self.images.push(json!({
            "bufferView": view,
            "mimeType": image.mime_type,
            "name": name,
        }));
        self.images.len() - 1
    }

    fn push_floats<const N: usize>(&mut self, rows: &[[f32; N]], with_range: bool) -> usize {
        let view = self
            .buffers
            .push_for(bytemuck::cast_slice(rows.as_flattened()), ARRAY_BUFFER);
        let mut accessor = json!({
            "bufferView": view,
            "componentType": FLOAT,
            "count": rows.len(),
            "type": format!("VEC{N}"),
        });
        if with_range {
            let extreme = |start: f32, pick: fn(f32, f32) -> f32| {
                let bounds = rows.iter().fold([start; N], |bounds, row| {
                    std::array::from_fn(|k| pick(bounds[k], row[k]))
                });
                Value::from(bounds.map(f64::from).to_vec())
            };
            accessor["min"] = extreme(f32::INFINITY, f32::min);
            accessor["max"] = extreme(f32::NEG_INFINITY, f32::max);
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn push_indices(&mut self, indices: &[u32], vertex_count: usize) -> usize {
        // The largest value of each type is reserved by glTF.
        let (view, component_type) = if vertex_count <= usize::from(u16::MAX) {
            let short: Vec<u16> = indices.iter().map(|&i| i as u16).collect();
            let bytes = bytemuck::cast_slice(&short);
            (
                self.buffers.push_for(bytes, ELEMENT_ARRAY_BUFFER),
                UNSIGNED_SHORT,
            )
        } else {
            let bytes = bytemuck::cast_slice(indices);
            (
                self.buffers.push_for(bytes, ELEMENT_ARRAY_BUFFER),
                UNSIGNED_INT,
            )
        };
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": component_type,
            "count": indices.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// The hull's arrays as the document's one mesh, with these images as its unlit base colour and its normals.
    pub(super) fn set_mesh(&mut self, arrays: &HullArrays, atlas: Option<&AtlasPart>) -> ArrayPart {
        let indices = self.push_indices(&arrays.indices, arrays.positions.len());
        let positions = self.push_floats(&arrays.positions, true);
        let normals = self.push_floats(&arrays.normals, false);
        let mut attributes = json!({ "POSITION": positions, "NORMAL": normals });
        let uvs = (!arrays.uvs.is_empty()).then(|| self.push_floats(&arrays.uvs, false));
        if let Some(uvs) = uvs {
            attributes["TEXCOORD_0"] = uvs.into();
        }
        if !arrays.tangents.is_empty() {
            attributes["TANGENT"] = self.push_floats(&arrays.tangents, false).into();
        }
        self.primitive = json!({
            "attributes": attributes,
            "indices": indices,
            "material": 0,
        });
        self.atlas_image = atlas.map(|a| a.image);
        self.normal_image = atlas.and_then(|a| a.normals);
        ArrayPart {
            positions_accessor: positions,
            indices_accessor: indices,
            uvs_accessor: uvs,
        }
    }

    /// The JSON text of the whole document with a buffer of that many bytes. The extension's checksum is still blank.
    pub(super) fn json(&self, extension: &Extension, buffer_bytes: usize) -> String {
        let mut surface = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        let mut root = json!({
            "asset": { "version": "2.0", "generator": extension.build.generator },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0, "name": extension.model.name }],
            "meshes": [{
                "name": extension.model.name,
                "primitives": [self.primitive],
                // Programs that leave the extension out often keep this.
                "extras": { TRACE: EXTENSION_NAME },
            }],
            "accessors": self.accessors,
            "bufferViews": self.buffers.views,
            "buffers": [{ "byteLength": buffer_bytes }],
            "extensions": { EXTENSION_NAME: extension },
        });
        if let Some(translation) = self.translation {
            root["nodes"][0]["translation"] = json!(translation);
        }
        let mut extensions = vec![EXTENSION_NAME];
        if self.has_webp {
            extensions.push(WEBP_EXTENSION);
        }
        if let Some(image) = self.atlas_image {
            let mut textures = vec![json!({ "source": image, "sampler": 0 })];
            let mut material = json!({ "name": "atlas", "extensions": { UNLIT_EXTENSION: {} } });
            if let Some(normals) = self.normal_image {
                textures.push(json!({ "source": normals, "sampler": 0 }));
                material["normalTexture"] = json!({ "index": 1 });
            }
            root["textures"] = textures.into();
            root["samplers"] = json!([{
                "magFilter": LINEAR,
                "minFilter": LINEAR,
                "wrapS": CLAMP_TO_EDGE,
                "wrapT": CLAMP_TO_EDGE,
            }]);
            surface["baseColorTexture"] = json!({ "index": 0 });
            material["pbrMetallicRoughness"] = surface;
            root["materials"] = json!([material]);
            extensions.push(UNLIT_EXTENSION);
        } else {
            root["materials"] = json!([{ "name": "plain", "pbrMetallicRoughness": surface }]);
        }
        root["extensionsUsed"] = json!(extensions);
        if !self.images.is_empty() {
            root["images"] = json!(self.images);
        }
        root.to_string()
    }
}

/// What is read of a glTF document.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PlainDocument {
    #[serde(default)]
    pub(super) extensions: serde_json::Map<String, Value>,
    #[serde(default)]
    pub(super) asset: PlainAsset,
    #[serde(default)]
    pub(super) nodes: Vec<PlainNode>,
    #[serde(default)]
    pub(super) meshes: Vec<PlainMesh>,
    #[serde(default)]
    pub(super) accessors: Vec<PlainAccessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<PlainBufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<PlainBuffer>,
    #[serde(default)]
    pub(super) images: Vec<PlainImage>,
}

/// The program that wrote the document.
#[derive(Debug, Default, Deserialize)]
pub(super) struct PlainAsset {
    pub(super) generator: Option<String>,
}

/// A mesh, as far as it is read.
#[derive(Debug, Deserialize)]
pub(super) struct PlainMesh {
    #[serde(default)]
    pub(super) primitives: Vec<PlainPrimitive>,
}

/// A primitive, as far as it is read.
#[derive(Debug, Deserialize)]
pub(super) struct PlainPrimitive {
    /// Accessors by attribute.
    #[serde(default)]
    pub(super) attributes: std::collections::BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
}

/// An accessor.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PlainAccessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    #[serde(default)]
    pub(super) sparse: Option<Value>,
}

/// A buffer view.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PlainBufferView {
    #[serde(default)]
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

/// A buffer; without an address it is the file's binary chunk.
#[derive(Debug, Deserialize)]
pub(super) struct PlainBuffer {
    pub(super) uri: Option<String>,
}

/// An image.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PlainImage {
    pub(super) buffer_view: Option<usize>,
    pub(super) uri: Option<String>,
    #[serde(default)]
    pub(super) mime_type: String,
}
