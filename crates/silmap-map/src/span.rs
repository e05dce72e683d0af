//! Interpolating the spans of two views on one slab (section 5.3).
//!
//! Source: Silhouette Mapping, section 5.3: single intervals, pants, n-legged pants and cliques. An interval i of the first
//! view and an interval j of the second interpolate to one interval, end by end; the span is the union over the pairs that
//! are kept. All pairs give the image of the two-view visual hull; cliques keep fewer.

use crate::connect::Connector;
use crate::sweep::{Interval, Side, insertion_sort};

/// Where the intervals of two views are cut into cliques: cliques end before interval `.0` of the first view and `.1` of the
/// second. Pairs are kept within a clique only.
pub(crate) type Cuts = Vec<(u32, u32)>;

/// Buffers for one slab.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanScratch {
    pairs: Vec<Interval>,
    splits: Vec<f64>,
    order: Vec<u32>,
    union: Vec<Interval>,
}

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
        let pair = |i: &Interval, j: &Interval| Interval {
            enter: i.enter.lerp(j.enter, alpha),
            exit: i.exit.lerp(j.exit, alpha),
        };
        if let ([i], [j]) = (one, two) {
            output.push(heights, &[pair(i, j)], (0.0, 1.0));
            return;
        }
        self.pairs.clear();
        let (mut i0, mut j0) = (0, 0);
        for &(i1, j1) in cuts.iter().chain(&[(one.len() as u32, two.len() as u32)]) {
            for i in &one[i0..i1 as usize] {
                self.pairs
                    .extend(two[j0..j1 as usize].iter().map(|j| pair(i, j)));
            }
            (i0, j0) = (i1 as usize, j1 as usize);
        }
        self.push_union(heights, output);
    }

    /// Adds the union of `self.pairs` to `output`, splitting the slab where its structure changes (where pants open).
    fn push_union(&mut self, (y_top, y_bottom): (f64, f64), output: &mut Connector) {
        self.unite_at(0.5);
        if self.is_uniform() {
            output.push((y_top, y_bottom), &self.union, (0.0, 1.0));
            return;
        }
        find_splits(&self.pairs, &mut self.splits);
        let mut from = 0.0;
        let mut y_from = y_top;
        for k in 0..=self.splits.len() {
            let (to, y_to) = match self.splits.get(k) {
                Some(&share) => (share, y_top + (y_bottom - y_top) * share),
                None => (1.0, y_bottom),
            };
            self.unite_at(0.5 * (from + to));
            output.push((y_from, y_to), &self.union, (from, to));
            (from, y_from) = (to, y_to);
        }
    }

    /// Whether `self.union`, found half-way, is the union on the whole slab.
    fn is_uniform(&self) -> bool {
        let at = |end: fn(Side) -> f64| is_uniform_at(&self.pairs, &self.order, &self.union, end);
        at(|side| side.top) && at(|side| side.bottom)
    }

    /// Writes the union of the pairs, as it is at a share of the slab where no sides cross, to `self.union`.
    fn unite_at(&mut self, share: f64) {
        let pairs = &self.pairs;
        self.order.clear();
        self.order.extend(0..pairs.len() as u32);
        insertion_sort(&mut self.order, |&k| pairs[k as usize].enter.at(share));
        self.union.clear();
        for &k in &self.order {
            let pair = pairs[k as usize];
            match self.union.last_mut() {
                Some(last) if pair.enter.at(share) <= last.exit.at(share) => {
                    if pair.exit.at(share) > last.exit.at(share) {
                        last.exit = pair.exit;
                    }
                }
                _ => self.union.push(pair),
            }
        }
    }
}

/// Whether the parts of the union that were found half-way are those of both borders too. May say no where they are, never
/// yes where they are not.
fn is_uniform_at(
    pairs: &[Interval],
    order: &[u32],
    union: &[Interval],
    end: impl Fn(Side) -> f64,
) -> bool {
    let mut reached = f64::NEG_INFINITY;
    let mut parts = union.iter();
    let Some(mut part) = parts.next() else {
        return true;
    };
    for &k in order {
        let pair = pairs[k as usize];
        if pair.enter.at(0.5) > part.exit.at(0.5) {
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
