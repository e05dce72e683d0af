//! Leaving out points of a curve that nobody would miss.
//!
//! Source: Douglas, Peucker. Algorithms for the Reduction of the Number of Points Required to Represent a Digitized Line. 1973.

use glam::DVec3;

/// Buffers.
#[derive(Clone, Debug, Default)]
pub struct Thinning {
    is_kept: Vec<bool>,
    stack: Vec<(usize, usize)>,
}

impl Thinning {
    /// Says of each point of a closed loop whether it stays: those that are left out lie within a tolerance of the lines between those
    /// that stay. Of a loop that is flat, within the tolerance, two stay.
    pub fn keep(&mut self, points: &[DVec3], tolerance: f64) -> &[bool] {
        let count = points.len();
        self.is_kept.clear();
        self.is_kept.resize(count, count <= 3);
        if count <= 3 {
            return &self.is_kept;
        }
        // From the first point to the farthest, and back to the first, which is number `count` then.
        let at = |k: usize| points[k % count];
        let farthest = (1..count).fold(1, |best, k| {
            let way = |k: usize| points[0].distance_squared(points[k]);
            if way(k) > way(best) { k } else { best }
        });
        self.is_kept[0] = true;
        self.is_kept[farthest] = true;
        self.stack.clear();
        self.stack.extend([(0, farthest), (farthest, count)]);
        while let Some((from, to)) = self.stack.pop() {
            let (a, b) = (at(from), at(to));
            let mut worst = (tolerance * tolerance, 0);
            for k in from + 1..to {
                let off = distance_squared(at(k), a, b);
                if off > worst.0 {
                    worst = (off, k);
                }
            }
            if worst.1 > 0 {
                self.is_kept[worst.1] = true;
                self.stack.extend([(from, worst.1), (worst.1, to)]);
            }
        }
        &self.is_kept
    }
}

fn distance_squared(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let length = along.length_squared();
    let t = if length > 0.0 {
        ((p - a).dot(along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    p.distance_squared(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// What is left out lies near the line between its neighbours that stay.
        #[test]
        fn what_goes_is_near_what_stays(
            points in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, -0.1..0.1_f64), 3..40), tolerance in 0.0..0.5_f64,
        ) {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
            let mut thinning = Thinning::default();
            let kept = thinning.keep(&points, tolerance).to_vec();
            let n = points.len();
            prop_assert!(kept.iter().filter(|&&k| k).count() >= 2);
            for k in (0..n).filter(|&k| !kept[k]) {
                let before = (1..n).map(|d| (k + n - d) % n).find(|&j| kept[j]).unwrap();
                let after = (1..n).map(|d| (k + d) % n).find(|&j| kept[j]).unwrap();
                let off = distance_squared(points[k], points[before], points[after]).sqrt();
                prop_assert!(off <= tolerance + 1e-12, "{off}");
            }
        }
    }

    #[test]
    fn a_straight_side_has_no_points_in_between() {
        let square: Vec<DVec3> = (0..40)
            .map(|k| {
                let t = f64::from(k % 10) / 10.0;
                let p = [(t, 0.0), (1.0, t), (1.0 - t, 1.0), (0.0, 1.0 - t)][k as usize / 10];
                DVec3::new(p.0, p.1, 0.0)
            })
            .collect();
        let mut thinning = Thinning::default();
        let kept = thinning.keep(&square, 1e-6);
        assert_eq!(kept.iter().filter(|&&k| k).count(), 4);
    }
}
