//! Smaller versions of a picture, each half as large as the one before, for instances that are small on the screen.
//!
//! Source: Williams. Pyramidal Parametrics. SIGGRAPH 1983. Pixels are averaged in linear light.

use silmap_geometry::ColourImage;
use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};

/// Steps of linear light, from black to white.
const STEPS: usize = u16::MAX as usize;

/// Averages colours.
#[derive(Debug)]
pub(crate) struct Halving {
    /// Linear light of an sRGB byte.
    linear: Vec<u16>,
    /// The byte of a linear light.
    bytes: Vec<u8>,
}

/// How many versions there are, the picture itself included.
pub(crate) fn level_count(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

impl Halving {
    pub(crate) fn new() -> Self {
        let linear = |byte: u16| linear_from_srgb(f32::from(byte) / 255.0) * STEPS as f32;
        let byte = |step: usize| srgb_from_linear(step as f32 / STEPS as f32) * 255.0;
        Self {
            linear: (0..256).map(|k| linear(k).round() as u16).collect(),
            bytes: (0..=STEPS).map(|k| byte(k).round() as u8).collect(),
        }
    }

    /// The next smaller version: each pixel is the mean of four. The last row or column of an odd number is left out.
    pub(crate) fn half(&self, picture: &ColourImage) -> ColourImage {
        let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
        let at = |x: u32, y: u32| {
            let (x, y) = (x.min(picture.width - 1), y.min(picture.height - 1));
            4 * (y as usize * picture.width as usize + x as usize)
        };
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| at(2 * x + i, 2 * y + j));
                for channel in 0..3 {
                    let light =
                        |k: usize| u32::from(self.linear[usize::from(picture.rgba[k + channel])]);
                    let sum: u32 = four.into_iter().map(light).sum();
                    rgba.push(self.bytes[(sum as usize + 2) / 4]);
                }
                let sum: u32 = four
                    .into_iter()
                    .map(|k| u32::from(picture.rgba[k + 3]))
                    .sum();
                rgba.push(((sum + 2) / 4) as u8);
            }
        }
        ColourImage {
            width,
            height,
            rgba,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, colour: impl Fn(u32, u32) -> [u8; 4]) -> ColourImage {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        ColourImage {
            width,
            height,
            rgba: pixels.flat_map(|(x, y)| colour(x, y)).collect(),
        }
    }

    #[test]
    fn one_colour_stays_what_it_is_down_to_one_pixel() {
        let halving = Halving::new();
        for k in 0..=255 {
            let mut one = picture(5, 3, |_, _| [k, 255 - k, k / 2, k]);
            for _ in 1..level_count(5, 3) {
                one = halving.half(&one);
                assert!(one.rgba.chunks(4).all(|p| *p == [k, 255 - k, k / 2, k]));
            }
            assert_eq!((one.width, one.height), (1, 1));
        }
    }

    /// A chessboard is half as bright from afar: that is 188 of 255, not 128.
    #[test]
    fn light_is_averaged_and_not_its_encoding() {
        let board = picture(8, 8, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 4]);
        let half = Halving::new().half(&board);
        assert!(
            half.rgba
                .chunks(4)
                .all(|p| p[..3] == [188; 3] && p[3] == 128)
        );
    }
}
