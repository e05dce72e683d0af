//! Models that are a round tube about a closed curve on a torus: the torus itself and the trefoil knot.
//!
//! The frame along the curve is the normal of the carrying torus, the tangent, and their cross product. It closes up
//! after one turn by construction, so the tube needs no twist correction.

use std::f64::consts::TAU;

use glam::DVec3;
use silmap_geometry::TriangleMesh;

/// A closed curve that winds on a torus about the z axis.
struct TorusCurve {
    /// Turns about the z axis, and turns about the circular core, before the curve closes.
    turns: (f64, f64),
    /// Radius of the core circle, model units.
    core: f64,
    /// Radius of the torus that carries the curve; 0 for the core circle itself.
    minor: f64,
    /// Radius of the tube about the curve.
    tube: f64,
}

/// Fewest sides a tube may have.
const MIN_SIDES: usize = 3;

/// How far the number of sides may be from the one with square cells, as a factor, for the sake of a face count that is
/// nearer to the one asked for.
const SIDES_FREEDOM: f64 = 1.3;

/// Samples of the curve's length; a quarter of a percent of the shortest edge at a million faces.
const LENGTH_SAMPLES: usize = 1 << 14;

/// A torus about the z axis with radii 1 and 0.4: 2 · rings · sides faces, near-square cells.
pub(super) fn torus(faces: usize) -> TriangleMesh {
    TorusCurve {
        turns: (1.0, 0.0),
        core: 1.0,
        minor: 0.0,
        tube: 0.4,
    }
    .mesh(faces, 3)
}

/// A tube of radius 0.2 about a (2, 3) torus knot with radii 0.9 and 0.42.
pub(super) fn trefoil_knot(faces: usize) -> TriangleMesh {
    // With fewer rings the tube is not a knot that a person recognises, and strands may touch.
    const MIN_RINGS: usize = 24;
    TorusCurve {
        turns: (2.0, 3.0),
        core: 0.9,
        minor: 0.42,
        tube: 0.2,
    }
    .mesh(faces, MIN_RINGS)
}

impl TorusCurve {
    /// Point, unit tangent and unit normal of the carrying torus at parameter `t` in [0, 2π).
    fn frame(&self, t: f64) -> (DVec3, DVec3, DVec3) {
        let (sin_u, cos_u) = (self.turns.0 * t).sin_cos();
        let (sin_v, cos_v) = (self.turns.1 * t).sin_cos();
        let ring = self.core + self.minor * cos_v;
        let point = DVec3::new(ring * cos_u, ring * sin_u, self.minor * sin_v);
        let along_u = DVec3::new(-sin_u, cos_u, 0.0) * (ring * self.turns.0);
        let along_v =
            DVec3::new(-sin_v * cos_u, -sin_v * sin_u, cos_v) * (self.minor * self.turns.1);
        let normal = DVec3::new(cos_v * cos_u, cos_v * sin_u, sin_v);
        (point, (along_u + along_v).normalize_or_zero(), normal)
    }

    /// Curve length up to each of [`LENGTH_SAMPLES`] equal steps of the parameter.
    fn lengths(&self) -> Vec<f64> {
        let at = |k: usize| self.frame(TAU * k as f64 / LENGTH_SAMPLES as f64).0;
        let mut total = 0.0;
        let mut lengths = vec![0.0];
        for k in 0..LENGTH_SAMPLES {
            total += at(k).distance(at(k + 1));
            lengths.push(total);
        }
        lengths
    }

    /// The tube with about `faces` faces, at least `min_rings` rings.
    fn mesh(&self, faces: usize, min_rings: usize) -> TriangleMesh {
        let lengths = self.lengths();
        let total = lengths[LENGTH_SAMPLES];
        let aspect = total / (TAU * self.tube);
        let (rings, sides) = grid_for(faces, aspect, min_rings);

        let mut mesh = TriangleMesh::default();
        for i in 0..rings {
            let (center, tangent, normal) = self.frame(parameter_at(&lengths, i, rings));
            let side = tangent.cross(normal);
            for j in 0..sides {
                let (sin, cos) = (TAU * j as f64 / sides as f64).sin_cos();
                mesh.positions
                    .push(center + (normal * cos + side * sin) * self.tube);
            }
        }
        let vertex = |i: usize, j: usize| ((i % rings) * sides + j % sides) as u32;
        for i in 0..rings {
            for j in 0..sides {
                let [a, b] = [vertex(i, j), vertex(i, j + 1)];
                let [c, d] = [vertex(i + 1, j + 1), vertex(i + 1, j)];
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }
}

/// Parameter at which `i` of `rings` equal parts of the curve's length are behind.
fn parameter_at(lengths: &[f64], i: usize, rings: usize) -> f64 {
    let wanted = lengths[LENGTH_SAMPLES] * i as f64 / rings as f64;
    let next = lengths
        .partition_point(|&l| l <= wanted)
        .clamp(1, LENGTH_SAMPLES);
    let (low, high) = (lengths[next - 1], lengths[next]);
    TAU * ((next - 1) as f64 + (wanted - low) / (high - low)) / LENGTH_SAMPLES as f64
}

/// Rings and sides whose 2 · rings · sides is nearest to `faces`, with about `aspect` rings a side; among equally near
/// ones the squarest cells, then the fewest sides.
fn grid_for(faces: usize, aspect: f64, min_rings: usize) -> (usize, usize) {
    let ideal = (faces as f64 / 2.0 / aspect).sqrt();
    let from = ((ideal / SIDES_FREEDOM).ceil() as usize).max(MIN_SIDES);
    let to = ((ideal * SIDES_FREEDOM).floor() as usize).max(from);
    (from..=to)
        .map(|sides| {
            let rings = ((faces + sides) / (2 * sides)).max(min_rings);
            let miss = (2 * rings * sides).abs_diff(faces);
            let stretch = (sides as f64 / ideal).ln().abs();
            (miss, stretch, rings, sides)
        })
        .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map_or((min_rings, MIN_SIDES), |(_, _, rings, sides)| {
            (rings, sides)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_hit_round_counts() {
        for faces in [2_048, 65_536, 20_000] {
            let (rings, sides) = grid_for(faces, 2.5, 3);
            assert_eq!(2 * rings * sides, faces);
        }
        assert_eq!(grid_for(0, 2.5, 3), (3, 3));
    }

    #[test]
    fn torus_volume_converges() {
        let exact = 2.0 * std::f64::consts::PI.powi(2) * 0.4 * 0.4;
        let error = |faces| (torus(faces).volume() / exact - 1.0).abs();
        assert!(error(65_536) < 1e-3);
        assert!(error(1_024) > 10.0 * error(65_536));
    }

    #[test]
    fn knot_volume_is_that_of_its_tube() {
        // Pappus: the frame is orthogonal to the curve, so the volume is its length times the disc.
        let knot = trefoil_knot(60_000);
        let curve = TorusCurve {
            turns: (2.0, 3.0),
            core: 0.9,
            minor: 0.42,
            tube: 0.2,
        };
        let exact = curve.lengths()[LENGTH_SAMPLES] * std::f64::consts::PI * 0.04;
        assert!((knot.volume() / exact - 1.0).abs() < 5e-3);
    }

    #[test]
    fn knot_strands_keep_apart() {
        // The nearest approach of the curve to itself, away from the neighbourhood, must exceed the tube's diameter.
        let curve = TorusCurve {
            turns: (2.0, 3.0),
            core: 0.9,
            minor: 0.42,
            tube: 0.2,
        };
        let n = 720;
        let points: Vec<_> = (0..n)
            .map(|k| curve.frame(TAU * k as f64 / n as f64).0)
            .collect();
        let mut nearest = f64::INFINITY;
        for i in 0..n {
            for j in i + n / 12..(i + n - n / 12).min(n) {
                nearest = nearest.min(points[i].distance(points[j]));
            }
        }
        assert!(nearest > 0.5, "{nearest}");
    }
}
