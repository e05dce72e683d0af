//! Rounding an asset as its file rounds it.

use super::rounding::MapHeader;
use super::{Asset, AssetError, map_bytes, references, silhouettes};

/// The asset as it comes back from a file: contours, depths and errors rounded.
///
/// # Errors
/// When a number is too large to be stored or a view's camera is not determined by its eye.
pub fn quantise(asset: &Asset) -> Result<Asset, AssetError> {
    let bytes = map_bytes::encode(&asset.map)?;
    let mut map = bytes.decode(&MapHeader::of(&asset.map))?;
    if let Some(shares) = silhouettes::photographed(&asset.map)? {
        silhouettes::set_photographed(&mut map, &shares)?;
    }
    let mut rounded = Asset {
        map,
        record: asset.record.clone(),
        hull: asset.hull.clone(),
        textures: asset.textures.clone(),
        placement: asset.placement,
    };
    let record = &mut rounded.record;
    for (_, share) in record
        .error_curve
        .iter_mut()
        .chain(&mut record.uniform_curve)
    {
        *share = f64::from(*share as f32);
    }
    references::spell_integers(&mut record.params);
    if let Some(order) = &mut record.order {
        order.round();
    }
    Ok(rounded)
}
