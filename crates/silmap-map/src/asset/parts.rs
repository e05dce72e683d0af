//! Which part of the model each contour outlines, next to the silhouettes.
//!
//! After a byte that names the coding, contour by contour: the number of its part less that of the contour before in the view, or less 0 for the
//! first. Contours of a view stand in the order of their parts. Maps of one part have no such bytes.

use super::AssetError;
use super::packing::{Decoder, Encoder};
use crate::SilhouetteMap;

const PART: &str = "parts of contours";

/// The one coding that this program writes and reads.
const CODING: u8 = 1;

/// The bytes for a map; `None` where all contours are of one part.
pub(super) fn encode(map: &SilhouetteMap) -> Result<Option<Vec<u8>>, AssetError> {
    if map.part_count() <= 1 {
        return Ok(None);
    }
    let mut out = Encoder::default();
    out.byte(CODING);
    for (v, view) in map.views.iter().enumerate() {
        let mut last = 0;
        for contour in &view.contours {
            let step = (contour.part.checked_sub(last)).ok_or(AssetError::PartOrder { view: v })?;
            out.unsigned(step.into());
            last = contour.part;
        }
    }
    Ok(Some(out.finish()))
}

/// Gives the contours of `map` their parts.
pub(super) fn decode(bytes: &[u8], map: &mut SilhouetteMap) -> Result<(), AssetError> {
    let mut read = Decoder::new(bytes, PART);
    let found = read.byte()?;
    if found != CODING {
        return Err(AssetError::PartCoding {
            found,
            known: CODING,
        });
    }
    for (v, view) in map.views.iter_mut().enumerate() {
        let mut last = 0_u16;
        for contour in &mut view.contours {
            let step = u16::try_from(read.unsigned()?).ok();
            let part = step.and_then(|step| last.checked_add(step));
            last = part
                .filter(|&part| part < SilhouetteMap::MOST_PARTS)
                .ok_or(AssetError::PartOrder { view: v })?;
            contour.part = last;
        }
    }
    read.finish()
}
