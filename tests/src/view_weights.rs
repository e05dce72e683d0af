//! Blend weights of texture views on a face of the hull, as a reference for what shaders compute.
//!
//! The paper takes the nearest view that sees the face; when another becomes the nearest, the face pops. Here up to three views
//! share a face. Their distance a_i is that between the directions from the face to the view and to the eye, and their weights are
//! 1/a_i − 1/t, where t is the distance of the fourth: a view's weight is zero when it drops out for another, and a view that the
//! eye coincides with takes all.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2, for the visibility bits and the nearest view; Buehler, Bosse,
//! McMillan, Gortler, Cohen. Unstructured Lumigraph Rendering. SIGGRAPH 2001, section 4, for weights that fall to zero.
//! Deviations: distances are chords between directions at each face's middle, not distances of camera centers, so that going
//! nearer or farther changes nothing.

use glam::DVec3;

/// Views that share a face.
const SHARERS: usize = 3;

/// The largest distance between directions; what fewer than four views are weighed against.
const FARTHEST: f64 = 2.0;

/// A view nearer than this is where the eye is.
const NEAREST: f64 = 1e-9;

/// Views that see a face: numbers and eyes.
pub type Witnesses<'a> = &'a [(usize, DVec3)];

/// The paper's choice: the view whose eye is nearest, of equals the first; none where no view sees the face.
#[must_use]
pub fn nearest(witnesses: Witnesses<'_>, eye: DVec3) -> Vec<(usize, f64)> {
    let distance = |w: &(usize, DVec3)| w.1.distance_squared(eye);
    let least = |a, b| if distance(b) < distance(a) { b } else { a };
    let chosen = witnesses.iter().reduce(least);
    chosen.map(|w| (w.0, 1.0)).into_iter().collect()
}

/// Views that share a face with this middle on the model, and their weights, with sum one; none where no view sees the face.
#[must_use]
pub fn blended(witnesses: Witnesses<'_>, middle: DVec3, eye: DVec3) -> Vec<(usize, f64)> {
    let direction = (eye - middle).normalize_or_zero();
    let mut by_distance: Vec<(f64, usize)> = witnesses
        .iter()
        .map(|&(view, place)| {
            let to_view = (place - middle).normalize_or_zero();
            (to_view.distance(direction).min(FARTHEST), view)
        })
        .collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    let limit = by_distance.get(SHARERS).map_or(FARTHEST, |d| d.0);
    let weight = |d: f64| d.max(NEAREST).recip() - limit.max(NEAREST).recip();
    let mut shares: Vec<(usize, f64)> = by_distance
        .iter()
        .take(SHARERS)
        .map(|&(d, view)| (view, weight(d)))
        .collect();
    let sum: f64 = shares.iter().map(|s| s.1).sum();
    if sum > 0.0 {
        shares.iter_mut().for_each(|s| s.1 /= sum);
        shares
    } else {
        // As far as the fourth, all of them: any is as good.
        witnesses.first().map(|w| (w.0, 1.0)).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eyes on a sphere of radius three, all of which see the one face at the origin.
    fn many_views(count: u32) -> Vec<(usize, DVec3)> {
        (0..count)
            .map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
                let (sin, cos) = (2.4 * f64::from(k)).sin_cos();
                let place = (1.0 - z * z).sqrt() * DVec3::new(cos, sin, 0.0) + z * DVec3::Z;
                (k as usize, 3.0 * place)
            })
            .collect()
    }

    /// Weight of each of 64 views.
    fn spread(shares: &[(usize, f64)]) -> Vec<f64> {
        let mut of_view = vec![0.0; 64];
        shares
            .iter()
            .for_each(|&(view, weight)| of_view[view] += weight);
        of_view
    }

    #[test]
    fn the_paper_shows_the_nearest_view_that_sees_a_face() {
        let eyes = [(0, DVec3::X), (1, DVec3::Y), (2, DVec3::Z)];
        let eye = DVec3::new(3.0, 2.0, 1.0);
        for first in 0..3 {
            assert_eq!(nearest(&eyes[first..], eye), [(first, 1.0)]);
        }
        assert_eq!(nearest(&[], eye), []);
        assert_eq!(blended(&[], DVec3::ZERO, eye), []);
    }

    #[test]
    fn at_a_views_own_place_it_is_shown_alone() {
        let views = many_views(20);
        for &(k, place) in &views {
            for distance in [1.5, 3.0, 10.0] {
                let eye = place.normalize_or_zero() * distance;
                let shown = spread(&blended(&views, DVec3::ZERO, eye));
                assert!(shown[k] > 0.9999, "{shown:?}");
            }
        }
    }

    #[test]
    fn weights_sum_to_one_and_do_not_jump() {
        let views = many_views(20);
        let eye = |turn: f64| DVec3::new(turn.cos(), 0.9 * (2.3 * turn).sin(), turn.sin()) * 3.0;
        let shared = |turn: f64| blended(&views, DVec3::ZERO, eye(turn));
        let alone = |turn: f64| nearest(&views, eye(turn));
        // The largest change of a weight in a step along a walk around the face.
        let largest_change = |chosen: &dyn Fn(f64) -> Vec<(usize, f64)>, steps: u32| {
            let mut largest = 0.0_f64;
            let mut before = spread(&chosen(0.0));
            for k in 1..=steps {
                let after = spread(&chosen(6.0 * f64::from(k) / f64::from(steps)));
                assert!((after.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
                largest = largest.max(change.fold(0.0, f64::max));
                before = after;
            }
            largest
        };
        // In a tenth of a step nothing changes by much more than a tenth.
        let (large, small) = (
            largest_change(&shared, 20_000),
            largest_change(&shared, 200_000),
        );
        assert!(small < 0.2 * large, "{small} after {large}");
        // The nearest view alone jumps, however small the step.
        assert_eq!(largest_change(&alone, 200_000), 1.0);
    }

    #[test]
    fn views_as_far_as_each_other_share_and_many_of_them_do_no_harm() {
        let around: Vec<(usize, DVec3)> = (0..6_usize)
            .map(|k| {
                let (sin, cos) = (k as f64).sin_cos();
                (k, DVec3::new(cos, sin, 1.0))
            })
            .collect();
        for count in 1..=6_usize {
            let of_view = spread(&blended(&around[..count], DVec3::ZERO, DVec3::Z));
            assert!((of_view.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            if count <= SHARERS {
                assert!((of_view[0] - 1.0 / count as f64).abs() < 1e-9);
            }
        }
    }
}
