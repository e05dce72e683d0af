//! From the sides of a sweep to closed loops.
//!
//! Source: Silhouette Mapping, section 5.2, footnote 5 defers this step to a longer report. Here the outline is the left
//! and right sides of all slabs plus, on each slab border, the exclusive-or of the spans above and below. Walking the
//! side ends on a border from left to right, every second gap between neighbours belongs to that exclusive-or, and each
//! such pair joins one side that arrives to one that departs: so the loops close for every topology, by construction.

use glam::DVec4;

use super::hairs::HairCutter;
use super::sleeve::{Slack, Sleeve};
use crate::loops::DeepLoops;

/// One side of some slabs: a run of points. Left sides are walked upwards, right sides downwards.
#[derive(Clone, Copy, Debug)]
struct SideRun {
    start: u32,
    end: u32,
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
pub(crate) struct LoopBuilder {
    points: Vec<DVec4>,
    sides: Vec<SideRun>,
    /// Lower ends of the last slab's sides, from left to right: left sides depart from there, right sides arrive.
    above: Vec<End>,
    /// Upper ends of the slab being added.
    below: Vec<End>,
    /// Lower ends of the slab being added.
    lower: Vec<End>,
    bottom: f64,
    hairs: HairCutter,
}

const NONE: u32 = u32::MAX;

impl LoopBuilder {
    /// Clears everything, keeping the storage.
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
        self.sides.push(SideRun {
            start: start as u32,
            end: end as u32,
            is_left: self.below.len() % 2 == 1,
            next: NONE,
        });
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

    /// Ends the last slab and appends all loops to `loops`, without repeated points and points that lie on the line between
    /// those that are kept to within `slack`.
    pub(crate) fn finish(&mut self, slack: Slack, loops: &mut DeepLoops) {
        self.flush();
        let n_before = loops.n_loops();
        for start in 0..self.sides.len() {
            let mut at = start;
            if self.sides[at].next == NONE {
                continue;
            }
            let first = loops.finished_points();
            let mut thinning = Sleeve::new(slack, loops.open_loop());
            while self.sides[at].next != NONE {
                let side = &mut self.sides[at];
                let run = self.points[side.start as usize..side.end as usize].iter();
                if side.is_left {
                    run.rev().for_each(|&p| thinning.append(p));
                } else {
                    run.for_each(|&p| thinning.append(p));
                }
                at = std::mem::replace(&mut side.next, NONE) as usize;
            }
            thinning.finish(first);
            loops.close();
        }
        if slack.hair > 0.0 {
            self.hairs.cut(loops, n_before, slack.hair);
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
