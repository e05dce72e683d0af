//! The parts of rows that at least a given number of intervals cover, swept down from row to row.
//!
//! The union of interpolated pairs of intervals is what at least one of them covers (Silhouette Mapping, section 5.3), and the part
//! that three regions share is what three cover. As long as the ends of the intervals stay in one order, only their coordinates
//! change: most rows need no more than a check of that order. Where two ends change places between two rows, the covered parts are
//! found anew above and below.

use glam::{DVec3, DVec4};

use crate::sweep::interval::insertion_sort;
use crate::sweep::loop_builder::{LoopBuilder, is_straight};

/// Ends that meet within this share of their place, and of 1, bound one and the same side, above and below.
const MEETING: f64 = 1e-9;

/// A sweep down the rows of some intervals. Their ends are numbered: 2k enters interval k, and 2k + 1 leaves it; where it is left
/// before it is entered, it covers nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageSweep {
    /// How many intervals must cover a place.
    least: u32,
    line: Line,
    /// The ends that bound what is covered, left and right ones in turn.
    bounds: Vec<u32>,
    found: Vec<u32>,
    /// The points of each bound since the top of the run.
    sides: Vec<Vec<DVec4>>,
    y_top: f64,
    /// Whether the bounds are those of this sweep.
    is_open: bool,
    /// Whether something was left out of them that had no width, and may widen.
    is_thin: bool,
    /// Where the sides end that are written next, and whether they wait for a sweep that goes on with them.
    waiting: Vec<DVec4>,
    is_waiting: bool,
    /// The last row's height, and its ends: place, disparity and slide of each.
    y: f64,
    upper: Vec<DVec3>,
    /// The row that is gone down to.
    lower: Vec<DVec3>,
    /// The order on that row.
    sorted: Vec<u32>,
    meetings: Vec<Meeting>,
    side_ends: Vec<usize>,
}

/// Two ends change places at a share of the way from one row to the next.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    share: f64,
    /// The one that comes from the left, and the other.
    ends: [u32; 2],
}

/// The ends along a horizontal line.
#[derive(Clone, Debug, Default)]
struct Line {
    /// From left to right.
    order: Vec<u32>,
    /// Where each end stands in that order.
    stands: Vec<u32>,
    /// How many intervals are covered after each end in that order.
    depths: Vec<u32>,
}

impl Line {
    /// Counts anew after the order has changed.
    fn count(&mut self) {
        self.stands.resize(self.order.len(), 0);
        for (k, &end) in self.order.iter().enumerate() {
            self.stands[end as usize] = k as u32;
        }
        self.depths.clear();
        let mut depth = 0;
        for &end in &self.order {
            depth = self.depth_after(depth, end);
            self.depths.push(depth);
        }
    }

    /// How many intervals are covered after an end, given how many before it.
    fn depth_after(&self, before: u32, end: u32) -> u32 {
        let other = self.stands[end as usize ^ 1];
        let own = self.stands[end as usize];
        match (end & 1 == 0, own < other) {
            (true, true) => before + 1,
            (false, false) => before - 1,
            _ => before,
        }
    }

    /// Lets two neighbours change places; says whether that changes what `least` intervals cover, or by what it is bounded.
    fn swap(&mut self, k: usize, least: u32) -> bool {
        let before = if k == 0 { 0 } else { self.depths[k - 1] };
        let (middle, after) = (self.depths[k], self.depths[k + 1]);
        self.order.swap(k, k + 1);
        let (left, right) = (self.order[k], self.order[k + 1]);
        self.stands[left as usize] = k as u32;
        self.stands[right as usize] = k as u32 + 1;
        self.depths[k] = self.depth_after(before, left);
        let is_here = |depth: u32| depth >= least;
        [middle, self.depths[k]]
            .iter()
            .any(|&m| is_here(m) != is_here(before) || is_here(m) != is_here(after))
    }

    /// Writes the ends that bound what `least` intervals cover to `bounds`. What is no wider than nothing by `x` is left out: says
    /// whether anything was.
    fn find_bounds(&self, least: u32, x: impl Fn(u32) -> f64, bounds: &mut Vec<u32>) -> bool {
        bounds.clear();
        let mut is_thin = false;
        let (mut depth, mut entered) = (0, 0);
        for (&end, &after) in self.order.iter().zip(&self.depths) {
            if depth < least && after >= least {
                entered = end;
            } else if depth >= least && after < least {
                if x(entered) < x(end) {
                    bounds.extend([entered, end]);
                } else {
                    is_thin = true;
                }
            }
            depth = after;
        }
        is_thin
    }
}

impl CoverageSweep {
    /// Begins to follow what at least `least` of the intervals between so many ends cover.
    pub(crate) fn begin(&mut self, least: u32, n_ends: usize) {
        self.least = least;
        self.is_open = false;
        self.y = f64::INFINITY;
        self.line.order.clear();
        self.line.order.extend(0..n_ends as u32);
        self.upper.resize(n_ends, DVec3::ZERO);
        self.lower.resize(n_ends, DVec3::ZERO);
    }

    /// Where the ends of the next row are written to: place, disparity and slide of each.
    pub(crate) fn next_row(&mut self) -> &mut [DVec3] {
        &mut self.lower
    }

    /// Goes down to the row that was written, at height `y`; between the last one and it all ends go straight. They may turn where
    /// `is_bent` says so.
    #[inline]
    pub(crate) fn step(
        &mut self,
        y: f64,
        is_bent: impl Fn(usize) -> bool,
        output: &mut LoopBuilder,
    ) {
        if self.is_open && !self.is_thin && is_sorted(&self.line.order, &self.lower) {
            for (&end, side) in self.bounds.iter().zip(&mut self.sides) {
                if is_bent(end as usize) {
                    side.push(point(self.lower[end as usize], y));
                }
            }
        } else if self.y < y {
            self.step_by_meetings(y, is_bent, output);
        }
        self.y = y;
        std::mem::swap(&mut self.upper, &mut self.lower);
    }

    /// Goes down past the heights at which ends change places.
    fn step_by_meetings(
        &mut self,
        y: f64,
        is_bent: impl Fn(usize) -> bool,
        output: &mut LoopBuilder,
    ) {
        if !self.is_open {
            let key = |end: u32| (self.upper[end as usize].x, self.lower[end as usize].x);
            insertion_sort(&mut self.line.order, key, |_, _| {});
            self.line.count();
        }
        self.find_meetings();
        let mut from = 0.0;
        let mut is_changed = !self.is_open || self.is_thin;
        let mut next = 0;
        loop {
            let to = self.meetings.get(next).map_or(1.0, |m| m.share);
            if is_changed && (from < to || to >= 1.0) {
                self.find_bounds(0.5 * (from + to));
                let is_known = self.is_open && self.found == self.bounds;
                if !is_known && !self.hand_over(from, y) {
                    self.close(from, y, output);
                    self.open(from, y, output);
                }
                is_changed = false;
            }
            if next == self.meetings.len() {
                break;
            }
            let n_here = self.meetings[next..]
                .iter()
                .take_while(|m| m.share == to)
                .count();
            is_changed |= self.pass(next..next + n_here);
            (from, next) = (to, next + n_here);
        }
        if self.line.order != self.sorted {
            std::mem::swap(&mut self.line.order, &mut self.sorted);
            self.line.count();
        }
        for (&end, side) in self.bounds.iter().zip(&mut self.sides) {
            if is_bent(end as usize) {
                side.push(point(self.lower[end as usize], y));
            }
        }
    }

    /// Finds which ends change places on the way to the next row, and sorts those of that row.
    fn find_meetings(&mut self) {
        let (upper, lower) = (&self.upper, &self.lower);
        let meetings = &mut self.meetings;
        meetings.clear();
        self.sorted.clone_from(&self.line.order);
        let by_lower = |end: u32| lower[end as usize].x;
        insertion_sort(&mut self.sorted, by_lower, |a, b| {
            let apart = |ends: &[DVec3]| ends[a as usize].x - ends[b as usize].x;
            let (above, below) = (apart(upper), apart(lower));
            // Ends that stand in one place above may be in either order there.
            let share = (above / (above - below)).clamp(0.0, 1.0);
            let ends = [a, b];
            meetings.push(Meeting { share, ends });
        });
        if meetings.len() > 1 {
            meetings.sort_unstable_by(|a, b| a.share.total_cmp(&b.share).then(a.ends.cmp(&b.ends)));
        }
    }

    /// Lets all ends change places that meet at one share of the way; says whether that may change what is covered.
    fn pass(&mut self, meetings: std::ops::Range<usize>) -> bool {
        let mut is_changed = false;
        let mut n_left = meetings.len();
        // Where more than two meet, neighbours go first.
        while n_left > 0 {
            let n_before = n_left;
            n_left = 0;
            for meeting in &self.meetings[meetings.clone()] {
                let [a, b] = meeting.ends.map(|end| self.line.stands[end as usize]);
                if b == a + 1 {
                    is_changed |= self.line.swap(a as usize, self.least);
                } else if a < b {
                    n_left += 1;
                }
            }
            if n_left == n_before {
                let share = self.meetings[meetings.start].share;
                let later = self.meetings.get(meetings.end).map_or(1.0, |m| m.share);
                let between = 0.5 * (share + later);
                let (upper, lower) = (&self.upper, &self.lower);
                let x = |end: u32| mix(upper[end as usize].x, lower[end as usize].x, between);
                insertion_sort(&mut self.line.order, x, |_, _| {});
                self.line.count();
                return true;
            }
        }
        is_changed
    }

    /// Finds what bounds what is covered at a share of the way to the next row.
    fn find_bounds(&mut self, share: f64) {
        let (upper, lower) = (&self.upper, &self.lower);
        let x = |end: u32| mix(upper[end as usize].x, lower[end as usize].x, share);
        self.is_thin = self.line.find_bounds(self.least, x, &mut self.found);
    }

    /// The end at a share of the way to the next row, at height `y`.
    fn point_at(&self, end: u32, share: f64, y: f64) -> DVec4 {
        let (a, b) = (self.upper[end as usize], self.lower[end as usize]);
        let touch = if share >= 1.0 { b } else { a + (b - a) * share };
        point(touch, mix(self.y, y, share))
    }

    /// Lets the bounds that were found go on where others end: false, with nothing done, where these are elsewhere.
    fn hand_over(&mut self, share: f64, y: f64) -> bool {
        if !self.is_open || self.found.len() != self.bounds.len() {
            return false;
        }
        let do_meet = |(&before, &after): (&u32, &u32)| {
            let [one, two] = [before, after].map(|end| self.point_at(end, share, y).x);
            before == after || (one - two).abs() <= MEETING * (1.0 + two.abs())
        };
        if !self.bounds.iter().zip(&self.found).all(do_meet) {
            return false;
        }
        for k in 0..self.found.len() {
            let after = self.found[k];
            if self.bounds[k] != after {
                let point = self.point_at(after, share, y);
                push_below(&mut self.sides[k], point);
                self.bounds[k] = after;
            }
        }
        true
    }

    /// Opens a run with the bounds that were found, at a share of the way to the next row, at height `y`. Where they go on from the
    /// sides that wait, that is one run.
    fn open(&mut self, share: f64, y: f64, output: &mut LoopBuilder) {
        self.is_open = true;
        std::mem::swap(&mut self.bounds, &mut self.found);
        let y_top = mix(self.y, y, share);
        if std::mem::take(&mut self.is_waiting) {
            if self.do_go_on(share, y) {
                return;
            }
            self.write(output);
        }
        self.y_top = y_top;
        while self.sides.len() < self.bounds.len() {
            self.sides.push(Vec::new());
        }
        for k in 0..self.bounds.len() {
            let point = self.point_at(self.bounds[k], share, y);
            self.sides[k].clear();
            self.sides[k].push(point);
        }
    }

    /// Lets the sides that wait go on: false, with nothing done, where the bounds that were found are elsewhere.
    fn do_go_on(&mut self, share: f64, y: f64) -> bool {
        if self.waiting.len() != self.bounds.len() {
            return false;
        }
        let y_top = mix(self.y, y, share);
        let do_meet = |(&end, last): (&u32, &DVec4)| {
            let x = self.point_at(end, share, y).x;
            last.y == y_top && (last.x - x).abs() <= MEETING * (1.0 + x.abs())
        };
        if !self.bounds.iter().zip(&self.waiting).all(do_meet) {
            return false;
        }
        let ends = self.bounds.iter().map(|&end| self.lower[end as usize]);
        for ((end, &last), side) in ends.zip(&self.waiting).zip(&mut self.sides) {
            let is_straight = (side.last()).is_some_and(|&p| is_straight(p, last, point(end, y)));
            if !is_straight {
                push_below(side, last);
            }
        }
        true
    }

    /// Ends the run at a share of the way to the next row, at height `y`.
    fn close(&mut self, share: f64, y: f64, output: &mut LoopBuilder) {
        if !self.is_open {
            return;
        }
        self.waiting.clear();
        for k in 0..self.bounds.len() {
            self.waiting.push(self.point_at(self.bounds[k], share, y));
        }
        self.write(output);
    }

    /// Ends the sweep at the last row. Its sides wait for a sweep that goes on with them.
    pub(crate) fn end(&mut self) {
        if self.is_open {
            let ends = self.bounds.iter().map(|&end| self.upper[end as usize]);
            self.waiting.clear();
            self.waiting.extend(ends.map(|end| point(end, self.y)));
            self.is_waiting = true;
        }
    }

    /// Adds what waits to `output`: nothing goes on.
    pub(crate) fn finish(&mut self, output: &mut LoopBuilder) {
        if std::mem::take(&mut self.is_waiting) {
            self.write(output);
        }
    }

    /// Adds the last run to `output`.
    fn write(&mut self, output: &mut LoopBuilder) {
        let Some(y_bottom) = self.waiting.first().map(|p| p.y) else {
            return;
        };
        if y_bottom <= self.y_top {
            return;
        }
        let sides = &mut self.sides[..self.waiting.len()];
        for (side, &last) in sides.iter_mut().zip(&self.waiting) {
            push_below(side, last);
        }
        output.begin_slab(self.y_top);
        let points = output.points();
        let start = points.len();
        self.side_ends.clear();
        for side in sides {
            points.extend_from_slice(side);
            self.side_ends.push(points.len());
        }
        output.end_followed(start, &self.side_ends, y_bottom);
    }
}

/// Whether ends stand in this order on a row.
fn is_sorted(order: &[u32], row: &[DVec3]) -> bool {
    let mut last = f64::NEG_INFINITY;
    order.iter().all(|&end| {
        let x = row[end as usize].x;
        let is_after = last <= x;
        last = x;
        is_after
    })
}

/// From one number to another; exact at both.
fn mix(from: f64, to: f64, share: f64) -> f64 {
    if share >= 1.0 {
        to
    } else {
        from + (to - from) * share
    }
}

fn point(touch: DVec3, y: f64) -> DVec4 {
    DVec4::new(touch.x, y, touch.y, touch.z)
}

/// Appends a point to a side that may have come to its height already.
fn push_below(side: &mut Vec<DVec4>, point: DVec4) {
    if side.last().is_none_or(|last| last.y < point.y) {
        side.push(point);
    }
}

#[cfg(test)]
mod tests;
