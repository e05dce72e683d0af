//! A grey picture cut at a level: which pixels are inside, and the outline between them to a part of a pixel.
//!
//! Source: W. Lorensen, H. Cline. Marching Cubes. SIGGRAPH 1987, in two dimensions (marching squares).
//! Deviations: where two pixels that meet in a corner are inside they are apart, as in tracing masks; the border of the picture is an
//! outline where the object reaches it.

use glam::DVec2;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Loop, Mask};

/// Heights above the level at the middles of pixels: positive inside, never zero.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    width: usize,
    height: usize,
    values: Vec<f32>,
    /// Whether the picture holds two values alone, so that nothing lies between pixels.
    is_hard: bool,
}

/// A pixel beyond the border.
const BEYOND: f32 = -1.0;

impl Levels {
    /// Of values row by row. Those above the level are inside.
    pub(crate) fn new((width, height): (u32, u32), values: Vec<f32>, is_hard: bool) -> Self {
        debug_assert_eq!(values.len(), width as usize * height as usize);
        Self {
            width: width as usize,
            height: height as usize,
            values,
            is_hard,
        }
    }

    /// Inside is outside and outside inside.
    pub(crate) fn inverted(mut self) -> Self {
        for value in &mut self.values {
            *value = -*value;
        }
        self
    }

    pub(crate) fn size(&self) -> (u32, u32) {
        (self.width as u32, self.height as u32)
    }

    fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// The pixels whose middles are inside.
    pub(crate) fn mask(&self) -> Mask {
        let mut mask = Mask::new(self.width as u32, self.height as u32);
        for (y, row) in self.values.chunks_exact(self.width).enumerate() {
            for (x, &value) in row.iter().enumerate() {
                if value > 0.0 {
                    mask.set(x as u32, y as u32, true);
                }
            }
        }
        mask
    }

    /// The outline, in pixels from the top-left corner: around pixels where the picture is black and white, else where it passes the
    /// level. Outer loops have positive area, holes negative.
    pub(crate) fn outline(&self) -> Vec<Loop> {
        match self.is_hard {
            true => trace_contours(&self.mask()),
            false => self.crossings(),
        }
    }

    /// The mask of a picture with `k` × `k` pixels for each of these, or of one with a pixel for each `k` × `k` of these.
    pub(crate) fn resampled(&self, to: (u32, u32)) -> Mask {
        let (width, height) = (to.0 as usize, to.1 as usize);
        let mut mask = Mask::new(to.0, to.1);
        for y in 0..height {
            for x in 0..width {
                let value = match width < self.width {
                    true => self.mean_of_block((x, y), self.width / width),
                    false => self.between((x, y), width / self.width),
                };
                if value > 0.0 {
                    mask.set(x as u32, y as u32, true);
                }
            }
        }
        mask
    }

    /// By how much more of a block is inside than outside; of equal shares the first pixel decides.
    fn mean_of_block(&self, (x, y): (usize, usize), k: usize) -> f32 {
        let mut sum = 0.0;
        for row in y * k..(y + 1) * k {
            for column in x * k..(x + 1) * k {
                sum += self.share(column, row);
            }
        }
        if sum == 0.0 {
            self.at(x * k, y * k)
        } else {
            sum
        }
    }

    /// How much of a pixel is inside, −1 to 1.
    fn share(&self, x: usize, y: usize) -> f32 {
        match self.is_hard {
            true => self.at(x, y).signum(),
            false => self.at(x, y).clamp(-1.0, 1.0),
        }
    }

    /// The value at the middle of the pixel (x, y) of a picture `k` times as large.
    fn between(&self, (x, y): (usize, usize), k: usize) -> f32 {
        if self.is_hard {
            return self.at(x / k, y / k);
        }
        let place = |v: usize, count: usize| {
            let v = ((v as f32 + 0.5) / k as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            let first = (v as usize).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), v - first as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (place(x, self.width), place(y, self.height));
        let row = |y| self.at(x0, y) * (1.0 - u) + self.at(x1, y) * u;
        row(y0) * (1.0 - v) + row(y1) * v
    }

    /// Nodes are the middles of pixels, with two more rings around them: one on the border with the values of the pixels beside it, and
    /// one in the same place that is outside.
    fn node(&self, x: usize, y: usize) -> f32 {
        let is_beyond = x == 0 || y == 0 || x == self.width + 3 || y == self.height + 3;
        match is_beyond {
            true => BEYOND,
            false => self.at(
                x.saturating_sub(2).min(self.width - 1),
                y.saturating_sub(2).min(self.height - 1),
            ),
        }
    }

    fn place(&self, x: usize, y: usize) -> DVec2 {
        let along = |v: usize, count: usize| (v as f64 - 1.5).clamp(0.0, count as f64);
        DVec2::new(along(x, self.width), along(y, self.height))
    }

    fn crossings(&self) -> Vec<Loop> {
        let (columns, rows) = (self.width + 4, self.height + 4);
        // A crossing lies on an edge to the right of a node (0) or below it (1).
        let number = |x: usize, y: usize, side: usize| 2 * (y * columns + x) + side;
        // The crossing that follows each; a crossing is entered once and left once.
        let mut follows: Vec<(usize, usize)> = Vec::new();
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let inside = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
                    .map(|(x, y)| self.node(x, y) > 0.0);
                // Sides in the order top, right, bottom, left; side k goes from corner k to corner k + 1.
                let sides = [
                    number(x, y, 0),
                    number(x + 1, y, 1),
                    number(x, y + 1, 0),
                    number(x, y, 1),
                ];
                // The outline goes from the side where the inside begins to the one where it ends, around its corners one after another.
                for begin in 0..4 {
                    let is_begin = !inside[begin] && inside[(begin + 1) % 4];
                    if !is_begin {
                        continue;
                    }
                    let mut end = (begin + 1) % 4;
                    while inside[(end + 1) % 4] {
                        end = (end + 1) % 4;
                    }
                    follows.push((sides[end], sides[begin]));
                }
            }
        }
        follows.sort_unstable();
        let next_of = |crossing: usize| follows.binary_search_by_key(&crossing, |f| f.0).ok();
        let mut is_done = vec![false; follows.len()];
        let mut loops = Vec::new();
        for start in 0..follows.len() {
            let mut points: Loop = Vec::new();
            let mut at = start;
            while !is_done[at] {
                is_done[at] = true;
                points.push(self.crossing(follows[at].0, columns));
                match next_of(follows[at].1) {
                    Some(next) => at = next,
                    None => break,
                }
            }
            let points = without_straight_corners(points);
            if points.len() > 2 {
                loops.push(from_the_top(points));
            }
        }
        loops.sort_by(|a: &Loop, b: &Loop| {
            a[0].y.total_cmp(&b[0].y).then(a[0].x.total_cmp(&b[0].x))
        });
        loops
    }

    fn crossing(&self, number: usize, columns: usize) -> DVec2 {
        let (node, side) = (number / 2, number % 2);
        let (x, y) = (node % columns, node / columns);
        let (x1, y1) = if side == 0 { (x + 1, y) } else { (x, y + 1) };
        let (a, b) = (f64::from(self.node(x, y)), f64::from(self.node(x1, y1)));
        self.place(x, y).lerp(self.place(x1, y1), a / (a - b))
    }
}

/// Without points that repeat the one before or lie straight between their neighbours along a row or column.
fn without_straight_corners(points: Loop) -> Loop {
    let mut kept: Loop = Vec::with_capacity(points.len());
    let is_straight = |a: DVec2, b: DVec2, c: DVec2| {
        a == b || b == c || (b - a).perp_dot(c - b) == 0.0 && (b - a).dot(c - b) > 0.0
    };
    for point in points {
        while let [.., a, b] = kept[..]
            && is_straight(a, b, point)
        {
            kept.pop();
        }
        if kept.last() != Some(&point) {
            kept.push(point);
        }
    }
    // The same around the end.
    while kept.len() > 2 {
        let count = kept.len();
        if is_straight(kept[count - 2], kept[count - 1], kept[0]) {
            kept.pop();
        } else if is_straight(kept[count - 1], kept[0], kept[1]) {
            kept.remove(0);
        } else {
            break;
        }
    }
    kept
}

/// Beginning at the topmost corner, the leftmost of these.
fn from_the_top(mut points: Loop) -> Loop {
    let key = |k: &usize| (points[*k].y, points[*k].x);
    let top = (0..points.len()).min_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    points.rotate_left(top.unwrap_or(0));
    points
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use silmap_geometry::polygon::signed_area;

    use super::*;

    /// Shares of pixels that a disc covers, by 8 × 8 samples.
    fn disc(side: u32, middle: DVec2, radius: f64) -> Levels {
        let share = |x: u32, y: u32| {
            let samples = (0..64).filter(|k| {
                let at =
                    DVec2::new(f64::from(k % 8), f64::from(k / 8)) / 8.0 + DVec2::splat(1.0 / 16.0);
                (DVec2::new(x.into(), y.into()) + at).distance(middle) < radius
            });
            samples.count() as f32 / 32.0 - 1.0 + 1e-3
        };
        let values = (0..side * side)
            .map(|k| share(k % side, k / side))
            .collect();
        Levels::new((side, side), values, false)
    }

    #[test]
    fn a_soft_disc_has_an_outline_to_a_twentieth_of_a_pixel() {
        let (middle, radius) = (DVec2::new(15.3, 16.8), 9.6);
        let soft = disc(32, middle, radius);
        let [outline] = &soft.outline()[..] else {
            panic!("{:?}", soft.outline().len());
        };
        let off = |p: &DVec2| (p.distance(middle) - radius).abs();
        assert!(outline.iter().map(off).fold(0.0, f64::max) < 0.2);
        let mean = outline.iter().map(off).sum::<f64>() / outline.len() as f64;
        assert!(mean < 0.05, "{mean}");
        let area = std::f64::consts::PI * radius * radius;
        assert!((signed_area(outline) / area - 1.0).abs() < 0.005);
        // Around pixels it is farther off.
        let hard = trace_contours(&soft.mask());
        assert!(hard[0].iter().map(off).fold(0.0, f64::max) > 0.4);
    }

    #[test]
    fn the_border_of_the_picture_closes_the_outline() {
        // All inside, softly: the outline is the border.
        let all = Levels::new((5, 4), vec![0.3; 20], false);
        assert_eq!(all.outline().len(), 1);
        assert_eq!(signed_area(&all.outline()[0]), 20.0);
        assert_eq!(all.outline()[0].len(), 4);
        // Cut off on the right.
        let cut = disc(32, DVec2::new(32.0, 15.0), 8.0).outline();
        assert_eq!(cut.len(), 1);
        let half = 0.5 * std::f64::consts::PI * 64.0;
        assert!((signed_area(&cut[0]) / half - 1.0).abs() < 0.01);
        assert!(cut[0].iter().any(|p| p.x == 32.0));
    }

    #[test]
    fn sizes_that_are_multiples_keep_the_shape() {
        let fine = disc(32, DVec2::new(15.0, 17.0), 8.0);
        let coarse = fine.resampled((16, 16));
        let wanted = disc(16, DVec2::new(7.5, 8.5), 4.0).mask();
        assert!(coarse.count_different(&wanted) <= 2);
        let larger = disc(16, DVec2::new(7.5, 8.5), 4.0).resampled((32, 32));
        assert!(larger.count_different(&fine.mask()) <= 12);
    }

    proptest! {
        /// A pixel's middle is within the loops where it is inside.
        #[test]
        fn loops_hold_the_middles_of_pixels_inside(
            values in prop::collection::vec(prop::sample::select(vec![-1.0_f32, -0.3, -0.01, 0.01, 0.4, 1.0]), 42)
        ) {
            let levels = Levels::new((7, 6), values, false);
            let loops = levels.outline();
            let mask = levels.mask();
            for (x, y) in (0..6).flat_map(|y| (0..7).map(move |x| (x, y))) {
                let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let winding: i32 = loops.iter().map(|l| winding(l, at)).sum();
                prop_assert_eq!(winding, i32::from(mask.get(x.into(), y.into())));
            }
            let inverted = levels.clone().inverted();
            prop_assert_eq!(inverted.mask().count() + mask.count(), 42);
            // Of two values the outline goes around pixels.
            let hard = Levels::new((7, 6), levels.values, true);
            prop_assert_eq!(hard.outline(), trace_contours(&mask));
        }
    }

    fn winding(points: &[DVec2], at: DVec2) -> i32 {
        let pairs = points.iter().zip(points.iter().cycle().skip(1));
        pairs
            .map(|(a, b)| {
                let side = (*b - *a).perp_dot(at - *a);
                match (a.y <= at.y, b.y <= at.y) {
                    (true, false) if side > 0.0 => 1,
                    (false, true) if side < 0.0 => -1,
                    _ => 0,
                }
            })
            .sum()
    }
}
