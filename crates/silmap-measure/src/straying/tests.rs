//! Outlines whose distances are known, and distances that are found another way.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use silmap_geometry::Mask;
use silmap_geometry::polygon::{distance_squared_to_segment, fill_even_odd};

use super::*;
use crate::evaluate::compare;

fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Loop {
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
        .map(|(u, v)| DVec2::new(x + u, y + v))
        .to_vec()
}

/// A star-shaped polygon with long and short edges.
fn polygon(random: &mut ChaCha8Rng) -> Loop {
    let count = random.random_range(3..60);
    let mut radius = || random.random_range(5.0..100.0_f64);
    (0..count)
        .map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
            DVec2::new(cos, sin) * radius() + 128.0
        })
        .collect()
}

#[test]
fn a_square_that_is_shifted_is_off_by_as_much() {
    for by in [0.25, 1.0, 3.0] {
        let (one, two) = (
            rectangle(10.0, 10.0, 40.0, 40.0),
            rectangle(10.0 + by, 10.0, 40.0, 40.0),
        );
        let found = straying(&[one], &[two]);
        assert!((found.largest_px - by).abs() < 1e-12, "{found:?}");
        assert!((found.p99_px - by).abs() < 1e-12, "{found:?}");
        assert!((found.place.distance(found.nearest) - by).abs() < 1e-12);
        // Half of a boundary is off by that; what the inner side lacks near corners, the flat sides have where they reach beyond.
        assert!((found.mean_px - 0.5 * by).abs() < 0.02 * by, "{found:?}");
    }
}

#[test]
fn concentric_squares_have_the_mean_of_their_ring() {
    // From without, corners are √2 away and sides 1; from within, all samples but none is 1.
    let (inner, outer) = (
        rectangle(10.0, 10.0, 100.0, 100.0),
        rectangle(9.0, 9.0, 102.0, 102.0),
    );
    let found = straying(&[inner], &[outer]);
    assert!((found.largest_px - 2.0_f64.sqrt()).abs() < 1e-12);
    assert!(
        (found.mean_px - 1.0).abs() < 2e-3 && (found.p99_px - 1.0).abs() < 0.13,
        "{found:?}"
    );
}

#[test]
fn either_may_be_the_first_and_pixels_are_only_a_unit() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..20 {
        let (one, two) = ([polygon(&mut random)], [polygon(&mut random)]);
        let (found, swapped) = (straying(&one, &two), straying(&two, &one));
        assert_eq!(found.largest_px, swapped.largest_px);
        assert_eq!(
            (found.mean_px, found.p99_px),
            (swapped.mean_px, swapped.p99_px)
        );
        let larger = |loops: &[Loop; 1]| [loops[0].iter().map(|p| p * 3.0 + 17.0).collect()];
        let scaled = straying(&larger(&one), &larger(&two));
        assert!((scaled.largest_px / 3.0 - found.largest_px).abs() <= 0.5 * STEP_PX);
        assert!((scaled.mean_px / 3.0 - found.mean_px).abs() < 0.05 * found.mean_px);
        // Moved and turned by a right angle, all numbers are the same.
        let turned = |loops: &[Loop; 1]| [loops[0].iter().map(|p| p.perp() + 400.0).collect()];
        let found_turned = straying(&turned(&one), &turned(&two));
        assert!((found_turned.mean_px - found.mean_px).abs() < 1e-9);
        assert!((found_turned.p99_px - found.p99_px).abs() < 1e-9);
    }
}

/// The definition, word by word: between samples and all segments of the other, without a grid.
fn by_definition(one: &Loop, two: &Loop) -> [f64; 3] {
    let [there, back] = [(one, two), (two, one)].map(|(from, to)| {
        let mut all = Vec::new();
        for (a, b) in edges(from) {
            let count = (a.distance(b) / 0.5).ceil().max(1.0) as usize;
            for k in 0..count {
                let p = a + (b - a) * (k as f64 / count as f64);
                let nearest = edges(to)
                    .map(|(a, b)| distance_squared_to_segment(p, a, b))
                    .fold(f64::INFINITY, f64::min);
                all.push(nearest.sqrt());
            }
        }
        all.sort_by(f64::total_cmp);
        // Linear between order statistics, as NumPy has it.
        let at = 0.99 * (all.len() - 1) as f64;
        let (low, high) = (all[at as usize], all[(at as usize + 1).min(all.len() - 1)]);
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        [mean, low + (high - low) * at.fract(), all[all.len() - 1]]
    });
    [
        0.5 * (there[0] + back[0]),
        there[1].max(back[1]),
        there[2].max(back[2]),
    ]
}

#[test]
fn distances_are_those_of_looking_at_all_segments() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    for _ in 0..40 {
        let (one, two) = (polygon(&mut random), polygon(&mut random));
        let expected = by_definition(&one, &two);
        let found = straying(&[one], &[two]);
        let found = [found.mean_px, found.p99_px, found.largest_px];
        let is_same = found
            .iter()
            .zip(expected)
            .all(|(f, e)| (f - e).abs() < 1e-9);
        assert!(is_same, "{found:?} for {expected:?}");
    }
}

/// What shares of pixels do not see: a hair of a third of a pixel.
#[test]
fn a_hair_and_a_slit_are_as_far_as_they_are_long_and_cover_no_pixel() {
    let square = rectangle(30.5, 30.5, 60.0, 60.0);
    let hair = rectangle(90.5, 60.6, 25.0, 0.3);
    let mut slit = rectangle(60.6, 30.5, 0.3, 20.0);
    slit.reverse();
    for (thin, long) in [(hair, 25.0), (slit, 20.0)] {
        let with = [square.clone(), thin];
        let found = straying(&with, std::slice::from_ref(&square));
        // The slit's end is nearest to the side it opens to.
        assert!((found.largest_px - long).abs() < 0.01, "{found:?}");
        assert!(found.mean_px > 0.1, "{found:?}");
        let [mut one, mut two] = [(); 2].map(|()| Mask::new(128, 128));
        fill_even_odd(&with, &mut one);
        fill_even_odd([&square], &mut two);
        assert_eq!(compare(&one, &two), (0.0, 0.0));
    }
    let same = straying(std::slice::from_ref(&square), std::slice::from_ref(&square));
    assert!(same.largest_px < 1e-12 && same.mean_px < 1e-12);
}

#[test]
fn an_outline_that_is_missing_is_infinitely_far_and_two_are_alike() {
    let square = [rectangle(0.0, 0.0, 4.0, 4.0)];
    for (one, two) in [(&square[..], &[][..]), (&[], &square)] {
        let found = straying(one, two);
        assert!(found.largest_px.is_infinite() && found.mean_px.is_infinite());
    }
    assert_eq!(straying(&[], &[]), Straying::default());
}

#[test]
fn summaries_are_those_of_the_numbers() {
    let with = |number: f64| Straying {
        mean_px: number,
        p99_px: 2.0 * number,
        largest_px: 10.0 * number,
        ..Straying::default()
    };
    let of = |numbers: &[f64]| StrayingSummary::of(numbers.iter().map(|&n| with(n)));
    let all: Vec<f64> = (0..=10).rev().map(f64::from).collect();
    let expected = StrayingSummary {
        mean: 5.0,
        p99_median: 10.0,
        largest_median: 50.0,
        largest_p90: 90.0,
        largest: 100.0,
    };
    assert_eq!(of(&all), Some(expected));
    assert_eq!(of(&[]), None);
    let missing = of(&[1.0, 2.0, f64::INFINITY]).unwrap();
    assert_eq!(missing.largest_median, 20.0);
    assert!(missing.largest.is_infinite() && missing.largest_p90.is_infinite());
    let both = of(&[f64::INFINITY; 2]).unwrap();
    assert!(both.largest_p90.is_infinite() && both.mean.is_infinite());
}
