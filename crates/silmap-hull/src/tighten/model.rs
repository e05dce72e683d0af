//! The model near a patch of the hull, and the places for a vertex that leave it covered.
//!
//! A point x of the model lies beneath the face from a ring edge to the vertex exactly when the vertex lies on the outer
//! side of the plane through that edge and x: a linear constraint on the vertex. Points that faces lie above are known
//! only once the vertex is, so the program is solved several times: each time the points beneath the faces are gathered
//! anew, and where a face still cuts into the model, so are the places where it does.
//!
//! Nothing rests on that gathering. A place is good when no new face crosses a triangle of the model, by exact
//! predicates on the coordinates as they are stored: the model is connected and does not cross the old faces either, so
//! it is on the inner side of the new ones as it was of the old ones.

use glam::{BVec3, DVec3};
use silmap_geometry::lp::{self, HalfSpace, Solution};
use silmap_geometry::predicates::triangles_cross;
use silmap_geometry::{Bvh, TriangleMesh};

use super::patch::Patch;

/// Times the program is solved before a place is given up.
const ROUNDS: usize = 8;
/// How far the vertex may go from the patch's origin along each axis, in the patch's radii.
const REACH: f64 = 0.75;
/// The linear program's infinity, in radii of the patch.
const BOUND: f64 = 64.0;
/// How far the vertex is kept from its constraints, in radii of the patch, so that the exact test seldom fails.
const MARGIN_REL: f64 = 1e-7;
/// Points nearer to a ring edge than this, in radii of the patch, say nothing about where the vertex may be.
const VAGUE_REL: f64 = 1e-6;
/// Points deeper beneath a face than this, in radii of the patch, are left to the exact test.
const DEEP_REL: f64 = 0.2;
/// Heights above a face within this, in radii of the patch, are left to the exact test: far above their rounding.
const UNSURE_REL: f64 = 1e-12;

/// The model, and what of it lies near the patch at hand.
#[derive(Debug)]
pub(super) struct Model<'a> {
    mesh: &'a TriangleMesh,
    tree: &'a Bvh,
    /// Per vertex: the last gathering that took it.
    taken: Vec<u32>,
    gathering: u32,
    /// Relative to the patch's origin.
    points: Vec<DVec3>,
    /// Faces of the model that cross the face looked at last.
    crossing: Vec<u32>,
    /// Which points constrain the vertex already, for each face.
    is_asked: Vec<bool>,
    half_spaces: Vec<HalfSpace>,
    polygon: [Vec<DVec3>; 2],
}

impl<'a> Model<'a> {
    pub(super) fn new(mesh: &'a TriangleMesh, tree: &'a Bvh) -> Self {
        Self {
            mesh,
            tree,
            taken: vec![0; mesh.positions.len()],
            gathering: 0,
            points: Vec::new(),
            crossing: Vec::new(),
            is_asked: Vec::new(),
            half_spaces: Vec::new(),
            polygon: [Vec::new(), Vec::new()],
        }
    }

    /// Whether a triangle passes through the model's surface.
    pub(super) fn is_crossed_by(&self, corners: [DVec3; 3]) -> bool {
        let mut is_crossed = false;
        self.tree.faces_near_hull(bounds(corners), &corners, |f| {
            is_crossed = is_crossed || triangles_cross(corners, self.mesh.corners(f as usize));
        });
        is_crossed
    }

    /// Whether a point is at most `distance` away from the model.
    pub(super) fn is_near(&self, point: DVec3, distance: f64) -> bool {
        distance == f64::INFINITY || self.tree.closest_point_within(point, distance).is_some()
    }

    /// The place, relative to the patch's origin, where the vertex of the patch's fan adds least volume; `None` when no
    /// good one was found. The search starts at the origin.
    pub(super) fn place(&mut self, patch: &Patch) -> Option<DVec3> {
        self.gather(patch);
        self.half_spaces.clear();
        for axis in DVec3::AXES {
            for normal in [axis, -axis] {
                self.half_spaces.push(HalfSpace {
                    normal,
                    offset: -REACH * patch.radius,
                });
            }
        }
        self.take_points_beneath(patch, DVec3::ZERO);
        for _ in 0..ROUNDS {
            let bound = patch.radius * BOUND;
            let Solution::Optimal(best) =
                lp::minimise(patch.gradient, &mut self.half_spaces, bound)
            else {
                return None;
            };
            // As it will be stored.
            let at = (patch.origin + best) - patch.origin;
            if !self.take_crossings(patch, at) {
                return Some(at);
            }
            self.take_points_beneath(patch, at);
        }
        None
    }

    /// Whether the fan's faces cross nothing of what was gathered last.
    pub(super) fn is_clear(&mut self, patch: &Patch, at: DVec3) -> bool {
        (0..patch.ring.len()).all(|k| !self.find_crossing(patch, k, at))
    }

    /// Collects the vertices, of triangles that an allowed fan may meet, that may lie beneath it.
    fn gather(&mut self, patch: &Patch) {
        let (low, high) = patch.bounds();
        let reach = DVec3::splat(REACH * patch.radius * (1.0 + 1e-9));
        let low = low.min(patch.origin - reach);
        let high = high.max(patch.origin + reach);
        self.gathering += 1;
        self.points.clear();
        // Only points at most so deep beneath the fan count: of long faces most have theirs elsewhere.
        let deep = DVec3::splat(DEEP_REL * patch.radius * (1.0 + 1e-9));
        let (least, most) = (low - deep, high + deep);
        let corner = |k: u32| {
            let side = |axis: u32| (k >> axis & 1) == 1;
            DVec3::select(BVec3::new(side(0), side(1), side(2)), most, least)
        };
        let corners: [DVec3; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        self.tree.faces_near_hull((low, high), &corners, |f| {
            for v in self.mesh.faces[f as usize] {
                let taken = &mut self.taken[v as usize];
                if *taken != self.gathering {
                    *taken = self.gathering;
                    let position = self.mesh.positions[v as usize];
                    if position.cmpge(least).all() && position.cmple(most).all() {
                        self.points.push(position - patch.origin);
                    }
                }
            }
        });
        self.is_asked.clear();
        self.is_asked
            .resize(self.points.len() * patch.ring.len(), false);
    }

    /// Constrains the vertex by the model's vertices beneath the faces of the fan to `at`.
    fn take_points_beneath(&mut self, patch: &Patch, at: DVec3) {
        let deep = DEEP_REL * patch.radius;
        let count = self.points.len();
        for (k, &[from, to]) in patch.ring.iter().enumerate() {
            let Some(prism) = Prism::on([from, to, at]) else {
                continue;
            };
            for (i, &point) in self.points.iter().enumerate() {
                let place = k * count + i;
                let height = prism.normal.dot(point - from);
                if height <= 0.0 && height > -deep && !self.is_asked[place] && prism.holds(point) {
                    self.is_asked[place] = true;
                    let constraint = above([from, to], point, patch.radius);
                    self.half_spaces.extend(constraint);
                }
            }
        }
    }

    /// Constrains the vertex where faces of the fan to `at` cross the model; false when none does.
    fn take_crossings(&mut self, patch: &Patch, at: DVec3) -> bool {
        let mut is_crossed = false;
        for (k, &[from, to]) in patch.ring.iter().enumerate() {
            if !self.find_crossing(patch, k, at) {
                continue;
            }
            is_crossed = true;
            let Some(prism) = Prism::on([from, to, at]) else {
                continue;
            };
            for &f in &self.crossing {
                let corners = self.mesh.corners(f as usize);
                self.polygon[0].clear();
                self.polygon[0].extend(corners.map(|p| p - patch.origin));
                prism.clip(&mut self.polygon);
                for &point in &self.polygon[0] {
                    if prism.normal.dot(point - from) > 0.0 {
                        self.half_spaces
                            .extend(above([from, to], point, patch.radius));
                    }
                }
            }
        }
        is_crossed
    }

    /// Lists the triangles that cross face `k` of the fan to `at`; false when there are none.
    fn find_crossing(&mut self, patch: &Patch, k: usize, at: DVec3) -> bool {
        self.crossing.clear();
        let [from, to] = patch.ring[k];
        let normal = (to - from).cross(at - from);
        let normal = normal / normal.length();
        let base = normal.dot(from);
        // Rounding decides nothing: what is within this of the plane goes to the exact test, and so does everything
        // where the face has no area and heights are not numbers.
        let unsure =
            patch.radius * UNSURE_REL + patch.origin.abs().max_element() * (8.0 * f64::EPSILON);
        let [p, q] = patch.ring_places[k];
        let face = [p, q, patch.origin + at];
        let sides = [(from, to), (to, at), (at, from)]
            .map(|(p, q)| (p, normal.cross(q - p).normalize_or_zero()));
        self.tree.faces_near_hull(bounds(face), &face, |f| {
            let corners = self.mesh.corners(f as usize);
            let local = corners.map(|p| p - patch.origin);
            let heights = local.map(|p| normal.dot(p) - base);
            let is_beside = heights.iter().all(|&h| h > unsure)
                || heights.iter().all(|&h| h < -unsure)
                || (sides.iter())
                    .any(|&(on, inwards)| local.iter().all(|&p| inwards.dot(p - on) < -unsure));
            if !is_beside && triangles_cross(face, corners) {
                self.crossing.push(f);
            }
        });
        !self.crossing.is_empty()
    }
}

/// What keeps the face from a ring edge to the vertex above a point; `None` when the point is too near the edge to say.
fn above([from, to]: [DVec3; 2], point: DVec3, radius: f64) -> Option<HalfSpace> {
    let edge = (to - from).try_normalize()?;
    let cross = edge.cross(point - from);
    let distance = cross.length();
    if distance <= VAGUE_REL * radius {
        return None;
    }
    let normal = cross / distance;
    Some(HalfSpace {
        normal,
        offset: normal.dot(from) + MARGIN_REL * radius,
    })
}

fn bounds([a, b, c]: [DVec3; 3]) -> (DVec3, DVec3) {
    (a.min(b).min(c), a.max(b).max(c))
}

/// The points above and below a triangle, along its normal.
struct Prism {
    /// Of unit length.
    normal: DVec3,
    /// A point of each side, and the direction inwards.
    sides: [(DVec3, DVec3); 3],
}

impl Prism {
    fn on([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| (p, normal.cross(q - p)));
        Some(Self { normal, sides })
    }

    fn holds(&self, point: DVec3) -> bool {
        self.sides
            .iter()
            .all(|&(on, inwards)| inwards.dot(point - on) >= 0.0)
    }

    /// Cuts the convex polygon in the first list down to what lies in the prism; the second is scratch.
    fn clip(&self, [polygon, kept]: &mut [Vec<DVec3>; 2]) {
        for &(on, inwards) in &self.sides {
            kept.clear();
            for (i, &p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                let (s, t) = (inwards.dot(p - on), inwards.dot(q - on));
                if s >= 0.0 {
                    kept.push(p);
                }
                if (s > 0.0 && t < 0.0) || (s < 0.0 && t > 0.0) {
                    kept.push(p + (q - p) * (s / (s - t)));
                }
            }
            std::mem::swap(polygon, kept);
        }
    }
}
