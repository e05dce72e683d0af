//! A photograph of an object: its camera, its colours, and which of them are the object's.
//!
//! Colours are linear light times a gain for each channel, by which photographs of different exposure and white balance are evened out.
//! Light adds up and scales in linear values only, so the gain is a factor there and not on the stored bytes.

use std::sync::LazyLock;

use glam::{DVec2, DVec3, DVec4};

use crate::ColourImage;
use crate::lighting::linear_from_srgb;

/// Steps in a pixel, as distances to the border are stored.
pub const INSIDE_STEPS: f64 = 8.0;

/// Of the bilinear weights around a place, so much must lie on pixels that are known.
const LEAST_KNOWN: f32 = 0.25;

/// Linear values of the bytes of sRGB.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_from_srgb(byte as f32 / 255.0)));

/// A photograph and its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// Centre of projection, object space.
    pub eye: DVec3,
    /// (a, b, w) = rows · (point, 1); the point is seen at (a/w, b/w), pixels from the picture's top-left corner, where w > 0.
    pub image_from_object: [DVec4; 3],
    /// sRGB colours. Alpha is no opacity but how far a pixel's centre lies inside the object's border, in [`INSIDE_STEPS`] a pixel,
    /// zero outside.
    pub picture: ColourImage,
    /// Nearer to the border than this a pixel holds background as well, pixels.
    pub border_px: f64,
    /// Factors on linear red, green and blue.
    pub gain: [f32; 3],
}

/// What a photograph shows at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Linear light, gain included.
    pub colour: [f32; 3],
    /// How far inside of the pixels that hold no background, and of the picture's sides, pixels.
    pub inside_px: f64,
}

impl Photograph {
    /// Where the ray from the eye along a direction meets the picture's plane; `None` when it does not.
    #[must_use]
    pub fn image_from_direction(&self, direction: DVec3) -> Option<DVec2> {
        let [a, b, w] = self.image_from_object.map(|r| r.truncate().dot(direction));
        (w > 0.0).then(|| DVec2::new(a / w, b / w))
    }

    /// Where a point is seen; `None` when it is not in front.
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        self.image_from_direction(point - self.eye)
    }

    /// The colour at a place, bilinear between pixels that hold no background; `None` where there are none.
    #[must_use]
    pub fn look(&self, image: DVec2) -> Option<Seen> {
        let size = DVec2::new(self.picture.width.into(), self.picture.height.into());
        if image.cmplt(DVec2::ZERO).any() || image.cmpgt(size).any() {
            return None;
        }
        let (width, height) = (self.picture.width as i64, self.picture.height as i64);
        let (x, y) = (image.x - 0.5, image.y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = ((x - left) as f32, (y - top) as f32);
        let (mut colour, mut known, mut inside) = ([0.0_f32; 3], 0.0_f32, 0.0_f64);
        for (dx, dy, weight) in [
            (0, 0, (1.0 - u) * (1.0 - v)),
            (1, 0, u * (1.0 - v)),
            (0, 1, (1.0 - u) * v),
            (1, 1, u * v),
        ] {
            let column = (left as i64 + dx).clamp(0, width - 1);
            let row = (top as i64 + dy).clamp(0, height - 1);
            let at = 4 * (row * width + column) as usize;
            let pixel = &self.picture.rgba[at..at + 4];
            let inside_px = f64::from(pixel[3]) / INSIDE_STEPS - self.border_px;
            if pixel[3] == 0 || inside_px < 0.0 {
                continue;
            }
            for (sum, &byte) in colour.iter_mut().zip(&pixel[..3]) {
                *sum += weight * LINEAR[usize::from(byte)];
            }
            known += weight;
            inside += f64::from(weight) * inside_px;
        }
        let size = DVec2::new(width as f64, height as f64);
        let from_sides = image.min(size - image).min_element();
        (known >= LEAST_KNOWN).then(|| Seen {
            colour: std::array::from_fn(|c| colour[c] / known * self.gain[c]),
            inside_px: (inside / f64::from(known)).min(from_sides),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 × 30 pixels that look along +z; the left half is background, the object a ramp along the columns.
    fn photograph() -> Photograph {
        let pixel = |k: u32| {
            let x = k % 40;
            let inside = (f64::from(x) - 19.5).clamp(0.0, 30.0) * INSIDE_STEPS;
            [(100 + x) as u8, 90, 80, inside as u8]
        };
        let row = DVec4::new;
        Photograph {
            eye: DVec3::new(0.0, 0.0, -1.0),
            image_from_object: [
                row(40.0, 0.0, 20.0, 20.0),
                row(0.0, 40.0, 15.0, 15.0),
                row(0.0, 0.0, 1.0, 1.0),
            ],
            picture: ColourImage {
                width: 40,
                height: 30,
                rgba: (0..1200).flat_map(pixel).collect(),
            },
            border_px: 1.5,
            gain: [1.0, 2.0, 0.5],
        }
    }

    #[test]
    fn points_and_directions_fall_on_the_same_place() {
        let photograph = photograph();
        let point = DVec3::new(0.2, -0.1, 1.0);
        let image = photograph.project(point).unwrap();
        assert!(image.distance(DVec2::new(24.0, 13.0)) < 1e-12);
        let along = photograph.image_from_direction(3.0 * (point - photograph.eye));
        assert!(along.unwrap().distance(image) < 1e-12);
        assert_eq!(photograph.project(DVec3::new(0.0, 0.0, -2.0)), None);
    }

    #[test]
    fn background_has_no_part_in_a_colour() {
        let photograph = photograph();
        assert_eq!(photograph.look(DVec2::new(10.0, 15.0)), None);
        assert_eq!(photograph.look(DVec2::new(41.0, 15.0)), None);
        // Column 21 is the first that is known: half a pixel beside its centre it still is all that counts.
        let first = photograph.look(DVec2::new(21.1, 15.0)).unwrap();
        assert!((first.colour[0] - linear_from_srgb(121.0 / 255.0)).abs() < 1e-6);
        assert!(first.inside_px.abs() < 1e-9);
        let between = photograph.look(DVec2::new(31.0, 15.0)).unwrap();
        let mean = [130.0, 131.0].map(|b: f32| linear_from_srgb(b / 255.0) / 2.0);
        assert!((between.colour[0] - mean[0] - mean[1]).abs() < 1e-6);
        // The side of the picture is nearer than the object's border.
        assert!((between.inside_px - 9.0).abs() < 1e-6, "{between:?}");
    }

    #[test]
    fn gains_are_factors_on_linear_light() {
        let seen = photograph().look(DVec2::new(35.5, 10.5)).unwrap();
        let expected = [1.0 * 135.0, 90.0, 80.0_f32];
        let gains = [1.0, 2.0, 0.5];
        for c in 0..3 {
            let linear = linear_from_srgb(expected[c] / 255.0) * gains[c];
            assert!((seen.colour[c] - linear).abs() < 1e-6);
        }
    }
}
