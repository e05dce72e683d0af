//! Putting an asset's data back into a plain glTF file that another program made of it.
//!
//! The plain file stays as it is, materials, nodes and all; the extension is added with everything it refers to. Where the file
//! has the same numbers or the same picture already, that is referred to.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use serde_json::{Map, Value, json};
use thiserror::Error;

use super::contents::{Buffers, Data};
use super::document::{
    EXTENSION_NAME, FLOAT, PlainDocument, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, WEBP,
};
use super::nodes::{moved, node_places};
use super::read::Contents;
use super::references::{self, Kind};
use super::same_hull::{HullDifference, HullShape, Triangles};
use super::{AssetError, container, write};

/// Why an asset's data were not put back.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AttachError {
    /// The asset cannot be read.
    #[error("the asset: {0}")]
    Asset(AssetError),
    /// The plain file cannot be read.
    #[error("{0}")]
    Plain(AssetError),
    /// The plain file is an asset that is whole.
    #[error("it has its silhouette map still: nothing is to be put back")]
    Whole,
    /// The plain file's hull is another one.
    #[error("its hull is not the asset's any more: {0}")]
    Changed(HullDifference),
    /// The hull is stored in a way that is not read.
    #[error(
        "its mesh is compressed by {extension}, so that it cannot be compared with the hull: put the data back before it is compressed"
    )]
    Compressed {
        /// The extension that would be needed.
        extension: String,
    },
}

/// What was put back.
#[derive(Clone, Debug, PartialEq)]
pub struct Attached {
    /// The bytes of the `.glb` file.
    pub file: Vec<u8>,
    /// What the plain file calls the mesh that is the hull.
    pub mesh: String,
    /// Bytes that were added, JSON included.
    pub added_bytes: u64,
}

/// Extensions by which vertices are compressed.
const COMPRESSIONS: [&str; 3] = [
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
];

/// Puts the data of `asset` into `plain`, both the bytes of `.glb` files. `scene` are the triangles of the plain file's scene where
/// the caller can read more kinds of files than this.
///
/// # Errors
/// When one of the two cannot be read, the plain file has a whole silhouette map, or its hull is not the asset's within
/// [`SAME_HULL_SHARE`](super::SAME_HULL_SHARE) of its extent.
pub fn attach(
    plain: &[u8],
    asset: &[u8],
    scene: Option<Triangles>,
) -> Result<Attached, AttachError> {
    // Written anew, so that files of earlier versions become of this one.
    let written = super::read(asset).and_then(|asset| write(&asset));
    let written = written.map_err(AttachError::Asset)?;
    let source = Contents::open(&written, &|_| None).map_err(AttachError::Asset)?;
    match super::read(plain) {
        Ok(_) => return Err(AttachError::Whole),
        Err(error @ AssetError::NotGlb { .. }) => return Err(AttachError::Plain(error)),
        Err(_) => {}
    }
    let mut target = Target::open(plain).map_err(AttachError::Plain)?;
    let mesh = find_hull(&target, &written, scene)?;
    target.add(&written, source.data())?;
    let file = target.finish()?;
    Ok(Attached {
        added_bytes: (file.len() as u64).saturating_sub(plain.len() as u64),
        file,
        mesh,
    })
}

/// The name of the mesh that is the hull.
fn find_hull(
    target: &Target<'_>,
    written: &[u8],
    scene: Option<Triangles>,
) -> Result<String, AttachError> {
    let hull = Target::open(written).map_err(AttachError::Asset)?;
    let hull = hull.meshes();
    // In their own coordinates, and in those of the scene.
    let mut shapes: Vec<HullShape> = Vec::new();
    for places in hull
        .iter()
        .flat_map(|m| [Some(&m.own), m.in_scene.as_ref()])
    {
        shapes.extend(places.map(HullShape::new));
    }
    let meshes = target.meshes();
    let mut difference = HullDifference::Nothing;
    let candidates = (meshes.iter())
        .flat_map(|m| [m.in_scene.as_ref(), Some(&m.own)])
        .flatten();
    for candidate in candidates.chain(scene.as_ref()) {
        for shape in &shapes {
            match shape.compare(candidate) {
                Ok(()) => return Ok(candidate.name.clone()),
                Err(found) if rank(&found) > rank(&difference) => difference = found,
                Err(_) => {}
            }
        }
    }
    // What could not be read may well be the hull.
    let compressed = COMPRESSIONS.iter().find(|name| target.uses(name));
    match (compressed, scene) {
        (Some(name), None) => Err(AttachError::Compressed {
            extension: (*name).to_owned(),
        }),
        _ => Err(AttachError::Changed(difference)),
    }
}

/// How far the comparison of a mesh came: of several that differ the one that came farthest is reported.
fn rank(difference: &HullDifference) -> usize {
    match difference {
        HullDifference::Nothing => 0,
        HullDifference::Count { .. } => 1,
        HullDifference::Vertex { .. } => 2,
        HullDifference::Triangle { .. } => 3,
    }
}

/// A primitive of a file, in its mesh's coordinates and, where a node shows it, in those of the scene.
struct PlacedMesh {
    own: Triangles,
    in_scene: Option<Triangles>,
}

/// A file that data are added to.
struct Target<'a> {
    root: Value,
    document: PlainDocument,
    buffers: Buffers<'a>,
    binary: Cow<'a, [u8]>,
}

impl<'a> Target<'a> {
    fn open(file: &'a [u8]) -> Result<Self, AssetError> {
        let chunks = container::split(file)?;
        let bad = |e: serde_json::Error| AssetError::Document {
            reason: e.to_string(),
        };
        let root: Value = serde_json::from_slice(chunks.json).map_err(bad)?;
        let document: PlainDocument = serde_json::from_slice(chunks.json).map_err(bad)?;
        let buffers = Buffers::of(&document, chunks.binary, &|_| None);
        Ok(Self {
            root,
            document,
            buffers,
            binary: Cow::Borrowed(chunks.binary),
        })
    }

    fn data(&self) -> Data<'_> {
        Data {
            document: &self.document,
            buffers: &self.buffers,
        }
    }

    fn uses(&self, extension: &str) -> bool {
        let names = self.root.get("extensionsUsed").and_then(Value::as_array);
        names.is_some_and(|names| names.iter().any(|name| name == extension))
    }

    /// All primitives that are triangles and can be read.
    fn meshes(&self) -> Vec<PlacedMesh> {
        let places = node_places(&self.root);
        let mut found = Vec::new();
        for (m, mesh) in self.document.meshes.iter().enumerate() {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let json = self.root.pointer(&format!("/meshes/{m}"));
                let name = json.and_then(|j| j.get("name")?.as_str());
                let name = name.map_or_else(|| format!("{m}"), str::to_owned);
                let mode = json.and_then(|j| j.pointer(&format!("/primitives/{p}/mode"))?.as_u64());
                let Some(own) = (mode.unwrap_or(TRIANGLES) == TRIANGLES)
                    .then(|| self.triangles(name, primitive))
                    .flatten()
                else {
                    continue;
                };
                let place = places.iter().find(|(mesh, _)| *mesh == m);
                let in_scene = place.map(|(_, place)| moved(&own, place));
                found.push(PlacedMesh { own, in_scene });
            }
        }
        found
    }

    fn triangles(
        &self,
        name: String,
        primitive: &super::document::PlainPrimitive,
    ) -> Option<Triangles> {
        let data = self.data();
        let accessor = *primitive.attributes.get("POSITION")?;
        let positions = self.positions(accessor)?;
        let indices = match primitive.indices {
            Some(index) => data.indices(index).ok()?,
            None => (0..positions.len() as u32).collect(),
        };
        Some(Triangles {
            name,
            positions,
            faces: indices.as_chunks::<3>().0.to_vec(),
        })
    }

    /// Positions as floats or, as KHR_mesh_quantization has them, integers.
    fn positions(&self, accessor: usize) -> Option<Vec<DVec3>> {
        let data = self.data();
        if let Ok(floats) = data.float_rows::<3>(accessor) {
            let double = |p: [f32; 3]| Vec3::from(p).as_dvec3();
            return Some(floats.into_iter().map(double).collect());
        }
        let json = self.root.pointer(&format!("/accessors/{accessor}"))?;
        let is_normalized = json.get("normalized").and_then(Value::as_bool) == Some(true);
        data.integer_rows(accessor, is_normalized).ok()
    }

    /// Adds the extension of a written asset, and what it refers to.
    fn add(&mut self, written: &[u8], source: Data<'_>) -> Result<(), AttachError> {
        let chunks = container::split(written).map_err(AttachError::Asset)?;
        let from: Value = serde_json::from_slice(chunks.json).map_err(|e| {
            AttachError::Asset(AssetError::Document {
                reason: e.to_string(),
            })
        })?;
        let mut extension = from
            .pointer(&format!("/extensions/{EXTENSION_NAME}"))
            .and_then(Value::as_object)
            .cloned()
            .unwrap_or_default();
        self.own_first_buffer();
        let mut has_webp = false;
        references::renumber(&mut extension, &mut |kind, index| {
            let mut bytes = Vec::new();
            source.meaning(kind, index, &mut bytes)?;
            let json = |list: &str| {
                let thing = from.pointer(&format!("/{list}/{index}"));
                thing.cloned().unwrap_or_default()
            };
            Ok(match kind {
                Kind::View => self.push_view(&bytes),
                Kind::Image => {
                    let image = json("images");
                    has_webp |= image["mimeType"] == WEBP;
                    let mime_type = image["mimeType"].as_str().unwrap_or_default();
                    self.find(kind, "images", &bytes)
                        .filter(|&same| self.document.images[same].mime_type == mime_type)
                        .unwrap_or_else(|| self.push("images", image, &bytes))
                }
                Kind::Accessor => self.find(kind, "accessors", &bytes).unwrap_or_else(|| {
                    let mut accessor = json("accessors");
                    accessor["byteOffset"] = 0.into();
                    if accessor["type"] == "SCALAR" {
                        accessor["componentType"] = UNSIGNED_INT.into();
                    }
                    self.push("accessors", accessor, &bytes)
                }),
            })
        })
        .map_err(AttachError::Asset)?;
        object(&mut self.root, "extensions").insert(EXTENSION_NAME.to_owned(), extension.into());
        let used = array(&mut self.root, "extensionsUsed");
        if !used.iter().any(|name| name == EXTENSION_NAME) {
            used.push(EXTENSION_NAME.into());
        }
        if has_webp
            && !used
                .iter()
                .any(|name| name == super::document::WEBP_EXTENSION)
        {
            used.push(super::document::WEBP_EXTENSION.into());
        }
        Ok(())
    }

    /// Something of the plain file that means the same as these bytes.
    fn find(&self, kind: Kind, list: &str, bytes: &[u8]) -> Option<usize> {
        let count = match kind {
            Kind::Accessor => self.document.accessors.len(),
            _ => self.document.images.len(),
        };
        let mut meant = Vec::new();
        (0..count).find(|&index| {
            meant.clear();
            let is_read = self.data().meaning(kind, index, &mut meant).is_ok();
            is_read && meant == bytes && !self.is_compressed(list, index)
        })
    }

    /// Whether another extension says where the bytes are in truth.
    fn is_compressed(&self, list: &str, index: usize) -> bool {
        let thing = self.root.pointer(&format!("/{list}/{index}"));
        let view = thing.and_then(|t| t.get("bufferView")?.as_u64());
        let view = view.and_then(|v| self.root.pointer(&format!("/bufferViews/{v}/extensions")));
        view.is_some()
    }

    /// Makes the first buffer that of the binary chunk.
    fn own_first_buffer(&mut self) {
        let buffers = array(&mut self.root, "buffers");
        let is_own = buffers.first().is_some_and(|b| b.get("uri").is_none());
        if is_own {
            return;
        }
        buffers.insert(0, json!({ "byteLength": 0 }));
        self.binary = Cow::Borrowed(&[]);
        for view in array(&mut self.root, "bufferViews") {
            shift_buffer(view);
        }
    }

    fn push_view(&mut self, bytes: &[u8]) -> usize {
        let binary = self.binary.to_mut();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let view = json!({
            "buffer": 0,
            "byteOffset": binary.len(),
            "byteLength": bytes.len(),
        });
        binary.extend_from_slice(bytes);
        let views = array(&mut self.root, "bufferViews");
        views.push(view);
        views.len() - 1
    }

    /// Adds a thing with its bytes to a list.
    fn push(&mut self, list: &str, mut thing: Value, bytes: &[u8]) -> usize {
        thing["bufferView"] = self.push_view(bytes).into();
        let things = array(&mut self.root, list);
        things.push(thing);
        things.len() - 1
    }

    fn finish(mut self) -> Result<Vec<u8>, AttachError> {
        self.root["buffers"][0]["byteLength"] = self.binary.len().into();
        container::join(&self.root.to_string(), &self.binary).map_err(AttachError::Plain)
    }
}

const TRIANGLES: u64 = 4;

/// Counts buffers on by one, wherever a buffer view names one.
fn shift_buffer(value: &mut Value) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                match value.as_u64() {
                    Some(index) if key == "buffer" => *value = (index + 1).into(),
                    _ => shift_buffer(value),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(shift_buffer),
        _ => {}
    }
}

fn array<'v>(root: &'v mut Value, key: &str) -> &'v mut Vec<Value> {
    if !root.is_object() {
        *root = Value::Object(Map::new());
    }
    let value = &mut root[key];
    if !value.is_array() {
        *value = Value::Array(Vec::new());
    }
    value.as_array_mut().expect("it was made an array")
}

fn object<'v>(root: &'v mut Value, key: &str) -> &'v mut Map<String, Value> {
    let value = &mut root[key];
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
    value.as_object_mut().expect("it was made an object")
}

impl Data<'_> {
    /// Rows of three integers, normalized to at most 1 or not.
    fn integer_rows(self, index: usize, is_normalized: bool) -> Result<Vec<DVec3>, AssetError> {
        const BYTE: u32 = 5120;
        const SHORT: u32 = 5122;
        let component = self.component_type(index)?;
        let (width, largest) = match component {
            BYTE => (1, f64::from(i8::MAX)),
            UNSIGNED_BYTE => (1, f64::from(u8::MAX)),
            SHORT => (2, f64::from(i16::MAX)),
            UNSIGNED_SHORT => (2, f64::from(u16::MAX)),
            FLOAT | UNSIGNED_INT => (4, 1.0),
            _ => {
                return Err(AssetError::Document {
                    reason: format!("accessor {index} does not hold positions"),
                });
            }
        };
        let flat = self.rows(index, "VEC3", width, 3, |bytes| {
            let value = match (component, bytes) {
                (BYTE, &[a]) => f64::from(a.cast_signed()),
                (SHORT, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
                (UNSIGNED_SHORT, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
                (_, &[a, ..]) => f64::from(a),
                _ => 0.0,
            };
            if is_normalized {
                (value / largest).max(-1.0)
            } else {
                value
            }
        })?;
        Ok(flat
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&p| DVec3::from(p))
            .collect())
    }
}
