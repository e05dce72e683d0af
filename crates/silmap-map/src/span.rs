//! Interpolating the spans of two views on one slab (section 5.3).
//!
//! Source: Silhouette Mapping, section 5.3: single intervals, pants, n-legged pants and cliques. An interval i of the first
//! view and an interval j of the second interpolate to one interval, end by end; the span is the union over the pairs that
//! are kept. All pairs give the image of the two-view visual hull; cliques keep fewer.

use crate::connect::Connector;
use crate::side::{Interval, Side, Touch, insertion_sort};

/// Where the intervals of two views are cut into cliques: cliques end before interval `.0` of the first view and `.1` of the
/// second. Pairs are kept within a clique only.
pub(crate) type Cuts = Vec<(u32, u32)>;

/// A range of x₁ − x₂ between corresponding points of the two views, across a slab: how near and how far geometry can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parallax {
    /// That of the farthest point.
    pub(crate) least: Limit,
    /// That of the nearest point.
    pub(crate) greatest: Limit,
}

/// A limit that is linear across a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limit {
    /// Value at the slab's top (smaller y).
    pub(crate) top: f64,
    /// Value at the slab's bottom.
    pub(crate) bottom: f64,
}

impl Parallax {
    /// Whether two ends that meet have an allowed parallax on the whole slab.
    fn allows(&self, one: Side, two: Side) -> bool {
        let within = |d: f64, least: f64, greatest: f64| least <= d && d <= greatest;
        within(one.top.x - two.top.x, self.least.top, self.greatest.top)
            && within(
                one.bottom.x - two.bottom.x,
                self.least.bottom,
                self.greatest.bottom,
            )
    }
}

impl Parallax {
    /// Whether no points of two intervals have an allowed parallax, on the whole slab.
    fn forbids(&self, i: &Interval, j: &Interval) -> bool {
        let is_beyond = |a: Side, b: Side, limit: Limit| {
            a.top.x - b.top.x >= limit.top && a.bottom.x - b.bottom.x >= limit.bottom
        };
        let is_short = |a: Side, b: Side, limit: Limit| {
            a.top.x - b.top.x <= limit.top && a.bottom.x - b.bottom.x <= limit.bottom
        };
        is_beyond(i.enter, j.exit, self.greatest) || is_short(i.exit, j.enter, self.least)
    }
}

/// The side moved by `factor` times a parallax, which is what its points are then taken to have.
fn moved(side: Side, parallax: Limit, factor: f64) -> Side {
    let at = |t: Touch, disparity: f64| Touch {
        x: t.x + factor * disparity,
        disparity,
        slide: 0.0,
    };
    Side {
        top: at(side.top, parallax.top),
        bottom: at(side.bottom, parallax.bottom),
    }
}

/// Which pairs of intervals are kept, and how much of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairRule<'a> {
    /// Only pairs within a clique.
    pub(crate) cuts: &'a Cuts,
    /// Only the part of a pair with this parallax, if there is a limit.
    pub(crate) parallax: Option<Parallax>,
}

/// An interpolated pair of intervals: it enters at the last of some sides and leaves at the first of others.
///
/// Points x₁ and x₂ of the intervals with parallax d interpolate to x₁ − αd, or x₂ + (1 − α)d. Where the rays of two ends meet
/// too near or too far, the end is what the last allowed depth gives; where nothing is allowed, the sides have crossed.
#[derive(Clone, Copy, Debug)]
struct Pair {
    enters: [Side; 3],
    exits: [Side; 3],
}

impl Pair {
    fn new(i: &Interval, j: &Interval, alpha: f64, parallax: Option<Parallax>) -> Self {
        let (enter, exit) = (i.enter.lerp(j.enter, alpha), i.exit.lerp(j.exit, alpha));
        let Some(Parallax { least, greatest }) = parallax else {
            return Self {
                enters: [enter; 3],
                exits: [exit; 3],
            };
        };
        let beta = 1.0 - alpha;
        Self {
            enters: [
                enter,
                moved(j.enter, least, beta),
                moved(i.enter, greatest, -alpha),
            ],
            exits: [
                exit,
                moved(i.exit, least, -alpha),
                moved(j.exit, greatest, beta),
            ],
        }
    }

    /// The pair as one interval, when the same two sides bound it on the whole slab.
    fn as_interval(&self) -> Option<Interval> {
        let order = |a: &&Side, b: &&Side| a.top.x.total_cmp(&b.top.x);
        let enter = self.enters.iter().max_by(order)?;
        let exit = self.exits.iter().min_by(order)?;
        let is_last = self.enters.iter().all(|s| s.bottom.x <= enter.bottom.x);
        let is_first = self.exits.iter().all(|s| s.bottom.x >= exit.bottom.x);
        let is_there = enter.top.x <= exit.top.x && enter.bottom.x <= exit.bottom.x;
        (is_last && is_first && is_there).then_some(Interval {
            enter: *enter,
            exit: *exit,
        })
    }

    /// Whether some side at which the pair must be entered lies beyond one where it must be left, on the whole slab.
    fn is_nowhere(&self) -> bool {
        self.enters.iter().any(|enter| {
            let is_beyond =
                |exit: &Side| enter.top.x >= exit.top.x && enter.bottom.x >= exit.bottom.x;
            self.exits.iter().any(is_beyond)
        })
    }

    /// The sides that bound the pair at a share of the slab; `None` where nothing of it is allowed.
    fn at(&self, share: f64) -> Option<Interval> {
        let order = |a: &&Side, b: &&Side| a.at(share).total_cmp(&b.at(share));
        let enter = *self.enters.iter().max_by(order)?;
        let exit = *self.exits.iter().min_by(order)?;
        (enter.at(share) < exit.at(share)).then_some(Interval { enter, exit })
    }

    /// Adds the shares at which other sides begin to bound the pair.
    fn find_kinks(&self, kinks: &mut Vec<f64>) {
        for sides in [&self.enters, &self.exits] {
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                kinks.extend(sides[a].crossing(sides[b]));
            }
        }
        for enter in &self.enters {
            kinks.extend(self.exits.iter().filter_map(|exit| enter.crossing(*exit)));
        }
    }
}

/// Buffers for one slab.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanScratch {
    pairs: Vec<Pair>,
    kinks: Vec<f64>,
    intervals: Vec<Interval>,
    given: Vec<Interval>,
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
        rule: &PairRule<'_>,
        alpha: f64,
        output: &mut Connector,
    ) {
        if one.is_empty() || two.is_empty() {
            return;
        }
        if let ([i], [j]) = (one, two)
            && rule
                .parallax
                .is_none_or(|p| p.allows(i.enter, j.enter) && p.allows(i.exit, j.exit))
        {
            let enter = i.enter.lerp(j.enter, alpha);
            let exit = i.exit.lerp(j.exit, alpha);
            output.push(heights, &[Interval { enter, exit }], (0.0, 1.0));
            return;
        }
        self.pairs.clear();
        self.intervals.clear();
        let (mut i0, mut j0) = (0, 0);
        let end = (one.len() as u32, two.len() as u32);
        for &(i1, j1) in rule.cuts.iter().chain(&[end]) {
            for i in &one[i0..i1 as usize] {
                for j in &two[j0..j1 as usize] {
                    self.add_pair(i, j, alpha, rule.parallax);
                }
            }
            (i0, j0) = (i1 as usize, j1 as usize);
        }
        if !self.pairs.is_empty() {
            self.push_pairs(heights, output);
        } else if are_disjoint(&self.intervals) {
            output.push(heights, &self.intervals, (0.0, 1.0));
        } else {
            self.push_union(heights, (0.0, 1.0), output);
        }
    }

    /// Adds a pair of intervals: as one interval where the same sides bound it on the whole slab.
    fn add_pair(&mut self, i: &Interval, j: &Interval, alpha: f64, parallax: Option<Parallax>) {
        let Some(limits) =
            parallax.filter(|p| !(p.allows(i.enter, j.enter) && p.allows(i.exit, j.exit)))
        else {
            self.intervals.push(Interval {
                enter: i.enter.lerp(j.enter, alpha),
                exit: i.exit.lerp(j.exit, alpha),
            });
            return;
        };
        if limits.forbids(i, j) {
            return;
        }
        let pair = Pair::new(i, j, alpha, parallax);
        if let Some(interval) = pair.as_interval() {
            self.intervals.push(interval);
        } else if !pair.is_nowhere() {
            self.pairs.push(pair);
        }
    }

    /// Adds the union of the intervals that `fill` writes to `output`: where sides cross, an interval is empty.
    pub(crate) fn unite(
        &mut self,
        heights: (f64, f64),
        output: &mut Connector,
        fill: impl FnOnce(&mut Vec<Interval>),
    ) {
        let mut intervals = std::mem::take(&mut self.given);
        fill(&mut intervals);
        self.kinks.clear();
        self.kinks
            .extend(intervals.iter().filter_map(|i| i.enter.crossing(i.exit)));
        self.sort_kinks();
        let mut from = 0.0;
        for k in 0..self.kinks.len() {
            let to = self.kinks[k];
            let middle = 0.5 * (from + to);
            let is_there = |i: &&Interval| i.enter.at(middle) < i.exit.at(middle);
            self.intervals.clear();
            self.intervals.extend(intervals.iter().filter(is_there));
            if are_disjoint(&self.intervals) {
                let y_at = |share: f64| height_at(heights, share);
                output.push((y_at(from), y_at(to)), &self.intervals, (from, to));
            } else {
                self.push_union(heights, (from, to), output);
            }
            from = to;
        }
        self.given = intervals;
    }

    /// Orders the shares at which something changes, up to the slab's bottom.
    fn sort_kinks(&mut self) {
        self.kinks.push(1.0);
        self.kinks.sort_unstable_by(f64::total_cmp);
        self.kinks.dedup();
    }

    /// Adds the union of the pairs and of `self.intervals` to `output`, part by part where other sides begin to bound a pair.
    fn push_pairs(&mut self, heights: (f64, f64), output: &mut Connector) {
        self.kinks.clear();
        for pair in &self.pairs {
            pair.find_kinks(&mut self.kinks);
        }
        self.sort_kinks();
        let n_whole = self.intervals.len();
        let mut from = 0.0;
        for k in 0..self.kinks.len() {
            let to = self.kinks[k];
            let middle = 0.5 * (from + to);
            self.intervals.truncate(n_whole);
            self.intervals
                .extend(self.pairs.iter().filter_map(|pair| pair.at(middle)));
            self.push_union(heights, (from, to), output);
            from = to;
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
