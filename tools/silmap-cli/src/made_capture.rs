//! A capture that is made and not taken: photographs of a mesh, with masks as people draw them.
//!
//! The truth is known: whatever is built of such a capture can be compared with the mesh. All of it is a function of the mesh, the
//! number of spoiled masks and constants.

mod cameras;
mod mask;
mod noise;
mod photograph;

use rayon::prelude::*;
use serde_json::json;
use silmap_capture::Pinhole;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{Bvh, ColourImage, Mask, TriangleMesh};

pub(crate) use cameras::between;
pub(crate) use photograph::{Exposure, Photographer};

/// Taking the photographs.
pub(crate) const TAKE: Stage = Stage("taking photographs");

/// A view of the capture.
#[derive(Debug)]
pub(crate) struct MadeView {
    pub(crate) name: String,
    pub(crate) camera: Pinhole,
    pub(crate) photograph: ColourImage,
    pub(crate) mask: Mask,
    /// Whether its mask has a bite out or a blob added.
    pub(crate) is_spoiled: bool,
}

/// Photographs `model` from around, and spoils so large a share of the masks, rounded up to whole ones.
///
/// # Errors
/// When the caller asked to stop.
pub(crate) fn make(
    model: &TriangleMesh,
    spoil: f64,
    watch: &Watch<'_>,
) -> Result<Vec<MadeView>, Interrupted> {
    let tree = Bvh::new(model);
    let photographer = Photographer::new(model, &tree);
    let cameras = cameras::around(&model.bounds());
    let spoiled = mask::chosen(cameras.len(), spoil);
    watch.start(TAKE, cameras.len() as u64);
    let views = (cameras.into_par_iter().enumerate())
        .map(|(v, camera)| {
            watch.check()?;
            let photograph = photographer.photograph(&camera, &Exposure::of_view(v));
            let mut mask = mask::drawn(&tree, &camera, v);
            let is_spoiled = spoiled.contains(&v);
            if is_spoiled {
                mask::spoil(&mut mask, v);
            }
            watch.advance(TAKE, 1);
            Ok(MadeView {
                name: format!("view_{v:02}"),
                camera,
                photograph,
                mask,
                is_spoiled,
            })
        })
        .collect();
    watch.finish(TAKE);
    views
}

/// The text of `cameras.json`, with photographs in `images/` and masks in `masks/`.
pub(crate) fn camera_file(name: &str, views: &[MadeView]) -> String {
    let of_view = |view: &MadeView| {
        let camera = &view.camera;
        let origin = -glam::DVec3::from_array(camera.axes.map(|axis| axis.dot(camera.eye)));
        json!({
            "name": view.name,
            "photo": format!("images/{}.jpg", view.name),
            "mask": format!("masks/{}.png", view.name),
            "K": [
                [camera.focal.x, camera.skew, camera.principal.x],
                [0.0, camera.focal.y, camera.principal.y],
                [0.0, 0.0, 1.0],
            ],
            "R": camera.axes.map(|axis| axis.to_array()),
            "t": origin.to_array(),
        })
    };
    let first = views.first().map(|view| &view.camera);
    let value = json!({
        "name": name,
        "width": first.map(|c| c.width),
        "height": first.map(|c| c.height),
        // From the top-left corner: the first pixel's centre is half a pixel from it.
        "pixel_centre": 0.5,
        "metric": true,
        "views": views.iter().map(of_view).collect::<Vec<_>>(),
    });
    format!("{value:#}\n")
}
