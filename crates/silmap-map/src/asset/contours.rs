//! Views, contours of several parts with depths and levels, and the polytope as bytes: as [`silhouettes`](super::silhouettes), but contours
//! are coded by adaptive bits ([`contour_coder`](super::contour_coder)), and depths are rounded as finely as pixels are.

use glam::DVec3;

use super::arithmetic::{BitReader, BitWriter};
use super::contour_coder::{ContourCoder, Rounded, too_many};
use super::levels::check_coarsest;
use super::packing::{Decoder, Encoder};
use super::rounding::{MapHeader, check_camera};
use super::{AssetError, polytope};
use crate::{CapturedView, SilhouetteMap};

const PART: &str = "silhouettes";

/// Fewest bytes of a view: its eye.
const VIEW_BYTES: usize = 24;

/// Steps of depths in the bounding radius, as powers of two.
const DEPTH_BITS: std::ops::RangeInclusive<u32> = 8..=20;

/// Most contours of a view.
const MOST_CONTOURS: i64 = 1 << 20;

/// Depths of captures of this side are rounded to 2ᵇⁱᵗˢ steps in the bounding radius: a step is at most a quarter of a pixel of them, and
/// seen from a neighbouring view a small part of that.
pub(super) fn depth_bits(resolution_px: u32) -> u32 {
    let fine = u64::from(resolution_px.max(1)) * 2;
    fine.next_power_of_two().ilog2().clamp(10, 12)
}

pub(super) fn encode(map: &SilhouetteMap) -> Result<Vec<u8>, AssetError> {
    let header = MapHeader::of(map);
    header.check()?;
    let bits = depth_bits(map.resolution_px);
    let mut out = Encoder::default();
    out.count(map.views.len());
    for (v, view) in map.views.iter().enumerate() {
        check_camera(&header, v, &view.camera)?;
        for x in view.camera.eye.to_array() {
            out.double(x);
        }
    }
    polytope::encode(&mut out, map)?;
    out.byte(bits as u8);
    let has_levels = map.has_levels();
    out.byte(u8::from(has_levels));
    let mut bytes = out.finish();

    let mut coder = ContourCoder::new(BitWriter::new(), has_levels);
    for (v, view) in map.views.iter().enumerate() {
        coder.begin_view();
        let grid = header.depth_grid(view.camera.eye, bits);
        let count = view.contours.len() as i64;
        if count > MOST_CONTOURS {
            return Err(too_many(
                "contours of a view",
                count as f64,
                MOST_CONTOURS as f64,
            ));
        }
        coder.count(count);
        for (c, contour) in view.contours.iter().enumerate() {
            let rounded = Rounded::of(contour, &grid)?;
            check_coarsest(contour, v, c)?;
            coder.contour(Some(&rounded), v)?;
        }
    }
    bytes.extend(coder.finish());
    Ok(bytes)
}

pub(super) fn decode(header: &MapHeader, bytes: &[u8]) -> Result<SilhouetteMap, AssetError> {
    header.check()?;
    let mut read = Decoder::new(bytes, PART);
    let view_count = read.count(VIEW_BYTES)?;
    let mut views = Vec::with_capacity(view_count);
    for v in 0..view_count {
        let eye = DVec3::new(read.double()?, read.double()?, read.double()?);
        views.push(CapturedView {
            camera: header.camera(v, eye)?,
            contours: Vec::new(),
            photographed: None,
        });
    }
    let triangles = polytope::decode(&mut read, view_count)?;
    let bits = u32::from(read.byte()?);
    if !DEPTH_BITS.contains(&bits) {
        return Err(too_many(
            "number of bits of depths",
            bits.into(),
            (*DEPTH_BITS.end()).into(),
        ));
    }
    let has_levels = read.byte()? != 0;

    let mut coder = ContourCoder::new(BitReader::new(read.rest()), has_levels);
    for (v, view) in views.iter_mut().enumerate() {
        coder.begin_view();
        let grid = header.depth_grid(view.camera.eye, bits);
        let count = coder.count(0);
        if !(0..=MOST_CONTOURS).contains(&count) {
            return Err(AssetError::Truncated { part: PART });
        }
        for c in 0..count as usize {
            let contour = coder.contour(None, v)?.contour(&grid)?;
            check_coarsest(&contour, v, c)?;
            view.contours.push(contour);
        }
    }
    if coder.left() > 0 {
        let bytes = coder.left();
        return Err(AssetError::Trailing { part: PART, bytes });
    }
    Ok(header.map(views, triangles))
}
