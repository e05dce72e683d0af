//! Changes that only enlarge the region, for conservative contours.

use glam::DVec2;

use super::VERTEX_STEPS_PER_PX;
use super::outline::{Proposal, SimplifiedLoops, turn};

/// How many lattice steps from the exact crossing of two lines a point beyond both is looked for.
const SEARCH_STEPS: i32 = 4;

impl SimplifiedLoops {
    /// What the removal of `v` costs: the area it adds, as far as that is known before trying.
    pub(super) fn cost_of_outward(&self, v: u32) -> Option<f64> {
        let [_, p, n, nn] = self.neighbourhood(v)?;
        let [a, b, c, d] = [p, v, n, nn].map(|v| self.vertex(v).position);
        let area = turn(a, b, c);
        if area <= 0.0 {
            return Some(-area);
        }
        let tip = point_beyond(a, b, c, d)?;
        Some(turn(b, tip, c).max(0.0))
    }

    /// Removes `v` if it is concave; if it and the next vertex are convex, replaces both by a point outside.
    pub(super) fn propose_outward(&self, v: u32) -> Option<Proposal> {
        let [_, p, n, nn] = self.neighbourhood(v)?;
        let (vertex, before, after) = (self.vertex(v), self.vertex(p), self.vertex(n));
        let (a, b, c) = (before.position, vertex.position, after.position);
        let area = turn(a, b, c);
        if area <= 0.0 {
            let is_near = self.is_near((p, a), (after.place, c));
            return is_near.then_some(Proposal {
                before: a,
                after: c,
                takes_place: false,
                swept: [Some([a, b, c]), None, None, None, None],
            });
        }
        let d = self.vertex(nn).position;
        if turn(b, c, d) <= 0.0 {
            return None;
        }
        let tip = point_beyond(a, b, c, d)?;
        let takes_place = tip.distance_squared(vertex.place.position)
            < tip.distance_squared(after.place.position);
        let place = if takes_place {
            vertex.place
        } else {
            after.place
        };
        let is_near = tip.distance_squared(place.position) <= self.tolerance_squared
            && self.is_near((p, a), (place, tip))
            && self.is_near(
                (if takes_place { v } else { n }, tip),
                (self.vertex(nn).place, d),
            );
        is_near.then_some(Proposal {
            before: a,
            after: tip,
            takes_place,
            swept: [Some([b, tip, c]), None, None, None, None],
        })
    }
}

/// The lattice point nearest to where the lines from `a` through `b` and from `d` through `c` meet that lies on neither's
/// inner side, so that a, point, d is convex and has `b` and `c` inside or on it.
fn point_beyond(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> Option<DVec2> {
    let (along, back) = (b - a, c - d);
    let crossing = along.perp_dot(back);
    // Together the two turns must be less than half a circle.
    let s = (d - a).perp_dot(back) / crossing;
    if crossing >= 0.0 || !s.is_finite() {
        return None;
    }
    let exact = (a + along * s) * VERTEX_STEPS_PER_PX;
    let mut best: Option<(f64, DVec2)> = None;
    for j in -SEARCH_STEPS..=SEARCH_STEPS {
        for i in -SEARCH_STEPS..=SEARCH_STEPS {
            let lattice = exact.round() + DVec2::new(f64::from(i), f64::from(j));
            let point = lattice / VERTEX_STEPS_PER_PX;
            let distance = lattice.distance_squared(exact);
            let is_better = best.is_none_or(|(least, _)| distance < least);
            if is_better && turn(a, point, b) >= 0.0 && turn(point, d, c) >= 0.0 {
                best = Some((distance, point));
            }
        }
    }
    best.map(|(_, point)| point)
}
