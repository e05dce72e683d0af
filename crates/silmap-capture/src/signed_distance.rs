//! How far each place of an image lies from a mask's outline.
//!
//! Source: P. Felzenszwalb, D. Huttenlocher. Distance Transforms of Sampled Functions. Theory of Computing 8, 2012.
//! Deviations: distances of inside and outside pixels are both taken to pixel *centres* and shortened by half a pixel, so that the
//! outline lies on pixel borders; only a frame around the mask is kept.

use glam::DVec2;
use silmap_geometry::Mask;

/// Pixels that are kept around the mask.
const MARGIN_PX: u32 = 24;

/// Steps in a pixel, as distances are stored.
const STEPS: f64 = 64.0;

/// Farther than this is not told apart, pixels.
const FARTHEST_PX: f64 = 500.0;

/// Signed distances to a mask's outline, positive outside, for image coordinates from the top-left corner.
#[derive(Clone, Debug)]
pub(crate) struct SignedDistance {
    /// First column and row that are kept.
    first: [u32; 2],
    columns: usize,
    rows: usize,
    values: Vec<i16>,
    /// Corners of the box around the mask, pixels.
    low: DVec2,
    high: DVec2,
}

impl SignedDistance {
    /// Of a mask that is not empty; of an empty one everything is far outside.
    pub(crate) fn new(mask: &Mask) -> Self {
        let Some((low, high)) = bounds_of(mask) else {
            return Self {
                first: [0; 2],
                columns: 1,
                rows: 1,
                values: vec![i16::MAX],
                low: DVec2::INFINITY,
                high: DVec2::NEG_INFINITY,
            };
        };
        let first = low.map(|v| v.saturating_sub(MARGIN_PX));
        let sizes = [mask.width(), mask.height()];
        let ends: [u32; 2] = std::array::from_fn(|k| (high[k] + MARGIN_PX).min(sizes[k]));
        let (columns, rows) = ((ends[0] - first[0]) as usize, (ends[1] - first[1]) as usize);
        let is_inside = |x: usize, y: usize| {
            mask.get(
                i64::from(first[0]) + x as i64,
                i64::from(first[1]) + y as i64,
            )
        };
        let to_inside = squared_distances(columns, rows, is_inside);
        let to_outside = squared_distances(columns, rows, |x, y| !is_inside(x, y));
        let value = |(inside, outside): (f32, f32)| {
            // One of them is zero.
            let px = (f64::from(inside).sqrt() - 0.5).max(0.0)
                - (f64::from(outside).sqrt() - 0.5).max(0.0);
            (px.clamp(-FARTHEST_PX, FARTHEST_PX) * STEPS).round() as i16
        };
        Self {
            first,
            columns,
            rows,
            values: to_inside.into_iter().zip(to_outside).map(value).collect(),
            low: DVec2::new(low[0].into(), low[1].into()),
            high: DVec2::new(high[0].into(), high[1].into()),
        }
    }

    /// The distance at an image point, pixels: bilinear near the outline, a lower bound far outside.
    pub(crate) fn at(&self, image: DVec2) -> f64 {
        let aside = (self.low - image).max(image - self.high).max(DVec2::ZERO);
        if aside.max_element() >= f64::from(MARGIN_PX - 1) {
            return aside.length().min(FARTHEST_PX);
        }
        let place = |v: f64, first: u32, count: usize| {
            let v = (v - 0.5 - f64::from(first)).clamp(0.0, (count - 1) as f64);
            let at = (v as usize).min(count.saturating_sub(2));
            (at, v - at as f64)
        };
        let (x, u) = place(image.x, self.first[0], self.columns);
        let (y, v) = place(image.y, self.first[1], self.rows);
        let value = |dx: usize, dy: usize| {
            let (x, y) = ((x + dx).min(self.columns - 1), (y + dy).min(self.rows - 1));
            f64::from(self.values[y * self.columns + x])
        };
        let top = value(0, 0) * (1.0 - u) + value(1, 0) * u;
        let bottom = value(0, 1) * (1.0 - u) + value(1, 1) * u;
        (top * (1.0 - v) + bottom * v) / STEPS
    }
}

/// The box around the set pixels: first column and row, and those after the last.
pub(crate) fn bounds_of(mask: &Mask) -> Option<([u32; 2], [u32; 2])> {
    let mut found: Option<([u32; 2], [u32; 2])> = None;
    for y in 0..mask.height() {
        let row = mask.row(y);
        let Some(first_word) = row.iter().position(|&w| w != 0) else {
            continue;
        };
        let last_word = row.iter().rposition(|&w| w != 0).unwrap_or(first_word);
        let left = 64 * first_word as u32 + row[first_word].trailing_zeros();
        let right = 64 * last_word as u32 + 64 - row[last_word].leading_zeros();
        let (low, high) = found.get_or_insert(([left, y], [right, y + 1]));
        low[0] = low[0].min(left);
        high[0] = high[0].max(right);
        high[1] = y + 1;
    }
    found
}

/// Squared distance of each pixel centre to the nearest one for which `is_site` holds; the largest number where there is none.
fn squared_distances(
    columns: usize,
    rows: usize,
    is_site: impl Fn(usize, usize) -> bool,
) -> Vec<f32> {
    const NONE: f32 = f32::MAX;
    let mut grid = vec![NONE; columns * rows];
    // Along columns: two passes of counting.
    for x in 0..columns {
        let mut since: Option<u32> = None;
        for y in 0..rows {
            since = if is_site(x, y) {
                Some(0)
            } else {
                since.map(|s| s + 1)
            };
            if let Some(s) = since {
                grid[y * columns + x] = s as f32 * s as f32;
            }
        }
        since = None;
        for y in (0..rows).rev() {
            since = if is_site(x, y) {
                Some(0)
            } else {
                since.map(|s| s + 1)
            };
            if let Some(s) = since {
                let cell = &mut grid[y * columns + x];
                *cell = cell.min(s as f32 * s as f32);
            }
        }
    }
    // Along rows: the lower envelope of a parabola at each column.
    let mut feet: Vec<(usize, f32)> = Vec::with_capacity(columns);
    let mut starts: Vec<f64> = Vec::with_capacity(columns);
    for row in grid.chunks_exact_mut(columns) {
        feet.clear();
        starts.clear();
        for (x, &height) in row.iter().enumerate() {
            if height == NONE {
                continue;
            }
            let start = loop {
                let Some(&(foot, at_foot)) = feet.last() else {
                    break f64::NEG_INFINITY;
                };
                let (p, q) = (foot as f64, x as f64);
                let meet =
                    (f64::from(height) + q * q - f64::from(at_foot) - p * p) / (2.0 * (q - p));
                if starts.last().is_some_and(|&s| meet <= s) {
                    feet.pop();
                    starts.pop();
                } else {
                    break meet;
                }
            };
            feet.push((x, height));
            starts.push(start);
        }
        if feet.is_empty() {
            continue;
        }
        let mut at = 0;
        for (x, cell) in row.iter_mut().enumerate() {
            while at + 1 < feet.len() && starts[at + 1] < x as f64 {
                at += 1;
            }
            let (foot, height) = feet[at];
            let along = x as f32 - foot as f32;
            *cell = along * along + height;
        }
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search_over_all_pixels() {
        let is_site = |x: usize, y: usize| (x * 7 + y * 13 + x * y).is_multiple_of(11) && x > 3;
        let found = squared_distances(23, 17, is_site);
        for y in 0..17_usize {
            for x in 0..23_usize {
                let sites = (0..17).flat_map(|v| (0..23).map(move |u| (u, v)));
                let nearest = sites
                    .filter(|&(u, v)| is_site(u, v))
                    .map(|(u, v): (usize, usize)| u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2))
                    .min()
                    .unwrap();
                assert_eq!(found[y * 23 + x], nearest as f32, "{x} {y}");
            }
        }
    }

    #[test]
    fn the_outline_lies_on_pixel_borders() {
        let mut mask = Mask::new(300, 100);
        for y in 40..60 {
            mask.set_span(y, 100, 200);
        }
        let field = SignedDistance::new(&mask);
        for (x, distance) in [(100.0, 0.0), (97.5, 2.5), (102.5, -2.5), (10.0, 90.0)] {
            let found = field.at(DVec2::new(x, 50.0));
            assert!((found - distance).abs() < 0.02, "{x}: {found}");
        }
        assert!(SignedDistance::new(&Mask::new(5, 5)).at(DVec2::ONE) > 400.0);
    }

    #[test]
    fn beyond_the_border_of_the_image_there_is_no_background() {
        let mut mask = Mask::new(40, 40);
        for y in 0..40 {
            mask.set_span(y, 0, 20);
        }
        let found = SignedDistance::new(&mask).at(DVec2::new(0.5, 0.5));
        assert!((found + 19.5).abs() < 0.02, "{found}");
    }
}
