//! The part of the image that three regions share, as simple loops.
//!
//! The three two-step orders of an eye each give a region. Conservative regions all hold the true silhouette, so their
//! intersection does too, and it is the same whatever order comes first. The regions nearly coincide and have few crossings,
//! which suits a sweep: between two rows every side is linear, and only where sides cross is anything found anew.

use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};

use crate::loops::{DeepLoops, FlatLoops};
use crate::sweep::coverage::Cover;
use crate::sweep::follow::do_cross;
use crate::sweep::loop_builder::{Connector, Slack};
use crate::sweep::monotone_chain::{Chains, Strand, Walker};

/// Parts with fewer vertices than this are visited row by row at once.
const FEWEST_FOLLOWED: u32 = 12;

/// Coordinates are pixels here: this is about what contours are rounded to.
const SLACK_PX: f64 = 0.05;

/// Loops of a smaller area, in square pixels, are specks that thinned-out sides leave where they cross.
const SPECK_PX2: f64 = 0.05;

/// Buffers for intersecting three regions.
#[derive(Clone, Debug, Default)]
pub(crate) struct IntersectScratch {
    chains: [Chains; 3],
    walkers: [Walker; 3],
    side_ends: Vec<usize>,
    is_bent: Vec<bool>,
    cover: Cover,
    connector: Connector,
    loops: DeepLoops,
}

impl IntersectScratch {
    /// Writes the loops that bound what all `regions` (each even-odd, without crossings) cover to `output`.
    pub(crate) fn intersect(&mut self, regions: [&FlatLoops; 3], output: &mut FlatLoops) {
        for ((chains, walker), region) in
            (self.chains.iter_mut().zip(&mut self.walkers)).zip(regions)
        {
            chains.clear();
            for points in region.iter() {
                for p in points {
                    chains.push(DVec3::new(p.x, p.y, 0.0));
                }
                chains.close(SLACK_PX);
            }
            chains.seal();
            walker.restart();
        }
        self.connector.clear();
        self.sweep();
        self.cover.finish(&mut self.connector);
        let slack = Slack {
            line: SLACK_PX,
            depth: f64::INFINITY,
            hair: 0.0,
        };
        self.connector.finish(slack, &mut self.loops);
        output.clear();
        for points in self.loops.iter() {
            for p in points {
                output.push(p.xy());
            }
            output.close_unless(is_speck);
        }
    }

    fn sweep(&mut self) {
        let mut y = (self.chains.iter()).fold(f64::INFINITY, |y, c| y.min(c.first_y()));
        while y.is_finite() {
            let mut end = f64::INFINITY;
            for (walker, chains) in self.walkers.iter_mut().zip(&self.chains) {
                walker.enter(chains, y);
                end = end.min(walker.end(chains));
            }
            if !end.is_finite() {
                return;
            }
            if self.walkers.iter().all(|w| w.n_intervals() > 0) {
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
        let views = self.walkers.iter().zip(&self.chains);
        views.map(|(w, c)| w.count_vertices(c, y)).sum()
    }

    /// Intersects side by side; false, with nothing done, where intervals do not belong together one by one.
    fn follow(&mut self, heights: (f64, f64)) -> bool {
        let [a, b, c] = &self.walkers;
        let n_sides = a.strands().len();
        if [b, c].iter().any(|w| w.strands().len() != n_sides) || !self.are_apart(heights.1) {
            return false;
        }
        self.cover.finish(&mut self.connector);
        self.connector.begin_slab(heights.0);
        self.side_ends.clear();
        let points = self.connector.points();
        let start = points.len();
        let mut from = start;
        for k in 0..n_sides {
            let strands = [a, b, c].map(|w| w.strands()[k]);
            // What all cover begins at the last of their left sides, and ends at the first of their right ones.
            if k % 2 == 0 {
                follow_last(&self.chains, strands, heights, 1.0, points);
            } else {
                follow_last(&self.chains, strands, heights, -1.0, points);
            }
            let end = points.len();
            if let Some(&before) = self.side_ends.last()
                && do_cross(&points[from..before], &points[before..end])
            {
                points.truncate(start);
                return false;
            }
            from = self.side_ends.last().copied().unwrap_or(start);
            self.side_ends.push(end);
        }
        self.connector
            .end_followed(start, &self.side_ends, heights.1);
        for (walker, chains) in self.walkers.iter_mut().zip(&self.chains) {
            walker.advance(chains, heights.1);
        }
        true
    }

    /// Whether each interval of every region lies left of the next of every other.
    fn are_apart(&self, y_bottom: f64) -> bool {
        let n_sides = self.walkers[0].strands().len();
        let views = || self.walkers.iter().zip(&self.chains);
        (2..n_sides).step_by(2).all(|k| {
            let range =
                |w: &Walker, chains: &Chains, k: usize| w.strands()[k].x_range(chains, y_bottom);
            let rightmost = views().map(|(w, c)| range(w, c, k - 1).1);
            let leftmost = views().map(|(w, c)| range(w, c, k).0);
            rightmost.fold(f64::NEG_INFINITY, f64::max) < leftmost.fold(f64::INFINITY, f64::min)
        })
    }

    /// Intersects row by row, between vertices of any region.
    fn visit_rows(&mut self, (y_top, y_bottom): (f64, f64)) {
        let n_ends = self.walkers.iter().map(|w| w.strands().len()).sum();
        self.cover.begin(3, n_ends);
        let mut y = y_top;
        loop {
            self.is_bent.clear();
            let strands = self.walkers.iter().flat_map(Walker::strands);
            for (end, strand) in self.cover.next_row().iter_mut().zip(strands) {
                *end = strand.place(y).extend(0.0);
                self.is_bent.push(strand.next_y() <= y);
            }
            let is_bent = |end: usize| self.is_bent[end];
            self.cover.step(y, is_bent, &mut self.connector);
            for (walker, chains) in self.walkers.iter_mut().zip(&self.chains) {
                walker.advance(chains, y);
            }
            if y >= y_bottom {
                break;
            }
            y = (self.walkers.iter()).fold(y_bottom, |least, w| least.min(w.next_vertex()));
        }
        self.cover.end();
    }
}

/// Whether a loop, in pixels, is too small to be more than a trace of where sides cross.
pub(crate) fn is_speck(points: &[DVec2]) -> bool {
    double_area(points).abs() <= 2.0 * SPECK_PX2
}

fn double_area(points: &[DVec2]) -> f64 {
    let Some(&last) = points.last() else {
        return 0.0;
    };
    let steps = std::iter::once(&last).chain(points).zip(points);
    steps.map(|(a, b)| a.perp_dot(*b)).sum()
}

/// Appends the side that is, at each height, the last of three in the direction of `sign` to `points`.
fn follow_last(
    chains: &[Chains; 3],
    mut strands: [Strand; 3],
    (y_top, y_bottom): (f64, f64),
    sign: f64,
    points: &mut Vec<DVec4>,
) {
    let last = |xs: &[f64; 3]| (xs[0] * sign).max(xs[1] * sign).max(xs[2] * sign) * sign;
    let mut y = y_top;
    let mut before: Option<([f64; 3], f64)> = None;
    loop {
        let xs = [0, 1, 2].map(|k: usize| strands[k].at(y).x);
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
        for (strand, chains) in strands.iter_mut().zip(chains) {
            if strand.next_y() <= y {
                strand.advance(chains, y);
            }
            next = next.min(strand.next_y());
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
                let mut flat = FlatLoops::default();
                flat.assign([&l[..]]);
                flat
            });
            let mut output = FlatLoops::default();
            let [a, b, c] = &regions;
            IntersectScratch::default().intersect([a, b, c], &mut output);
            let (mut expected, mut filled, mut got) = (Mask::new(66, 66), Mask::new(66, 66), Mask::new(66, 66));
            fill_even_odd(&loops[..1], &mut expected);
            for l in &loops[1..] {
                fill_even_odd(std::slice::from_ref(l), &mut filled);
                expected.intersect(&filled);
            }
            fill_even_odd(output.iter(), &mut got);
            prop_assert!(got.count_different(&expected) as f64 <= near_outlines(&loops), "{} differ", got.count_different(&expected));
            let area: f64 = output.iter().map(signed_area).sum();
            prop_assert!((area - expected.count() as f64).abs() < 140.0, "orientation or area is off: {area}");
        }
    }
}
