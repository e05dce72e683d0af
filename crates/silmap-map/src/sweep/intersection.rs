//! The part of the image that three regions share, as simple loops.
//!
//! The three two-step orders of an eye each give a region. Conservative regions all hold the true silhouette, so their
//! intersection does too, and it is the same whatever order comes first. The regions nearly coincide and have few crossings,
//! which suits a sweep: between two rows every side is linear, and only where sides cross is anything found anew.

use glam::{DVec4, Vec4Swizzles};

use crate::loops::{DeepLoops, SeenLoops};
use crate::sweep::coverage::CoverageSweep;
use crate::sweep::crossing::{NOWHERE, widen_by_crossing};
use crate::sweep::cursor::{ChainCursor, SweepCursor};
use crate::sweep::loop_builder::LoopBuilder;
use crate::sweep::monotone_chain::MonotoneChains;
use crate::sweep::sleeve::Slack;
use crate::tidy::is_speck;

/// Parts with fewer vertices than this are visited row by row at once.
const FEWEST_FOLLOWED: u32 = 12;

/// Coordinates are pixels here: this is about what contours are rounded to.
const SLACK_PX: f64 = 0.05;

/// The intersection of three regions, with its buffers.
#[derive(Clone, Debug, Default)]
pub struct RegionIntersection {
    chains: [MonotoneChains; 3],
    cursors: [SweepCursor; 3],
    side_ends: Vec<usize>,
    is_bent: Vec<bool>,
    cover: CoverageSweep,
    builder: LoopBuilder,
    loops: DeepLoops,
}

impl RegionIntersection {
    /// Writes the loops that bound what all `regions` (each even-odd, without crossings) cover to `output`.
    pub fn intersect(&mut self, regions: [&SeenLoops; 3], output: &mut SeenLoops) {
        for ((chains, cursor), region) in
            (self.chains.iter_mut().zip(&mut self.cursors)).zip(regions)
        {
            chains.clear();
            for points in region.iter() {
                for p in points {
                    chains.push(*p);
                }
                chains.close(SLACK_PX);
            }
            chains.seal();
            cursor.restart();
        }
        self.builder.clear();
        self.sweep();
        self.cover.finish(&mut self.builder);
        let slack = Slack {
            line: SLACK_PX,
            depth: f64::INFINITY,
            hair: 0.0,
        };
        self.loops.clear();
        self.builder.finish(slack, &mut self.loops);
        output.clear();
        for points in self.loops.iter() {
            for p in points {
                output.push(p.xyz());
            }
            output.close_unless(is_speck);
        }
    }

    fn sweep(&mut self) {
        let mut y = (self.chains.iter()).fold(f64::INFINITY, |y, c| y.min(c.first_y()));
        while y.is_finite() {
            let mut end = f64::INFINITY;
            for (cursor, chains) in self.cursors.iter_mut().zip(&self.chains) {
                cursor.enter(chains, y);
                end = end.min(cursor.end(chains));
            }
            if !end.is_finite() {
                return;
            }
            if self.cursors.iter().all(|w| w.n_intervals() > 0) {
                self.visit((y, end));
            }
            y = end;
        }
    }

    /// Intersects between two heights where no chain ends: side by side where the regions' intervals belong together one by
    /// one, and slab by slab where they do not.
    fn visit(&mut self, (mut y, end): (f64, f64)) {
        while y < end {
            let mut bottom = end;
            while !self.follow((y, bottom)) {
                let middle = 0.5 * (y + bottom);
                if self.count_vertices(bottom) < FEWEST_FOLLOWED || middle <= y {
                    self.visit_rows((y, bottom));
                    break;
                }
                bottom = middle;
            }
            y = bottom;
        }
    }

    /// Vertices of all regions from where the walks are down to height `y`.
    fn count_vertices(&self, y: f64) -> u32 {
        let views = self.cursors.iter().zip(&self.chains);
        views.map(|(w, c)| w.count_vertices(c, y)).sum()
    }

    /// Intersects side by side; false, with nothing done, where intervals do not belong together one by one.
    fn follow(&mut self, heights: (f64, f64)) -> bool {
        let [a, b, c] = &self.cursors;
        let n_sides = a.chain_cursors().len();
        if [b, c].iter().any(|w| w.chain_cursors().len() != n_sides) || !self.are_apart(heights.1) {
            return false;
        }
        self.cover.finish(&mut self.builder);
        self.builder.begin_slab(heights.0);
        self.side_ends.clear();
        let points = self.builder.points();
        let start = points.len();
        let mut from = start;
        for k in 0..n_sides {
            let chain_cursors = [a, b, c].map(|w| w.chain_cursors()[k]);
            // What all cover begins at the last of their left sides, and ends at the first of their right ones.
            if k % 2 == 0 {
                follow_last(&self.chains, chain_cursors, heights, 1.0, points);
            } else {
                follow_last(&self.chains, chain_cursors, heights, -1.0, points);
            }
            let end = points.len();
            if let Some(&before) = self.side_ends.last() {
                let mut crossing = NOWHERE;
                widen_by_crossing(&points[from..before], &points[before..end], &mut crossing);
                if crossing != NOWHERE {
                    points.truncate(start);
                    return false;
                }
            }
            from = self.side_ends.last().copied().unwrap_or(start);
            self.side_ends.push(end);
        }
        self.builder.end_followed(start, &self.side_ends, heights.1);
        for (cursor, chains) in self.cursors.iter_mut().zip(&self.chains) {
            cursor.advance(chains, heights.1);
        }
        true
    }

    /// Whether each interval of every region lies left of the next of every other.
    fn are_apart(&self, y_bottom: f64) -> bool {
        let n_sides = self.cursors[0].chain_cursors().len();
        let views = || self.cursors.iter().zip(&self.chains);
        (2..n_sides).step_by(2).all(|k| {
            let range = |w: &SweepCursor, chains: &MonotoneChains, k: usize| {
                w.chain_cursors()[k].x_range(chains, y_bottom)
            };
            let rightmost = views().map(|(w, c)| range(w, c, k - 1).1);
            let leftmost = views().map(|(w, c)| range(w, c, k).0);
            rightmost.fold(f64::NEG_INFINITY, f64::max) < leftmost.fold(f64::INFINITY, f64::min)
        })
    }

    /// Intersects row by row, between vertices of any region.
    fn visit_rows(&mut self, (y_top, y_bottom): (f64, f64)) {
        let n_ends = self.cursors.iter().map(|w| w.chain_cursors().len()).sum();
        self.cover.begin(3, n_ends);
        let mut y = y_top;
        loop {
            self.is_bent.clear();
            let chain_cursors = self.cursors.iter().flat_map(SweepCursor::chain_cursors);
            for (end, cursor) in self.cover.next_row().iter_mut().zip(chain_cursors) {
                *end = cursor.place(y).extend(0.0);
                self.is_bent.push(cursor.next_y() <= y);
            }
            let is_bent = |end: usize| self.is_bent[end];
            self.cover.step(y, is_bent, &mut self.builder);
            for (cursor, chains) in self.cursors.iter_mut().zip(&self.chains) {
                cursor.advance(chains, y);
            }
            if y >= y_bottom {
                break;
            }
            y = (self.cursors.iter()).fold(y_bottom, |least, w| least.min(w.next_vertex()));
        }
        self.cover.end();
    }
}

/// Appends the side that is, at each height, the last of three in the direction of `sign` to `points`.
fn follow_last(
    chains: &[MonotoneChains; 3],
    mut chain_cursors: [ChainCursor; 3],
    (y_top, y_bottom): (f64, f64),
    sign: f64,
    points: &mut Vec<DVec4>,
) {
    let last = |xs: &[f64; 3]| (xs[0] * sign).max(xs[1] * sign).max(xs[2] * sign) * sign;
    let mut y = y_top;
    let mut before: Option<([f64; 3], f64)> = None;
    loop {
        let xs = [0, 1, 2].map(|k: usize| chain_cursors[k].at(y).x);
        if let Some((old, y_old)) = before {
            for share in crossings(&old, &xs).into_iter().flatten() {
                let mixed = [0, 1, 2].map(|k: usize| old[k] + (xs[k] - old[k]) * share);
                let y = y_old + (y - y_old) * share;
                points.push(DVec4::new(last(&mixed), y, 0.0, 0.0));
            }
        }
        points.push(DVec4::new(last(&xs), y, 0.0, 0.0));
        if y >= y_bottom {
            return;
        }
        before = Some((xs, y));
        let mut next = y_bottom;
        for (cursor, chains) in chain_cursors.iter_mut().zip(chains) {
            if cursor.next_y() <= y {
                cursor.advance(chains, y);
            }
            next = next.min(cursor.next_y());
        }
        y = next;
    }
}

/// The shares of the way from one triple to another at which two of the numbers are equal, ascending.
fn crossings(from: &[f64; 3], to: &[f64; 3]) -> [Option<f64>; 3] {
    let mut shares = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| {
        let (above, below) = (from[i] - from[j], to[i] - to[j]);
        let is_crossed = above * below < 0.0;
        is_crossed.then(|| above / (above - below))
    });
    if shares.iter().flatten().count() > 1 {
        shares.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loops::FlatLoops;
    use glam::DVec2;
    use proptest::prelude::*;
    use silmap_geometry::polygon::{fill_even_odd, signed_area};
    use silmap_geometry::{Loop, Mask};

    /// A star-shaped loop: simple whatever the radii are.
    fn star(radii: &[f64], center: DVec2) -> Loop {
        let n = radii.len() as f64;
        let point = |(k, r): (usize, &f64)| {
            let (sin, cos) = (k as f64 / n * std::f64::consts::TAU).sin_cos();
            center + DVec2::new(cos, sin) * *r
        };
        radii.iter().enumerate().map(point).collect()
    }

    fn any_star() -> impl Strategy<Value = Loop> {
        let radii = prop::collection::vec(
            prop::sample::select(vec![4.0, 10.0, 10.5, 17.25, 30.0]),
            3..20,
        );
        (radii, 30.0..36.0_f64, 30.0..36.0_f64).prop_map(|(r, x, y)| star(&r, DVec2::new(x, y)))
    }

    /// Pixel centres within the slack of an outline may fall on either side: how many lie there.
    fn near_outlines(loops: &[Loop]) -> f64 {
        let length: f64 = loops
            .iter()
            .flatten()
            .zip(loops.iter().flatten().skip(1))
            .map(|(a, b)| a.distance(*b))
            .sum();
        2.0 * SLACK_PX * length
    }

    proptest! {
        #[test]
        fn intersection_fills_the_pixels_all_three_fill(loops in prop::array::uniform3(any_star())) {
            let regions = loops.clone().map(|l| {
                let mut seen = SeenLoops::default();
                l.iter().for_each(|p| seen.push(p.extend(0.0)));
                seen.close();
                seen
            });
            let mut output = SeenLoops::default();
            let [a, b, c] = &regions;
            RegionIntersection::default().intersect([a, b, c], &mut output);
            let (mut expected, mut filled, mut got) = (Mask::new(66, 66), Mask::new(66, 66), Mask::new(66, 66));
            fill_even_odd(&loops[..1], &mut expected);
            for l in &loops[1..] {
                fill_even_odd(std::slice::from_ref(l), &mut filled);
                expected.intersect(&filled);
            }
            let mut flat = FlatLoops::default();
            output.flatten_to(&mut flat);
            fill_even_odd(flat.iter(), &mut got);
            prop_assert!(got.count_different(&expected) as f64 <= near_outlines(&loops), "{} differ", got.count_different(&expected));
            let area: f64 = flat.iter().map(signed_area).sum();
            prop_assert!((area - expected.count() as f64).abs() < 140.0, "orientation or area is off: {area}");
        }
    }
}
