//! The part of a hull that one change replaces: faces around a vertex or an edge, and the ring they leave.

use glam::DVec3;

use super::super::surface::{Surface, next, previous};

/// Least compactness of a new face (one for an equilateral triangle), unless the old ones were worse.
const MIN_COMPACTNESS: f64 = 0.02;
/// Least cosine between the normal of a new face and that of the old face at the same ring edge.
const MIN_TURN_COSINE: f64 = 0.3;
/// Faces whose normals have a smaller cosine than this lie folded onto one another.
const FOLDED_COSINE: f64 = -0.8;

/// Faces that are replaced by a fan from the ring to one vertex. Coordinates are relative to `origin`.
#[derive(Debug, Default)]
pub(super) struct Patch {
    pub(super) origin: DVec3,
    /// Largest distance of a ring vertex from the origin.
    pub(super) radius: f64,
    /// The ring, counter-clockwise from outside, an edge at a time.
    pub(super) ring: Vec<[DVec3; 2]>,
    /// The same as they are stored.
    pub(super) ring_places: Vec<[DVec3; 2]>,
    /// The old faces.
    pub(super) faces: Vec<[DVec3; 3]>,
    /// Ids of the old faces.
    pub(super) face_ids: Vec<u32>,
    /// Six times the fan's volume is this times its vertex.
    pub(super) gradient: DVec3,
    /// Six times the volume of the old faces.
    volume: f64,
    /// Normals of the old face within and the face outside at each ring edge; of unit length, or zero.
    normals: Vec<DVec3>,
    outer: Vec<DVec3>,
    least_compactness: f64,
    /// Cosine of the sharpest turn between faces, of those at the ring.
    sharpest_cosine: f64,
}

impl Patch {
    /// The faces around a vertex.
    pub(super) fn around_vertex(&mut self, surface: &Surface, vertex: u32) {
        self.clear(surface.position(vertex));
        for h in surface.leaving(vertex) {
            self.push(surface, next(h), true);
        }
        self.finish();
    }

    /// The faces around both ends of an edge.
    pub(super) fn around_edge(&mut self, surface: &Surface, h: u32) {
        let twin = surface.twin(h);
        self.clear(
            surface
                .position(surface.start(h))
                .midpoint(surface.position(surface.start(twin))),
        );
        for opposite in surface.ring(h) {
            self.push(surface, opposite, true);
        }
        for side in [next(h), next(twin)] {
            self.push(surface, side, false);
        }
        self.finish();
    }

    fn clear(&mut self, origin: DVec3) {
        self.origin = origin;
        self.ring.clear();
        self.ring_places.clear();
        self.outer.clear();
        self.faces.clear();
        self.face_ids.clear();
        self.normals.clear();
    }

    fn push(&mut self, surface: &Surface, h: u32, is_ring: bool) {
        let corners = [surface.start(h), surface.end(h), surface.start(previous(h))]
            .map(|v| surface.position(v) - self.origin);
        self.faces.push(corners);
        self.face_ids.push(h / 3);
        if is_ring {
            self.ring.push([corners[0], corners[1]]);
            self.ring_places
                .push([surface.start(h), surface.end(h)].map(|v| surface.position(v)));
            let [a, b, c] = surface
                .corners(surface.twin(h) / 3)
                .map(|v| surface.position(v));
            self.outer.push((b - a).cross(c - a).normalize_or_zero());
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            self.normals.push(cross.normalize_or_zero());
        }
    }

    fn finish(&mut self) {
        let squared = self.ring.iter().map(|[from, _]| from.length_squared());
        self.radius = squared.fold(0.0, f64::max).sqrt();
        self.gradient = self.ring.iter().map(|[from, to]| from.cross(*to)).sum();
        self.volume = self.faces.iter().map(|[a, b, c]| a.dot(b.cross(*c))).sum();
        self.least_compactness = self
            .faces
            .iter()
            .map(|&face| compactness(face))
            .fold(f64::INFINITY, f64::min);
        let turns = self.normals.iter().zip(&self.outer).map(|(n, o)| n.dot(*o));
        self.sharpest_cosine = turns.fold(1.0, f64::min);
    }

    /// The box around the old faces.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.faces.iter().flatten().fold(start, |(low, high), &p| {
            (low.min(p + self.origin), high.max(p + self.origin))
        })
    }

    /// Volume that the hull gains when the fan's vertex is at `at`; negative when it loses some.
    pub(super) fn added_volume(&self, at: DVec3) -> f64 {
        (self.gradient.dot(at) - self.volume) / 6.0
    }

    /// Whether the fan's faces are no slivers, turn over nowhere and fold onto no neighbour.
    pub(super) fn is_sound(&self, at: DVec3) -> bool {
        let least = MIN_COMPACTNESS.min(self.least_compactness * 0.5);
        let sharpest = FOLDED_COSINE.min(self.sharpest_cosine);
        let normal_of = |k: usize| {
            let [from, to] = self.ring[k];
            (to - from).cross(at - from).normalize_or_zero()
        };
        let mut before = normal_of(self.ring.len() - 1);
        (0..self.ring.len()).all(|k| {
            let [from, to] = self.ring[k];
            let normal = normal_of(k);
            let is_sound = compactness([from, to, at]) >= least
                && normal.dot(self.normals[k]) >= MIN_TURN_COSINE
                && normal.dot(before) >= sharpest
                && normal.dot(self.outer[k]) >= sharpest;
            before = normal;
            is_sound
        })
    }
}

/// One for an equilateral triangle, zero for a degenerate one.
pub(super) fn compactness([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if sides > 0.0 {
        2.0 * 3.0_f64.sqrt() * (b - a).cross(c - a).length() / sides
    } else {
        0.0
    }
}
