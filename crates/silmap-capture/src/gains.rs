//! Exposure and white balance evened out: one factor on linear light for each channel of each photograph.
//!
//! Points of the surface are looked at by all photographs that see them, away from borders, as the mean over a few pixels. The logarithm of
//! what photograph v shows of point p is modelled as c_p − g_v; the g_v and c_p are those of least squares, with weights after Huber, so
//! that highlights, and points that lie beside the object's true surface, count little. The mean of the g_v over the photographs is zero
//! in each channel: that of the gains, as factors, is one.
//!
//! A turntable turns the object under its light: from each view to the next all that both see becomes a little brighter or darker, and a
//! gain that follows changes slowly around the object, while exposures are set for each photograph alone. Where the gains of neighbours
//! tell most of a photograph's own, what neighbours have in common is therefore taken for light and left: it makes no seam, and the
//! photographs keep their colours.
//!
//! Sources: M. Brown, D. Lowe. Automatic Panoramic Image Stitching using Invariant Features. IJCV 74(1), 2007, section 6 (gains by least
//! squares, and the term that holds them near one); P. Huber. Robust Estimation of a Location Parameter. Annals of Mathematical
//! Statistics 35(1), 1964.
//! Deviations: points of the surface in the place of overlapping pixels, logarithms in the place of values, so that all photographs dark is
//! no solution, and a gain for each channel.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{Bvh, ClosedMesh, Photograph};

use crate::looker::Looker;
use crate::photographs::ViewPhotograph;
use crate::residual::median;
use crate::view::{Capture, CaptureWarning};

/// Evening out exposures.
pub const GAINS: Stage = Stage("evening out exposures");

/// Points of the surface that are looked at, about.
const POINTS: usize = 4000;

/// A point is looked at as the mean over a square of so many places a side, so far apart, pixels: the surface is not exact.
const WINDOW: i32 = 5;
const WINDOW_STEP_PX: f64 = 1.5;

/// Linear values beside these are black or burnt out, and tell no exposure.
const USABLE: [f64; 2] = [0.002, 0.9];

/// Rounds of weighting.
const ROUNDS: usize = 12;

/// Residuals count in full up to so many standard deviations (95 % as good as least squares where errors are normal).
const HUBER: f64 = 1.345;

/// Standard deviation of a normal distribution over the median of what is beside its middle.
const DEVIATION_OVER_MEDIAN: f64 = 1.4826;

/// Logarithms nearer than this are alike: less than a step of 8 bits.
const LEAST_DEVIATION: f64 = 2e-3;

/// How hard gains are held at one, as a share of a photograph's weight: decides only where nothing else does.
const HOLD: f64 = 1e-3;

/// Correlation of gains with the mean of their neighbours': below the first they are exposures, above the second they follow the light.
/// Independent ones have one of 0 ± 1/√n, n the number of photographs.
const LIGHT: [f64; 2] = [0.55, 0.8];

/// A gain that is farther from one by this factor is worth a warning.
const FAR: f64 = 1.6;

/// Smallest and largest gain of all photographs and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainRange {
    /// The smallest.
    pub smallest: f64,
    /// The largest.
    pub largest: f64,
}

/// Sets the gains of the photographs so that they agree on the surface's colours.
///
/// # Errors
/// When the caller asked to stop.
pub fn even_out(
    photographs: &mut [ViewPhotograph],
    (surface, capture): (&ClosedMesh, &Capture),
    warnings: &mut Vec<CaptureWarning>,
    watch: &Watch<'_>,
) -> Result<GainRange, Interrupted> {
    watch.start(GAINS, photographs.len() as u64);
    let tree = Bvh::new(surface.mesh());
    let normals = surface.mesh().vertex_normals();
    let step = normals.len().div_ceil(POINTS).max(1);
    let points: Vec<(DVec3, DVec3)> = (surface.mesh().positions.iter().copied().zip(normals))
        .step_by(step)
        .collect();
    let looks = (photographs.par_iter())
        .map(|ViewPhotograph { photograph, .. }| {
            watch.check()?;
            let looker = Looker::new(photograph, &tree, surface);
            let of_point = |(p, &(point, normal)): (usize, &(DVec3, DVec3))| {
                let look = looker.look(point, normal)?;
                Some((p, look.weight, mean_logarithm(photograph, look.image)?))
            };
            let found: Vec<_> = points.iter().enumerate().filter_map(of_point).collect();
            watch.advance(GAINS, 1);
            Ok(found)
        })
        .collect::<Result<Vec<_>, Interrupted>>()?;
    let logarithms: [Vec<f64>; 3] = std::array::from_fn(|channel| {
        let sights: Vec<Sight> = looks
            .iter()
            .enumerate()
            .flat_map(|(v, looks)| {
                looks.iter().map(move |&(point, weight, values)| Sight {
                    photograph: v,
                    point,
                    weight,
                    value: values[channel],
                })
            })
            .collect();
        solve(&sights, photographs.len(), points.len())
    });
    watch.finish(GAINS);
    let mut range = GainRange {
        smallest: 1.0,
        largest: 1.0,
    };
    for (v, found) in photographs.iter_mut().enumerate() {
        let gain: [f64; 3] = std::array::from_fn(|c| logarithms[c][v].exp());
        found.photograph.gain = gain.map(|g| g as f32);
        for g in gain {
            range.smallest = range.smallest.min(g);
            range.largest = range.largest.max(g);
        }
        if gain.iter().any(|g| g.max(g.recip()) > FAR) {
            let view = capture.views[found.view].name.clone();
            warnings.push(CaptureWarning::Exposure { view, gain });
        }
    }
    Ok(range)
}

/// A point in a photograph.
#[derive(Clone, Copy, Debug)]
struct Sight {
    photograph: usize,
    point: usize,
    weight: f64,
    /// Logarithm of a channel's linear light.
    value: f64,
}

/// Logarithms of the mean colour around a place; `None` where some of it is not the object, or too dark or bright.
fn mean_logarithm(photograph: &Photograph, at: DVec2) -> Option<[f64; 3]> {
    let mut sum = [0.0; 3];
    let half = WINDOW / 2;
    for (i, j) in (-half..=half).flat_map(|j| (-half..=half).map(move |i| (i, j))) {
        let offset = WINDOW_STEP_PX * DVec2::new(i.into(), j.into());
        let seen = photograph.look(at + offset)?;
        for (s, c) in sum.iter_mut().zip(seen.colour) {
            *s += f64::from(c);
        }
    }
    let mean = sum.map(|s| s / f64::from(WINDOW * WINDOW));
    let [low, high] = USABLE;
    (mean.iter().all(|m| (low..=high).contains(m))).then(|| mean.map(f64::ln))
}

/// The g_v of least squares, their mean zero; zero for photographs that share no point with others.
fn solve(sights: &[Sight], photographs: usize, points: usize) -> Vec<f64> {
    let mut gains = vec![0.0; photographs];
    let mut neighbours = Vec::new();
    let mut residuals = vec![0.0; sights.len()];
    for _ in 0..ROUNDS {
        let deviation =
            DEVIATION_OVER_MEDIAN * median(residuals.iter().map(|r: &f64| r.abs())).unwrap_or(0.0);
        let reach = HUBER * deviation.max(LEAST_DEVIATION);
        let weights: Vec<f64> = (sights.iter().zip(&residuals))
            .map(|(s, r)| s.weight * (reach / r.abs().max(reach)))
            .collect();
        let system = System::of(sights, &weights, (photographs, points));
        neighbours = system.neighbours();
        gains = system.solution();
        let colours = colours(sights, &weights, &gains, points);
        for (residual, s) in residuals.iter_mut().zip(sights) {
            *residual = s.value + gains[s.photograph] - colours[s.point];
        }
    }
    let centred = |gains: &[f64]| -> Vec<f64> {
        let mean = gains.iter().sum::<f64>() / photographs.max(1) as f64;
        gains.iter().map(|g| g - mean).collect()
    };
    centred(&without_light(&centred(&gains), &neighbours))
}

/// Gains, their mean zero, less what they have in common with their neighbours', where that is most of them. `neighbours` has for each
/// photograph the shares of the others in the mean of its neighbours.
fn without_light(gains: &[f64], neighbours: &[Vec<f64>]) -> Vec<f64> {
    let around: Vec<f64> = (neighbours.iter())
        .map(|shares| shares.iter().zip(gains).map(|(s, g)| s * g).sum())
        .collect();
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let (own, common) = (product(gains, gains), product(&around, &around));
    if own <= 0.0 || common <= 0.0 {
        return gains.to_vec();
    }
    let along = product(gains, &around);
    let [low, high] = LIGHT;
    let share = ((along / (own * common).sqrt() - low) / (high - low)).clamp(0.0, 1.0);
    (gains.iter().zip(&around))
        .map(|(g, a)| g - share * along / common * a)
        .collect()
}

/// The c_p for given gains.
fn colours(sights: &[Sight], weights: &[f64], gains: &[f64], points: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); points];
    for (s, w) in sights.iter().zip(weights) {
        sums[s.point].0 += w * (s.value + gains[s.photograph]);
        sums[s.point].1 += w;
    }
    let mean = |(sum, weight): (f64, f64)| if weight > 0.0 { sum / weight } else { 0.0 };
    sums.into_iter().map(mean).collect()
}

/// The normal equations of the gains alone, after the c_p are taken out.
struct System {
    size: usize,
    /// Row after row.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl System {
    fn of(sights: &[Sight], weights: &[f64], (size, points): (usize, usize)) -> Self {
        let mut of_point: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); points];
        for (s, &w) in sights.iter().zip(weights) {
            of_point[s.point].push((s.photograph, w, s.value));
        }
        let (mut matrix, mut right) = (vec![0.0; size * size], vec![0.0; size]);
        for sights in of_point {
            let whole: f64 = sights.iter().map(|s| s.1).sum();
            if whole <= 0.0 {
                continue;
            }
            let mean = sights.iter().map(|s| s.1 * s.2).sum::<f64>() / whole;
            for &(v, w, value) in &sights {
                matrix[v * size + v] += w;
                right[v] -= w * (value - mean);
                for &(u, x, _) in &sights {
                    matrix[v * size + u] -= w * x / whole;
                }
            }
        }
        let trace: f64 = (0..size).map(|v| matrix[v * size + v]).sum();
        let hold = (HOLD * trace / size.max(1) as f64).max(f64::MIN_POSITIVE);
        for v in 0..size {
            matrix[v * size + v] += hold;
        }
        Self {
            size,
            matrix,
            right,
        }
    }

    /// For each photograph the shares of the others in what it sees together with others.
    fn neighbours(&self) -> Vec<Vec<f64>> {
        let n = self.size;
        (0..n)
            .map(|v| {
                let shared = |u: usize| if u == v { 0.0 } else { -self.matrix[v * n + u] };
                let whole: f64 = (0..n).map(shared).sum();
                let share = |u| if whole > 0.0 { shared(u) / whole } else { 0.0 };
                (0..n).map(share).collect()
            })
            .collect()
    }

    /// By the Cholesky decomposition: the matrix is symmetric and, held, positive.
    fn solution(mut self) -> Vec<f64> {
        let n = self.size;
        for j in 0..n {
            for i in j..n {
                let dot: f64 = (0..j)
                    .map(|k| self.matrix[i * n + k] * self.matrix[j * n + k])
                    .sum();
                let rest = self.matrix[i * n + j] - dot;
                self.matrix[i * n + j] = if i == j {
                    rest.max(f64::MIN_POSITIVE).sqrt()
                } else {
                    rest / self.matrix[j * n + j]
                };
            }
        }
        let mut x = self.right;
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| self.matrix[i * n + k] * x[k]).sum();
            x[i] = (x[i] - dot) / self.matrix[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| self.matrix[k * n + i] * x[k]).sum();
            x[i] = (x[i] - dot) / self.matrix[i * n + i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten photographs in a ring, each sees the points of a third of it; every seventh value is far off.
    fn ring(gains: &[f64], outliers: bool) -> Vec<Sight> {
        let points = 300;
        let mut sights = Vec::new();
        for (v, gain) in gains.iter().enumerate() {
            for p in 0..points {
                let apart = (p as f64 / 30.0 - v as f64).rem_euclid(10.0);
                if apart.min(10.0 - apart) > 1.7 {
                    continue;
                }
                let noise = 0.02 * ((p * 7 + v * 13) as f64).sin();
                let colour = -1.0 + (p as f64 * 0.05).cos();
                let highlight = if outliers && (p + v) % 7 == 0 {
                    1.5
                } else {
                    0.0
                };
                sights.push(Sight {
                    photograph: v,
                    point: p,
                    weight: 1.0,
                    value: colour - gain + noise + highlight,
                });
            }
        }
        sights
    }

    #[test]
    fn made_gains_come_back_whatever_a_few_points_say() {
        let made: Vec<f64> = (0..10).map(|v| 0.3 * (f64::from(v) * 1.3).sin()).collect();
        let mean = made.iter().sum::<f64>() / 10.0;
        for outliers in [false, true] {
            let found = solve(&ring(&made, outliers), 10, 300);
            for (found, made) in found.iter().zip(&made) {
                assert!((found - (made - mean)).abs() < 0.02, "{found} {made}");
            }
            assert!(found.iter().sum::<f64>().abs() < 1e-9);
        }
        let even = solve(&ring(&[0.0; 10], true), 10, 300);
        assert!(even.iter().all(|g| g.abs() < 0.01), "{even:?}");
    }

    /// A ring of photographs under a light that stays where it is, with and without exposures of their own.
    #[test]
    fn light_that_changes_slowly_is_left_and_exposures_are_not() {
        let light = |v: usize| 0.25 * (v as f64 * std::f64::consts::TAU / 36.0).sin();
        let exposure = |v: usize| 0.3 * ((v * v) as f64 * 1.7).sin();
        let neighbours: Vec<Vec<f64>> = (0..36_usize)
            .map(|v| {
                let apart = |u: usize| v.abs_diff(u).min(36 - v.abs_diff(u));
                let share = |u| {
                    if (1..=4).contains(&apart(u)) {
                        0.125
                    } else {
                        0.0
                    }
                };
                (0..36).map(share).collect()
            })
            .collect();
        let all = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..36).map(of).collect() };
        let largest = |gains: &[f64]| gains.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
        let left = without_light(&all(&light), &neighbours);
        assert!(largest(&left) < 0.01, "{left:?}");
        let exposures = all(&exposure);
        assert_eq!(without_light(&exposures, &neighbours), exposures);
        // Both: what differs from photograph to photograph stays.
        let both = without_light(&all(&|v| light(v) + 0.1 * exposure(v)), &neighbours);
        let rest: Vec<f64> = (0..36).map(|v| both[v] - 0.1 * exposure(v)).collect();
        assert!(largest(&rest) < 0.08, "{rest:?}");
    }

    #[test]
    fn photographs_without_a_point_in_common_keep_their_exposure() {
        assert_eq!(solve(&[], 3, 5), [0.0; 3]);
        let sights: Vec<Sight> = (0..3)
            .map(|v| Sight {
                photograph: v,
                point: v,
                weight: 1.0,
                value: v as f64,
            })
            .collect();
        assert!(solve(&sights, 3, 3).iter().all(|g| g.abs() < 1e-9));
    }
}
