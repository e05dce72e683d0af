//! How far a piece of a surface is from convex.
//!
//! At a point of the surface: how far its normal goes before it leaves the piece's convex hull. The hull is taken as the intersection of half-spaces
//! in fixed directions, which hold it.

use glam::DVec3;
use silmap_geometry::TriangleMesh;

use crate::capture::spiral_directions;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) place: DVec3,
    pub(super) normal: DVec3,
}

/// Directions that a hull's half-spaces have, spread evenly; and those of a surface's own normals besides, which flat faces need.
const DIRECTIONS: u32 = 128;
const MOST_NORMALS: usize = 128;

/// Normals closer than this, by their cosine, are one.
const SAME_COSINE: f64 = 0.9995;

/// Concavities below this, in radii of the model's bounding sphere, do not count: half-spaces are that far from the hull.
const LEAST_REL: f64 = 0.02;

/// Half-spaces more aside than this from a normal say nothing.
const LEAST_COSINE: f64 = 0.05;

/// `count` points spread evenly over the area of a mesh.
pub(super) fn samples(mesh: &TriangleMesh, count: usize) -> Vec<Sample> {
    let areas: Vec<f64> = (0..mesh.faces.len())
        .map(|f| mesh.face_cross(f).length())
        .collect();
    let whole: f64 = areas.iter().sum();
    let step = whole / count as f64;
    let mut samples = Vec::with_capacity(count);
    let mut reached = 0.0;
    for (f, area) in areas.iter().enumerate() {
        let first = samples.len();
        // The middle of each share of the area.
        while (samples.len() as f64 + 0.5) * step < reached + area && samples.len() < count {
            let [a, b, c] = mesh.corners(f);
            let k = (samples.len() - first + 1) as f64;
            // Multiples of the two numbers that go best with each other (Roberts), folded into the triangle.
            let (u, v) = ((k * 0.754_877_666).fract(), (k * 0.569_840_290).fract());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            samples.push(Sample {
                place: a + (b - a) * u + (c - a) * v,
                normal: mesh.face_cross(f).normalize_or_zero(),
            });
        }
        reached += area;
    }
    samples
}

/// Directions, in which all extents are measured.
#[derive(Clone, Debug)]
pub(super) struct Hulls {
    directions: Vec<DVec3>,
    radius: f64,
}

impl Hulls {
    /// For a model with these samples, whose bounding sphere has a radius.
    pub(super) fn new(samples: &[Sample], radius: f64) -> Self {
        let mut directions = spiral_directions(DIRECTIONS);
        let most = directions.len() + MOST_NORMALS;
        for sample in samples {
            let is_new = |n: DVec3| directions.iter().all(|d| d.dot(n) < SAME_COSINE);
            if directions.len() < most && is_new(sample.normal) {
                directions.push(sample.normal);
            }
        }
        Self { directions, radius }
    }

    /// The sum of the squares of all samples' concavities, in radii.
    pub(super) fn cost(&self, samples: &[Sample], extents: &mut Vec<f64>) -> f64 {
        extents.clear();
        extents.extend(self.directions.iter().map(|d| {
            let reach = samples.iter().map(|s| d.dot(s.place));
            reach.fold(f64::NEG_INFINITY, f64::max)
        }));
        let least = LEAST_REL * self.radius;
        let sum: f64 = samples
            .iter()
            .map(|s| {
                let room = self.room(s, extents);
                let counted = (room - least).max(0.0) / self.radius;
                counted * counted
            })
            .sum();
        sum
    }

    /// How far a sample's normal goes before it leaves the hull.
    fn room(&self, sample: &Sample, extents: &[f64]) -> f64 {
        let mut room = f64::INFINITY;
        for (d, extent) in self.directions.iter().zip(extents) {
            let cosine = d.dot(sample.normal);
            if cosine > LEAST_COSINE {
                room = room.min((extent - d.dot(sample.place)) / cosine);
            }
        }
        if room.is_finite() { room } else { 0.0 }
    }
}
