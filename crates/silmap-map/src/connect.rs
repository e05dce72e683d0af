//! From the sides of a sweep to closed loops.
//!
//! Source: Silhouette Mapping, section 5.2, footnote 5 defers this step to a longer report. Here the outline is the left
//! and right sides of all slabs plus, on each slab border, the exclusive-or of the spans above and below. Walking the
//! side ends on a border from left to right, every second gap between neighbours belongs to that exclusive-or, and each
//! such pair joins one side that arrives to one that departs: so the loops close for every topology, by construction.

use glam::{DVec2, DVec3};

use crate::loops::DeepLoops;
use crate::side::{Interval, Side};

/// Points that add less than this to the line between those that are kept are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slack {
    /// Distance from the line, in units of x and y.
    pub line: f64,
    /// Difference in the third coordinate.
    pub depth: f64,
}

/// A run of points that is one side of a slab, from top to bottom.
#[derive(Clone, Copy, Debug)]
struct SideRun {
    start: u32,
    end: u32,
    /// Left sides are walked upwards, right sides downwards.
    is_left: bool,
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
    points: Vec<DVec3>,
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
    pub(crate) fn points(&mut self) -> &mut Vec<DVec3> {
        &mut self.points
    }

    /// Makes a side of the points from `start` to `end`. Left and right sides take turns.
    pub(crate) fn add_side(&mut self, start: usize, end: usize) {
        let side = self.sides.len() as u32;
        self.below.push(End {
            x: self.points[start].x,
            side,
        });
        self.lower.push(End {
            x: self.points[end - 1].x,
            side,
        });
        self.sides.push(SideRun {
            start: start as u32,
            end: end as u32,
            is_left: self.below.len() % 2 == 1,
            next: NONE,
        });
    }

    /// Ends a slab, all sides of which reach down to `y_bottom`.
    pub(crate) fn end_slab(&mut self, y_bottom: f64) {
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
                let run = &self.points[side.start as usize..side.end as usize];
                if side.is_left {
                    run.iter().rev().for_each(|&p| sleeve.append(p));
                } else {
                    run.iter().for_each(|&p| sleeve.append(p));
                }
                at = std::mem::replace(&mut side.next, NONE) as usize;
            }
            sleeve.finish(first);
            loops.close();
        }
        self.clear();
    }
}

/// Thins a polyline out as it comes: a point is dropped while one line from the last kept point passes all that were dropped.
///
/// Source: Zhao and Saalfeld, Linear-Time Sleeve-Fitting Polyline Simplification Algorithms, 1997. The lines that pass
/// within the slack of all points since the last kept one form a cone, and so do those of the third coordinate over the
/// distance.
struct Sleeve<'a> {
    slack: Slack,
    points: &'a mut Vec<DVec3>,
    /// The last kept point, and the one after it, which may yet be dropped.
    anchor: Option<DVec3>,
    last: DVec3,
    /// Directions that bound the cone, in the order of turning.
    low: DVec2,
    high: DVec2,
    least_slope: f64,
    greatest_slope: f64,
}

impl<'a> Sleeve<'a> {
    fn new(slack: Slack, points: &'a mut Vec<DVec3>) -> Self {
        Self {
            slack,
            points,
            anchor: None,
            last: DVec3::ZERO,
            low: DVec2::ZERO,
            high: DVec2::ZERO,
            least_slope: 0.0,
            greatest_slope: 0.0,
        }
    }

    fn append(&mut self, point: DVec3) {
        let Some(anchor) = self.anchor else {
            self.keep(point);
            return;
        };
        if point.truncate() == self.last.truncate() {
            return;
        }
        let v = (point - anchor).truncate();
        let distance = v.length();
        let is_open = self.low == DVec2::ZERO;
        if !is_open {
            let reached = (self.last - anchor).truncate();
            let rise = point.z - anchor.z;
            let is_ahead = (v - reached).dot(reached) >= 0.0;
            let is_within = self.low.perp_dot(v) >= 0.0
                && v.perp_dot(self.high) >= 0.0
                && self.least_slope * distance <= rise
                && rise <= self.greatest_slope * distance;
            if !is_ahead || !is_within {
                let last = self.last;
                self.keep(last);
                self.append(point);
                return;
            }
        }
        self.narrow(v, distance, point.z - anchor.z, is_open);
        self.last = point;
    }

    /// Keeps a point, from which everything is open again.
    fn keep(&mut self, point: DVec3) {
        self.points.push(point);
        self.anchor = Some(point);
        self.last = point;
        self.low = DVec2::ZERO;
        self.high = DVec2::ZERO;
    }

    /// Narrows the cone to lines that pass the point at `v` from the anchor.
    fn narrow(&mut self, v: DVec2, distance: f64, rise: f64, is_open: bool) {
        let inverse = 1.0 / distance;
        // Near the anchor the cone is left half a right angle to each side: wider, it would say nothing.
        let across = v.perp() * (self.slack.line * inverse).min(1.0);
        let (low, high) = (v - across, v + across);
        let (least, greatest) = (
            (rise - self.slack.depth) * inverse,
            (rise + self.slack.depth) * inverse,
        );
        if is_open {
            (self.low, self.high) = (low, high);
            (self.least_slope, self.greatest_slope) = (least, greatest);
            return;
        }
        if self.low.perp_dot(low) > 0.0 {
            self.low = low;
        }
        if high.perp_dot(self.high) > 0.0 {
            self.high = high;
        }
        self.least_slope = self.least_slope.max(least);
        self.greatest_slope = self.greatest_slope.min(greatest);
    }

    /// Ends the loop that starts at `first`.
    fn finish(self, first: usize) {
        if self.points.len() > first && self.last.truncate() != self.points[first].truncate() {
            let end = self.points.len() - 1;
            if self.points[end].truncate() != self.last.truncate() {
                self.points.push(self.last);
            }
        }
    }
}

fn deep_point(side: Side, share: f64, y: f64) -> DVec3 {
    let touch = side.touch_at(share);
    DVec3::new(touch.x, y, touch.disparity)
}
