//! From the bytes of a `.glb` to an asset.
//!
//! Everything is verified: the checksum is compared first, then every count against the bytes that are there and every index
//! against what it points into.

use glam::DVec3;
use serde_json::{Map, Value};

use super::contents::{Beside, Buffers, Data};
use super::document::{
    EXTENSION_NAME, Extension, FORMAT_VERSION, PlainDocument, TRACE, WHOLE_FILE_VERSION,
};
use super::hull_mesh::{self, HullArrays};
use super::map_bytes::MapBytes;
use super::pictures::{check_atlas_picture, check_picture};
use super::references;
use super::rounding::MapHeader;
use super::{
    Asset, AssetError, AssetSizes, Atlas, BuildRecord, EncodedImage, Placement, TextureSet,
    TextureView,
};
use super::{container, order, paint, placement, relief, silhouettes};
use crate::SilhouetteMap;

/// The asset in the bytes of a `.glb` file, or of a `.gltf` file that holds its own data.
///
/// Another program may have rewritten the file: all that counts is that the extension and what it refers to mean the same.
///
/// # Errors
/// When the bytes are not a glTF file, have no silhouette map, come from another version of the format, or are damaged:
/// any changed byte of the asset's own and any cut is noticed.
pub fn read(file: &[u8]) -> Result<Asset, AssetError> {
    read_with(file, &|_| None)
}

/// As [`read`]; `beside` gives the bytes of files that the document names.
///
/// # Errors
/// As [`read`].
pub fn read_with(file: &[u8], beside: Beside<'_>) -> Result<Asset, AssetError> {
    Contents::open(file, beside)?.asset()
}

/// The silhouette map alone, for a program that draws the rest by other means. The checksum is over the rest too.
///
/// # Errors
/// As [`read`].
pub fn read_map(file: &[u8], beside: Beside<'_>) -> Result<SilhouetteMap, AssetError> {
    Contents::open(file, beside)?.map()
}

/// How the bytes of a `.glb` file divide.
///
/// # Errors
/// As [`read`], but without looking into the parts.
pub fn sizes(file: &[u8]) -> Result<AssetSizes, AssetError> {
    sizes_with(file, &|_| None)
}

/// As [`sizes`]; `beside` gives the bytes of files that the document names.
///
/// # Errors
/// As [`sizes`].
pub fn sizes_with(file: &[u8], beside: Beside<'_>) -> Result<AssetSizes, AssetError> {
    let contents = Contents::open(file, beside)?;
    let data = contents.data();
    let Extension {
        map,
        hull,
        textures,
        ..
    } = &contents.extension;
    let levels = data.view_if_there(map.levels_view)?;
    let map = data.view(map.silhouettes_view)?.len() + levels.map_or(0, <[u8]>::len);
    let atlas = textures.atlas.as_ref();
    let atlas = atlas.into_iter().flat_map(|a| [Some(a.image), a.normals]);
    let mut paint = data.view(textures.cameras_view)?.len();
    let depths = data.view_if_there(textures.depths_view)?;
    paint += depths.map_or(0, <[u8]>::len);
    for &image in textures
        .images
        .iter()
        .chain(atlas.flatten().collect::<Vec<_>>().iter())
    {
        paint += data.image(image)?.bytes.len();
    }
    let arrays = contents.arrays()?;
    let numbers = arrays.positions.len() * 3 + arrays.uvs.len() * 2 + arrays.indices.len();
    let hull = data.view(hull.vertices_view)?.len() + 4 * numbers;
    Ok(AssetSizes {
        map: map as u64,
        hull: hull as u64,
        textures: paint as u64,
        total: file.len() as u64,
        format_version: contents.extension.format_version,
    })
}

/// The name of the model that an asset was made from, by the JSON text of its file; `None` when there is no silhouette map.
/// Nothing is checked.
#[must_use]
pub fn model_name(json: &[u8]) -> Option<String> {
    let document: Value = serde_json::from_slice(json).ok()?;
    let extension = document.get("extensions")?.get(EXTENSION_NAME)?;
    let name = extension.pointer("/model/name").and_then(Value::as_str);
    Some(name.unwrap_or_default().to_owned())
}

/// A file that is whole, of a version that is known.
pub(super) struct Contents<'a> {
    pub(super) document: PlainDocument,
    pub(super) extension: Extension,
    version: u32,
    buffers: Buffers<'a>,
}

fn bad_document(error: &serde_json::Error) -> AssetError {
    AssetError::Document {
        reason: error.to_string(),
    }
}

/// The JSON text and the binary chunk of a `.glb` file; a `.gltf` file is its own text.
fn split(file: &[u8]) -> Result<container::Chunks<'_>, AssetError> {
    if file.trim_ascii_start().starts_with(b"{") {
        let binary = &[];
        return Ok(container::Chunks { json: file, binary });
    }
    container::split(file)
}

/// Whether a document without the extension was an asset once, as far as its content shows.
fn was_asset(json: &[u8]) -> bool {
    let Ok(document) = serde_json::from_slice::<Value>(json) else {
        return false;
    };
    let lists = ["/meshes", "/nodes", "/scenes"].map(|place| document.pointer(place));
    let mut things = lists
        .into_iter()
        .flatten()
        .filter_map(Value::as_array)
        .flatten();
    let is_named = |place: &str| {
        let names = document.pointer(place).and_then(Value::as_array);
        names.is_some_and(|names| names.iter().any(|name| name == EXTENSION_NAME))
    };
    things.any(|thing| {
        thing
            .pointer("/extras")
            .is_some_and(|e| e.get(TRACE).is_some())
    }) || is_named("/extensionsUsed")
}

/// The checksum that a document's extension should have, and the bytes that it refers to.
fn checksum(data: Data<'_>, extension: &Map<String, Value>) -> Result<(String, u64), AssetError> {
    references::checksum(extension, &mut |kind, index, bytes| {
        data.meaning(kind, index, bytes)
    })
}

/// Compares the checksum with the extension and the bytes that it refers to.
fn check(data: Data<'_>, extension: &Map<String, Value>) -> Result<(), AssetError> {
    let by = data.document.asset.generator.clone();
    let lost = |by: &Option<String>| AssetError::LostData { by: by.clone() };
    let (computed, bytes) = checksum(data, extension).map_err(|_| lost(&by))?;
    if extension.get("dataBytes").and_then(Value::as_u64) != Some(bytes) {
        return Err(lost(&by));
    }
    match extension.get("checksum").and_then(Value::as_str) {
        Some(stored) if stored == computed => Ok(()),
        // A fuzzer is to get past the checksum, to what must hold without it.
        _ if cfg!(fuzzing) => Ok(()),
        stored => Err(AssetError::Damaged {
            stored: stored.unwrap_or("nothing").to_owned(),
            computed,
            by,
        }),
    }
}

/// The checksum of a file whose own is still blank, and the bytes that its extension refers to.
pub(super) fn checksum_of(file: &[u8]) -> Result<(String, u64), AssetError> {
    let chunks = split(file)?;
    let document: PlainDocument =
        serde_json::from_slice(chunks.json).map_err(|e| bad_document(&e))?;
    let buffers = Buffers::of(&document, chunks.binary, &|_| None);
    let data = Data {
        document: &document,
        buffers: &buffers,
    };
    let extension = document.extensions.get(EXTENSION_NAME);
    let extension = extension.and_then(Value::as_object);
    checksum(data, extension.unwrap_or(&Map::new()))
}

impl<'a> Contents<'a> {
    pub(super) fn open(file: &'a [u8], beside: Beside<'_>) -> Result<Self, AssetError> {
        let chunks = split(file)?;
        let mut document: PlainDocument =
            serde_json::from_slice(chunks.json).map_err(|e| bad_document(&e))?;
        let by = &document.asset.generator;
        let Some(mut extension) = document.extensions.remove(EXTENSION_NAME) else {
            return Err(AssetError::NoSilhouetteMap {
                was_asset: was_asset(chunks.json),
                by: by.clone(),
            });
        };
        references::spell_integers(&mut extension);
        let version = extension.get("formatVersion").and_then(Value::as_u64);
        let version = version.and_then(|v| u32::try_from(v).ok());
        let version = match version {
            Some(version @ WHOLE_FILE_VERSION..=FORMAT_VERSION) => version,
            Some(found) => {
                return Err(AssetError::UnknownVersion {
                    found,
                    known: FORMAT_VERSION,
                });
            }
            None => {
                return Err(AssetError::Document {
                    reason: "the silhouette map has no format version".into(),
                });
            }
        };
        let buffers = Buffers::of(&document, chunks.binary, beside);
        if version == WHOLE_FILE_VERSION {
            container::check_seal(file, by.as_deref())?;
        } else {
            let data = Data {
                document: &document,
                buffers: &buffers,
            };
            check(data, extension.as_object().unwrap_or(&Map::new()))?;
        }
        let extension: Extension =
            serde_json::from_value(extension).map_err(|e| bad_document(&e))?;
        if version > WHOLE_FILE_VERSION && extension.hull.arrays.is_none() {
            return Err(AssetError::Document {
                reason: "the silhouette map does not say where its hull is".into(),
            });
        }
        Ok(Self {
            version,
            document,
            extension,
            buffers,
        })
    }

    pub(super) fn data(&self) -> Data<'_> {
        Data {
            document: &self.document,
            buffers: &self.buffers,
        }
    }

    fn map(&self) -> Result<SilhouetteMap, AssetError> {
        let map = &self.extension.map;
        let header = MapHeader {
            center: map.center.into(),
            radius: map.radius,
            resolution_px: map.resolution,
            tolerance_px: map.tolerance,
            coverage: map.coverage.into(),
        };
        let photographed = map.photographed.as_deref();
        let bytes = MapBytes {
            version: self.version,
            silhouettes: self.data().view(map.silhouettes_view)?.into(),
            levels: (self.data().view_if_there(map.levels_view)?).map(Into::into),
        };
        let mut map = bytes.decode(&header)?;
        if let Some(shares) = photographed {
            silhouettes::set_photographed(&mut map, shares)?;
        }
        Ok(map)
    }

    pub(super) fn asset(&self) -> Result<Asset, AssetError> {
        let Extension {
            model,
            build,
            hull: hull_part,
            textures,
            ..
        } = &self.extension;
        let (mut hull, corner_uvs) =
            hull_mesh::weld(self.data().view(hull_part.vertices_view)?, &self.arrays()?)?;
        hull.volume_ratio = hull_part.volume_ratio;

        let (cameras, visible_views) = paint::decode(
            self.data().view(textures.cameras_view)?,
            textures.images.len(),
            hull.faces.len(),
        )?;
        let mut views = Vec::with_capacity(cameras.len());
        for (camera, &image) in cameras.into_iter().zip(&textures.images) {
            let image = self.picture(image, "of a texture view")?;
            views.push(TextureView { camera, image });
        }
        let atlas = match &textures.atlas {
            Some(part) if corner_uvs.len() == hull.faces.len() => Some(Atlas {
                image: self.atlas_picture(part.image)?,
                normals: (part.normals)
                    .map(|image| self.atlas_picture(image))
                    .transpose()?,
                size_px: part.size,
                corner_uvs,
            }),
            Some(_) => {
                return Err(AssetError::Count {
                    what: "faces with texture coordinates",
                    found: corner_uvs.len(),
                    expected: hull.faces.len(),
                });
            }
            None => None,
        };

        let relief = match self.data().view_if_there(textures.depths_view)? {
            Some(bytes) => Some(relief::decode(bytes, views.len())?),
            None => None,
        };

        let map = self.map()?;
        let uniform_curve = match self.data().view_if_there(build.uniform_curve_view)? {
            Some(bytes) => paint::decode_curve(bytes)?,
            None => Vec::new(),
        };
        let order = match self.data().view_if_there(build.collapse_order_view)? {
            Some(bytes) => Some(order::decode(bytes, map.views.len())?),
            None => None,
        };
        let in_model = model.origin.map_or(DVec3::ZERO, DVec3::from);
        Ok(Asset {
            record: BuildRecord {
                name: model.name.clone(),
                model_faces: model.faces,
                model_vertices: model.vertices,
                model_crc32: model.crc32,
                captured_views: build.captured_views,
                error_curve: paint::decode_curve(self.data().view(build.error_curve_view)?)?,
                uniform_curve,
                order,
                generator: build.generator.clone(),
                options: build.options.clone(),
                params: build.params.clone(),
            },
            map,
            hull,
            textures: TextureSet {
                views,
                visible_views,
                atlas,
                relief,
            },
            placement: Placement {
                in_model,
                // Where nodes turn the asset or scale it, it is taken as it was made.
                in_scene: placement::in_scene(&self.document.nodes).unwrap_or(in_model),
            },
        })
    }

    /// The hull's arrays: where the extension says, or in files of version 1 those of the first mesh.
    fn arrays(&self) -> Result<HullArrays, AssetError> {
        let missing = |what: &str| AssetError::Document {
            reason: format!("the first mesh has no {what}"),
        };
        let (positions, uvs, indices) = match &self.extension.hull.arrays {
            Some(part) => (
                part.positions_accessor,
                part.uvs_accessor,
                part.indices_accessor,
            ),
            None => {
                let mesh = self.document.meshes.first();
                let primitive = mesh.and_then(|mesh| mesh.primitives.first());
                let primitive = primitive.ok_or(missing("triangles"))?;
                let attribute = |name: &str| primitive.attributes.get(name).copied();
                (
                    attribute("POSITION").ok_or(missing("positions"))?,
                    attribute("TEXCOORD_0"),
                    primitive.indices.unwrap_or(0),
                )
            }
        };
        let data = self.data();
        let positions = data.float_rows::<3>(positions)?;
        let uvs = match uvs {
            Some(index) => data.float_rows::<2>(index)?,
            None => Vec::new(),
        };
        if !uvs.is_empty() && uvs.len() != positions.len() {
            return Err(AssetError::Count {
                what: "texture coordinates",
                found: uvs.len(),
                expected: positions.len(),
            });
        }
        Ok(HullArrays {
            positions,
            uvs,
            indices: data.indices(indices)?,
            ..HullArrays::default()
        })
    }

    fn atlas_picture(&self, index: usize) -> Result<EncodedImage, AssetError> {
        let picture = self.picture(index, "of the atlas")?;
        check_atlas_picture(&picture)?;
        Ok(picture)
    }

    fn picture(&self, index: usize, what: &'static str) -> Result<EncodedImage, AssetError> {
        let picture = self.data().image(index)?;
        check_picture(&picture, what)?;
        Ok(picture)
    }
}
