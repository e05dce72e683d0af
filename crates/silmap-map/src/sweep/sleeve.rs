//! Thinning out a polyline as it comes.
//!
//! Source: Zhao and Saalfeld, Linear-Time Sleeve-Fitting Polyline Simplification Algorithms, 1997.

use glam::{DVec2, DVec4, Vec4Swizzles};

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

/// Thins a polyline out as it comes: a point is dropped while one line from the last kept point passes all that were dropped.
///
/// Source: Zhao and Saalfeld, Linear-Time Sleeve-Fitting Polyline Simplification Algorithms, 1997. The lines that pass
/// within the slack of all points since the last kept one form a cone, and so do those of the third coordinate over the
/// distance.
pub(super) struct Sleeve<'a> {
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
    pub(super) fn new(slack: Slack, points: &'a mut Vec<DVec4>) -> Self {
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

    pub(super) fn append(&mut self, point: DVec4) {
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
    pub(super) fn finish(self, first: usize) {
        let kept = [self.points.get(first), self.anchor.as_ref()];
        let is_kept = |p: &DVec4| p.xy() == self.last.xy();
        if !kept.into_iter().flatten().any(is_kept) {
            self.points.push(self.last);
        }
    }
}
