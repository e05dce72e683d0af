//! The parametrisation of the original over the hull, and its discontinuities.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 4 and figures 4 and 5.
//! Deviations: where the line along the normal misses, or first meets the original far behind the nearest point of it, that
//! point is taken. The paper shows jumps in pictures; here they are counted.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_geometry::{Bvh, TriangleMesh};
use silmap_map::asset::TangentFrames;
use silmap_map::{Atlas, CoarseHull};

use super::Parametrisation;
use super::visibility::HullFaces;

/// A ray starts this far outside the hull (share of the bounding radius), because rounding may have put the hull inside.
const START_OUTSIDE_REL: f64 = 1e-4;

/// A hit this many times farther away than the nearest point of the original has slipped past what the face stands for.
const MAX_HIT_DISTANCE_RATIO: f64 = 4.0;

/// From one texel to the next the original's point may move this many times as far as the hull's before it counts as a jump: so
/// far it moves on a surface that is 76° steep.
const JUMP_RATIO: f64 = 4.0;

/// A point of the original: a face and the weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) face: usize,
    pub(super) weights: [f64; 3],
}

/// The hull as its texels see it, and what lies behind it.
#[derive(Debug)]
pub(super) struct Shooter<'a> {
    pub(super) corners: Vec<[DVec3; 3]>,
    /// Smooth outward normals at the corners.
    pub(super) normals: Vec<[DVec3; 3]>,
    bvh: &'a Bvh,
    /// Distance from the face at which rays start.
    outside: f64,
    how: Parametrisation,
}

impl<'a> Shooter<'a> {
    /// `bvh` is over the original's faces, `radius` its bounding radius.
    pub(super) fn new(
        hull: &CoarseHull,
        (bvh, radius): (&'a Bvh, f64),
        how: Parametrisation,
    ) -> Self {
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
    pub(super) fn point(&self, face: usize, weights: [f64; 3]) -> DVec3 {
        blend(&self.corners[face], weights)
    }

    /// How far below a point of the hull lines along the normal look for the original: there and nearby.
    pub(super) fn reach(&self, face: usize, weights: [f64; 3]) -> f64 {
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
    pub(super) fn source(&self, face: usize, weights: [f64; 3], reach: f64) -> Source {
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

/// How often a parametrisation jumps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Discontinuities {
    /// Texels whose centres lie in a face's triangle.
    pub texels: u64,
    /// Those of them from which the original's point jumps to the texel on the right or below, of the same face.
    pub jumps: u64,
}

impl Discontinuities {
    /// Jumps among a thousand texels; zero when there are no texels.
    #[must_use]
    pub fn per_thousand(&self) -> f64 {
        1000.0 * self.jumps as f64 / self.texels.max(1) as f64
    }
}

/// Counts the jumps of a parametrisation over the texels of an atlas: those where the original's point moves more than four times
/// as far as the hull's.
///
/// `bvh` is over the faces of `original`. The hull and the atlas belong together, as in an asset that was read.
#[must_use]
pub fn discontinuities(
    (original, bvh): (&TriangleMesh, &Bvh),
    hull: &CoarseHull,
    atlas: &Atlas,
    how: Parametrisation,
) -> Discontinuities {
    let shooter = Shooter::new(hull, (bvh, original.bounds().radius), how);
    let size = DVec2::new(atlas.size_px[0].into(), atlas.size_px[1].into());
    let counts: Vec<Discontinuities> = (0..hull.faces.len().min(atlas.corner_uvs.len()))
        .into_par_iter()
        .map(|face| {
            let corners = atlas.corner_uvs[face].map(|uv| DVec2::from(uv.map(f64::from)) * size);
            count_in_face(corners, |weights| {
                let source = shooter.source(face, weights, shooter.reach(face, weights));
                let shown = blend(&original.corners(source.face), source.weights);
                (shooter.point(face, weights), shown)
            })
        })
        .collect();
    counts
        .iter()
        .fold(Discontinuities::default(), |sum, c| Discontinuities {
            texels: sum.texels + c.texels,
            jumps: sum.jumps + c.jumps,
        })
}

/// Counts in one face, whose corners lie there in the atlas; `at` gives the points of hull and original at some weights.
fn count_in_face(
    [a, b, c]: [DVec2; 3],
    at: impl Fn([f64; 3]) -> (DVec3, DVec3),
) -> Discontinuities {
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 || !area.is_finite() {
        return Discontinuities::default();
    }
    let low = a.min(b).min(c).floor();
    let high = a.max(b).max(c).ceil();
    let columns = (high.x - low.x).max(0.0) as usize;
    let rows = (high.y - low.y).max(0.0) as usize;
    if columns.max(rows) > MAX_SIDE_PX as usize {
        // No picture is that large: a file that says so is not one of ours.
        return Discontinuities::default();
    }
    let at_texel = |x: usize, y: usize| {
        let p = low + DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let weights = [
            (c - b).perp_dot(p - b) / area,
            (a - c).perp_dot(p - c) / area,
            (b - a).perp_dot(p - a) / area,
        ];
        weights.iter().all(|&w| w >= 0.0).then(|| at(weights))
    };
    let jumps = |from: (DVec3, DVec3), to: Option<(DVec3, DVec3)>| {
        to.is_some_and(|to| to.1.distance(from.1) > JUMP_RATIO * to.0.distance(from.0))
    };
    let mut count = Discontinuities::default();
    let mut above: Vec<Option<(DVec3, DVec3)>> = Vec::new();
    let mut jumps_down = vec![false; columns];
    let mut jumps_right = vec![false; columns];
    for y in 0..=rows {
        let row: Vec<_> = (0..columns)
            .map(|x| if y < rows { at_texel(x, y) } else { None })
            .collect();
        for (x, from) in above.iter().enumerate() {
            jumps_down[x] = from.is_some_and(|from| jumps(from, row[x]));
            count.jumps += u64::from(from.is_some() && (jumps_down[x] || jumps_right[x]));
        }
        for (x, from) in row.iter().enumerate() {
            let next = row.get(x + 1).copied().flatten();
            jumps_right[x] = from.is_some_and(|from| jumps(from, next));
            count.texels += u64::from(from.is_some());
        }
        above = row;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILE: [DVec2; 3] = [
        DVec2::new(1.0, 1.0),
        DVec2::new(29.0, 1.0),
        DVec2::new(1.0, 29.0),
    ];

    /// The first corner at the origin, the others along x and y.
    fn on_plane(weights: [f64; 3]) -> DVec3 {
        DVec3::new(weights[1], weights[2], 0.0)
    }

    #[test]
    fn a_smooth_map_does_not_jump_and_a_cut_jumps_along_its_length() {
        let smooth = count_in_face(TILE, |w| {
            let p = on_plane(w);
            (p, DVec3::new(p.x + 0.2 * p.y * p.y, p.y, 2.0 * p.x))
        });
        assert_eq!(smooth.jumps, 0);
        // Half of 28 × 28, and half of those on the long side.
        assert!((378..=420).contains(&smooth.texels), "{smooth:?}");
        // Beyond a line the map is somewhere else: one jump for each row that crosses it.
        let cut = count_in_face(TILE, |w| {
            let p = on_plane(w);
            (p, p + if p.x > 0.5 { DVec3::Z } else { DVec3::ZERO })
        });
        assert!((13..=15).contains(&cut.jumps), "{cut:?}");
        assert!(cut.per_thousand() > 20.0);
    }

    #[test]
    fn every_way_round_of_a_tile_counts_the_same() {
        let [a, b, c] = TILE;
        let cut = |p: DVec3| {
            p + if p.x + 0.3 * p.y > 0.6 {
                DVec3::Z
            } else {
                DVec3::ZERO
            }
        };
        let count = |corners: [DVec2; 3]| {
            count_in_face(corners, |w| (on_plane(w), cut(on_plane(w)))).texels
        };
        assert_eq!(count([a, b, c]), count([b, c, a]));
        assert_eq!(count([a, b, c]), count([a, c, b]));
        assert_eq!(count([a, a, c]), 0);
        assert_eq!(count([a, b * 1e12, c * 1e12]), 0);
    }
}
