//! How wrong the interpolated silhouette is: misclassified and escaped pixels over test viewpoints, and how far it strays from the exact
//! outline.
//!
//! Source: Silhouette Mapping, section 9 and figure 11: pixels whose inside or outside is wrong, divided by the pixels
//! inside the true silhouette. "Escaped" are those inside the true silhouette that are predicted outside: what breaks
//! conservativeness. How far outlines stray is beyond the paper: see [`straying`](crate::straying()).

use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use silmap_exact::OutlineError;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, CameraError, CoverageRule, Loop, Mask, TriangleMesh};
use silmap_geometry::{Interrupted, Stage, Watch};
use silmap_map::{
    Detail, InterpolateError, Interpolation, MapReader, Method, Polytope, PolytopeError,
    SilhouetteMap, Transfer,
};
use silmap_preprocess::capture::cpu::rasterise;
use silmap_preprocess::capture::{CaptureError, spiral_directions};
use thiserror::Error;

use crate::exact_outlines::ExactOutlines;
use crate::{Straying, StrayingSummary, straying};

/// Measuring errors; the units are viewpoints.
pub const EVALUATE: Stage = Stage("measuring errors");

/// Where the test viewpoints lie, along random directions from the center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// Where the ray meets the polytope: the paper's interpolation without its homography.
    #[default]
    Polytope,
    /// On the sphere of the captured views.
    Sphere,
    /// At distances log-uniform in 1.5R…10R.
    Shell,
}

impl Place {
    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Polytope => "polytope",
            Self::Sphere => "sphere",
            Self::Shell => "shell",
        }
    }
}

/// Nearest and farthest eye of [`Place::Shell`], in radii of the bounding sphere.
const SHELL_RADII: (f64, f64) = (1.5, 10.0);

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluateParams {
    /// Number of test viewpoints.
    pub viewpoints: u32,
    /// Seed of their directions.
    pub seed: u64,
    /// Where they lie.
    pub place: Place,
    /// The methods to measure.
    pub methods: Vec<Method>,
    /// How outlines are carried off the polytope.
    pub transfer: Transfer,
    /// How fine the contours are that outlines are interpolated from.
    pub detail: Detail,
    /// Side of the square test images, pixels.
    pub size_px: u32,
    /// Whether to measure how far outlines stray, which takes the exact outline of the model at each viewpoint.
    pub with_straying: bool,
}

impl Default for EvaluateParams {
    fn default() -> Self {
        Self {
            viewpoints: 200,
            seed: 1,
            place: Place::Polytope,
            methods: Method::ALL.to_vec(),
            transfer: Transfer::default(),
            detail: Detail::default(),
            size_px: 512,
            with_straying: true,
        }
    }
}

/// Errors at one viewpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewpointError {
    /// The test viewpoint, object space.
    pub eye: DVec3,
    /// How the silhouette was interpolated.
    pub method: Method,
    /// Misclassified pixels over pixels inside.
    pub misclassified: f64,
    /// Escaped pixels over pixels inside.
    pub escaped: f64,
    /// Pixels inside the true outline, which both are shares of.
    pub inside_px: u64,
    /// How far the interpolated outline strays from the exact one, where that is measured.
    pub straying: Option<Straying>,
}

/// Errors over some pictures, as shares of the pixels inside the true outline.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shares {
    /// Mean misclassified share.
    pub misclassified_mean: f64,
    /// Median misclassified share.
    pub misclassified_median: f64,
    /// Largest misclassified share.
    pub misclassified_max: f64,
    /// Mean escaped share.
    pub escaped_mean: f64,
    /// Largest escaped share.
    pub escaped_max: f64,
}

impl Shares {
    /// Of the misclassified and the escaped share in each picture; `None` of no picture.
    pub fn of(errors: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (mut wrong, escaped): (Vec<f64>, Vec<f64>) = errors.unzip();
        wrong.sort_by(f64::total_cmp);
        let count = wrong.len();
        let misclassified_max = *wrong.last()?;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count as f64;
        Some(Self {
            misclassified_mean: mean(&wrong),
            misclassified_median: 0.5 * (wrong[(count - 1) / 2] + wrong[count / 2]),
            misclassified_max,
            escaped_mean: mean(&escaped),
            escaped_max: escaped.iter().copied().fold(0.0, f64::max),
        })
    }
}

/// Errors of one method over all viewpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodErrors {
    /// The method.
    pub method: Method,
    /// Its errors.
    pub shares: Shares,
    /// How far its outlines stray, where that is measured.
    pub straying: Option<StrayingSummary>,
}

/// Why errors cannot be measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The map is not a star-shaped polytope.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// A test camera cannot be made.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The model cannot be drawn from a test viewpoint.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The model has no exact outline at a test viewpoint.
    #[error(transparent)]
    Outline(#[from] OutlineError),
    /// The silhouette cannot be interpolated.
    #[error(transparent)]
    Interpolate(#[from] InterpolateError),
    /// Nothing was asked for.
    #[error("no viewpoint or no method to evaluate")]
    Nothing,
}

/// The test viewpoints: the same for the same seed, whatever is measured at them.
///
/// # Errors
/// When the map is not a star-shaped polytope.
pub fn viewpoints(
    map: &SilhouetteMap,
    params: &EvaluateParams,
) -> Result<Vec<DVec3>, PolytopeError> {
    let polytope = Polytope::new(map)?;
    let mut random = ChaCha8Rng::seed_from_u64(params.seed);
    let sphere = map
        .views
        .first()
        .map_or(3.0 * map.radius, |v| v.camera.eye.distance(map.center));
    let eyes = (0..params.viewpoints).map(|_| {
        let z = random.random_range(-1.0..1.0_f64);
        let (sin, cos) = random.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let share = random.random_range(0.0..1.0_f64);
        let direction = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
        match params.place {
            Place::Polytope => polytope
                .locate(map.center + direction, 0)
                .map_or(map.center, |at| at.point),
            Place::Sphere => map.center + direction * sphere,
            Place::Shell => {
                let (near, far) = SHELL_RADII;
                map.center + direction * (map.radius * near * (far / near).powf(share))
            }
        }
    });
    Ok(eyes.collect())
}

/// Viewpoints on the polytope in `count` directions that are spread evenly over the sphere, always the same ones.
///
/// # Errors
/// When the map is not a star-shaped polytope.
pub fn spread_viewpoints(map: &SilhouetteMap, count: u32) -> Result<Vec<DVec3>, PolytopeError> {
    let polytope = Polytope::new(map)?;
    let eyes = spiral_directions(count).into_iter().map(|direction| {
        polytope
            .locate(map.center + direction, 0)
            .map_or(map.center, |at| at.point)
    });
    Ok(eyes.collect())
}

/// Misclassified and escaped shares of a prediction against the true mask.
#[must_use]
pub fn compare(predicted: &Mask, truth: &Mask) -> (f64, f64) {
    let inside = truth.count().max(1) as f64;
    (
        predicted.count_different(truth) as f64 / inside,
        truth.count_missing_in(predicted) as f64 / inside,
    )
}

/// Measures the interpolated silhouettes of `map` against pictures of `model` at [`viewpoints`]: per viewpoint, in their order
/// and that of the methods.
///
/// # Errors
/// When interrupted, when nothing is asked for, or when the map is broken.
pub fn evaluate(
    map: &SilhouetteMap,
    model: &TriangleMesh,
    params: &EvaluateParams,
    watch: &Watch<'_>,
) -> Result<Vec<ViewpointError>, EvaluateError> {
    let eyes = viewpoints(map, params)?;
    evaluate_at(&eyes, map, model, params, watch)
}

/// As [`evaluate`], at viewpoints of the caller's choice.
///
/// # Errors
/// As [`evaluate`], and when an eye lies in the bounding sphere.
pub fn evaluate_at(
    eyes: &[DVec3],
    map: &SilhouetteMap,
    model: &TriangleMesh,
    params: &EvaluateParams,
    watch: &Watch<'_>,
) -> Result<Vec<ViewpointError>, EvaluateError> {
    if eyes.is_empty() || params.methods.is_empty() {
        return Err(EvaluateError::Nothing);
    }
    let prepared = (
        MapReader::new(map)?,
        params.with_straying.then(|| ExactOutlines::new(model)),
    );
    watch.start(EVALUATE, eyes.len() as u64);
    let per_eye: Vec<Vec<ViewpointError>> = eyes
        .par_iter()
        .map_init(
            || prepared.clone(),
            |(reader, exact), &eye| {
                watch.check()?;
                let seen = Comparison::new(eye, map, model, params.size_px)?;
                let exact = exact
                    .as_mut()
                    .map(|e| e.seen_by(&seen.camera))
                    .transpose()?;
                let mut errors = Vec::with_capacity(params.methods.len());
                for &method in &params.methods {
                    let how = Interpolation {
                        method,
                        transfer: params.transfer,
                        detail: params.detail,
                    };
                    let found = silmap_map::outline(map, &seen.camera, how, reader)?;
                    let predicted = seen.filled(found.simple_loops());
                    let (misclassified, escaped) = compare(&predicted, &seen.truth);
                    errors.push(ViewpointError {
                        eye,
                        method,
                        misclassified,
                        escaped,
                        inside_px: seen.truth.count(),
                        straying: (exact.as_ref())
                            .map(|exact| straying(found.simple_loops(), exact)),
                    });
                }
                watch.advance(EVALUATE, 1);
                Ok(errors)
            },
        )
        .collect::<Result<_, EvaluateError>>()?;
    watch.finish(EVALUATE);
    Ok(per_eye.into_iter().flatten().collect())
}

/// The camera of a test viewpoint: its square image of so many pixels a side just holds the bounding sphere.
pub(crate) fn test_camera(
    eye: DVec3,
    map: &SilhouetteMap,
    size_px: u32,
) -> Result<Camera, CameraError> {
    Camera::fit_sphere(eye, map.center, map.radius, None, (size_px, size_px))
}

/// A test viewpoint with the model's pixels there.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The camera, whose square image just holds the bounding sphere.
    pub camera: Camera,
    /// The model's pixels.
    pub truth: Mask,
}

impl Comparison {
    /// Draws the model from `eye` in an image of `size_px` squared.
    ///
    /// # Errors
    /// When the eye lies in the bounding sphere, or the model reaches out of it.
    pub fn new(
        eye: DVec3,
        map: &SilhouetteMap,
        model: &TriangleMesh,
        size_px: u32,
    ) -> Result<Self, EvaluateError> {
        let camera = test_camera(eye, map, size_px)?;
        let mut truth = Mask::new(size_px, size_px);
        rasterise(model, &camera, CoverageRule::Center, &mut truth)?;
        Ok(Self { camera, truth })
    }

    /// The pixels inside the interpolated outline.
    ///
    /// # Errors
    /// As [`silmap_map::outline`].
    pub fn predict(
        &self,
        map: &SilhouetteMap,
        how: Interpolation,
        reader: &mut MapReader,
    ) -> Result<Mask, InterpolateError> {
        let outline = silmap_map::outline(map, &self.camera, how, reader)?;
        Ok(self.filled(outline.simple_loops()))
    }

    /// The pixels inside loops of this picture.
    fn filled(&self, loops: &[Loop]) -> Mask {
        let mut mask = Mask::new(self.camera.width_px, self.camera.height_px);
        fill_even_odd(loops, &mut mask);
        mask
    }
}

/// Means, medians and extremes of each method, in the order the methods appear.
#[must_use]
pub fn summarise(errors: &[ViewpointError]) -> Vec<MethodErrors> {
    Method::ALL
        .into_iter()
        .filter_map(|method| {
            let own = || errors.iter().filter(|e| e.method == method);
            Some(MethodErrors {
                method,
                shares: Shares::of(own().map(|e| (e.misclassified, e.escaped)))?,
                straying: StrayingSummary::of(own().filter_map(|e| e.straying)),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shifted_silhouette_is_seen() {
        let (mut truth, mut shifted) = (Mask::new(64, 64), Mask::new(64, 64));
        for y in 10..30 {
            truth.set_span(y, 10, 30);
            shifted.set_span(y, 12, 32);
        }
        assert_eq!(compare(&truth, &truth), (0.0, 0.0));
        assert_eq!(compare(&shifted, &truth), (0.2, 0.1));
        assert_eq!(compare(&Mask::new(64, 64), &truth), (1.0, 1.0));
    }

    #[test]
    fn summaries_are_those_of_the_numbers() {
        let error = |misclassified: f64, escaped: f64| ViewpointError {
            eye: DVec3::ZERO,
            method: Method::Hull,
            misclassified,
            escaped,
            inside_px: 1000,
            straying: None,
        };
        let summary = summarise(&[
            error(0.3, 0.0),
            error(0.1, 0.1),
            error(0.2, 0.2),
            error(0.2, 0.1),
        ]);
        assert_eq!(summary.len(), 1);
        let s = summary[0].shares;
        assert!((s.misclassified_mean - 0.2).abs() < 1e-12 && (s.escaped_mean - 0.1).abs() < 1e-12);
        assert_eq!(
            (s.misclassified_median, s.misclassified_max, s.escaped_max),
            (0.2, 0.3, 0.2)
        );
        assert_eq!(Shares::of(std::iter::empty()), None);
    }
}
