//! Choice of the texture views.
//!
//! Source: Silhouette Mapping (TR-1-99), section 8.2, which picks views by hand and calls an automatic choice open.
//! Here: greedy maximum coverage. A set of views is worth Σ area × cosine over the hull's faces, each face with the view that
//! sees it most squarely of those that may paint it. This is submodular, so the greedy choice reaches at least 63 % of the
//! best set's worth.

use super::visibility::HullFaces;

/// What a view would do for each face: the cosine it sees the face at, or zero when it may not paint it.
#[must_use]
pub fn face_cosines(hull: &HullFaces, paintable: &[bool], eye: glam::DVec3) -> Vec<f64> {
    let cosine = |face: usize| match paintable[face] {
        true => hull.cosine(face, eye).max(0.0),
        false => 0.0,
    };
    (0..hull.len()).map(cosine).collect()
}

/// Up to `count` candidates, each the one that adds most to those before it; of equals the first. Stops early when nothing
/// adds anything.
///
/// `cosines` holds the numbers of [`face_cosines`] for each candidate.
pub(super) fn choose_views(areas: &[f64], cosines: &[Vec<f64>], count: usize) -> Vec<usize> {
    let mut best = vec![0.0_f64; areas.len()];
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let gain = |candidate: &[f64]| -> f64 {
            (0..areas.len())
                .map(|f| areas[f] * (candidate[f] - best[f]).max(0.0))
                .sum()
        };
        let gains = cosines.iter().map(|c| gain(c)).enumerate();
        let Some((winner, gain)) = gains.reduce(|a, b| if b.1 > a.1 { b } else { a }) else {
            break;
        };
        if gain <= 0.0 {
            break;
        }
        for (b, &c) in best.iter_mut().zip(&cosines[winner]) {
            *b = b.max(c);
        }
        chosen.push(winner);
    }
    chosen
}

/// Σ area × best cosine over Σ area: 1 when every face is seen head-on.
#[must_use]
pub fn merit(areas: &[f64], cosines: &[&[f64]]) -> f64 {
    let best = |f: usize| cosines.iter().map(|c| c[f]).fold(0.0, f64::max);
    let whole: f64 = areas.iter().sum();
    let seen: f64 = (0..areas.len()).map(|f| areas[f] * best(f)).sum();
    match whole > 0.0 {
        true => seen / whole,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greedy_choice_covers_what_is_left() {
        let areas = [1.0, 1.0, 1.0, 5.0];
        let cosines = vec![
            vec![0.9, 0.9, 0.0, 0.0],
            vec![0.8, 0.8, 0.8, 0.0],
            vec![0.0, 0.0, 0.0, 0.5],
            vec![0.0, 0.0, 0.0, 0.5],
        ];
        let chosen = choose_views(&areas, &cosines, 2);
        assert_eq!(chosen, [2, 1]);
        let picked: Vec<&[f64]> = chosen.iter().map(|&c| &cosines[c][..]).collect();
        assert!((merit(&areas, &picked) - (0.8 * 3.0 + 0.5 * 5.0) / 8.0).abs() < 1e-12);
        // A worse set is worth less.
        let worse: Vec<&[f64]> = [2, 3].iter().map(|&c: &usize| &cosines[c][..]).collect();
        assert!(merit(&areas, &worse) < merit(&areas, &picked));
        // A fourth view would add nothing.
        assert_eq!(choose_views(&areas, &cosines, 10), [2, 1, 0]);
        assert!(choose_views(&areas, &[], 3).is_empty());
    }
}
