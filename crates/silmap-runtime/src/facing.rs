//! How squarely texture views see the model, found from their depths: of several views, the one that sees a place squarely shows most of it.
//!
//! It takes the place of a picture's opacity, which says nothing there.

use silmap_geometry::{Camera, ColourImage};
use silmap_map::Relief;

/// Cosines between the surface's normal and the direction to the eye, per pixel of a depth picture, in steps of 1/255: zero where nothing
/// is seen and beside it, and next to zero where depth jumps.
pub(crate) fn facing(relief: &Relief, view: usize, camera: &Camera) -> Vec<u8> {
    let (width, height) = (relief.width_px as usize, relief.height_px as usize);
    let codes = &relief.views[view].codes;
    let depths: Vec<Option<f64>> = codes.iter().map(|&c| relief.depth(view, c)).collect();
    let pixel = camera.half_tangent * 2.0 / glam::DVec2::new(width as f64, height as f64);
    // Of three lines each, as steps of depths are not much smaller than a pixel.
    const LINES: [(isize, f64); 3] = [(-1, 0.25), (0, 0.5), (1, 0.25)];
    let cosine = |x: usize, y: usize| -> Option<f64> {
        let at = |dx: isize, dy: isize| -> Option<f64> {
            let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
            if x < width && y < height {
                depths[y * width + x]
            } else {
                None
            }
        };
        let depth = at(0, 0)?;
        let (mut across, mut along) = (0.0, 0.0);
        for (k, share) in LINES {
            across += share * (at(1, k)? - at(-1, k)?);
            along += share * (at(k, 1)? - at(k, -1)?);
        }
        let slope = glam::DVec2::new(across, along) / (2.0 * depth * pixel);
        Some(1.0 / (1.0 + slope.length_squared()).sqrt())
    };
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    all.map(|(x, y)| (cosine(x, y).unwrap_or(0.0) * 255.0).round() as u8)
        .collect()
}

/// Puts it into a picture of the same field of view.
pub(crate) fn set_facing(picture: &mut ColourImage, facing: &[u8], relief: &Relief) {
    let (width, height) = (picture.width as usize, picture.height as usize);
    for y in 0..height {
        let row = (2 * y + 1) * relief.height_px as usize / (2 * height);
        for x in 0..width {
            let column = (2 * x + 1) * relief.width_px as usize / (2 * width);
            picture.rgba[4 * (y * width + x) + 3] = facing[row * relief.width_px as usize + column];
        }
    }
}
