//! The polytope's triangles as bytes.

use super::AssetError;
use super::packing::{Decoder, Encoder};
use crate::SilhouetteMap;

/// Fewest bytes of a triangle.
const TRIANGLE_BYTES: usize = 3;

pub(super) fn encode(out: &mut Encoder, map: &SilhouetteMap) -> Result<(), AssetError> {
    out.count(map.triangles.len());
    for &index in map.triangles.iter().flatten() {
        if index as usize >= map.views.len() {
            return Err(AssetError::NoSuch {
                what: "view",
                index: index.into(),
                count: map.views.len(),
            });
        }
        out.unsigned(index.into());
    }
    Ok(())
}

pub(super) fn decode(
    read: &mut Decoder<'_>,
    view_count: usize,
) -> Result<Vec<[u32; 3]>, AssetError> {
    let triangle_count = read.count(TRIANGLE_BYTES)?;
    let mut triangles = Vec::with_capacity(triangle_count);
    for _ in 0..triangle_count {
        let mut view = || read.index("view", view_count);
        triangles.push([view()?, view()?, view()?]);
    }
    Ok(triangles)
}
