//! From the trapezoids of a sweep to closed loops.
//!
//! Source: Silhouette Mapping, section 5.2, footnote 5 defers this step to a longer report. Here the outline is the left
//! and right sides of all trapezoids plus, on each slab border, the exclusive-or of the spans above and below. Walking the
//! side ends on a border from left to right, every second gap between neighbours belongs to that exclusive-or, and each
//! such pair joins one chain that arrives to one that departs: so the loops close for every topology, by construction.

use glam::DVec2;

use crate::loops::FlatLoops;
use crate::sweep::Interval;

/// Points closer than this to the line between their neighbours are dropped, in units of the coordinates given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slack(pub f64);

/// A side's end on the current border: where, and which vertex.
#[derive(Clone, Copy, Debug)]
struct End {
    x: f64,
    vertex: u32,
}

/// Collects trapezoids from top to bottom.
#[derive(Clone, Debug, Default)]
pub(crate) struct Connector {
    points: Vec<DVec2>,
    /// The vertex that follows, for every vertex that a chain leaves.
    next: Vec<u32>,
    /// Lower ends of the last slab's sides, from left to right: alternately departing (left sides run upwards) and arriving.
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
        self.next.clear();
        self.above.clear();
        self.bottom = f64::NEG_INFINITY;
    }

    fn vertex(&mut self, x: f64, y: f64) -> u32 {
        self.points.push(DVec2::new(x, y));
        self.next.push(NONE);
        self.points.len() as u32 - 1
    }

    /// Adds the part of a slab from `y_top` to `y_bottom`, where `intervals` (left to right, not overlapping) are given over
    /// the shares `from..to` of their slab.
    pub(crate) fn push(
        &mut self,
        (y_top, y_bottom): (f64, f64),
        intervals: &[Interval],
        (from, to): (f64, f64),
    ) {
        if self.bottom != y_top {
            self.flush();
        }
        self.below.clear();
        self.lower.clear();
        for interval in intervals {
            let enter_top = self.vertex(interval.enter.at(from), y_top);
            let enter_bottom = self.vertex(interval.enter.at(to), y_bottom);
            let exit_top = self.vertex(interval.exit.at(from), y_top);
            let exit_bottom = self.vertex(interval.exit.at(to), y_bottom);
            self.next[enter_bottom as usize] = enter_top;
            self.next[exit_top as usize] = exit_bottom;
            self.below.push(End {
                x: self.points[enter_top as usize].x,
                vertex: enter_top,
            });
            self.below.push(End {
                x: self.points[exit_top as usize].x,
                vertex: exit_top,
            });
            self.lower.push(End {
                x: self.points[enter_bottom as usize].x,
                vertex: enter_bottom,
            });
            self.lower.push(End {
                x: self.points[exit_bottom as usize].x,
                vertex: exit_bottom,
            });
        }
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
            let (vertex, departs) = if from_above {
                i += 1;
                (above[i - 1].vertex, (i - 1) % 2 == 0)
            } else {
                j += 1;
                (below[j - 1].vertex, (j - 1) % 2 == 1)
            };
            open = match open {
                None => Some((vertex, departs)),
                Some((other, true)) => {
                    self.next[vertex as usize] = other;
                    None
                }
                Some((other, false)) => {
                    self.next[other as usize] = vertex;
                    None
                }
            };
        }
    }

    /// Ends the last slab and writes all loops to `loops`, without repeated points and points that lie on the line between
    /// their neighbours to within `slack`.
    pub(crate) fn finish(&mut self, slack: Slack, loops: &mut FlatLoops) {
        self.flush();
        loops.clear();
        for start in 0..self.next.len() {
            let mut vertex = start;
            if self.next[vertex] == NONE {
                continue;
            }
            let first = loops.finished_points();
            while self.next[vertex] != NONE {
                append(loops.open_loop(), first, self.points[vertex], slack);
                let following = self.next[vertex];
                self.next[vertex] = NONE;
                vertex = following as usize;
            }
            trim_seam(loops.open_loop(), first, slack);
            loops.close();
        }
        self.clear();
    }
}

/// Whether `b` adds nothing between `a` and `c`.
fn is_redundant(a: DVec2, b: DVec2, c: DVec2, slack: Slack) -> bool {
    let (ab, ac) = (b - a, c - a);
    let length = ac.length();
    if length <= slack.0 {
        return ab.length() <= slack.0;
    }
    let along = ab.dot(ac);
    ac.perp_dot(ab).abs() <= slack.0 * length && (0.0..=length * length).contains(&along)
}

/// Appends `point` to the loop that starts at `first`, replacing a last point that became redundant.
fn append(points: &mut Vec<DVec2>, first: usize, point: DVec2, slack: Slack) {
    if points.len() > first && points[points.len() - 1] == point {
        return;
    }
    if points.len() >= first + 2
        && is_redundant(
            points[points.len() - 2],
            points[points.len() - 1],
            point,
            slack,
        )
    {
        points.pop();
    }
    points.push(point);
}

/// Drops redundant points where the loop's end meets its start.
fn trim_seam(points: &mut Vec<DVec2>, first: usize, slack: Slack) {
    while points.len() >= first + 3 {
        let n = points.len();
        if points[n - 1] == points[first]
            || is_redundant(points[n - 2], points[n - 1], points[first], slack)
        {
            points.pop();
        } else if is_redundant(points[n - 1], points[first], points[first + 1], slack) {
            points.remove(first);
        } else {
            return;
        }
    }
}
