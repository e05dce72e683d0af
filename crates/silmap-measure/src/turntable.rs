//! A turn around an asset, with the full mesh beside it: pictures to look at.

use std::f64::consts::TAU;

use glam::DVec3;
use silmap_geometry::{Camera, ColourImage, TriangleMesh, Watch};
use silmap_gpu::Gpu;
use silmap_map::{Asset, Method};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};

use crate::MeasureError;

/// Frames of the turn: ten degrees each.
const FRAMES: u32 = 36;

/// Side of each picture, pixels.
const SIDE_PX: u32 = 192;

/// How far the eye is, in radii: nearer than captured views, so that no frame is one of them.
const DISTANCE_RADII: f64 = 2.6;

/// How far above the horizon it is.
const ELEVATION_RAD: f64 = 0.3;

/// Where it begins: between the front and the right.
const FIRST_RAD: f64 = 0.4;

/// One frame of a turn.
#[derive(Clone, Debug)]
pub struct TurntableFrame {
    /// The full mesh, lit, on white.
    pub model: ColourImage,
    /// The hull, clipped to the interpolated outline.
    pub clipped: ColourImage,
}

/// The frames of a whole turn, from one eye on counter-clockwise around +Y.
///
/// # Errors
/// When interrupted, or something cannot be drawn.
pub fn turntable(
    (asset, model): (&Asset, &TriangleMesh),
    gpu: &Gpu,
    watch: &Watch<'_>,
) -> Result<Vec<TurntableFrame>, MeasureError> {
    let map = &asset.map;
    let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
    renderer.load_asset(gpu, asset)?;
    renderer.load_model(gpu, model)?;
    let method = Method::best_for(map);
    eyes()
        .map(|away| {
            watch.check()?;
            let eye = map.center + away * (DISTANCE_RADII * map.radius);
            let size = (SIDE_PX, SIDE_PX);
            let camera = Camera::fit_sphere(eye, map.center, map.radius, None, size)?;
            let mut draw = |mode| renderer.render(gpu, &frame_params(camera, mode, method));
            Ok(TurntableFrame {
                model: draw(Mode::Original)?,
                clipped: draw(Mode::Clipped)?,
            })
        })
        .collect()
}

/// Directions from the center to the eyes.
fn eyes() -> impl Iterator<Item = DVec3> {
    let (height, ring) = ELEVATION_RAD.sin_cos();
    (0..FRAMES).map(move |k| {
        let (x, z) = (FIRST_RAD + f64::from(k) / f64::from(FRAMES) * TAU).sin_cos();
        DVec3::new(ring * x, height, ring * z)
    })
}

fn frame_params(camera: Camera, mode: Mode, method: Method) -> FrameParams {
    FrameParams {
        camera,
        mode,
        method,
        paint: Paint::default(),
        antialias: Antialias::Soft,
        background: Background::Colour([255; 3]),
        edges: EdgeParams::default(),
        light: None,
        shadow: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_closes() {
        let eyes: Vec<DVec3> = eyes().collect();
        let step = |k: usize| eyes[(k + 1) % eyes.len()].distance(eyes[k]);
        for (k, eye) in eyes.iter().enumerate() {
            assert!((eye.length() - 1.0).abs() < 1e-12);
            assert!((step(k) - step(0)).abs() < 1e-12, "{k}");
        }
        assert!(step(0) > 0.1);
    }
}
