//! Texture cameras, visibility bits and the error curve as bytes.

use glam::{DVec2, DVec3};
use silmap_geometry::Camera;
use silmap_geometry::camera::MAX_SIDE_PX;

use super::packing::{Decoder, Encoder};
use super::{AssetError, MAX_TEXTURE_VIEWS, TextureSet};

const PART: &str = "texture cameras and visibility bits";

/// How far a stored frame may be from orthonormal.
const FRAME_SLACK: f64 = 1e-6;

/// Cameras and visibility bits; the pictures are stored as glTF images.
pub(super) fn encode(textures: &TextureSet, face_count: usize) -> Result<Vec<u8>, AssetError> {
    let view_count = textures.views.len();
    check_view_count(view_count)?;
    let mut out = Encoder::default();
    for (v, view) in textures.views.iter().enumerate() {
        check_camera(v, &view.camera)?;
        for x in camera_numbers(&view.camera) {
            out.double(x);
        }
        out.unsigned(view.camera.width_px.into());
        out.unsigned(view.camera.height_px.into());
    }
    let has_bits = !textures.visible_views.is_empty();
    if has_bits && textures.visible_views.len() != face_count {
        return Err(AssetError::Count {
            what: "visibility words",
            found: textures.visible_views.len(),
            expected: face_count,
        });
    }
    out.unsigned(has_bits.into());
    for &bits in &textures.visible_views {
        check_bits(bits, view_count)?;
        out.low_bytes(bits, view_count.div_ceil(8));
    }
    Ok(out.finish())
}

/// The cameras and visibility bits of `view_count` views on `face_count` faces.
pub(super) fn decode(
    bytes: &[u8],
    view_count: usize,
    face_count: usize,
) -> Result<(Vec<Camera>, Vec<u64>), AssetError> {
    check_view_count(view_count)?;
    let mut read = Decoder::new(bytes, PART);
    let mut cameras = Vec::with_capacity(view_count);
    for v in 0..view_count {
        let camera = decode_camera(&mut read)?;
        check_camera(v, &camera)?;
        cameras.push(camera);
    }
    let mut visible_views = Vec::new();
    if read.index("visibility table", 2)? == 1 {
        for _ in 0..face_count {
            let bits = read.low_bytes(view_count.div_ceil(8))?;
            check_bits(bits, view_count)?;
            visible_views.push(bits);
        }
    }
    read.finish()?;
    Ok((cameras, visible_views))
}

fn camera_numbers(camera: &Camera) -> impl Iterator<Item = f64> {
    [camera.eye, camera.right, camera.up, camera.forward]
        .into_iter()
        .flat_map(|v| v.to_array())
        .chain(camera.half_tangent.to_array())
}

fn decode_camera(read: &mut Decoder<'_>) -> Result<Camera, AssetError> {
    let mut vector = || -> Result<DVec3, AssetError> {
        Ok(DVec3::new(read.double()?, read.double()?, read.double()?))
    };
    let [eye, right, up, forward] = [vector()?, vector()?, vector()?, vector()?];
    Ok(Camera {
        eye,
        right,
        up,
        forward,
        half_tangent: DVec2::new(read.double()?, read.double()?),
        center_offset: DVec2::ZERO,
        width_px: read.index("image column", MAX_SIDE_PX as usize + 1)?,
        height_px: read.index("image row", MAX_SIDE_PX as usize + 1)?,
    })
}

fn check_camera(view: usize, camera: &Camera) -> Result<(), AssetError> {
    let Camera {
        right, up, forward, ..
    } = *camera;
    let skew = [
        right.length() - 1.0,
        up.length() - 1.0,
        forward.length() - 1.0,
        right.dot(up),
        up.dot(forward),
        forward.dot(right),
    ];
    let sizes = 1..=MAX_SIDE_PX;
    let is_proper = camera_numbers(camera).all(f64::is_finite)
        && skew.iter().all(|x| x.abs() <= FRAME_SLACK)
        && camera.half_tangent.cmpgt(DVec2::ZERO).all()
        && camera.center_offset == DVec2::ZERO
        && sizes.contains(&camera.width_px)
        && sizes.contains(&camera.height_px);
    if is_proper {
        return Ok(());
    }
    Err(AssetError::TextureCamera { view })
}

fn check_view_count(found: usize) -> Result<(), AssetError> {
    if found <= MAX_TEXTURE_VIEWS {
        return Ok(());
    }
    Err(AssetError::Count {
        what: "texture views",
        found,
        expected: MAX_TEXTURE_VIEWS,
    })
}

fn check_bits(bits: u64, view_count: usize) -> Result<(), AssetError> {
    let used = u64::BITS - bits.leading_zeros();
    if used as usize <= view_count {
        return Ok(());
    }
    Err(AssetError::NoSuch {
        what: "texture view",
        index: u64::from(used - 1),
        count: view_count,
    })
}

/// Views kept and misclassified share, one pair after the other.
pub(super) fn encode_curve(curve: &[(u32, f64)]) -> Result<Vec<u8>, AssetError> {
    let mut out = Encoder::default();
    out.count(curve.len());
    for &(views, share) in curve {
        let single = share as f32;
        check_share(single)?;
        out.unsigned(views.into());
        out.single(single);
    }
    Ok(out.finish())
}

pub(super) fn decode_curve(bytes: &[u8]) -> Result<Vec<(u32, f64)>, AssetError> {
    let mut read = Decoder::new(bytes, "points of the error curve");
    let count = read.count(5)?;
    let mut curve = Vec::with_capacity(count);
    for _ in 0..count {
        let views = read.word("view")?;
        let share = read.single()?;
        check_share(share)?;
        curve.push((views, f64::from(share)));
    }
    read.finish()?;
    Ok(curve)
}

pub(super) fn check_share(share: f32) -> Result<(), AssetError> {
    if share.is_finite() {
        return Ok(());
    }
    Err(AssetError::OutOfRange {
        what: "misclassified share",
        value: share.into(),
        limit: f32::MAX.into(),
    })
}
