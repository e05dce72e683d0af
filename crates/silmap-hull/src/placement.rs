//! Where the vertex of a collapsed edge goes, and what that costs.
//!
//! The faces around the edge bound the vertex: it must lie on or outside the plane of each. Among those places the one
//! that adds the least volume is the optimum of a linear program, as volume is linear in the vertex. The volume's
//! gradient is the sum of the faces' own vector areas, so the program is never unbounded.
//!
//! Why this is enough: the new faces and the flipped old ones together bound the tetrahedra between the new vertex and
//! each old face. A vertex outside all planes gives none of them a negative volume, so the winding number falls nowhere,
//! whatever folds or crossings there are.
//!
//! Source: section 7 of the 1999 paper. Deviation: guards on shape keep slivers and spikes out of the sequence (the bare
//! program stalls on real scans); they forbid collapses, and never loosen a constraint.

use glam::DVec3;
use silmap_geometry::lp::{self, HalfSpace, Solution};
use silmap_geometry::predicates::side_of_plane;

use super::HullParams;
use super::surface::{Surface, next, previous};

/// The linear program's infinity, in radii of the edge's neighbourhood: vertices further out are never wanted.
const REACH: f64 = 64.0;
/// How far outside the planes the vertex is aimed, in radii of the neighbourhood: above the program's own slack, so that
/// the exact test rarely fails, and far below anything visible. Later tries are for slivers, whose planes are vague.
const MARGINS_REL: [f64; 3] = [1e-10, 1e-8, 1e-6];
/// Faces of a compactness below this have no direction worth comparing with.
const VAGUE_COMPACTNESS: f64 = 1e-6;

/// A collapse that is allowed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Placement {
    /// Where the vertex goes.
    pub(super) position: DVec3,
    /// Volume it adds; not negative.
    pub(super) added_volume: f64,
    /// What the queue is ordered by.
    pub(super) priority: f64,
}

/// How far shapes may go wrong; loosened when nothing else is left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guards {
    /// Most faces at a vertex.
    pub(super) max_valence: u32,
    /// Least compactness of a new face, unless the old ones are worse.
    pub(super) min_compactness: f64,
    /// Least cosine between the normals of a face before and after.
    pub(super) min_turn_cosine: f64,
    /// Farthest the vertex may be from the edge's middle, in radii of the neighbourhood.
    pub(super) max_reach: f64,
}

/// What placing vertices asks of a face, kept so that it is worked out once for the dozen edges that ask.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FaceShape {
    /// Twice the vector area.
    cross: DVec3,
    /// Of unit length; zero when the face has no area.
    normal: DVec3,
    compactness: f64,
}

impl FaceShape {
    pub(super) fn of(surface: &Surface, face: u32) -> Self {
        let [a, b, c] = surface.corners(face).map(|v| surface.position(v));
        let (ab, bc, ca) = (b - a, c - b, a - c);
        let cross = ca.cross(ab);
        Self {
            cross,
            normal: cross.normalize_or_zero(),
            compactness: compactness(
                cross.length(),
                ab.length_squared() + bc.length_squared() + ca.length_squared(),
            ),
        }
    }
}

/// The faces around an edge, relative to its middle.
#[derive(Debug, Default)]
pub(super) struct Neighbourhood {
    origin: DVec3,
    /// Largest distance of a vertex from the origin.
    radius: f64,
    /// Vertex ids of all faces.
    faces: Vec<[u32; 3]>,
    /// On or outside each face's plane.
    planes: Vec<HalfSpace>,
    /// Six times the volume between the old faces and a new vertex: this times the vertex, less `base`.
    gradient: DVec3,
    base: f64,
    /// Start and end of each ring edge, and unit normal and compactness of its face.
    ring: Vec<RingEdge>,
    half_spaces: Vec<HalfSpace>,
}

#[derive(Clone, Copy, Debug)]
struct RingEdge {
    from: DVec3,
    to: DVec3,
    normal: DVec3,
    compactness: f64,
}

/// One for an equilateral triangle, zero for a degenerate one, from twice its area and its sides.
fn compactness(cross_length: f64, sides_squared: f64) -> f64 {
    if sides_squared > 0.0 {
        2.0 * 3.0_f64.sqrt() * cross_length / sides_squared
    } else {
        0.0
    }
}

impl Neighbourhood {
    /// Takes in the faces around the edge of `h`; `shapes` are those of all faces.
    pub(super) fn gather(&mut self, surface: &Surface, shapes: &[FaceShape], h: u32) {
        let twin = surface.twin(h);
        self.origin = surface
            .position(surface.start(h))
            .midpoint(surface.position(surface.start(twin)));
        self.faces.clear();
        self.planes.clear();
        self.ring.clear();
        (self.gradient, self.base) = (DVec3::ZERO, 0.0);
        let mut radius_squared = 0.0_f64;
        for opposite in surface.ring(h) {
            let shape = &shapes[(opposite / 3) as usize];
            let (ids, from) = self.push_face(surface, shape, opposite);
            let to = surface.position(ids[1]) - self.origin;
            radius_squared = radius_squared.max(from.length_squared());
            self.ring.push(RingEdge {
                from,
                to,
                normal: shape.normal,
                compactness: shape.compactness,
            });
        }
        self.radius = radius_squared.sqrt();
        for side in [next(h), next(twin)] {
            self.push_face(surface, &shapes[(side / 3) as usize], side);
        }
    }

    /// Adds the face of a half-edge; returns its vertices from the half-edge's start on, and where that is.
    fn push_face(&mut self, surface: &Surface, shape: &FaceShape, h: u32) -> ([u32; 3], DVec3) {
        let ids = [surface.start(h), surface.end(h), surface.start(previous(h))];
        let corner = surface.position(ids[0]) - self.origin;
        self.faces.push(ids);
        self.gradient += shape.cross;
        self.base += shape.cross.dot(corner);
        if shape.normal != DVec3::ZERO {
            self.planes.push(HalfSpace {
                normal: shape.normal,
                offset: shape.normal.dot(corner),
            });
        }
        (ids, corner)
    }

    /// The faces around the edge, by vertex ids.
    pub(super) fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The cheapest allowed place, if there is one.
    pub(super) fn place(
        &mut self,
        surface: &Surface,
        guards: &Guards,
        params: &HullParams,
    ) -> Option<Placement> {
        MARGINS_REL
            .iter()
            .find_map(
                |margin| match self.place_with(surface, guards, params, *margin) {
                    Attempt::Placed(placement) => Some(Some(placement)),
                    Attempt::Refused => Some(None),
                    Attempt::Inside => None,
                },
            )
            .flatten()
    }

    fn place_with(
        &mut self,
        surface: &Surface,
        guards: &Guards,
        params: &HullParams,
        margin_rel: f64,
    ) -> Attempt {
        let ulp = self.origin.abs().max_element() * f64::EPSILON;
        let margin = self.radius * margin_rel + 4.0 * ulp;
        self.half_spaces.clear();
        self.half_spaces
            .extend(self.planes.iter().map(|h| HalfSpace {
                offset: h.offset + margin,
                ..*h
            }));
        let Solution::Optimal(local) =
            lp::minimise(self.gradient, &mut self.half_spaces, self.radius * REACH)
        else {
            return Attempt::Refused;
        };
        let mut is_inside = false;
        for is_lifted in [false, true] {
            let local = if is_lifted {
                let Some(lifted) = self.lifted() else {
                    continue;
                };
                lifted
            } else {
                local
            };
            let Some(shape) = self.shape_around(local, guards) else {
                continue;
            };
            let position = self.origin + local;
            if !self.is_outside(surface, position) {
                is_inside = true;
                continue;
            }
            let local = position - self.origin;
            let added_volume = ((self.gradient.dot(local) - self.base) / 6.0).max(0.0);
            return Attempt::Placed(Placement {
                position,
                added_volume,
                priority: added_volume + params.compactness_weight * shape,
            });
        }
        if is_inside {
            Attempt::Inside
        } else {
            Attempt::Refused
        }
    }

    /// The edge's middle, moved along the gradient until it is outside all planes: not the cheapest place, but next to
    /// the edge where the program's answer ran off sideways.
    fn lifted(&self) -> Option<DVec3> {
        let up = self.gradient.try_normalize()?;
        let mut height = 0.0_f64;
        for h in &self.half_spaces {
            let rate = h.normal.dot(up);
            if rate > 1e-3 {
                height = height.max(h.offset / rate);
            } else if h.offset > 0.0 {
                return None;
            }
        }
        Some(up * height)
    }

    /// Whether the exact predicate puts the vertex on or outside every plane.
    fn is_outside(&self, surface: &Surface, position: DVec3) -> bool {
        self.faces.iter().all(|face| {
            let [a, b, c] = face.map(|v| surface.position(v));
            side_of_plane(a, b, c, position) >= 0.0
        })
    }

    /// How bad the new faces' shapes are, as a volume; `None` when a guard forbids them.
    fn shape_around(&self, local: DVec3, guards: &Guards) -> Option<f64> {
        if local.length() > guards.max_reach * self.radius {
            return None;
        }
        let worst_before = self
            .ring
            .iter()
            .map(|e| e.compactness)
            .fold(f64::INFINITY, f64::min);
        let least = guards.min_compactness.min(worst_before * 0.5);
        let mut badness = 0.0;
        for edge in &self.ring {
            let (to_from, to_to) = (edge.from - local, edge.to - local);
            let cross = to_from.cross(to_to);
            let length = cross.length();
            let sides = to_from.length_squared()
                + to_to.length_squared()
                + edge.from.distance_squared(edge.to);
            let shape = compactness(length, sides);
            if shape < least || length == 0.0 {
                return None;
            }
            if edge.compactness > VAGUE_COMPACTNESS
                && cross.dot(edge.normal) < guards.min_turn_cosine * length
            {
                return None;
            }
            badness += (1.0 - shape) * sides * sides.sqrt();
        }
        Some(badness)
    }
}

enum Attempt {
    Placed(Placement),
    Refused,
    /// Only rounding is in the way.
    Inside,
}
