//! Which point of the original a point of the hull shows.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 4.
//! Deviation: where the line along the normal misses, or first meets the original far behind the nearest point of it, that
//! point is taken.

use glam::DVec3;
use silmap_geometry::Bvh;
use silmap_map::CoarseHull;
use silmap_map::asset::TangentFrames;

use super::Parametrisation;
use super::visibility::HullFaces;

/// A ray starts this far outside the hull (share of the bounding radius), because rounding may have put the hull inside.
const START_OUTSIDE_REL: f64 = 1e-4;

/// A hit this many times farther away than the nearest point of the original has slipped past what the face stands for.
const MAX_HIT_DISTANCE_RATIO: f64 = 4.0;

/// A point of the original: a face and the weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The face.
    pub face: usize,
    /// Weights of its corners, which add up to 1.
    pub weights: [f64; 3],
}

/// The hull as its texels see it, and what lies behind it.
#[derive(Debug)]
pub struct Shooter<'a> {
    corners: Vec<[DVec3; 3]>,
    /// Smooth outward normals at the corners.
    pub(super) normals: Vec<[DVec3; 3]>,
    bvh: &'a Bvh,
    /// Distance from the face at which rays start.
    outside: f64,
    how: Parametrisation,
}

impl<'a> Shooter<'a> {
    /// `bvh` is over the original's faces, `radius` its bounding radius.
    #[must_use]
    pub fn new(hull: &CoarseHull, (bvh, radius): (&'a Bvh, f64), how: Parametrisation) -> Self {
        let normals = TangentFrames::new(hull, &[]).normals;
        let double = |v: u32| DVec3::from_array(normals[v as usize].map(f64::from));
        Self {
            corners: HullFaces::new(hull).corners,
            normals: hull.faces.iter().map(|f| f.map(double)).collect(),
            bvh,
            outside: START_OUTSIDE_REL * radius,
            how,
        }
    }

    /// A point of the hull.
    #[must_use]
    pub fn point(&self, face: usize, weights: [f64; 3]) -> DVec3 {
        blend(&self.corners[face], weights)
    }

    /// How far below a point of the hull lines along the normal look for the original: there and nearby.
    #[must_use]
    pub fn reach(&self, face: usize, weights: [f64; 3]) -> f64 {
        match self.how {
            // No line is followed.
            Parametrisation::ClosestPoint => 0.0,
            Parametrisation::NormalShooting => {
                let point = self.point(face, weights);
                let nearest = self.bvh.closest_point(point).0;
                MAX_HIT_DISTANCE_RATIO * point.distance(nearest) + 2.0 * self.outside
            }
        }
    }

    /// What a point of the hull shows, by a line that reaches so far.
    #[must_use]
    pub fn source(&self, face: usize, weights: [f64; 3], reach: f64) -> Source {
        let point = self.point(face, weights);
        if self.how == Parametrisation::NormalShooting {
            let outward = blend(&self.normals[face], weights).normalize_or_zero();
            let start = point + outward * self.outside;
            let hit = self
                .bvh
                .first_hit(start, -outward, 0.0, reach + self.outside);
            if let Some(hit) = hit.filter(|hit| hit.enters) {
                return Source {
                    face: hit.face as usize,
                    weights: hit.barycentric,
                };
            }
        }
        let (_, face, weights) = self.bvh.closest_point(point);
        Source {
            face: face as usize,
            weights,
        }
    }
}

/// The sum of three vectors by their weights.
pub(super) fn blend(vectors: &[DVec3; 3], weights: [f64; 3]) -> DVec3 {
    (0..3).map(|k| vectors[k] * weights[k]).sum()
}
