//! Noise in space that is the same on every machine: integer hashing, no tables, no state.
//!
//! Source: Perlin. Improving Noise. SIGGRAPH 2002 (gradients, fade). Worley. A Cellular Texture Basis Function.
//! SIGGRAPH 1996 (nearest feature point).
//! Deviation: lattice points are hashed by multiplying and folding 64-bit integers in place of a permutation table.

use glam::{DVec3, I64Vec3};

/// 64 well-mixed bits of a lattice point.
fn hash(cell: I64Vec3) -> u64 {
    // Odd constants of the 64-bit finaliser of MurmurHash3 and the golden ratio.
    let mut h = 0x9E37_79B9_7F4A_7C15_u64;
    for c in cell.to_array() {
        h = (h ^ c as u64).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        h ^= h >> 33;
        h = h.wrapping_mul(0xC4CE_B9FE_1A85_EC53);
        h ^= h >> 29;
    }
    h
}

/// Three numbers in [0, 1) from a hash.
fn unit_cube(h: u64) -> DVec3 {
    let part = |shift: u32| (h >> shift & 0x1F_FFFF) as f64 / f64::from(0x20_0000);
    DVec3::new(part(0), part(21), part(42))
}

/// Smooth noise with features about one unit wide, zero on lattice points, within ±1.
pub(super) fn gradient_noise(point: DVec3) -> f64 {
    let base = point.floor();
    let local = point - base;
    let base = base.as_i64vec3();
    let fade = local * local * local * (local * (local * 6.0 - 15.0) + 10.0);
    let mut sum = 0.0;
    for corner in 0..8_i64 {
        let offset = I64Vec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let gradient = unit_cube(hash(base + offset)) * 2.0 - 1.0;
        let away = local - offset.as_dvec3();
        let weight = |f: f64, o: i64| if o == 1 { f } else { 1.0 - f };
        sum += gradient.dot(away)
            * weight(fade.x, offset.x)
            * weight(fade.y, offset.y)
            * weight(fade.z, offset.z);
    }
    sum.clamp(-1.0, 1.0)
}

/// The nearest of the points that are scattered one a unit cell.
pub(super) struct NearestCell {
    /// Distance to it.
    pub(super) distance: f64,
    /// Where it is.
    pub(super) position: DVec3,
    /// A number in [0, 1) that belongs to it.
    pub(super) random: f64,
}

/// How far feature points stray from their cell's middle, as a fraction of the cell.
const JITTER: f64 = 0.7;

/// The feature point that is nearest to `point`.
pub(super) fn nearest_cell(point: DVec3) -> NearestCell {
    let base = point.floor().as_i64vec3();
    let mut nearest = NearestCell {
        distance: f64::INFINITY,
        position: point,
        random: 0.0,
    };
    for k in 0..27_i64 {
        let cell = base + I64Vec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        let h = hash(cell);
        let feature =
            cell.as_dvec3() + DVec3::splat(0.5) + (unit_cube(h) - DVec3::splat(0.5)) * JITTER;
        let distance = point.distance(feature);
        if distance < nearest.distance {
            nearest = NearestCell {
                distance,
                position: feature,
                random: (h >> 40) as f64 / (1_u64 << 24) as f64,
            };
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_and_uses_its_range() {
        let (mut low, mut high, mut steepest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..20_000 {
            let p = DVec3::new(0.137, 0.071, 0.193) * f64::from(k);
            let n = gradient_noise(p);
            (low, high) = (low.min(n), high.max(n));
            steepest = steepest.max((gradient_noise(p + DVec3::X * 1e-4) - n).abs() / 1e-4);
        }
        assert!(low < -0.4 && high > 0.4, "{low} {high}");
        assert!(steepest < 4.0, "{steepest}");
        assert_eq!(gradient_noise(DVec3::new(3.0, -7.0, 11.0)), 0.0);
    }

    #[test]
    fn cells_are_found_from_both_sides_of_a_border() {
        for k in 0..2_000 {
            let p = DVec3::new(
                f64::from(k % 40) - 20.0,
                0.37 * f64::from(k),
                0.11 * f64::from(k),
            );
            let (left, right) = (nearest_cell(p - DVec3::X * 1e-9), nearest_cell(p));
            assert!((left.distance - right.distance).abs() < 1e-8);
        }
    }
}
