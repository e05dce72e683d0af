//! Views, contours, depths and the polytope as bytes, of maps of one part; those of several have [`contours`](super::contours).
//!
//! A view's camera is not stored: it is the one that fits the bounding sphere from the eye, rebuilt when reading. Contour
//! points are integers in units of 1/16 pixel. When all points of a view are multiples of a larger power of two (as traced
//! pixel corners are), that power is taken out first. Each number is stored as its difference from the one before,
//! continued from contour to contour. Depths are relative to the distance from the eye to the center, in units of
//! 1/4096 of the bounding radius: a thirtieth of a pixel of sideways error at 512 pixels.

use glam::{DVec2, DVec3};

use super::packing::{Decoder, Encoder};
use super::rounding::{Grid, MapHeader, POINT_GRID, POINT_STEPS_PER_PX, check_camera};
use super::{AssetError, polytope};
use crate::{CapturedView, SilhouetteMap, ViewContour};

/// Depths are rounded to 1/4096 of the bounding radius.
pub(super) const DEPTH_BITS: u32 = 12;

const PART: &str = "silhouettes";

/// Fewest bytes of a view (eye, shift, contour count), a contour and a point.
const VIEW_BYTES: usize = 26;
const CONTOUR_BYTES: usize = 1;
const POINT_BYTES: usize = 2;

/// Shares of outlines are rounded to this.
const SHARE_STEPS: f64 = 1000.0;

/// How much of each view's outline a photograph shows; `None` where no view says so.
///
/// # Errors
/// When one is not a share.
pub(super) fn photographed(map: &SilhouetteMap) -> Result<Option<Vec<f64>>, AssetError> {
    if map.views.iter().all(|v| v.photographed.is_none()) {
        return Ok(None);
    }
    let shares = map.views.iter().map(|v| v.photographed.unwrap_or(0.0));
    shares
        .map(checked_share)
        .collect::<Result<_, _>>()
        .map(Some)
}

fn checked_share(value: f64) -> Result<f64, AssetError> {
    match (0.0..=1.0).contains(&value) {
        true => Ok((value * SHARE_STEPS).round() / SHARE_STEPS),
        false => Err(AssetError::OutOfRange {
            what: "photographed share",
            value,
            limit: 1.0,
        }),
    }
}

/// Gives the views of a map their shares.
///
/// # Errors
/// When there is not one for each view, or one is none.
pub(super) fn set_photographed(map: &mut SilhouetteMap, shares: &[f64]) -> Result<(), AssetError> {
    if shares.len() != map.views.len() {
        return Err(AssetError::Count {
            what: "photographed shares",
            found: shares.len(),
            expected: map.views.len(),
        });
    }
    for (view, &share) in map.views.iter_mut().zip(shares) {
        view.photographed = Some(checked_share(share)?);
    }
    Ok(())
}

pub(super) fn encode(map: &SilhouetteMap) -> Result<Vec<u8>, AssetError> {
    let header = MapHeader::of(map);
    header.check()?;
    let mut out = Encoder::default();
    out.count(map.views.len());
    for (v, view) in map.views.iter().enumerate() {
        check_camera(&header, v, &view.camera)?;
        for x in view.camera.eye.to_array() {
            out.double(x);
        }
        encode_contours(
            &mut out,
            &view.contours,
            &header.depth_grid(view.camera.eye, DEPTH_BITS),
        )?;
    }
    polytope::encode(&mut out, map)?;
    Ok(out.finish())
}

fn encode_contours(
    out: &mut Encoder,
    contours: &[ViewContour],
    depth_grid: &Grid,
) -> Result<(), AssetError> {
    let mut points = Vec::new();
    let mut depths = Vec::new();
    for contour in contours {
        for p in &contour.points {
            points.push([POINT_GRID.steps(p.x)?, POINT_GRID.steps(p.y)?]);
        }
        for &depth in &contour.depths {
            depths.push(depth_grid.steps(depth)?);
        }
        if !contour.depths.is_empty() && contour.depths.len() != contour.points.len() {
            return Err(AssetError::Count {
                what: "depths of a contour",
                found: contour.depths.len(),
                expected: contour.points.len(),
            });
        }
    }
    let all_bits = points.iter().flatten().fold(0, |bits, &q| bits | q);
    // Every step of at least a pixel is enough: nothing is traced on a coarser grid.
    let shift = all_bits
        .trailing_zeros()
        .min(POINT_STEPS_PER_PX.log2() as u32);
    out.byte(shift as u8);
    out.count(contours.len());
    let (mut points, mut depths) = (points.into_iter(), depths.into_iter());
    let (mut last_point, mut last_depth) = ([0; 2], 0);
    for contour in contours {
        let has_depth = u64::from(!contour.depths.is_empty());
        out.unsigned((contour.points.len() as u64) << 1 | has_depth);
        for point in points.by_ref().take(contour.points.len()) {
            for (axis, last) in point.into_iter().zip(&mut last_point) {
                out.signed((axis - *last) >> shift);
                *last = axis;
            }
        }
        for depth in depths.by_ref().take(contour.depths.len()) {
            out.signed(depth - last_depth);
            last_depth = depth;
        }
    }
    Ok(())
}

pub(super) fn decode(header: &MapHeader, bytes: &[u8]) -> Result<SilhouetteMap, AssetError> {
    header.check()?;
    let mut read = Decoder::new(bytes, PART);
    let view_count = read.count(VIEW_BYTES)?;
    let mut views = Vec::with_capacity(view_count);
    for v in 0..view_count {
        let eye = DVec3::new(read.double()?, read.double()?, read.double()?);
        let camera = header.camera(v, eye)?;
        let contours = decode_contours(&mut read, &header.depth_grid(eye, DEPTH_BITS))?;
        views.push(CapturedView {
            camera,
            contours,
            photographed: None,
        });
    }
    let triangles = polytope::decode(&mut read, view_count)?;
    read.finish()?;
    Ok(header.map(views, triangles))
}

fn decode_contours(
    read: &mut Decoder<'_>,
    depth_grid: &Grid,
) -> Result<Vec<ViewContour>, AssetError> {
    let shift = read.byte()?;
    let contour_count = read.count(CONTOUR_BYTES)?;
    let mut contours = Vec::with_capacity(contour_count);
    let (mut point, mut depth) = ([0_i64; 2], 0_i64);
    for _ in 0..contour_count {
        let folded = read.unsigned()?;
        let has_depth = folded & 1 == 1;
        let point_count = read.check_room(folded >> 1, POINT_BYTES + usize::from(has_depth))?;
        let mut contour = ViewContour::default();
        contour.points.reserve_exact(point_count);
        for _ in 0..point_count {
            let mut coordinates = [0.0; 2];
            for (axis, coordinate) in point.iter_mut().zip(&mut coordinates) {
                let difference = read.signed()?.checked_shl(shift.into()).unwrap_or(0);
                *axis = axis.wrapping_add(difference);
                *coordinate = POINT_GRID.value(*axis)?;
            }
            contour.points.push(DVec2::from_array(coordinates));
        }
        if has_depth {
            contour.depths.reserve_exact(point_count);
            for _ in 0..point_count {
                depth = depth.wrapping_add(read.signed()?);
                contour.depths.push(depth_grid.value(depth)?);
            }
        }
        contours.push(contour);
    }
    Ok(contours)
}
