//! From a mask to the loops around its pixels, by following the cracks between covered and uncovered ones.
//!
//! The loops bound exactly the covered pixel squares, the image border included: their signed areas add up to the number
//! of covered pixels, and filling them gives the mask back. Covered pixels hang together by their sides (4-connected),
//! uncovered ones also by their corners.
//!
//! Source: A. Rosenfeld. Connectivity in digital pictures. Journal of the ACM 17(1), 1970 (border following).
//! Deviations: runs on the pixel lattice instead of pixel centres. Where a loop would touch itself in a corner it is cut
//! in two, so that every loop is simple; loops may still touch each other in such corners.

use glam::DVec2;
use silmap_geometry::{Loop, Mask};

/// A corner of the pixel lattice.
type Corner = [i32; 2];

/// Steps along a crack: right, down, left, up. The covered pixel is on the right hand, which makes outer loops positive.
const STEPS: [Corner; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
/// From a corner, the pixel ahead on the right hand for each step.
const AHEAD_RIGHT: [Corner; 4] = [[0, 0], [-1, 0], [-1, -1], [0, -1]];
/// From a corner, the pixel ahead on the left hand for each step.
const AHEAD_LEFT: [Corner; 4] = [[0, -1], [0, 0], [-1, 0], [-1, -1]];

/// Traces the outlines of a mask.
///
/// Each loop is simple and holds only the corners where it turns. Outer loops have positive area, holes negative. A loop
/// begins at its topmost corner, the leftmost of these; the loops are ordered by it.
#[must_use]
pub fn trace_contours(mask: &Mask) -> Vec<Loop> {
    let mut tracer = Tracer::new(mask);
    let mut found: Vec<Vec<Corner>> = Vec::new();
    for y in 0..mask.height() as usize {
        for word in 0..mask.words_per_row() {
            while let bits @ 1.. = tracer.open[y * mask.words_per_row() + word] {
                let x = 64 * word as i32 + bits.trailing_zeros() as i32;
                tracer.follow([x, y as i32]);
                tracer.split_simple(&mut found);
            }
        }
    }
    for corners in &mut found {
        let top_left = (0..corners.len()).min_by_key(|&k| (corners[k][1], corners[k][0]));
        corners.rotate_left(top_left.unwrap_or(0));
    }
    found.sort_unstable_by_key(|corners| (corners[0][1], corners[0][0], corners[1]));
    found
        .into_iter()
        .map(|corners| {
            let point = |[x, y]: Corner| DVec2::new(f64::from(x), f64::from(y));
            corners.into_iter().map(point).collect()
        })
        .collect()
}

struct Tracer<'a> {
    mask: &'a Mask,
    /// Pixels whose upper crack no loop has passed yet; every loop has such a crack, passed to the right.
    open: Vec<u64>,
    /// The loop being followed.
    corners: Vec<Corner>,
    /// Places in `corners` where two covered pixels meet only in the corner.
    contacts: Vec<usize>,
}

impl<'a> Tracer<'a> {
    fn new(mask: &'a Mask) -> Self {
        let mut open = mask.words().to_vec();
        let stride = mask.words_per_row();
        for (word, above) in open.iter_mut().skip(stride).zip(mask.words()) {
            *word &= !above;
        }
        Self {
            mask,
            open,
            corners: Vec::new(),
            contacts: Vec::new(),
        }
    }

    fn covers(&self, at: Corner, offset: Corner) -> bool {
        let (x, y) = (at[0] + offset[0], at[1] + offset[1]);
        self.mask.get(x.into(), y.into())
    }

    /// Follows the loop whose upper crack starts at `start`, into `corners` and `contacts`.
    fn follow(&mut self, start: Corner) {
        self.corners.clear();
        self.contacts.clear();
        let stride = self.mask.words_per_row();
        let mut at = start;
        let mut heading = 0;
        loop {
            if heading == 0 {
                let word = at[1] as usize * stride + at[0] as usize / 64;
                self.open[word] &= !(1 << (at[0] % 64));
            }
            at = [at[0] + STEPS[heading][0], at[1] + STEPS[heading][1]];
            let is_left_covered = self.covers(at, AHEAD_LEFT[heading]);
            let turned = if !self.covers(at, AHEAD_RIGHT[heading]) {
                if is_left_covered {
                    self.contacts.push(self.corners.len());
                }
                (heading + 1) % 4
            } else if is_left_covered {
                (heading + 3) % 4
            } else {
                heading
            };
            if turned != heading {
                self.corners.push(at);
                heading = turned;
            }
            // The first upper crack of a loop in reading order has no crack of the same loop on its left, so the start
            // is a corner and was pushed just now.
            if at == start && heading == 0 {
                break;
            }
        }
    }

    /// Moves the followed loop to `found`, cut in two wherever it touches itself.
    fn split_simple(&mut self, found: &mut Vec<Vec<Corner>>) {
        let corners = &self.corners;
        self.contacts.sort_unstable_by_key(|&k| (corners[k], k));
        // Each corner is passed at most twice.
        let mut repeats: Vec<(usize, usize)> = self
            .contacts
            .windows(2)
            .filter(|pair| corners[pair[0]] == corners[pair[1]])
            .map(|pair| (pair[1], pair[0]))
            .collect();
        if repeats.is_empty() {
            found.push(corners.clone());
            return;
        }
        repeats.sort_unstable();
        // Loops cut off never interleave, so what lies on the path since the first passing is one whole loop.
        let mut path: Vec<usize> = Vec::new();
        let mut begin = 0;
        for (second, first) in repeats {
            path.extend(begin..second);
            begin = second + 1;
            if let Some(cut) = path.iter().rposition(|&k| k == first) {
                found.push(path[cut..].iter().map(|&k| corners[k]).collect());
                path.truncate(cut + 1);
            }
        }
        path.extend(begin..corners.len());
        found.push(path.into_iter().map(|k| corners[k]).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use silmap_geometry::polygon::{fill_even_odd, signed_area};
    use std::collections::BTreeSet;

    fn mask_of(rows: &[&str]) -> Mask {
        let mut mask = Mask::new(rows[0].len() as u32, rows.len() as u32);
        for (y, row) in rows.iter().enumerate() {
            for (x, c) in row.bytes().enumerate() {
                mask.set(x as u32, y as u32, c == b'#');
            }
        }
        mask
    }

    /// Everything that is promised of the loops of any mask.
    fn check(mask: &Mask) -> Result<(), TestCaseError> {
        let loops = trace_contours(mask);
        let area: f64 = loops.iter().map(|l| signed_area(l)).sum();
        prop_assert_eq!(area, mask.count() as f64);
        let mut filled = Mask::new(mask.width(), mask.height());
        fill_even_odd(&loops, &mut filled);
        prop_assert_eq!(filled.count_different(mask), 0);
        let mut previous = None;
        for points in &loops {
            prop_assert!(points.len() >= 4);
            let keys: Vec<_> = points.iter().map(|p| (p.y as i64, p.x as i64)).collect();
            let distinct: BTreeSet<_> = keys.iter().collect();
            prop_assert_eq!(distinct.len(), keys.len(), "a corner is repeated");
            prop_assert_eq!(keys.iter().min(), keys.first());
            prop_assert!(previous < keys.first().copied(), "loops are out of order");
            previous = keys.first().copied();
            for k in 0..points.len() {
                let (a, b, c) = (
                    points[k],
                    points[(k + 1) % points.len()],
                    points[(k + 2) % points.len()],
                );
                prop_assert!((a.x == b.x) != (a.y == b.y), "not an axis-aligned edge");
                prop_assert!((b - a).perp_dot(c - b) != 0.0, "not a corner");
            }
            // The pixel right of (x) and below the first, topmost-leftmost corner tells outer loops from holes.
            let first = points[0];
            let is_outer = mask.get(first.x as i64, first.y as i64);
            prop_assert_eq!(signed_area(points) > 0.0, is_outer);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn noise(width in 1_u32..140, height in 1_u32..40, density in 0_u32..=8, seed in any::<u64>()) {
            let mut mask = Mask::new(width, height);
            let mut state = seed | 1;
            for y in 0..height {
                for x in 0..width {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    mask.set(x, y, (state >> 40) % 8 < u64::from(density));
                }
            }
            check(&mask)?;
        }

        #[test]
        fn boxes_and_bridges(boxes in prop::collection::vec((0_u32..90, 0_u32..30, 1_u32..40, 1_u32..4, any::<bool>()), 1..20)) {
            let mut mask = Mask::new(100, 32);
            for (x0, y0, long, short, is_wide) in boxes {
                let (w, h) = if is_wide { (long, short) } else { (short, long) };
                for y in y0..(y0 + h).min(32) {
                    for x in x0..(x0 + w).min(100) {
                        let flipped = !mask.get(x.into(), y.into());
                        mask.set(x, y, flipped);
                    }
                }
            }
            check(&mask)?;
        }
    }

    #[test]
    fn checkerboard_is_all_single_pixels() {
        let mut mask = Mask::new(65, 9);
        for y in 0..9 {
            for x in 0..65 {
                mask.set(x, y, (x + y) % 2 == 0);
            }
        }
        check(&mask).unwrap();
        assert_eq!(trace_contours(&mask).len() as u64, mask.count());
    }

    #[test]
    fn a_full_image_is_one_rectangle_and_an_empty_one_nothing() {
        let mut mask = Mask::new(70, 3);
        assert!(trace_contours(&mask).is_empty());
        for y in 0..3 {
            mask.set_span(y, 0, 70);
        }
        let corners = [(0.0, 0.0), (70.0, 0.0), (70.0, 3.0), (0.0, 3.0)];
        assert_eq!(
            trace_contours(&mask),
            vec![corners.map(|(x, y)| DVec2::new(x, y)).to_vec()]
        );
    }

    #[test]
    fn a_ring_that_touches_itself_becomes_an_outer_loop_and_a_hole() {
        // The two ends meet only in a corner: followed as one loop, the corner would be passed twice.
        let mask = mask_of(&[
            "######.", //
            "#....#.", "#....#.", "#...#..", "#####..",
        ]);
        check(&mask).unwrap();
        let closed = mask_of(&[
            "#####.", //
            "#...#.", "#....#", "#....#", "######",
        ]);
        check(&closed).unwrap();
        let loops = trace_contours(&closed);
        let areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
        assert_eq!(loops.len(), 2, "{loops:?}");
        assert!(areas[0] > 0.0 && areas[1] < 0.0, "{areas:?}");
    }

    #[test]
    fn holes_in_islands_in_holes() {
        let mask = mask_of(&[
            "#######", //
            "#.....#", "#.###.#", "#.#.#.#", "#.###.#", "#.....#", "#######",
        ]);
        check(&mask).unwrap();
        let areas: Vec<f64> = trace_contours(&mask)
            .iter()
            .map(|l| signed_area(l))
            .collect();
        assert_eq!(areas, [49.0, -25.0, 9.0, -1.0]);
    }
}
