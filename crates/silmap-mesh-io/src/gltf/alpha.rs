//! Faces that show nothing because their material cuts out what its alpha says is not there.
//!
//! A face shows nothing when no texel that it covers is as opaque as the material asks for, and it shows in part when
//! some are not. Texels are taken as squares: what a filter smears over their sides does not count.

use std::collections::BTreeMap;

use silmap_geometry::{ColourImage, TextureWrap};

/// How much of a face is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shows {
    Whole,
    Partly,
    Nothing,
}

/// A face without a texture: its corners' alpha decides.
pub(super) fn whole_face(alphas: [f64; 3], least: f64) -> Shows {
    match alphas.iter().filter(|&&alpha| alpha >= least).count() {
        0 => Shows::Nothing,
        3 => Shows::Whole,
        _ => Shows::Partly,
    }
}

/// Which texels are opaque enough, by material and by the least alpha asked of them.
#[derive(Default)]
pub(super) struct AlphaMaps {
    maps: BTreeMap<(u16, u8), AlphaMap>,
}

/// Maps kept at a time; vertex colours can ask for many.
const MOST_MAPS: usize = 8;

impl AlphaMaps {
    /// How much of a face with a texture shows; `material` names the texture.
    pub(super) fn face(
        &mut self,
        (material, image, wrap): (u16, &ColourImage, [TextureWrap; 2]),
        uvs: &[[f32; 2]; 3],
        alphas: [f64; 3],
        least: f64,
    ) -> Shows {
        if least <= 0.0 {
            return Shows::Whole;
        }
        let most = alphas.into_iter().fold(0.0, f64::max);
        // As bytes, and forgiving of rounding: a texel that is just as opaque as asked for shows.
        let byte = (255.0 * least / most - 1e-6).ceil();
        if most <= 0.0 || byte > 255.0 {
            return Shows::Nothing;
        }
        let key = (material, byte as u8);
        if !self.maps.contains_key(&key) && self.maps.len() >= MOST_MAPS {
            self.maps.clear();
        }
        let map = self
            .maps
            .entry(key)
            .or_insert_with(|| AlphaMap::new(image, byte as u8));
        map.face(uvs, wrap)
    }
}

/// How many texels of each row, from its start, are opaque enough.
struct AlphaMap {
    width: usize,
    height: usize,
    /// `height` rows of `width + 1` counts.
    sums: Vec<u32>,
}

/// Coordinates beyond this many texels are not followed texel by texel.
const FARTHEST_TEXEL: f64 = 1e9;

/// A face that covers a texel by less than this part of its side does not count as covering it.
const SLACK: f64 = 1e-3;

impl AlphaMap {
    fn new(image: &ColourImage, least: u8) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let mut sums = Vec::with_capacity((width + 1) * height);
        for row in image.rgba.chunks_exact(4 * width.max(1)) {
            let mut sum = 0;
            sums.push(sum);
            for pixel in row.chunks_exact(4) {
                sum += u32::from(pixel[3] >= least);
                sums.push(sum);
            }
        }
        Self {
            width,
            height,
            sums,
        }
    }

    fn face(&self, uvs: &[[f32; 2]; 3], wrap: [TextureWrap; 2]) -> Shows {
        let total: u64 = (0..self.height)
            .map(|row| u64::from(self.row(row)[self.width]))
            .sum();
        if total == 0 {
            return Shows::Nothing;
        }
        if total == (self.width * self.height) as u64 {
            return Shows::Whole;
        }
        let scale = [self.width as f64, self.height as f64];
        let points = uvs.map(|uv| [0, 1].map(|a| f64::from(uv[a]) * scale[a]));
        let far = |p: &[f64; 2]| p.iter().any(|x| x.abs() > FARTHEST_TEXEL);
        let low = points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(|p| p[1]).fold(-f64::INFINITY, f64::max);
        if points.iter().any(far) || high - low > 8.0 * scale[1] + 16.0 {
            return Shows::Partly;
        }
        let (first, end) = cells(low, high);
        let (mut seen, mut covered) = (0, 0);
        for row in first..end {
            let within = [(row as f64).max(low), ((row + 1) as f64).min(high)];
            let [left, right] = span(&points, within);
            let (from, to) = cells(left, right);
            let sums = self.row(wrap[1].texel(row, self.height));
            seen += self.up_to(sums, to, wrap[0]) - self.up_to(sums, from, wrap[0]);
            covered += to - from;
        }
        match seen {
            0 => Shows::Nothing,
            _ if seen == covered => Shows::Whole,
            _ => Shows::Partly,
        }
    }

    fn row(&self, row: usize) -> &[u32] {
        &self.sums[row * (self.width + 1)..(row + 1) * (self.width + 1)]
    }

    /// How many texels from place 0 of an endless row to before place `end` are opaque enough; negative before 0.
    fn up_to(&self, sums: &[u32], end: i64, wrap: TextureWrap) -> i64 {
        let width = self.width as i64;
        let sum = |place: i64| i64::from(sums[place as usize]);
        let total = sum(width);
        match wrap {
            TextureWrap::Repeat => end.div_euclid(width) * total + sum(end.rem_euclid(width)),
            TextureWrap::MirroredRepeat => {
                let place = end.rem_euclid(2 * width);
                let within = if place <= width {
                    sum(place)
                } else {
                    2 * total - sum(2 * width - place)
                };
                end.div_euclid(2 * width) * 2 * total + within
            }
            TextureWrap::ClampToEdge if end < 0 => end * sum(1),
            TextureWrap::ClampToEdge if end > width => {
                total + (end - width) * (total - sum(width - 1))
            }
            TextureWrap::ClampToEdge => sum(end),
        }
    }
}

/// The texels that an interval covers, one at least: first, and one past the last.
fn cells(low: f64, high: f64) -> (i64, i64) {
    let first = (low + SLACK).floor() as i64;
    let end = (high - SLACK).ceil() as i64;
    if first < end {
        (first, end)
    } else {
        let only = (0.5 * (low + high)).floor() as i64;
        (only, only + 1)
    }
}

/// From where to where a triangle reaches in x between two values of y, both of which it reaches.
fn span(points: &[[f64; 2]; 3], [low, high]: [f64; 2]) -> [f64; 2] {
    let (mut left, mut right) = (f64::INFINITY, -f64::INFINITY);
    let mut reach = |x: f64| {
        left = left.min(x);
        right = right.max(x);
    };
    for k in 0..3 {
        let ([ax, ay], [bx, by]) = (points[k], points[(k + 1) % 3]);
        if (low..=high).contains(&ay) {
            reach(ax);
        }
        for y in [low, high] {
            if (ay < y) != (by < y) {
                reach(ax + (bx - ax) * ((y - ay) / (by - ay)).clamp(0.0, 1.0));
            }
        }
    }
    if left <= right {
        [left, right]
    } else {
        // Rounding lost it: the whole triangle is surely enough.
        let x = points.map(|p| p[0]);
        [
            x.iter().copied().fold(f64::INFINITY, f64::min),
            x.iter().copied().fold(-f64::INFINITY, f64::max),
        ]
    }
}
