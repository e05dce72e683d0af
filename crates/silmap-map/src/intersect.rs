//! The part of the image that several regions share, as simple loops.
//!
//! The three two-step orders of an eye each give a region that holds the true silhouette, so their intersection does too,
//! and it depends on no order. The regions nearly coincide and have few crossings, which suits the slab sweep: within a slab
//! every side is linear, and slabs are split where sides cross.

use crate::connect::{Connector, Slack};
use crate::loops::FlatLoops;
use crate::sweep::{Interval, Side, Sweep, merge_heights};

/// Coordinates are pixels here: a thousandth of one is far below what is stored.
const SLACK_PX: Slack = Slack(1e-3);

/// Buffers for intersecting up to three regions.
#[derive(Clone, Debug, Default)]
pub(crate) struct IntersectScratch {
    sweeps: [Sweep; 3],
    intervals: [Vec<Interval>; 3],
    heights: Vec<f64>,
    splits: Vec<f64>,
    shared: Vec<Interval>,
    partial: Vec<Interval>,
    connector: Connector,
}

impl IntersectScratch {
    /// Writes the loops that bound the intersection of `regions` (each even-odd, without crossings) to `output`.
    pub(crate) fn intersect(&mut self, regions: [&FlatLoops; 3], output: &mut FlatLoops) {
        for (sweep, region) in self.sweeps.iter_mut().zip(regions) {
            sweep.restart(region);
        }
        let [a, b, c] = &self.sweeps;
        merge_heights(&[a.heights(), b.heights(), c.heights()], &mut self.heights);
        self.connector.clear();
        for k in 1..self.heights.len() {
            let (y_top, y_bottom) = (self.heights[k - 1], self.heights[k]);
            for (sweep, intervals) in self.sweeps.iter_mut().zip(&mut self.intervals) {
                sweep.step(y_top, y_bottom, intervals);
            }
            if self.intervals.iter().any(Vec::is_empty) {
                continue;
            }
            self.push_slab(y_top, y_bottom);
        }
        self.connector.finish(SLACK_PX, output);
    }

    fn push_slab(&mut self, y_top: f64, y_bottom: f64) {
        find_crossings(&self.intervals, &mut self.splits);
        let (mut from, mut y_from) = (0.0, y_top);
        for k in 0..=self.splits.len() {
            let (to, y_to) = match self.splits.get(k) {
                Some(&share) => (share, y_top + (y_bottom - y_top) * share),
                None => (1.0, y_bottom),
            };
            let middle = 0.5 * (from + to);
            let [a, b, c] = &self.intervals;
            shared_at(a, b, middle, &mut self.partial);
            shared_at(&self.partial, c, middle, &mut self.shared);
            self.connector
                .push((y_from, y_to), &self.shared, (from, to));
            (from, y_from) = (to, y_to);
        }
    }
}

/// Intersection of two sorted spans, as it is at `share`.
fn shared_at(one: &[Interval], two: &[Interval], share: f64, output: &mut Vec<Interval>) {
    output.clear();
    let later = |p: Side, q: Side| if p.at(share) >= q.at(share) { p } else { q };
    let earlier = |p: Side, q: Side| if p.at(share) <= q.at(share) { p } else { q };
    for i in one {
        for j in two {
            let shared = Interval {
                enter: later(i.enter, j.enter),
                exit: earlier(i.exit, j.exit),
            };
            if shared.enter.at(share) < shared.exit.at(share) {
                output.push(shared);
            }
        }
    }
}

/// The shares at which sides of different regions cross.
fn find_crossings(spans: &[Vec<Interval>; 3], splits: &mut Vec<f64>) {
    splits.clear();
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        for i in &spans[a] {
            for j in &spans[b] {
                for p in [i.enter, i.exit] {
                    splits.extend([j.enter, j.exit].iter().filter_map(|q| p.crossing(*q)));
                }
            }
        }
    }
    splits.sort_unstable_by(f64::total_cmp);
    splits.dedup();
}

#[cfg(test)]
mod tests {
    use super::*;
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
            // Pixel centres within the slack of an outline may fall on either side.
            prop_assert!(got.count_different(&expected) <= 1, "{} differ", got.count_different(&expected));
            let area: f64 = output.iter().map(signed_area).sum();
            prop_assert!((area - expected.count() as f64).abs() < 140.0, "orientation or area is off: {area}");
        }
    }
}
