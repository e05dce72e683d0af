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

/// A range of x₁ − x₂ between corresponding points of the two views: how near and how far geometry can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parallax {
    /// That of the farthest point.
    pub(crate) least: f64,
    /// That of the nearest point.
    pub(crate) greatest: f64,
}

impl Parallax {
    /// No limit, not even that rays meet in front of the eyes.
    pub(crate) const ANY: Self = Self {
        least: f64::NEG_INFINITY,
        greatest: f64::INFINITY,
    };
}

/// Which pairs of intervals are kept, and how much of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairRule<'a> {
    /// Only pairs within a clique.
    pub(crate) cuts: &'a Cuts,
    /// Only the part of a pair with this parallax.
    pub(crate) parallax: Parallax,
}

impl PairRule<'_> {
    /// The interpolation of two intervals; `None` when no point of theirs has an allowed parallax.
    ///
    /// Points x₁ and x₂ of the intervals with parallax d interpolate to x₁ − αd, or x₂ + (1 − α)d. Where the rays of two ends
    /// meet too near or too far on the whole slab, the end is what the last allowed depth gives.
    fn pair(&self, i: &Interval, j: &Interval, alpha: f64) -> Option<Interval> {
        let Parallax { least, greatest } = self.parallax;
        let always = |a: Side, b: Side, test: &dyn Fn(f64) -> bool| {
            test(a.top - b.top) && test(a.bottom - b.bottom)
        };
        let (too_far, too_near) = (|d: f64| d < least, |d: f64| d > greatest);
        if always(i.exit, j.enter, &too_far) || always(i.enter, j.exit, &too_near) {
            return None;
        }
        // The rays of the left ends meet too far off: the leftmost allowed pair keeps x₂ and moves x₁ right, and so on.
        let enter = if always(i.enter, j.enter, &too_far) {
            j.enter.shifted((1.0 - alpha) * least)
        } else if always(i.enter, j.enter, &too_near) {
            i.enter.shifted(-alpha * greatest)
        } else {
            i.enter.lerp(j.enter, alpha)
        };
        let exit = if always(i.exit, j.exit, &too_far) {
            i.exit.shifted(-alpha * least)
        } else if always(i.exit, j.exit, &too_near) {
            j.exit.shifted((1.0 - alpha) * greatest)
        } else {
            i.exit.lerp(j.exit, alpha)
        };
        // Where the limits are reached within the slab only, the whole pair is kept.
        if enter.top <= exit.top && enter.bottom <= exit.bottom {
            return Some(Interval { enter, exit });
        }
        Some(Interval {
            enter: i.enter.lerp(j.enter, alpha),
            exit: i.exit.lerp(j.exit, alpha),
        })
    }
}

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
        rule: &PairRule<'_>,
        alpha: f64,
        output: &mut Connector,
    ) {
        if one.is_empty() || two.is_empty() {
            return;
        }
        if let ([i], [j]) = (one, two) {
            let enter = i.enter.lerp(j.enter, alpha);
            let exit = i.exit.lerp(j.exit, alpha);
            output.push(heights, &[Interval { enter, exit }], (0.0, 1.0));
            return;
        }
        self.pairs.clear();
        let (mut i0, mut j0) = (0, 0);
        let end = (one.len() as u32, two.len() as u32);
        for &(i1, j1) in rule.cuts.iter().chain(&[end]) {
            for i in &one[i0..i1 as usize] {
                let in_clique = &two[j0..j1 as usize];
                self.pairs
                    .extend(in_clique.iter().filter_map(|j| rule.pair(i, j, alpha)));
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
