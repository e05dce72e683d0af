//! Random numbers and smooth noise that are functions of whole numbers, the same on every machine.
//!
//! Source: K. Perlin. An Image Synthesizer. SIGGRAPH 1985 (noise on a lattice); S. Vigna's SplitMix64 for its values.

/// A whole number that looks random, of others.
pub(super) fn scrambled(numbers: &[i64]) -> u64 {
    numbers
        .iter()
        .fold(0x5115_ca9e_7e57_0017, |state: u64, &n| {
            let mut z = (state ^ n as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        })
}

/// Evenly distributed in [−1, 1).
pub(super) fn even(numbers: &[i64]) -> f64 {
    (scrambled(numbers) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Noise in −1…1 that is smooth over lengths of one.
pub(super) fn smooth(place: [f64; 3], seed: i64) -> f64 {
    let low = place.map(f64::floor);
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let along: [f64; 3] = std::array::from_fn(|k| ease(place[k] - low[k]));
    let cell = low.map(|v| v as i64);
    (0..8_i64)
        .map(|corner| {
            let bit = |k: usize| corner >> k & 1;
            let weight: f64 = (0..3)
                .map(|k| {
                    if bit(k) == 1 {
                        along[k]
                    } else {
                        1.0 - along[k]
                    }
                })
                .product();
            weight * even(&[seed, cell[0] + bit(0), cell[1] + bit(1), cell[2] + bit(2)])
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_in_range_and_has_no_steps() {
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        let mut before = smooth([-3.0, 0.3, 7.7], 5);
        for k in 0..4000 {
            let now = smooth([-3.0 + 0.01 * f64::from(k), 0.3, 7.7], 5);
            assert!((now - before).abs() < 0.05);
            (low, high, before) = (low.min(now), high.max(now), now);
        }
        assert!((-1.0..-0.4).contains(&low) && (0.4..1.0).contains(&high));
        assert_ne!(smooth([0.5; 3], 1), smooth([0.5; 3], 2));
    }
}
