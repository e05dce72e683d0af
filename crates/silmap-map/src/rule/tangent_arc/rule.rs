//! The tight rule: the silhouette between two views of a smooth object whose contour generators are known.
//!
//! Source: beyond the paper. In an epipolar plane the two touching points and the crossing of the two touching rays are the
//! control polygon of a quadratic Bézier arc that touches both rays where the object does; what the viewpoint between sees is
//! the tangent to that arc.
//! Deviation: the arc is drawn in the plane of (x, disparity), the image of the epipolar plane under the projective map that
//! takes the line of viewpoints to infinity. There the viewpoint at α sees the point (x, d) at x − αd: its rays are parallel,
//! and the tangent is found by one division where the arc in the epipolar plane takes the root of a quadratic. Tangency, and
//! the order of the error, are the same in both.

use crate::sweep::interval::{Side, SpanInterval, TangentRay};

/// The touching ray between `one` and `two`, or the linear rule's where the three control points are not in convex position.
#[inline]
pub(crate) fn between(one: TangentRay, two: TangentRay, alpha: f64, side: Side) -> TangentRay {
    let beta = 1.0 - alpha;
    let crossing = one.x - two.x;
    let (g_one, g_two) = (one.disparity - crossing, two.disparity - crossing);
    let linear = one.lerp(two, alpha);
    let is_convex = match side {
        Side::Left => g_one < 0.0 && g_two > 0.0,
        Side::Right => g_one > 0.0 && g_two < 0.0,
    };
    if !is_convex {
        return linear;
    }
    // Derivatives of x − αd along the arc at its ends, halved; they have opposite signs.
    let (leave, arrive) = (alpha * g_one, beta * g_two);
    let turn = 1.0 / (leave - arrive);
    let (tau, rest) = (leave * turn, -arrive * turn);
    TangentRay {
        x: linear.x + leave * arrive * turn,
        disparity: crossing + rest * rest * g_one + tau * tau * g_two,
        slide: 2.0 * (tau * g_two - rest * g_one) * (-g_one * g_two * turn * turn),
    }
}

/// By how many disparities the viewpoint at α sees a point of the first view elsewhere.
pub(crate) fn first_shift(alpha: f64) -> f64 {
    -alpha
}

/// By how many disparities the viewpoint at α sees a point of the second view elsewhere.
pub(crate) fn second_shift(alpha: f64) -> f64 {
    1.0 - alpha
}

/// A touching point seen from elsewhere.
#[inline]
pub(crate) fn seen_from(touch: TangentRay, disparities: f64) -> TangentRay {
    TangentRay {
        x: touch.x + disparities * touch.disparity,
        ..touch
    }
}

/// The interval of the other view's span that holds a touching point, or the nearest: simplified contours may miss a point by
/// some pixels. The span is not empty.
fn home(touch: TangentRay, disparities: f64, others: &[SpanInterval]) -> usize {
    let x = seen_from(touch, disparities).x;
    let mut best = (f64::INFINITY, 0);
    for (k, other) in others.iter().enumerate() {
        let outside = (other.enter.x - x).max(x - other.exit.x).max(0.0);
        if outside < best.0 {
            best = (outside, k);
        }
    }
    best.1
}

/// The intervals of the other view that hold the ends of one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Homes {
    enter: usize,
    exit: usize,
}

impl Homes {
    fn new(interval: &SpanInterval, disparities: f64, others: &[SpanInterval]) -> Self {
        Self {
            enter: home(interval.enter, disparities, others),
            exit: home(interval.exit, disparities, others),
        }
    }
}

/// How one side of an interpolated interval comes from sides of the views' intervals, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Both views touch the same side.
    Both(usize, usize),
    /// A point that the first view touches, seen where it is.
    First(usize),
    /// A point that the second view touches, seen where it is.
    Second(usize),
    /// A side, and the one across a gap that only the first view sees.
    FirstGap(usize, usize),
    /// A side, and the one across a gap that only the second view sees.
    SecondGap(usize, usize),
    /// Neither view's touching point lies in the other's interval.
    Linear(usize, usize),
}

/// How a side is seen from between, given the two touching points that it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SideRule {
    /// Both views touch this side.
    Between(Side),
    /// Neither view's touching point lies in the other's interval.
    Linear,
    /// The first of the points, of the first view, is seen where it is.
    First,
    /// The first of the points, of the second view, is seen where it is.
    Second,
    /// The points are a side and the one across a gap, of the first view.
    FirstGap(Side),
    /// The points are a side and the one across a gap, of the second view.
    SecondGap(Side),
}

impl SideRule {
    /// What the viewpoint at α touches.
    #[inline]
    pub(crate) fn touch(self, a: TangentRay, b: TangentRay, alpha: f64) -> TangentRay {
        match self {
            Self::Between(side) => between(a, b, alpha, side),
            Self::Linear => a.lerp(b, alpha),
            Self::First => seen_from(a, first_shift(alpha)),
            Self::Second => seen_from(a, second_shift(alpha)),
            Self::FirstGap(side) => beside_gap(a, b, GapShifts::of_first(alpha), side),
            Self::SecondGap(side) => beside_gap(a, b, GapShifts::of_second(alpha), side),
        }
    }
}

/// Where the sides of an interpolated interval come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Linked {
    /// The intervals that are linked: of the first and of the second view.
    pair: (usize, usize),
    /// The left side.
    pub enter: Origin,
    /// The right side.
    pub exit: Origin,
}

impl Linked {
    /// The only interval of one view with the only one of the other.
    pub(crate) const SINGLE: Self = Self {
        pair: (0, 0),
        enter: Origin::Both(0, 0),
        exit: Origin::Both(0, 0),
    };
}

/// Writes how the intervals of two spans on one scanline, neither empty, are linked to `output`: one entry for every pair where a touching
/// point of one interval lies in the other.
///
/// An end of such a pair whose touching points lie in each other's interval is on one side: the tight rule joins them. Where
/// a leg opens, an inner end exists in one view only, and is seen where its touching point is.
///
/// `homes` is a buffer.
pub(crate) fn link(
    one: &[SpanInterval],
    two: &[SpanInterval],
    homes: &mut Vec<Homes>,
    output: &mut Vec<Linked>,
) {
    homes.clear();
    homes.extend(two.iter().map(|j| Homes::new(j, 1.0, one)));
    output.clear();
    for (a, i) in one.iter().enumerate() {
        let ahead = Homes::new(i, -1.0, two);
        for (b, back) in homes.iter().enumerate() {
            let enters = (ahead.enter == b, back.enter == a);
            let exits = (ahead.exit == b, back.exit == a);
            let is_linked = enters.0 || enters.1 || exits.0 || exits.1;
            if !is_linked {
                continue;
            }
            let origin = |(is_ahead, is_back): (bool, bool)| match (is_ahead, is_back) {
                (true, true) => Origin::Both(a, b),
                (true, false) => Origin::First(a),
                (false, true) => Origin::Second(b),
                (false, false) => Origin::Linear(a, b),
            };
            output.push(Linked {
                pair: (a, b),
                enter: origin(enters),
                exit: origin(exits),
            });
        }
    }
    find_gaps(output);
}

/// Pairs the sides of gaps that only one view sees.
fn find_gaps(links: &mut [Linked]) {
    for k in 0..links.len() {
        let (done, rest) = links.split_at_mut(k);
        let Some(right) = rest.first_mut() else {
            return;
        };
        // The leg before of the same interval: of the second view directly before, of the first somewhere before.
        let (a, b) = right.pair;
        match right.enter {
            Origin::Second(other) => {
                let before = done.last_mut().filter(|l| l.pair.0 == a);
                if let Some(left) = before
                    && let Origin::Second(j) = left.exit
                {
                    left.exit = Origin::SecondGap(j, other);
                    right.enter = Origin::SecondGap(other, j);
                }
            }
            Origin::First(other) => {
                let before = done.iter_mut().rev().find(|l| l.pair.1 == b);
                if let Some(left) = before
                    && let Origin::First(i) = left.exit
                {
                    left.exit = Origin::FirstGap(i, other);
                    right.enter = Origin::FirstGap(other, i);
                }
            }
            _ => {}
        }
    }
}

/// Where the viewpoint at α sees a side of a gap that only one view sees.
///
/// Both sides are points, seen where they are. When the view that sees no gap should see one by that, something else covers
/// it there: then the gap closes evenly on the way to that view.
#[inline]
pub(crate) fn beside_gap(
    own: TangentRay,
    across: TangentRay,
    shifts: GapShifts,
    side: Side,
) -> TangentRay {
    let gap = seen_from(across, shifts.to_blind).x - seen_from(own, shifts.to_blind).x;
    let seen = seen_from(own, shifts.to_eye);
    // Right sides of intervals look across to greater x, left ones to smaller.
    let open = match side {
        Side::Right => gap.max(0.0),
        Side::Left => gap.min(0.0),
    };
    TangentRay {
        x: seen.x + 0.5 * shifts.closing * open,
        ..seen
    }
}

/// From the view that sees a gap to other viewpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GapShifts {
    /// Disparities to the viewpoint that is interpolated.
    to_eye: f64,
    /// Disparities to the view that sees no gap.
    to_blind: f64,
    /// How much of a gap that should not be there is closed.
    closing: f64,
}

impl GapShifts {
    /// For gaps of the first view.
    pub(crate) fn of_first(alpha: f64) -> Self {
        Self {
            to_eye: first_shift(alpha),
            to_blind: first_shift(1.0),
            closing: alpha,
        }
    }

    /// For gaps of the second view.
    pub(crate) fn of_second(alpha: f64) -> Self {
        Self {
            to_eye: second_shift(alpha),
            to_blind: second_shift(0.0),
            closing: 1.0 - alpha,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The left touching ray at α of a disc in the plane of (x, disparity).
    fn left_of_disc(x: f64, disparity: f64, radius: f64, alpha: f64) -> TangentRay {
        // Rays run along (α, 1): the point touched is at the disc's middle plus the radius across them.
        let length = (1.0 + alpha * alpha).sqrt();
        let (px, pd) = (x - radius / length, disparity + radius * alpha / length);
        TangentRay {
            x: px - alpha * pd,
            disparity: pd,
            slide: radius / length.powi(3),
        }
    }

    fn mirrored(t: TangentRay) -> TangentRay {
        TangentRay {
            x: -t.x,
            disparity: -t.disparity,
            slide: -t.slide,
        }
    }

    proptest! {
        /// On a smooth object the rule is right to fourth order where the linear one is to second.
        #[test]
        fn a_disc_is_followed(x in -1.0..1.0_f64, d in 1.0..2.0_f64, radius in 0.1..1.0_f64, alpha in 0.05..0.95_f64) {
            let (one, two) = (left_of_disc(x, d, radius, 0.0), left_of_disc(x, d, radius, 1.0));
            // Viewpoints at 0 and 1 of a baseline scaled down: that is a disc scaled up in disparity.
            let truth = left_of_disc(x, d, radius, alpha);
            let (tight, linear) = (between(one, two, alpha, Side::Left), one.lerp(two, alpha));
            prop_assert!((tight.x - truth.x).abs() < 0.06 * (linear.x - truth.x).abs());
            prop_assert!(linear.x < truth.x, "the linear rule is conservative");
            prop_assert!((tight.slide / truth.slide - 1.0).abs() < 0.3, "{} for {}", tight.slide, truth.slide);
            let right = between(mirrored(one), mirrored(two), alpha, Side::Right);
            prop_assert!((right.x + tight.x).abs() < 1e-12 && (right.disparity + tight.disparity).abs() < 1e-12);
        }

        /// A point is seen where it is, by whatever side it is touched.
        #[test]
        fn a_point_is_itself(x in -1.0..1.0_f64, d in 1.0..2.0_f64, alpha in 0.0..1.0_f64) {
            for side in [Side::Left, Side::Right] {
                let seen = between(point(x, d), point(x - d, d), alpha, side);
                prop_assert!((seen.x - (x - alpha * d)).abs() < 1e-12 && (seen.disparity - d).abs() < 1e-9);
            }
        }

        /// Half the step takes a sixteenth of the error; chained, the disparity must be good as well.
        #[test]
        fn the_error_is_of_fourth_order(radius in 0.2..1.0_f64, from in 0.0..0.5_f64, step in 0.1..0.4_f64) {
            let error = |step: f64| {
                // The pair at `from` and `from + step`, in coordinates of that pair.
                let seen = |alpha: f64| {
                    let t = left_of_disc(0.0, 1.0, radius, alpha);
                    TangentRay { x: t.x, disparity: t.disparity * step, slide: 0.0 }
                };
                let (one, two) = (seen(from), seen(from + step));
                (between(one, two, 0.3, Side::Left).x - seen(from + 0.3 * step).x).abs()
            };
            prop_assert!(error(step) < 1e-13 || error(0.5 * step) < error(step) / 10.0);
        }
    }

    fn point(x: f64, disparity: f64) -> TangentRay {
        TangentRay {
            x,
            disparity,
            slide: 0.0,
        }
    }

    /// A wall that the first view sees whole, and the second with a gap between two touching points.
    fn wall(
        left_of_gap: (f64, f64),
        right_of_gap: (f64, f64),
    ) -> ([SpanInterval; 1], [SpanInterval; 2]) {
        let interval = |enter: (f64, f64), exit: (f64, f64)| SpanInterval {
            enter: point(enter.0, enter.1),
            exit: point(exit.0, exit.1),
        };
        (
            [interval((0.0, 1.0), (10.0, 1.0))],
            [
                interval((-1.0, 1.0), left_of_gap),
                interval(right_of_gap, (9.0, 1.0)),
            ],
        )
    }

    /// Where the sides of the gap are seen, by the links that are found.
    fn gap_between((one, two): &([SpanInterval; 1], [SpanInterval; 2]), alpha: f64) -> (f64, f64) {
        let mut links = Vec::new();
        link(one, two, &mut Vec::new(), &mut links);
        assert_eq!(links.len(), 2);
        assert_eq!(links[0].exit, Origin::SecondGap(0, 1));
        assert_eq!(links[1].enter, Origin::SecondGap(1, 0));
        let (left, right) = (two[0].exit, two[1].enter);
        (
            SideRule::SecondGap(Side::Right).touch(left, right, alpha).x,
            SideRule::SecondGap(Side::Left).touch(right, left, alpha).x,
        )
    }

    #[test]
    fn a_gap_opens_where_its_sides_are_seen_apart() {
        let wall = wall((4.0, 2.0), (4.5, 1.0));
        let late = gap_between(&wall, 0.9);
        assert!((late.0 - 4.2).abs() < 1e-12 && (late.1 - 4.6).abs() < 1e-12);
        let early = gap_between(&wall, 0.1);
        assert!(early.0 > early.1, "the gap is closed there");
    }

    /// Here the first view should see the gap by these points, but does not.
    #[test]
    fn a_gap_that_something_covers_closes_evenly() {
        let wall = wall((4.0, 1.0), (6.0, 1.0));
        let gap = |alpha: f64| {
            let (left, right) = gap_between(&wall, alpha);
            right - left
        };
        assert!(gap(0.0).abs() < 1e-12 && (gap(0.5) - 1.0).abs() < 1e-12);
        assert!((gap(1.0) - 2.0).abs() < 1e-12);
    }
}
