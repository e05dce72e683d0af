//! The 6 × 6 linear system of a small rigid motion.

use glam::DVec3;

/// What is added to the diagonal, as a share of its mean: motions that no outline distinguishes, such as that of a ring about its
/// axis, are then left alone.
const DAMPING: f64 = 1e-5;

/// Sums of a weighted least-squares problem in a rotation vector and a shift.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NormalEquations {
    matrix: [[f64; 6]; 6],
    right: [f64; 6],
}

impl NormalEquations {
    /// Asks that rotation · `lever` + shift · `pull` be `value`.
    pub(super) fn add(&mut self, lever: DVec3, pull: DVec3, value: f64, weight: f64) {
        let row = [lever.x, lever.y, lever.z, pull.x, pull.y, pull.z];
        for (i, a) in row.into_iter().enumerate() {
            for (sum, b) in self.matrix[i].iter_mut().zip(row) {
                *sum += weight * a * b;
            }
            self.right[i] += weight * a * value;
        }
    }

    /// The motion; zero where nothing was asked.
    pub(super) fn solve(mut self) -> (DVec3, DVec3) {
        let mean = (0..6).map(|i| self.matrix[i][i]).sum::<f64>() / 6.0;
        if mean <= 0.0 || !mean.is_finite() {
            return (DVec3::ZERO, DVec3::ZERO);
        }
        for i in 0..6 {
            self.matrix[i][i] += DAMPING * mean;
        }
        // Positive definite: elimination needs no exchange of rows.
        for i in 0..6 {
            for j in i + 1..6 {
                let factor = self.matrix[j][i] / self.matrix[i][i];
                for k in i..6 {
                    self.matrix[j][k] -= factor * self.matrix[i][k];
                }
                self.right[j] -= factor * self.right[i];
            }
        }
        let mut x = [0.0; 6];
        for i in (0..6).rev() {
            let known: f64 = (i + 1..6).map(|k| self.matrix[i][k] * x[k]).sum();
            x[i] = (self.right[i] - known) / self.matrix[i][i];
        }
        let [a, b, c, d, e, f] = x;
        (DVec3::new(a, b, c), DVec3::new(d, e, f))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_found_from_what_it_does() {
        let (turn, shift) = (DVec3::new(0.1, -0.2, 0.05), DVec3::new(-0.3, 0.02, 0.4));
        let mut equations = NormalEquations::default();
        for k in 0..40 {
            let wave = |s: f64| (s * f64::from(k + 1)).sin();
            let lever = DVec3::new(wave(0.7), wave(1.3), wave(2.9));
            let pull = DVec3::new(wave(1.9), wave(0.3), wave(2.3));
            equations.add(lever, pull, turn.dot(lever) + shift.dot(pull), 1.0);
        }
        let (found_turn, found_shift) = equations.solve();
        assert!(found_turn.distance(turn) < 1e-4, "{found_turn}");
        assert!(found_shift.distance(shift) < 1e-4, "{found_shift}");
        assert_eq!(NormalEquations::default().solve().0, DVec3::ZERO);
    }
}
