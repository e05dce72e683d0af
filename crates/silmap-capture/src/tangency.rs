//! Whether all image coordinates are off by a part of a pixel: by the planes through two eyes that touch both silhouettes.
//!
//! A plane through two eyes that touches the object touches both of its silhouettes. Where the masks of all views lie beside where their
//! cameras see the object, by the same step in each image, the planes of the two silhouettes differ; the step that makes them agree best
//! is the answer. No hull is carved, so that no voxel is too coarse for it. How sure it is follows from leaving out one view at a time.
//!
//! Source: R. Cipolla, K. Åström, P. Giblin. Motion from the Frontier of Curved Surfaces. ICCV 1995 (epipolar tangency).
//! Deviations: only the outermost tangent planes of a pair, which touch the convex hulls of the silhouettes; one step for all views
//! is sought rather than motion.

use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::Mask;

use crate::pinhole::Pinhole;
use crate::residual::median;
use crate::shift::ImageShift;
use crate::view::{Capture, CaptureView};

/// So many views are compared, at most.
const MOST_VIEWS: usize = 72;

/// Eyes that are nearer to each other, in distances from the object, tell nothing: about two degrees.
const LEAST_BASELINE: f64 = 0.03;

/// Rays nearer to the line through both eyes are not looked at (sine of the angle).
const LEAST_SINE: f64 = 0.08;

/// The silhouette's angle about the line through both eyes must be less.
const WIDEST: f64 = 2.4;

/// A point this near to the image's border may be where the object is cut off, pixels.
const BORDER_PX: f64 = 1.5;

/// Steps of the image coordinates by which slopes are found, pixels.
const STEP_PX: f64 = 0.25;

const ROUNDS: usize = 4;

/// Residuals beyond so many usual ones count less and less.
const USUAL: f64 = 2.0;

/// Without anything known the step is within this, pixels.
const PRIOR_PX: f64 = 20.0;

/// The step of all image coordinates that makes the silhouettes of a capture agree best; `None` where too few views say anything.
#[must_use]
pub fn image_shift(capture: &Capture) -> Option<ImageShift> {
    let stride = capture.views.len().div_ceil(MOST_VIEWS).max(1);
    let tried: Vec<&CaptureView> = capture.views.iter().step_by(stride).collect();
    let hulls: Vec<Outline> = tried.par_iter().map(|view| Outline::of(view)).collect();
    let pairs: Vec<(usize, usize)> = (0..hulls.len())
        .flat_map(|i| (i + 1..hulls.len()).map(move |j| (i, j)))
        .collect();
    let mut shift = DVec2::ZERO;
    let mut found = None;
    for _ in 0..ROUNDS {
        let residuals: Vec<Slope> = (pairs.par_iter())
            .map(|&(i, j)| slopes(&hulls, (i, j), shift))
            .flatten_iter()
            .collect();
        let usual = median(residuals.iter().map(|r| r.value.abs()))?;
        let (step, deviation) = solved(&residuals, hulls.len(), usual)?;
        shift += step;
        found = Some(ImageShift {
            by: -shift,
            deviation,
            usual,
        });
    }
    found.filter(|f| f.by.is_finite() && f.deviation.is_finite())
}

/// The convex hull of a mask and its camera.
struct Outline {
    camera: Pinhole,
    points: Vec<DVec2>,
    middle: DVec2,
}

impl Outline {
    fn of(view: &CaptureView) -> Self {
        let points = convex_hull(&view.mask);
        let sum: DVec2 = points.iter().sum();
        Self {
            camera: view.camera,
            middle: sum / points.len().max(1) as f64,
            points,
        }
    }

    fn is_at_border(&self, point: DVec2) -> bool {
        let size = DVec2::new(self.camera.width.into(), self.camera.height.into());
        point.min_element() < BORDER_PX || (size - point).min_element() < BORDER_PX
    }

    /// The outermost angles about an axis through the eye, and pixels for a unit of angle there; `None` where the object is cut off
    /// there. Nothing where the axis passes through the silhouette or near it.
    fn touched(&self, axis: DVec3, [p, q]: [DVec3; 2], shift: DVec2) -> Option<[Touch; 2]> {
        let mut ends: [Option<(f64, f64, DVec2)>; 2] = [None; 2];
        for &point in &self.points {
            let ray = self.camera.direction(point + shift).normalize_or_zero();
            let across = ray - ray.dot(axis) * axis;
            let sine = across.length();
            if sine < LEAST_SINE {
                return None;
            }
            let angle = across.dot(q).atan2(across.dot(p));
            let pixels = sine * self.camera.pixels_per_tangent();
            if ends[0].is_none_or(|e| angle < e.0) {
                ends[0] = Some((angle, pixels, point));
            }
            if ends[1].is_none_or(|e| angle > e.0) {
                ends[1] = Some((angle, pixels, point));
            }
        }
        let (low, high) = (ends[0]?, ends[1]?);
        if high.0 - low.0 > WIDEST {
            return None;
        }
        Some(
            [low, high].map(|(angle, pixels, point)| {
                (!self.is_at_border(point)).then_some((angle, pixels))
            }),
        )
    }
}

/// An angle and pixels for a unit of it.
type Touch = Option<(f64, f64)>;

/// A distance between tangent planes and how it changes with the shift, pixels.
struct Slope {
    views: [usize; 2],
    value: f64,
    along: DVec2,
}

fn slopes(hulls: &[Outline], (i, j): (usize, usize), shift: DVec2) -> Vec<Slope> {
    let at = |shift| tangents(&hulls[i], &hulls[j], shift);
    let (Some(middle), Some(x), Some(y)) = (
        at(shift),
        at(shift + STEP_PX * DVec2::X),
        at(shift + STEP_PX * DVec2::Y),
    ) else {
        return Vec::new();
    };
    (0..2)
        .filter_map(|end| {
            let (value, x, y) = (middle[end]?, x[end]?, y[end]?);
            Some(Slope {
                views: [i, j],
                value,
                along: DVec2::new(x - value, y - value) / STEP_PX,
            })
        })
        .collect()
}

/// How far the outermost tangent planes of two silhouettes are from each other, pixels.
fn tangents(a: &Outline, b: &Outline, shift: DVec2) -> Option<[Option<f64>; 2]> {
    let between = b.camera.eye - a.camera.eye;
    let axis = between.normalize_or_zero();
    let ray = a.camera.direction(a.middle).normalize_or_zero();
    let other = b.camera.direction(b.middle).normalize_or_zero();
    // The angle at the object.
    if ray.cross(other).length() < LEAST_BASELINE {
        return None;
    }
    let p = (ray - ray.dot(axis) * axis).normalize_or_zero();
    let basis = [p, axis.cross(p)];
    let (of_a, of_b) = (
        a.touched(axis, basis, shift)?,
        b.touched(axis, basis, shift)?,
    );
    Some(std::array::from_fn(|end| {
        let ((s, per_s), (t, per_t)) = (of_a[end]?, of_b[end]?);
        // Both silhouettes are as uncertain, in pixels.
        let pixels = 1.0 / (1.0 / per_s).hypot(1.0 / per_t);
        Some((s - t) * pixels)
    }))
}

/// The step that makes the residuals least, and its deviation by leaving out one view at a time.
fn solved(residuals: &[Slope], views: usize, usual: f64) -> Option<(DVec2, DVec2)> {
    let mut all = Normal::default();
    let mut of_view = vec![Normal::default(); views];
    for residual in residuals {
        let one = Normal::of(residual, usual);
        all = all.plus(&one, 1.0);
        for view in residual.views {
            of_view[view] = of_view[view].plus(&one, 1.0);
        }
    }
    let step = all.solve()?;
    let without: Vec<DVec2> = (of_view.iter().filter(|n| n.count > 0.0))
        .filter_map(|n| all.plus(n, -1.0).solve())
        .collect();
    let count = without.len() as f64;
    if count < 3.0 {
        return None;
    }
    let mean = without.iter().sum::<DVec2>() / count;
    let spread: DVec2 = without.iter().map(|w| (*w - mean) * (*w - mean)).sum();
    // The jackknife; each residual rests on two views, so that leaving out one takes away twice its share.
    let deviation = (spread * ((count - 1.0) / count)).map(f64::sqrt);
    Some((step, deviation))
}

/// Equations of the least squares.
#[derive(Clone, Copy, Debug, Default)]
struct Normal {
    left: [f64; 3],
    right: DVec2,
    count: f64,
}

impl Normal {
    fn of(residual: &Slope, usual: f64) -> Self {
        let scale = (USUAL * usual).max(0.05);
        // Cauchy's weight.
        let weight = 1.0 / (1.0 + (residual.value / scale).powi(2)) / (scale * scale);
        let d = residual.along;
        Self {
            left: [weight * d.x * d.x, weight * d.x * d.y, weight * d.y * d.y],
            right: -weight * residual.value * d,
            count: 1.0,
        }
    }

    fn plus(&self, other: &Self, sign: f64) -> Self {
        Self {
            left: std::array::from_fn(|k| self.left[k] + sign * other.left[k]),
            right: self.right + sign * other.right,
            count: self.count + sign * other.count,
        }
    }

    fn solve(&self) -> Option<DVec2> {
        let [a, b, c] = self.left;
        let prior = PRIOR_PX.powi(-2);
        let matrix = DMat2::from_cols(DVec2::new(a + prior, b), DVec2::new(b, c + prior));
        let found = matrix.inverse() * self.right;
        found.is_finite().then_some(found)
    }
}

/// The convex hull of the middles of the pixel sides at the ends of each row, anticlockwise in coordinates with y down.
fn convex_hull(mask: &Mask) -> Vec<DVec2> {
    let mut points = Vec::new();
    for y in 0..mask.height() {
        let row = mask.row(y);
        let Some(first) = row.iter().position(|&w| w != 0) else {
            continue;
        };
        let last = row.iter().rposition(|&w| w != 0).unwrap_or(first);
        let left = 64 * first as u32 + row[first].trailing_zeros();
        let right = 64 * last as u32 + 63 - row[last].leading_zeros();
        let (x, end, y) = (f64::from(left), f64::from(right) + 1.0, f64::from(y));
        points.push(DVec2::new(x, y + 0.5));
        points.push(DVec2::new(end, y + 0.5));
        for y in [y, y + 1.0] {
            points.push(DVec2::new(x + 0.5, y));
            points.push(DVec2::new(end - 0.5, y));
        }
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}
