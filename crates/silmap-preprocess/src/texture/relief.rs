//! How deep the original lies in each texture view: what the hull's fragments find their place on the original by.
//!
//! Source: Oliveira, Bishop, McAllister. Relief Texture Mapping. SIGGRAPH 2000.
//! Deviation: depths are those along the camera's forward direction from its eye, in even steps between the nearest and the farthest
//! that the view sees, and not below a surface: so they are as smooth as the model, and know of no hull.

use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{Camera, TriangleMesh};
use silmap_map::{DepthPicture, Relief};

use super::item_buffer::ItemBuffer;

/// Depth pictures of all views, with that side and those bits a depth.
pub(super) fn take(
    mesh: &TriangleMesh,
    cameras: &[Camera],
    (side_px, bits): (u32, u32),
    watch: &Watch<'_>,
) -> Result<Relief, Interrupted> {
    let views = cameras.par_iter().map(|camera| {
        watch.check()?;
        Ok(depth_picture(
            mesh,
            &camera.resized((side_px, side_px)),
            bits,
        ))
    });
    Ok(Relief {
        bits,
        width_px: side_px,
        height_px: side_px,
        views: views.collect::<Result<_, Interrupted>>()?,
    })
}

fn depth_picture(mesh: &TriangleMesh, camera: &Camera, bits: u32) -> DepthPicture {
    let buffer = ItemBuffer::draw_mesh(camera, mesh);
    let pixels = camera.width_px as usize * camera.height_px as usize;
    let depth = |pixel| {
        let inverse = buffer.inverse_depth(pixel);
        (inverse > 0.0).then(|| 1.0 / inverse)
    };
    let range = (0..pixels).filter_map(depth);
    let (near, far) = range.fold((f64::INFINITY, f64::NEG_INFINITY), |(near, far), depth| {
        (near.min(depth), far.max(depth))
    });
    if near > far {
        return DepthPicture {
            near: 0.0,
            far: 0.0,
            codes: vec![0; pixels],
        };
    }
    let steps = f64::from((1_u32 << bits) - 2);
    let per_length = if far > near {
        steps / (far - near)
    } else {
        0.0
    };
    let code = |pixel| depth(pixel).map_or(0, |d| 1 + ((d - near) * per_length).round() as u16);
    DepthPicture {
        near,
        far,
        codes: (0..pixels).map(code).collect(),
    }
}
