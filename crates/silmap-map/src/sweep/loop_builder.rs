//! From the sides of a sweep to closed loops.
//!
//! Source: Silhouette Mapping, section 5.2, footnote 5 defers this step to a longer report. Here the outline is the left
//! and right sides of all slabs plus, on each slab border, the exclusive-or of the spans above and below. Walking the
//! side ends on a border from left to right, every second gap between neighbours belongs to that exclusive-or, and each
//! such pair joins one side that arrives to one that departs: so the loops close for every topology, by construction.

use glam::{DVec2, DVec4, Vec4Swizzles};

use crate::loops::DeepLoops;
use crate::sweep::interval::{Interval, Side};
use crate::tidy::cut_hairs;

/// Points that add less than this to the line between those that are kept are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slack {
    /// Distance from the line, in units of x and y.
    pub line: f64,
    /// Difference in the third coordinate; infinite where that does not matter.
    pub depth: f64,
    /// Width of hairs and slits that are cut off, in units of x and y.
    pub hair: f64,
}

/// One side of some slabs: a run of points, and points that were added below it. Left sides are walked upwards, right sides
/// downwards.
#[derive(Clone, Copy, Debug)]
struct SideRun {
    top: u32,
    bottom: u32,
    /// Where the walk of the added points begins; those after it are linked.
    added: u32,
    /// The lowest point.
    lowest: u32,
    is_left: bool,
    /// The point above the lowest.
    above: DVec4,
    /// The side whose walk follows.
    next: u32,
}

/// A side's end on the current border.
#[derive(Clone, Copy, Debug)]
struct End {
    x: f64,
    side: u32,
}

/// Collects slabs from top to bottom.
#[derive(Clone, Debug, Default)]
pub(crate) struct Connector {
    points: Vec<DVec4>,
    /// Per added point that has another after it on the walk: that one.
    following: Vec<u32>,
    sides: Vec<SideRun>,
    /// Lower ends of the last slab's sides, from left to right: left sides depart from there, right sides arrive.
    above: Vec<End>,
    /// Upper ends of the slab being added.
    below: Vec<End>,
    /// Lower ends of the slab being added.
    lower: Vec<End>,
    bottom: f64,
}

const NONE: u32 = u32::MAX;

impl Connector {
    /// Forgets everything, keeping the storage.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.following.clear();
        self.sides.clear();
        self.above.clear();
        self.bottom = f64::NEG_INFINITY;
    }

    /// Starts a slab: its sides are then added from left to right.
    pub(crate) fn begin_slab(&mut self, y_top: f64) {
        if self.bottom != y_top {
            self.flush();
        }
        self.below.clear();
        self.lower.clear();
    }

    /// The points so far: those of a side are appended here from top to bottom before it is added.
    pub(crate) fn points(&mut self) -> &mut Vec<DVec4> {
        &mut self.points
    }

    /// Makes a side of the points from `start` to `end`. Left and right sides take turns.
    fn add_side(&mut self, start: usize, end: usize) {
        let side = self.sides.len() as u32;
        self.below.push(End {
            x: self.points[start].x,
            side,
        });
        self.lower.push(End {
            x: self.points[end - 1].x,
            side,
        });
        let lowest = end as u32 - 1;
        self.sides.push(SideRun {
            top: start as u32,
            bottom: lowest,
            added: NONE,
            lowest,
            is_left: self.below.len() % 2 == 1,
            above: self.points[end.saturating_sub(2).max(start)],
            next: NONE,
        });
    }

    /// Lets a side reach down to `point`; where it goes straight on, its lowest point moves there.
    fn extend_side(&mut self, side: u32, point: DVec4) {
        let side = &mut self.sides[side as usize];
        let reached = self.points[side.lowest as usize];
        if is_straight(side.above, reached, point) {
            self.points[side.lowest as usize] = point;
            return;
        }
        let added = self.points.len() as u32;
        self.points.push(point);
        self.following.resize(self.points.len(), NONE);
        if side.is_left {
            self.following[added as usize] = side.added;
            side.added = added;
        } else {
            self.following[added as usize] = NONE;
            if side.added == NONE {
                side.added = added;
            } else {
                self.following[side.lowest as usize] = added;
            }
        }
        side.above = reached;
        side.lowest = added;
    }

    /// Ends a slab whose sides are the points from `start` on, cut at `side_ends`.
    pub(crate) fn end_followed(&mut self, start: usize, side_ends: &[usize], y_bottom: f64) {
        let mut from = start;
        for &end in side_ends {
            self.add_side(from, end);
            from = end;
        }
        self.end_slab(y_bottom);
    }

    /// Ends a slab, all sides of which reach down to `y_bottom`.
    fn end_slab(&mut self, y_bottom: f64) {
        self.join();
        std::mem::swap(&mut self.above, &mut self.lower);
        self.bottom = y_bottom;
    }

    /// Adds the part of a slab from `y_top` to `y_bottom`, where `intervals` (left to right, not overlapping) are given over
    /// the shares `from..to` of their slab.
    pub(crate) fn push(
        &mut self,
        (y_top, y_bottom): (f64, f64),
        intervals: &[Interval],
        (from, to): (f64, f64),
    ) {
        if self.is_continued(y_top, intervals, from) {
            for k in 0..self.above.len() {
                let interval = &intervals[k / 2];
                let side = if k % 2 == 0 {
                    interval.enter
                } else {
                    interval.exit
                };
                let point = deep_point(side, to, y_bottom);
                self.above[k].x = point.x;
                self.extend_side(self.above[k].side, point);
            }
            self.bottom = y_bottom;
            return;
        }
        self.begin_slab(y_top);
        for interval in intervals {
            for side in [interval.enter, interval.exit] {
                let start = self.points.len();
                self.points.push(deep_point(side, from, y_top));
                self.points.push(deep_point(side, to, y_bottom));
                self.add_side(start, start + 2);
            }
        }
        self.end_slab(y_bottom);
    }

    /// Whether intervals begin just where those of the last slab ended.
    fn is_continued(&self, y_top: f64, intervals: &[Interval], share: f64) -> bool {
        self.bottom == y_top
            && self.above.len() == 2 * intervals.len()
            && self
                .above
                .chunks_exact(2)
                .zip(intervals)
                .all(|(ends, i)| ends[0].x == i.enter.at(share) && ends[1].x == i.exit.at(share))
    }

    /// Closes everything that is open on the current border.
    fn flush(&mut self) {
        self.below.clear();
        self.join();
        self.above.clear();
    }

    /// Joins the ends on one border in pairs, from left to right.
    fn join(&mut self) {
        let (above, below) = (&self.above, &self.below);
        let (mut i, mut j) = (0, 0);
        let mut open: Option<(u32, bool)> = None;
        while i < above.len() || j < below.len() {
            let from_above = j >= below.len() || (i < above.len() && above[i].x <= below[j].x);
            // Above, left sides (even places) depart upwards; below, right sides (odd places) depart downwards.
            let (side, departs) = if from_above {
                i += 1;
                (above[i - 1].side, (i - 1) % 2 == 0)
            } else {
                j += 1;
                (below[j - 1].side, (j - 1) % 2 == 1)
            };
            open = match open {
                None => Some((side, departs)),
                Some((other, true)) => {
                    self.sides[side as usize].next = other;
                    None
                }
                Some((other, false)) => {
                    self.sides[other as usize].next = side;
                    None
                }
            };
        }
    }

    /// Ends the last slab and writes all loops to `loops`, without repeated points and points that lie on the line between
    /// those that are kept to within `slack`.
    pub(crate) fn finish(&mut self, slack: Slack, loops: &mut DeepLoops) {
        self.flush();
        loops.clear();
        for start in 0..self.sides.len() {
            let mut at = start;
            if self.sides[at].next == NONE {
                continue;
            }
            let first = loops.finished_points();
            let mut sleeve = Sleeve::new(slack, loops.open_loop());
            while self.sides[at].next != NONE {
                let side = &mut self.sides[at];
                let run = &self.points[side.top as usize..=side.bottom as usize];
                if !side.is_left {
                    run.iter().for_each(|&p| sleeve.append(p));
                }
                let mut k = side.added;
                while k != NONE {
                    sleeve.append(self.points[k as usize]);
                    k = self.following[k as usize];
                }
                if side.is_left {
                    run.iter().rev().for_each(|&p| sleeve.append(p));
                }
                at = std::mem::replace(&mut side.next, NONE) as usize;
            }
            sleeve.finish(first);
            if slack.hair > 0.0 {
                cut_hairs(loops.open_loop(), first, slack.hair);
            }
            loops.close();
        }
        self.clear();
    }
}

/// Whether `b`, at a height between `a` and `c`, lies on the line between them but for rounding.
pub(crate) fn is_straight(a: DVec4, b: DVec4, c: DVec4) -> bool {
    const ROUNDING: f64 = 1e-9;
    let (ab, ac) = (b - a, c - a);
    let is_on = |part: f64, whole: f64| (part * ac.y - whole * ab.y).abs() <= ROUNDING * ac.y;
    is_on(ab.x, ac.x) && is_on(ab.z, ac.z)
}

/// Thins a polyline out as it comes: a point is dropped while one line from the last kept point passes all that were dropped.
///
/// Source: Zhao and Saalfeld, Linear-Time Sleeve-Fitting Polyline Simplification Algorithms, 1997. The lines that pass
/// within the slack of all points since the last kept one form a cone, and so do those of the third coordinate over the
/// distance.
struct Sleeve<'a> {
    slack: Slack,
    points: &'a mut Vec<DVec4>,
    /// The last kept point, and the one after it, which may yet be dropped.
    anchor: Option<DVec4>,
    last: DVec4,
    /// Directions that bound the cone, in the order of turning.
    low: DVec2,
    high: DVec2,
    /// Whether there is no cone yet.
    is_open: bool,
    /// Whether the third coordinate matters.
    is_deep: bool,
    /// The third coordinate's rise over the distance along the greater axis: bounds, as (rise, distance).
    least: (f64, f64),
    greatest: (f64, f64),
}

/// Whether one (rise, distance) is steeper than another.
fn is_steeper(one: (f64, f64), two: (f64, f64)) -> bool {
    one.0 * two.1 > two.0 * one.1
}

impl<'a> Sleeve<'a> {
    fn new(slack: Slack, points: &'a mut Vec<DVec4>) -> Self {
        Self {
            is_open: true,
            is_deep: slack.depth.is_finite(),
            slack,
            points,
            anchor: None,
            last: DVec4::ZERO,
            low: DVec2::ZERO,
            high: DVec2::ZERO,
            least: (0.0, 1.0),
            greatest: (0.0, 1.0),
        }
    }

    fn append(&mut self, point: DVec4) {
        let Some(anchor) = self.anchor else {
            self.keep(point);
            return;
        };
        if point.xy() == self.last.xy() {
            return;
        }
        let v = (point - anchor).xy();
        let rise = point.z - anchor.z;
        // The greater of the two coordinates stands for the length: at most a root of two too short.
        let distance = v.abs().max_element();
        if !self.is_open {
            let reached = (self.last - anchor).xy();
            let is_ahead = (v - reached).dot(reached) >= 0.0;
            let is_within = self.low.perp_dot(v) >= 0.0 && v.perp_dot(self.high) >= 0.0;
            if !is_ahead || !is_within || self.is_out_of_depth(rise, distance) {
                let last = self.last;
                self.keep(last);
                self.append(point);
                return;
            }
        }
        self.narrow(v, distance, rise);
        self.last = point;
    }

    /// Whether a line to a point with this rise at this distance does not pass the third coordinates of those dropped.
    fn is_out_of_depth(&self, rise: f64, distance: f64) -> bool {
        self.is_deep
            && (is_steeper(self.least, (rise, distance))
                || is_steeper((rise, distance), self.greatest))
    }

    /// Keeps a point, from which everything is open again.
    fn keep(&mut self, point: DVec4) {
        self.points.push(point);
        self.anchor = Some(point);
        self.last = point;
        self.is_open = true;
    }

    /// Narrows the cone to lines that pass the point at `v` from the anchor.
    fn narrow(&mut self, v: DVec2, distance: f64, rise: f64) {
        let is_open = std::mem::replace(&mut self.is_open, false);
        // Near the anchor the cone is left half a right angle to each side: wider, it would say nothing.
        let across = v.perp() * (std::f64::consts::FRAC_1_SQRT_2 * self.slack.line).min(distance);
        let (low, high) = (v * distance - across, v * distance + across);
        if is_open || self.low.perp_dot(low) > 0.0 {
            self.low = low;
        }
        if is_open || high.perp_dot(self.high) > 0.0 {
            self.high = high;
        }
        if !self.is_deep {
            return;
        }
        let least = (rise - self.slack.depth, distance);
        let greatest = (rise + self.slack.depth, distance);
        if is_open || is_steeper(least, self.least) {
            self.least = least;
        }
        if is_open || is_steeper(self.greatest, greatest) {
            self.greatest = greatest;
        }
    }

    /// Ends the loop that starts at `first`.
    fn finish(self, first: usize) {
        let kept = [self.points.get(first), self.anchor.as_ref()];
        let is_kept = |p: &DVec4| p.xy() == self.last.xy();
        if !kept.into_iter().flatten().any(is_kept) {
            self.points.push(self.last);
        }
    }
}

fn deep_point(side: Side, share: f64, y: f64) -> DVec4 {
    let touch = side.touch_at(share);
    DVec4::new(touch.x, y, touch.disparity, touch.slide)
}
