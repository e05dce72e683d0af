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
    /// Which of the hulls' directions is nearest to the normal.
    facing: u16,
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
                facing: 0,
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
    pub(super) fn new(samples: &mut [Sample], radius: f64) -> Self {
        let mut directions = spiral_directions(DIRECTIONS);
        let most = directions.len() + MOST_NORMALS;
        for sample in &*samples {
            let is_new = |n: DVec3| directions.iter().all(|d| d.dot(n) < SAME_COSINE);
            if directions.len() < most && is_new(sample.normal) {
                directions.push(sample.normal);
            }
        }
        for sample in samples {
            let cosine = |k: &usize| directions[*k].dot(sample.normal);
            let nearest = (0..directions.len()).max_by(|a, b| cosine(a).total_cmp(&cosine(b)));
            sample.facing = nearest.unwrap_or(0) as u16;
        }
        Self { directions, radius }
    }

    /// The sum of the squares of all samples' concavities, in radii.
    pub(super) fn cost(&self, samples: &[Sample], extents: &mut Vec<f64>) -> f64 {
        extents.clear();
        extents.extend(self.directions.iter().map(|&d| extent(d, samples)));
        let least = LEAST_REL * self.radius;
        let sum: f64 = samples
            .iter()
            .map(|s| {
                let room = self.room(s, extents, least);
                let counted = (room - least).max(0.0) / self.radius;
                counted * counted
            })
            .sum();
        sum
    }

    /// How far a sample's normal goes before it leaves the hull; anything up to `least` where it is no more than that.
    fn room(&self, sample: &Sample, extents: &[f64], least: f64) -> f64 {
        let within = |d: &DVec3, extent: f64| {
            let cosine = d.dot(sample.normal);
            if cosine > LEAST_COSINE {
                (extent - d.dot(sample.place)) / cosine
            } else {
                f64::INFINITY
            }
        };
        // Mostly the nearest direction says it.
        let facing = usize::from(sample.facing);
        let mut room = within(&self.directions[facing], extents[facing]);
        for (d, extent) in self.directions.iter().zip(extents) {
            if room <= least {
                return room;
            }
            room = room.min(within(d, *extent));
        }
        if room.is_finite() { room } else { 0.0 }
    }
}

/// How far samples reach in a direction.
fn extent(direction: DVec3, samples: &[Sample]) -> f64 {
    // In four lanes, which need not wait for each other.
    let mut most = [f64::NEG_INFINITY; 4];
    let mut fours = samples.chunks_exact(4);
    for four in &mut fours {
        for (most, sample) in most.iter_mut().zip(four) {
            let reach = direction.dot(sample.place);
            *most = if reach > *most { reach } else { *most };
        }
    }
    let rest = fours.remainder().iter().map(|s| direction.dot(s.place));
    rest.chain(most).fold(f64::NEG_INFINITY, f64::max)
}
