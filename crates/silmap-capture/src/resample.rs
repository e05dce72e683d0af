//! A picture bent into another: each pixel has the colour of a place between the pixels of the first.

use glam::DVec2;
use rayon::prelude::*;
use silmap_geometry::ColourImage;
use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};

/// A picture of this size, with the colour at `place` of each pixel's centre; `nothing` where there is no place.
pub(crate) fn resampled(
    picture: &ColourImage,
    (width, height): (u32, u32),
    nothing: [u8; 4],
    place: impl Fn(DVec2) -> Option<DVec2> + Sync,
) -> ColourImage {
    let row_bytes = 4 * width as usize;
    let mut rgba = vec![0; row_bytes * height as usize];
    let rows = rgba.par_chunks_exact_mut(row_bytes).enumerate();
    rows.for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let colour = place(centre).map_or(nothing, |p| sample(picture, p));
            pixel.copy_from_slice(&colour);
        }
    });
    ColourImage {
        width,
        height,
        rgba,
    }
}

/// The colour at a place, bilinear in light; colours count as much as they are opaque.
fn sample(picture: &ColourImage, place: DVec2) -> [u8; 4] {
    let last = DVec2::new(
        f64::from(picture.width) - 1.0,
        f64::from(picture.height) - 1.0,
    );
    let place = (place - 0.5).clamp(DVec2::ZERO, last);
    let low = place.floor();
    let part = (place - low).as_vec2();
    let mut sums = [0.0_f32; 4];
    for (aside, below) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let weight = (1.0 - (part.x - aside as f32).abs()) * (1.0 - (part.y - below as f32).abs());
        let at = (low + DVec2::new(aside, below)).min(last);
        let first = 4 * (at.y as usize * picture.width as usize + at.x as usize);
        let pixel = &picture.rgba[first..first + 4];
        let opaque = weight * f32::from(pixel[3]) / 255.0;
        for (sum, &byte) in sums.iter_mut().zip(&pixel[..3]) {
            *sum += opaque * linear_from_srgb(f32::from(byte) / 255.0);
        }
        sums[3] += opaque;
    }
    let byte = |value: f32| (255.0 * value).round().clamp(0.0, 255.0) as u8;
    let [r, g, b, alpha] = sums;
    let colour = |sum: f32| byte(srgb_from_linear(sum / alpha.max(f32::MIN_POSITIVE)));
    [colour(r), colour(g), colour(b), byte(alpha)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colour of a pixel that nobody sees is no part of what lies beside it.
    #[test]
    fn colours_count_as_much_as_they_are_opaque() {
        let picture = ColourImage {
            width: 2,
            height: 1,
            rgba: vec![200, 100, 50, 255, 0, 255, 0, 0],
        };
        assert_eq!(sample(&picture, DVec2::new(1.0, 0.5)), [200, 100, 50, 128]);
        assert_eq!(sample(&picture, DVec2::new(0.2, 0.5)), [200, 100, 50, 255]);
        let moved = resampled(&picture, (2, 1), [9; 4], |p| (p.x < 1.0).then_some(p));
        assert_eq!(moved.rgba, [200, 100, 50, 255, 9, 9, 9, 9]);
    }
}
