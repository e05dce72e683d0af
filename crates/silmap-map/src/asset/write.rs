//! From an asset to the bytes of a `.glb`.

use glam::DVec3;

use super::container::{self, CHECKSUM_BLANK};
use super::document::{
    AtlasPart, BuildPart, Document, Extension, HullPart, MapPart, ModelPart, TexturePart,
};
use super::pictures::{check_atlas_picture, check_picture};
use super::{
    Asset, AssetError, hull_mesh, map_bytes, order, paint, read, references, relief, silhouettes,
};

/// The bytes of the `.glb` file that holds `asset`: the same for the same asset, always.
///
/// # Errors
/// When the asset contradicts itself (counts, indices, cameras), has no hull, holds numbers that are not finite or too
/// large, or pictures that are neither PNG nor JPEG nor, for texture views, WebP.
pub fn write(asset: &Asset) -> Result<Vec<u8>, AssetError> {
    let Asset {
        record,
        map,
        hull,
        textures,
        placement,
    } = asset;
    let mut document = Document::default();

    let arrays = hull_mesh::unweld(hull, textures.atlas.as_ref())?;
    let atlas = match &textures.atlas {
        Some(atlas) => {
            check_atlas_picture(&atlas.image)?;
            let image = document.push_image(&atlas.image, "atlas");
            let normals = match &atlas.normals {
                Some(normals) => {
                    check_atlas_picture(normals)?;
                    Some(document.push_image(normals, "atlas normals"))
                }
                None => None,
            };
            Some(AtlasPart {
                image,
                normals,
                size: atlas.size_px,
            })
        }
        None => None,
    };
    let array_part = document.set_mesh(&arrays, atlas.as_ref());
    let mut images = Vec::with_capacity(textures.views.len());
    for (v, view) in textures.views.iter().enumerate() {
        check_picture(&view.image, "of a texture view")?;
        images.push(document.push_image(&view.image, &format!("view {v}")));
    }

    if !hull.volume_ratio.is_finite() {
        return Err(AssetError::OutOfRange {
            what: "volume ratio",
            value: hull.volume_ratio,
            limit: f64::MAX,
        });
    }
    let map_bytes = map_bytes::encode(map)?;
    let buffers = &mut document.buffers;
    let mut extension = Extension {
        format_version: map_bytes.version,
        checksum: CHECKSUM_BLANK.into(),
        data_bytes: 0,
        model: ModelPart {
            name: record.name.clone(),
            faces: record.model_faces,
            vertices: record.model_vertices,
            crc32: record.model_crc32,
            origin: unless_zero(placement.in_model)?,
        },
        build: BuildPart {
            generator: record.generator.clone(),
            options: record.options.clone(),
            params: {
                // As it comes back.
                let mut params = record.params.clone();
                references::spell_integers(&mut params);
                params
            },
            captured_views: record.captured_views,
            error_curve_view: buffers.push(&paint::encode_curve(&record.error_curve)?),
            uniform_curve_view: match record.uniform_curve.as_slice() {
                [] => None,
                curve => Some(buffers.push(&paint::encode_curve(curve)?)),
            },
            collapse_order_view: order::encode(record, map.views.len())?
                .map(|bytes| buffers.push(&bytes)),
        },
        map: MapPart {
            center: map.center.to_array(),
            radius: map.radius,
            resolution: map.resolution_px,
            tolerance: map.tolerance_px,
            coverage: map.coverage.into(),
            silhouettes_view: buffers.push(&map_bytes.silhouettes),
            levels_view: (map_bytes.levels).map(|bytes| buffers.push(&bytes)),
            photographed: silhouettes::photographed(map)?,
        },
        hull: HullPart {
            volume_ratio: hull.volume_ratio,
            vertices_view: buffers.push(&hull_mesh::encode(hull, &arrays)),
            arrays: Some(array_part),
        },
        textures: TexturePart {
            images,
            cameras_view: buffers.push(&paint::encode(textures, hull.faces.len())?),
            atlas,
            depths_view: match &textures.relief {
                Some(depths) => Some(buffers.push(&relief::encode(depths, textures.views.len())?)),
                None => None,
            },
        },
    };
    document.translation = unless_zero(placement.in_scene)?;
    let binary = std::mem::take(&mut document.buffers.binary);
    // The number of digits of `data_bytes` makes no difference to what it counts.
    let draft = container::join(&document.json(&extension, binary.len()), &binary)?;
    (_, extension.data_bytes) = read::checksum_of(&draft)?;
    let mut file = container::join(&document.json(&extension, binary.len()), &binary)?;
    seal(&mut file)?;
    Ok(file)
}

/// Writes the checksum of a file over its placeholder.
pub(super) fn seal(file: &mut [u8]) -> Result<(), AssetError> {
    let (sum, _) = read::checksum_of(file)?;
    container::seal(file, &sum);
    Ok(())
}

/// A place for the document, where there is something to say.
fn unless_zero(place: DVec3) -> Result<Option<[f64; 3]>, AssetError> {
    if let Some(&value) = place.to_array().iter().find(|x| !x.is_finite()) {
        return Err(AssetError::OutOfRange {
            what: "origin coordinate",
            value,
            limit: f64::MAX,
        });
    }
    // A zero of either sign.
    Ok((place != DVec3::ZERO).then_some(place.to_array()))
}
