//! Pictures: averaging samples into pixels, and filling uncovered pixels.

/// A picture in linear light with a weight for each pixel: zero says that nothing is known there.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Red, green, blue, each multiplied by the weight, and the weight.
    pub(super) pixels: Vec<[f32; 4]>,
}

impl Picture {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![[0.0; 4]; width * height],
        }
    }

    /// Adds a sample of weight one.
    pub(super) fn add(&mut self, pixel: usize, colour: [f32; 3]) {
        let sum = &mut self.pixels[pixel];
        for (s, c) in sum.iter_mut().zip(colour) {
            *s += c;
        }
        sum[3] += 1.0;
    }

    /// Colour of a pixel; black where nothing is known.
    pub(super) fn colour(&self, pixel: usize) -> [f32; 3] {
        let [r, g, b, weight] = self.pixels[pixel];
        match weight > 0.0 {
            true => [r / weight, g / weight, b / weight],
            false => [0.0; 3],
        }
    }

    /// Half the size, rounded up; each pixel the sum of up to four.
    fn halved(&self) -> Self {
        let mut half = Self::new(self.width.div_ceil(2), self.height.div_ceil(2));
        for y in 0..self.height {
            for x in 0..self.width {
                let sum = &mut half.pixels[(y / 2) * half.width + x / 2];
                for (s, c) in sum.iter_mut().zip(self.pixels[y * self.width + x]) {
                    *s += c;
                }
            }
        }
        half
    }

    /// Bilinear colour at a place in pixels (pixel centres at +0.5), repeating the border.
    pub(super) fn sample(&self, x: f32, y: f32) -> [f32; 3] {
        let near = |v: f32, size: usize| {
            let low = (v - 0.5).floor();
            let index = |v: f32| v.clamp(0.0, (size - 1) as f32) as usize;
            (index(low), index(low + 1.0), v - 0.5 - low)
        };
        let (x0, x1, fx) = near(x, self.width);
        let (y0, y1, fy) = near(y, self.height);
        let [a, b] = [y0, y1].map(|j| [x0, x1].map(|i| self.colour(j * self.width + i)));
        std::array::from_fn(|c| {
            let top = a[0][c] * (1.0 - fx) + a[1][c] * fx;
            let bottom = b[0][c] * (1.0 - fx) + b[1][c] * fx;
            top * (1.0 - fy) + bottom * fy
        })
    }

    /// Gives every pixel a colour: one that nothing covers takes it from the next coarser picture, and so on ("push and
    /// pull"), so that the known colours run smoothly outwards. Pixels that have a colour keep it.
    ///
    /// Source: S. Gortler, R. Grzeszczuk, R. Szeliski, M. Cohen. The Lumigraph. SIGGRAPH 1996, section 3.4.
    /// Deviation: a pixel is either known or not, so weights are not blended between levels.
    pub(super) fn fill(&mut self) {
        let is_known = |p: &[f32; 4]| p[3] > 0.0;
        if self.pixels.iter().all(is_known) || !self.pixels.iter().any(is_known) {
            return;
        }
        let mut coarse = self.halved();
        coarse.fill();
        for y in 0..self.height {
            for x in 0..self.width {
                let pixel = y * self.width + x;
                if !is_known(&self.pixels[pixel]) {
                    let [r, g, b] = coarse.sample((x as f32 + 0.5) / 2.0, (y as f32 + 0.5) / 2.0);
                    self.pixels[pixel] = [r, g, b, 1.0];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filling_keeps_what_is_known_and_invents_no_colour() {
        let mut picture = Picture::new(37, 21);
        for y in 8..12 {
            for x in 5..30 {
                picture.add(y * 37 + x, [x as f32 / 37.0, 0.5, 0.25]);
            }
        }
        let before = picture.clone();
        picture.fill();
        for pixel in 0..37 * 21 {
            let [r, g, b] = picture.colour(pixel);
            if before.pixels[pixel][3] > 0.0 {
                assert_eq!([r, g, b], before.colour(pixel));
            }
            assert!((5.0 / 37.0 - 1e-6..=29.0 / 37.0 + 1e-6).contains(&r), "{r}");
            assert!((g - 0.5).abs() < 1e-6 && (b - 0.25).abs() < 1e-6);
        }
        // Next to the known part the colour is nearly the same.
        let beside = 7 * 37 + 20;
        assert!((picture.colour(beside)[0] - 20.0 / 37.0).abs() < 0.1);
    }

    #[test]
    fn an_empty_picture_stays_black() {
        let mut picture = Picture::new(5, 3);
        picture.fill();
        assert!((0..15).all(|pixel| picture.colour(pixel) == [0.0; 3]));
    }
}
