//! A map's views, contours and polytope as binary parts, coded as the version of the file has them.

use std::borrow::Cow;

use super::document::{FORMAT_VERSION, ONE_PART_VERSION};
use super::rounding::MapHeader;
use super::{AssetError, contours, levels, silhouettes};
use crate::SilhouetteMap;

/// The binary parts of a map.
#[derive(Debug)]
pub(super) struct MapBytes<'a> {
    /// The version of files that have them so.
    pub(super) version: u32,
    pub(super) silhouettes: Cow<'a, [u8]>,
    /// Levels of detail, where they are beside the silhouettes.
    pub(super) levels: Option<Cow<'a, [u8]>>,
}

/// The version that a map needs: one that older programs read, where all contours are of one part.
fn version_of(map: &SilhouetteMap) -> u32 {
    if map.part_count() > 1 {
        FORMAT_VERSION
    } else {
        ONE_PART_VERSION
    }
}

/// The fraction of the bounding radius that depths of a map are rounded to, so that each moves by at most half of it: 1/4096 where all
/// contours are of one part, else by the side of captures, from 1/1024 at 512 pixels or fewer to 1/4096 at more than 1024.
#[must_use]
pub fn depth_steps_per_radius(map: &SilhouetteMap) -> f64 {
    let bits = if version_of(map) > ONE_PART_VERSION {
        contours::depth_bits(map.resolution_px)
    } else {
        silhouettes::DEPTH_BITS
    };
    f64::from(1_u32 << bits)
}

pub(super) fn encode(map: &SilhouetteMap) -> Result<MapBytes<'static>, AssetError> {
    let version = version_of(map);
    if version > ONE_PART_VERSION {
        return Ok(MapBytes {
            version,
            silhouettes: contours::encode(map)?.into(),
            levels: None,
        });
    }
    Ok(MapBytes {
        version,
        silhouettes: silhouettes::encode(map)?.into(),
        levels: levels::encode(map)?.map(Cow::from),
    })
}

impl MapBytes<'_> {
    pub(super) fn decode(&self, header: &MapHeader) -> Result<SilhouetteMap, AssetError> {
        if self.version > ONE_PART_VERSION {
            return contours::decode(header, &self.silhouettes);
        }
        let mut map = silhouettes::decode(header, &self.silhouettes)?;
        if let Some(bytes) = &self.levels {
            levels::decode(bytes, &mut map)?;
        }
        Ok(map)
    }
}
