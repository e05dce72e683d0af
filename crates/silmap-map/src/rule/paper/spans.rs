//! Interpolating the spans of two views on one slab (section 5.3).
//!
//! Source: Silhouette Mapping, section 5.3: single intervals, pants, n-legged pants and cliques. An interval i of the first
//! view and an interval j of the second interpolate to one interval, end by end; the span is the union over the pairs that
//! are kept. All pairs give the image of the two-view visual hull; cliques keep fewer. (Where all pairs are kept, see `within`.)

use crate::sweep::interval::{Interval, Side, insertion_sort};
use crate::sweep::loop_builder::Connector;

/// Where the intervals of two views are cut into cliques: cliques end before interval `.0` of the first view and `.1` of the
/// second. Pairs are kept within a clique only.
pub(crate) type Cuts = Vec<(u32, u32)>;

/// Buffers for one slab.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanScratch {
    intervals: Vec<Interval>,
    splits: Vec<f64>,
    order: Vec<u32>,
    union: Vec<Interval>,
    reaches: Vec<Reach>,
}

/// How far an interval reaches at both borders of a part of the slab: negated to the left, so that more is farther.
type Reach = [f64; 4];

impl SpanScratch {
    /// Interpolates the spans `one` and `two` at `alpha` on the slab between the two heights, and adds the result to
    /// `output`.
    ///
    /// An empty span in either view leaves the slab empty: no geometry lies in that epipolar plane.
    pub(crate) fn interpolate(
        &mut self,
        heights: (f64, f64),
        (one, two): (&[Interval], &[Interval]),
        cuts: &Cuts,
        alpha: f64,
        output: &mut Connector,
    ) {
        if one.is_empty() || two.is_empty() {
            return;
        }
        self.intervals.clear();
        let (mut i0, mut j0) = (0, 0);
        let end = (one.len() as u32, two.len() as u32);
        for &(i1, j1) in cuts.iter().chain(&[end]) {
            for i in &one[i0..i1 as usize] {
                let pairs = two[j0..j1 as usize].iter().map(|j| Interval {
                    enter: i.enter.lerp(j.enter, alpha),
                    exit: i.exit.lerp(j.exit, alpha),
                });
                self.intervals.extend(pairs);
            }
            (i0, j0) = (i1 as usize, j1 as usize);
        }
        if are_disjoint(&self.intervals) {
            output.push(heights, &self.intervals, (0.0, 1.0));
        } else {
            self.push_union(heights, (0.0, 1.0), output);
        }
    }

    /// Adds the union of `self.intervals` over a part of the slab to `output`, splitting it where the union's structure
    /// changes (where pants open).
    fn push_union(&mut self, heights: (f64, f64), (from, to): (f64, f64), output: &mut Connector) {
        let y_at = |share: f64| height_at(heights, share);
        self.leave_out_covered((from, to));
        self.unite_at(0.5 * (from + to));
        if self.is_uniform((from, to)) {
            output.push((y_at(from), y_at(to)), &self.union, (from, to));
            return;
        }
        find_splits(&self.intervals, &mut self.splits);
        self.splits.retain(|&share| from < share && share < to);
        self.splits.push(to);
        let mut start = from;
        for k in 0..self.splits.len() {
            let end = self.splits[k];
            self.unite_at(0.5 * (start + end));
            output.push((y_at(start), y_at(end)), &self.union, (start, end));
            start = end;
        }
    }

    /// Leaves out intervals that one other covers on the whole part: most do where many pairs are kept, and what follows takes long
    /// for many. Of two that are the same the first stays.
    fn leave_out_covered(&mut self, (from, to): (f64, f64)) {
        self.reaches.clear();
        self.reaches.extend(self.intervals.iter().map(|i| {
            let (enter, exit) = (i.enter, i.exit);
            [-enter.at(from), -enter.at(to), exit.at(from), exit.at(to)]
        }));
        let covers = |a: &Reach, b: &Reach| a.iter().zip(b).all(|(a, b)| a >= b);
        let reaches = &self.reaches;
        let mut k = 0;
        self.intervals.retain(|_| {
            let own = &reaches[k];
            let (before, after) = (&reaches[..k], &reaches[k + 1..]);
            k += 1;
            let is_covered = before.iter().any(|other| covers(other, own))
                || after.iter().any(|other| covers(other, own) && other != own);
            !is_covered
        });
    }

    /// Whether `self.union`, found half-way, is the union on the whole part.
    fn is_uniform(&self, (from, to): (f64, f64)) -> bool {
        let middle = 0.5 * (from + to);
        let at =
            |share: f64| is_uniform_at(&self.intervals, &self.order, &self.union, (middle, share));
        at(from) && at(to)
    }

    /// Writes the union of the intervals, as it is at a share of the slab where no sides cross, to `self.union`.
    fn unite_at(&mut self, share: f64) {
        let intervals = &self.intervals;
        self.order.clear();
        self.order.extend(0..intervals.len() as u32);
        insertion_sort(&mut self.order, |&k| intervals[k as usize].enter.at(share));
        self.union.clear();
        for &k in &self.order {
            let interval = intervals[k as usize];
            match self.union.last_mut() {
                Some(last) if interval.enter.at(share) <= last.exit.at(share) => {
                    if interval.exit.at(share) > last.exit.at(share) {
                        last.exit = interval.exit;
                    }
                }
                _ => self.union.push(interval),
            }
        }
    }
}

/// The height at a share of a slab; exact at its borders.
fn height_at(heights: (f64, f64), share: f64) -> f64 {
    match share {
        0.0 => heights.0,
        1.0 => heights.1,
        _ => heights.0 + (heights.1 - heights.0) * share,
    }
}

/// Whether intervals follow each other from left to right on the whole slab.
fn are_disjoint(intervals: &[Interval]) -> bool {
    intervals.windows(2).all(|pair| {
        let (exit, enter) = (pair[0].exit, pair[1].enter);
        exit.top.x < enter.top.x && exit.bottom.x < enter.bottom.x
    })
}

/// Whether the parts of the union that were found half-way are those of both borders too. May say no where they are, never
/// yes where they are not.
fn is_uniform_at(
    pairs: &[Interval],
    order: &[u32],
    union: &[Interval],
    (middle, share): (f64, f64),
) -> bool {
    let end = |side: Side| side.at(share);
    let mut reached = f64::NEG_INFINITY;
    let mut parts = union.iter();
    let Some(mut part) = parts.next() else {
        return true;
    };
    for &k in order {
        let pair = pairs[k as usize];
        if pair.enter.at(middle) > part.exit.at(middle) {
            if reached != end(part.exit) {
                return false;
            }
            match parts.next() {
                Some(next) if end(next.enter) >= reached => part = next,
                _ => return false,
            }
            reached = f64::NEG_INFINITY;
        }
        let connected = reached == f64::NEG_INFINITY || end(pair.enter) <= reached;
        if !connected || end(pair.enter) < end(part.enter) {
            return false;
        }
        reached = reached.max(end(pair.exit));
    }
    reached == end(part.exit)
}

/// The shares of the slab, ascending, at which any two sides of different intervals cross.
fn find_splits(intervals: &[Interval], splits: &mut Vec<f64>) {
    splits.clear();
    for (k, a) in intervals.iter().enumerate() {
        for b in &intervals[k + 1..] {
            let ends: [(Side, Side); 4] = [
                (a.enter, b.exit),
                (a.exit, b.enter),
                (a.enter, b.enter),
                (a.exit, b.exit),
            ];
            splits.extend(ends.iter().filter_map(|(p, q)| p.crossing(*q)));
        }
    }
    splits.sort_unstable_by(f64::total_cmp);
    splits.dedup();
}
