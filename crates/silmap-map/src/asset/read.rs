//! From the bytes of a `.glb` to an asset.
//!
//! Nothing is believed: the checksum is compared first, then every count against the bytes that are there and every index
//! against what it points into.

use glam::DVec3;
use serde_json::Value;

use super::document::{
    EXTENSION_NAME, Extension, FLOAT, FORMAT_VERSION, PlainDocument, UNSIGNED_INT, UNSIGNED_SHORT,
};
use super::hull_mesh::{self, HullArrays};
use super::packing::Decoder;
use super::silhouettes::MapHeader;
use super::write::{check_atlas_picture, check_picture};
use super::{
    Asset, AssetError, AssetSizes, Atlas, BuildRecord, EncodedImage, Placement, TextureSet,
    TextureView,
};
use super::{container, levels, order, paint, placement, silhouettes};

/// The asset in the bytes of a `.glb` file.
///
/// # Errors
/// When the bytes are not a glTF file, have no silhouette map, come from another version of the format, or are damaged:
/// any changed byte and any cut is noticed.
pub fn read(file: &[u8]) -> Result<Asset, AssetError> {
    Contents::open(file)?.asset()
}

/// How the bytes of a `.glb` file divide.
///
/// # Errors
/// As [`read`], but without looking into the parts.
pub fn sizes(file: &[u8]) -> Result<AssetSizes, AssetError> {
    let contents = Contents::open(file)?;
    let Extension {
        build,
        map,
        hull,
        textures,
        ..
    } = &contents.extension;
    let levels = contents.view_if_there(map.levels_view)?;
    let map = contents.view(map.silhouettes_view)?.len() + levels.map_or(0, <[u8]>::len);
    let mut record = contents.view(build.error_curve_view)?.len();
    for view in [build.uniform_curve_view, build.collapse_order_view] {
        record += contents.view_if_there(view)?.map_or(0, <[u8]>::len);
    }
    let mut paint = contents.view(textures.cameras_view)?.len();
    for image in &contents.document.images {
        paint += contents.view(image.buffer_view)?.len();
    }
    contents.view(hull.vertices_view)?;
    // All the buffer is one of the four; what is left over are the hull's arrays.
    let hull = contents.binary.len().saturating_sub(map + record + paint);
    Ok(AssetSizes {
        map: map as u64,
        hull: hull as u64,
        textures: paint as u64,
        total: file.len() as u64,
    })
}

/// A file that is whole and of this version.
struct Contents<'a> {
    document: PlainDocument,
    extension: Extension,
    binary: &'a [u8],
}

fn bad_document(error: &serde_json::Error) -> AssetError {
    AssetError::Document {
        reason: error.to_string(),
    }
}

fn no_such(what: &'static str, index: usize, count: usize) -> AssetError {
    AssetError::NoSuch {
        what,
        index: index as u64,
        count,
    }
}

fn get<'b, T>(what: &'static str, items: &'b [T], index: usize) -> Result<&'b T, AssetError> {
    items.get(index).ok_or(no_such(what, index, items.len()))
}

impl<'a> Contents<'a> {
    fn open(file: &'a [u8]) -> Result<Self, AssetError> {
        let chunks = container::split(file)?;
        let mut document: PlainDocument =
            serde_json::from_slice(chunks.json).map_err(|e| bad_document(&e))?;
        let extension = document
            .extensions
            .remove(EXTENSION_NAME)
            .ok_or(AssetError::NoSilhouetteMap)?;
        let version = extension.get("formatVersion").and_then(Value::as_u64);
        let version = version.and_then(|v| u32::try_from(v).ok());
        match version {
            Some(FORMAT_VERSION) => {}
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
        }
        container::check_seal(file)?;
        Ok(Self {
            document,
            extension: serde_json::from_value(extension).map_err(|e| bad_document(&e))?,
            binary: chunks.binary,
        })
    }

    fn asset(&self) -> Result<Asset, AssetError> {
        let Extension {
            model,
            build,
            map,
            hull: hull_part,
            textures,
            ..
        } = &self.extension;
        let (mut hull, corner_uvs) =
            hull_mesh::weld(self.view(hull_part.vertices_view)?, &self.arrays()?)?;
        hull.volume_ratio = hull_part.volume_ratio;

        let (cameras, visible_views) = paint::decode(
            self.view(textures.cameras_view)?,
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

        let header = MapHeader {
            center: map.center.into(),
            radius: map.radius,
            resolution_px: map.resolution,
            tolerance_px: map.tolerance,
            coverage: map.coverage.into(),
        };
        let levels_view = map.levels_view;
        let mut map = silhouettes::decode(&header, self.view(map.silhouettes_view)?)?;
        if let Some(bytes) = self.view_if_there(levels_view)? {
            levels::decode(bytes, &mut map)?;
        }
        let uniform_curve = match self.view_if_there(build.uniform_curve_view)? {
            Some(bytes) => paint::decode_curve(bytes)?,
            None => Vec::new(),
        };
        let order = match self.view_if_there(build.collapse_order_view)? {
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
                error_curve: paint::decode_curve(self.view(build.error_curve_view)?)?,
                uniform_curve,
                order,
                generator: build.generator.clone(),
                options: build.options.clone(),
            },
            map,
            hull,
            textures: TextureSet {
                views,
                visible_views,
                atlas,
            },
            placement: Placement {
                in_model,
                // Where nodes turn the asset or scale it, it is taken as it was made.
                in_scene: placement::in_scene(&self.document).unwrap_or(in_model),
            },
        })
    }

    /// The bytes of a buffer view.
    fn view(&self, index: usize) -> Result<&'a [u8], AssetError> {
        let view = get("buffer view", &self.document.buffer_views, index)?;
        self.binary
            .get(view.byte_offset..)
            .and_then(|rest| rest.get(..view.byte_length))
            .ok_or(AssetError::Truncated {
                part: "buffer views",
            })
    }

    fn view_if_there(&self, index: Option<usize>) -> Result<Option<&'a [u8]>, AssetError> {
        index.map(|index| self.view(index)).transpose()
    }

    /// The bytes of an accessor's elements, and its component type and count.
    fn accessor(&self, index: usize, shape: &str) -> Result<(&'a [u8], u32, usize), AssetError> {
        let accessor = get("accessor", &self.document.accessors, index)?;
        if accessor.shape != shape {
            return Err(AssetError::Document {
                reason: format!("accessor {index} is not a {shape}"),
            });
        }
        let bytes = self
            .view(accessor.buffer_view)?
            .get(accessor.byte_offset..)
            .ok_or(AssetError::Truncated { part: "accessors" })?;
        Ok((bytes, accessor.component_type, accessor.count))
    }

    fn float_rows<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, AssetError> {
        let (bytes, component_type, count) = self.accessor(index, &format!("VEC{N}"))?;
        if component_type != FLOAT {
            return Err(AssetError::Document {
                reason: format!("accessor {index} does not hold floats"),
            });
        }
        let mut read = Decoder::new(bytes, "mesh arrays");
        let count = read.check_room(count as u64, 4 * N)?;
        (0..count)
            .map(|_| {
                let mut row = [0.0; N];
                for x in &mut row {
                    *x = read.single()?;
                }
                Ok(row)
            })
            .collect()
    }

    fn indices(&self, index: usize) -> Result<Vec<u32>, AssetError> {
        let (bytes, component_type, count) = self.accessor(index, "SCALAR")?;
        let width = match component_type {
            UNSIGNED_SHORT => 2,
            UNSIGNED_INT => 4,
            _ => {
                return Err(AssetError::Document {
                    reason: format!("accessor {index} does not hold vertex indices"),
                });
            }
        };
        let mut read = Decoder::new(bytes, "mesh arrays");
        let count = read.check_room(count as u64, width)?;
        // Four bytes at most, so the cast loses nothing.
        (0..count)
            .map(|_| Ok(read.low_bytes(width)? as u32))
            .collect()
    }

    fn arrays(&self) -> Result<HullArrays, AssetError> {
        let mesh = get("mesh", &self.document.meshes, 0)?;
        let primitive = get("primitive", &mesh.primitives, 0)?;
        let positions = self.float_rows::<3>(primitive.attributes.position)?;
        let uvs = match primitive.attributes.texcoord {
            Some(index) => self.float_rows::<2>(index)?,
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
            indices: self.indices(primitive.indices)?,
            ..HullArrays::default()
        })
    }

    fn atlas_picture(&self, index: usize) -> Result<EncodedImage, AssetError> {
        let picture = self.picture(index, "of the atlas")?;
        check_atlas_picture(&picture)?;
        Ok(picture)
    }

    fn picture(&self, index: usize, what: &'static str) -> Result<EncodedImage, AssetError> {
        let image = get("image", &self.document.images, index)?;
        let picture = EncodedImage {
            mime_type: image.mime_type.clone(),
            bytes: self.view(image.buffer_view)?.to_vec(),
        };
        check_picture(&picture, what)?;
        Ok(picture)
    }
}
