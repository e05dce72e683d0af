//! Colour difference of two pictures.

use silmap_geometry::ColourImage;

/// Differences over the pixels that both pictures cover wholly, in steps of 255.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourDifference {
    /// Mean absolute difference of red, green and blue, sRGB-encoded.
    pub mean: [f64; 3],
    /// Pixels that were compared.
    pub pixels: u64,
}

impl ColourDifference {
    /// Compares the pixels that are opaque in both pictures: what lies inside of both outlines. `None` when the pictures differ in
    /// size or have no such pixel.
    #[must_use]
    pub fn between(a: &ColourImage, b: &ColourImage) -> Option<Self> {
        if (a.width, a.height) != (b.width, b.height) {
            return None;
        }
        let mut sums = [0_u64; 3];
        let mut pixels = 0;
        for (p, q) in a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)) {
            if p[3] == u8::MAX && q[3] == u8::MAX {
                pixels += 1;
                for (sum, (x, y)) in sums.iter_mut().zip(p.iter().zip(q)) {
                    *sum += u64::from(x.abs_diff(*y));
                }
            }
        }
        (pixels > 0).then(|| Self {
            mean: sums.map(|sum| sum as f64 / pixels as f64),
            pixels,
        })
    }

    /// The largest mean of the three channels.
    #[must_use]
    pub fn largest_channel(&self) -> f64 {
        self.mean.into_iter().fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixels: &[[u8; 4]]) -> ColourImage {
        ColourImage {
            width: pixels.len() as u32,
            height: 1,
            rgba: pixels.concat(),
        }
    }

    #[test]
    fn only_what_both_cover_is_compared() {
        let a = picture(&[
            [10, 20, 30, 255],
            [0, 0, 0, 0],
            [9, 9, 9, 255],
            [50, 50, 50, 255],
        ]);
        let b = picture(&[
            [14, 20, 24, 255],
            [9, 9, 9, 255],
            [0, 0, 0, 254],
            [50, 58, 50, 255],
        ]);
        let found = ColourDifference::between(&a, &b).unwrap();
        assert_eq!(found.pixels, 2);
        assert_eq!(found.mean, [2.0, 4.0, 3.0]);
        assert_eq!(found.largest_channel(), 4.0);
        let same = ColourDifference::between(&a, &a).unwrap();
        assert_eq!((same.mean, same.pixels), ([0.0; 3], 3));
    }

    #[test]
    fn nothing_to_compare_is_no_agreement() {
        let (clear, wide) = (picture(&[[0; 4]]), picture(&[[0, 0, 0, 255]; 2]));
        assert_eq!(ColourDifference::between(&clear, &clear), None);
        assert_eq!(ColourDifference::between(&clear, &wide), None);
    }
}
