//! Lines fitted to parts of a traced outline, and the removal of a vertex between two of them.
//!
//! A centre-sampled outline's cracks scatter evenly about the true line, so the least-squares line through the polyline
//! that joins the middles of the cracks has no bias. Sums along the loop make each fit a handful of operations.
//!
//! Source: P. Selinger. Potrace: a polygon-based tracing algorithm. 2003, sections 2.2 and 2.3 (fits by prefix sums,
//! vertices where fitted lines meet). Deviation: vertices go greedily instead of by shortest path.

use glam::DVec2;
use silmap_geometry::polygon::distance_squared_to_segment;

use super::VERTEX_STEPS_PER_PX;
use super::moments::Line;
use super::outline::{Place, Proposal, SimplifiedLoops};

/// Weight of a vertex's place on the traced outline against the two lines it should lie on: keeps the crossing of two
/// nearly parallel lines near, and shifts that of others by little.
const PLACE_WEIGHT: f64 = 0.01;

/// How often the ends of a fitted edge are shifted to bring it within the tolerance before it is given up.
const CORRECTIONS: usize = 6;
/// Edges that stray by more than this many tolerances are given up at once.
const MOST_CORRECTED: f64 = 1.5;
/// Corrections aim this far within the tolerance, pixels: rounding to the lattice moves an edge by up to half a step.
const ROUNDING_PX: f64 = 0.5 / VERTEX_STEPS_PER_PX;

/// The point nearest to two lines, and a little to `place`, on the vertex lattice.
fn meeting_point(one: &Line, other: &Line, place: DVec2) -> DVec2 {
    let (n, m) = (one.normal, other.normal);
    let (r, s) = (n.dot(place - one.center), m.dot(place - other.center));
    let xx = n.x * n.x + m.x * m.x + PLACE_WEIGHT;
    let xy = n.x * n.y + m.x * m.y;
    let yy = n.y * n.y + m.y * m.y + PLACE_WEIGHT;
    let right = -(n * r + m * s);
    let determinant = xx * yy - xy * xy;
    let shift = DVec2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / determinant;
    on_lattice(place + shift)
}

fn on_lattice(p: DVec2) -> DVec2 {
    (p * VERTEX_STEPS_PER_PX).round() / VERTEX_STEPS_PER_PX
}

impl SimplifiedLoops {
    /// What the removal of `v` costs: the growth of the sum of squared distances between lines and cracks, px³.
    pub(super) fn cost_of_fitted(&self, v: u32) -> Option<f64> {
        let [_, p, n, _] = self.neighbourhood(v)?;
        let merged = self.moments_between(p, n).fit();
        let apart = self.vertex(p).line.residual + self.vertex(v).line.residual;
        Some((merged.residual - apart).max(0.0))
    }

    /// Removes `v` and lays one edge through what its two edges stood for.
    ///
    /// The edge's ends move to where it meets its neighbours' lines; where that leaves the tolerance they stay.
    pub(super) fn propose_fitted(&self, v: u32) -> Option<Proposal> {
        let [pp, p, n, nn] = self.neighbourhood(v)?;
        let (vertex, before, after) = (self.vertex(v), self.vertex(p), self.vertex(n));
        let (first, last) = (self.vertex(pp).position, self.vertex(nn).position);
        let corners = [before.position, vertex.position, after.position];
        if let Some([a, b]) = self.fit_within_tolerance([pp, p, n, nn]) {
            return Some(Proposal {
                before: a,
                after: b,
                takes_place: false,
                swept: [
                    Some(corners),
                    Some([first, before.position, a]),
                    Some([after.position, before.position, a]),
                    Some([a, after.position, b]),
                    Some([last, after.position, b]),
                ],
            });
        }
        let can_stay = self.is_near((p, before.position), (after.place, after.position));
        can_stay.then_some(Proposal {
            before: before.position,
            after: after.position,
            takes_place: false,
            swept: [Some(corners), None, None, None, None],
        })
    }

    /// Positions for the vertices `p` and `n` such that the one edge between them and the edges to `pp` and `nn` fit the
    /// traced outline well and stay within the tolerance.
    fn fit_within_tolerance(&self, [pp, p, n, nn]: [u32; 4]) -> Option<[DVec2; 2]> {
        let (before, after) = (self.vertex(p), self.vertex(n));
        let (first, last) = (self.vertex(pp), self.vertex(nn));
        let merged = self.moments_between(p, n).fit();
        let mut a = meeting_point(&first.line, &merged, before.place.position);
        let mut b = meeting_point(&merged, &after.line, after.place.position);
        let tolerance = self.tolerance_squared.sqrt();
        for _ in 0..CORRECTIONS {
            let is_on_place = |q: DVec2, place: &Place| {
                distance_squared_to_segment(q, place.leg.0, place.leg.1) <= self.tolerance_squared
            };
            if !is_on_place(a, &before.place) || !is_on_place(b, &after.place) {
                return None;
            }
            let edges = [
                ((p, a), (after.place, b)),
                ((pp, first.position), (before.place, a)),
                ((n, b), (last.place, last.position)),
            ];
            let strays = edges.map(|(from, to)| self.worst_stray(from, to));
            let worst = (0..3).fold(0, |w, k| if strays[k].0 > strays[w].0 { k } else { w });
            let (stray_squared, corner) = strays[worst];
            if stray_squared <= self.tolerance_squared {
                return Some([a, b]);
            }
            // Least squares is not least distance: the least shift of the edge's free ends that brings it near enough.
            let stray = stray_squared.sqrt();
            if stray > tolerance * MOST_CORRECTED {
                return None;
            }
            let ((_, from), (_, to)) = edges[worst];
            let along = to - from;
            let t = ((corner - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let offset = corner - (from + along * t);
            let shift = offset * (1.0 - (tolerance - ROUNDING_PX) / stray);
            match worst {
                0 => {
                    let norm = t * t + (1.0 - t) * (1.0 - t);
                    a += shift * ((1.0 - t) / norm);
                    b += shift * (t / norm);
                }
                1 => a += shift / t.max(0.5),
                _ => b += shift / (1.0 - t).max(0.5),
            }
            a = on_lattice(a);
            b = on_lattice(b);
        }
        None
    }
}
