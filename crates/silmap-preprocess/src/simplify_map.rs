//! Simplifying the silhouette map: views that their neighbours predict are removed (section 6).
//!
//! Source: Silhouette Mapping, section 6: greedy collapses of polytope edges onto one of their ends, by the number of
//! misclassified pixels over all original views that the collapse would add.
//! Deviation: pixels are counted as a share of the view's inside, the measure of figure 11, so that all views weigh the same.
//! Costs in the neighbourhood of a collapse are re-evaluated when they reach the top of the heap, not at once. Afterwards the
//! views that are left are moved where that lowers the error.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

use rayon::prelude::*;
use silmap_geometry::Mask;
use silmap_map::{Method, SilhouetteMap};
use thiserror::Error;

use crate::progress::{Interrupted, Monitor, Stage};

mod polytope;
mod predict;
mod refine;

use polytope::{Collapse, SimplifiedPolytope};
use predict::{Prediction, Predictor};

/// When to stop removing views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyMapParams {
    /// Views to keep.
    pub keep: u32,
    /// Stop before the mean misclassified share over all original views exceeds this; overrides `keep`.
    pub max_error: Option<f64>,
    /// The method that predicts.
    pub method: Method,
}

impl Default for SimplifyMapParams {
    fn default() -> Self {
        Self {
            keep: 128,
            max_error: None,
            method: Method::Hull,
        }
    }
}

/// What simplifying did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimplifyMapReport {
    /// Views left and mean misclassified share over all original views, after each collapse (figure 11).
    pub curve: Vec<(u32, f64)>,
    /// Per collapse: the view that was removed and the neighbour it collapsed onto, as indices into the dense map.
    pub collapses: Vec<(u32, u32)>,
    /// Per view kept: its index in the dense map.
    pub kept: Vec<u32>,
    /// Mean misclassified share over all original views.
    pub misclassified_mean: f64,
    /// Largest misclassified share of an original view.
    pub misclassified_max: f64,
    /// How often a view's silhouette was predicted: the cost of simplifying.
    pub predictions: u64,
}

/// Why a map cannot be simplified.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SimplifyMapError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// There is not one mask for each view.
    #[error("{views} views came with {masks} masks")]
    MaskCount {
        /// Views of the dense map.
        views: usize,
        /// Masks given.
        masks: usize,
    },
}

/// Stale candidates evaluated at a time: enough for all cores, and fixed, so that the result depends on no thread count.
const BATCH: usize = 16;

/// First evaluations between two looks at the monitor.
const CHUNK: usize = 256;

/// A collapse in the heap with the cost it had when it was last evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    cost: f64,
    collapse: Collapse,
    /// Version of the removed view's star at that time.
    version: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// The heap's greatest element is the cheapest collapse; ties go to the smaller view numbers.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then_with(|| other.collapse.cmp(&self.collapse))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Removes views from `dense` until `params` says to stop or no collapse is possible.
///
/// `masks` are the captured silhouettes of all views, against which predictions are counted.
///
/// # Errors
/// When interrupted, or when views and masks do not belong together.
pub fn simplify(
    dense: &SilhouetteMap,
    masks: &[Mask],
    params: &SimplifyMapParams,
    monitor: &Monitor<'_>,
) -> Result<(SilhouetteMap, SimplifyMapReport), SimplifyMapError> {
    let views = dense.views.len();
    if masks.len() != views {
        return Err(SimplifyMapError::MaskCount {
            views,
            masks: masks.len(),
        });
    }
    let target = if params.max_error.is_some() {
        4
    } else {
        params.keep.max(4)
    };
    monitor.start(Stage::Map, views.saturating_sub(target as usize) as u64);
    let mut work = Simplification::new(dense, masks, params);
    work.evaluate_all(monitor)?;
    while work.polytope.view_count() > target as usize {
        monitor.check()?;
        let Some(candidate) = work.cheapest_collapse() else {
            break;
        };
        let total = work.error_sum + candidate.cost;
        if params
            .max_error
            .is_some_and(|limit| total / views as f64 > limit)
        {
            break;
        }
        work.apply(candidate.collapse);
        monitor.advance(Stage::Map, 1);
    }
    monitor.finish(Stage::Map);
    work.refine(monitor)?;
    Ok(work.finish())
}

/// The state of a simplification.
struct Simplification<'a> {
    predictor: Predictor<'a>,
    polytope: SimplifiedPolytope,
    /// Per original view: its misclassified share as the polytope is now.
    errors: Vec<f64>,
    error_sum: f64,
    heap: BinaryHeap<Candidate>,
    /// Errors predicted so far: most triangles around a candidate outlive the collapses beside it.
    known: HashMap<(u32, [u32; 3]), f64>,
    report: SimplifyMapReport,
}

impl<'a> Simplification<'a> {
    fn new(dense: &'a SilhouetteMap, masks: &'a [Mask], params: &SimplifyMapParams) -> Self {
        Self {
            predictor: Predictor::new(dense, masks, params.method),
            polytope: SimplifiedPolytope::new(dense),
            errors: vec![0.0; masks.len()],
            error_sum: 0.0,
            heap: BinaryHeap::new(),
            known: HashMap::new(),
            report: SimplifyMapReport::default(),
        }
    }

    /// Puts every possible collapse into the heap.
    fn evaluate_all(&mut self, monitor: &Monitor<'_>) -> Result<(), Interrupted> {
        let collapses: Vec<Collapse> = self.polytope.collapses().collect();
        for chunk in collapses.chunks(CHUNK) {
            monitor.check()?;
            self.evaluate(chunk);
        }
        Ok(())
    }

    /// Evaluates collapses and puts those that are allowed into the heap.
    fn evaluate(&mut self, collapses: &[Collapse]) {
        let evaluated: Vec<Option<(Candidate, Vec<Prediction>)>> = collapses
            .par_iter()
            .map_init(
                || self.predictor.scratch(),
                |scratch, &collapse| {
                    let predictions = self.predict(collapse, scratch)?;
                    let cost = predictions
                        .iter()
                        .map(|p| p.error - self.errors[p.view as usize])
                        .sum();
                    let version = self.polytope.version(collapse.removed);
                    Some((
                        Candidate {
                            cost,
                            collapse,
                            version,
                        },
                        predictions,
                    ))
                },
            )
            .collect();
        for (candidate, predictions) in evaluated.into_iter().flatten() {
            for p in predictions {
                if self.known.insert((p.view, p.views), p.error).is_none() {
                    self.report.predictions += 1;
                }
            }
            self.heap.push(candidate);
        }
    }

    /// The errors that the views around a collapse would have after it; `None` when it is not allowed.
    fn predict(
        &self,
        collapse: Collapse,
        scratch: &mut predict::PredictScratch,
    ) -> Option<Vec<Prediction>> {
        let triangles = self.polytope.triangles_after(collapse)?;
        let affected = self.polytope.views_around(collapse.removed);
        let mut predictions = Vec::with_capacity(affected.len());
        for view in affected {
            predictions.push(
                self.predictor
                    .predict(view, &triangles, &self.known, scratch)?,
            );
        }
        Some(predictions)
    }

    /// Takes the cheapest collapse off the heap, re-evaluating those whose neighbourhood changed.
    fn cheapest_collapse(&mut self) -> Option<Candidate> {
        loop {
            let mut stale = Vec::with_capacity(BATCH);
            while stale.len() < BATCH {
                let Some(&top) = self.heap.peek() else { break };
                if !self.polytope.is_edge(top.collapse) {
                    self.heap.pop();
                } else if self.polytope.version(top.collapse.removed) != top.version {
                    self.heap.pop();
                    stale.push(top.collapse);
                } else if stale.is_empty() {
                    self.heap.pop();
                    if self.polytope.triangles_after(top.collapse).is_some() {
                        return Some(top);
                    }
                } else {
                    break;
                }
            }
            if stale.is_empty() {
                return None;
            }
            self.evaluate(&stale);
        }
    }

    /// Carries a collapse out and enters the edges it made.
    fn apply(&mut self, collapse: Collapse) {
        let mut scratch = self.predictor.scratch();
        let Some(predictions) = self.predict(collapse, &mut scratch) else {
            return;
        };
        for p in &predictions {
            self.error_sum += p.error - self.errors[p.view as usize];
            self.errors[p.view as usize] = p.error;
        }
        let fresh = self.polytope.apply(collapse, &predictions);
        self.evaluate(&fresh);
        self.report
            .collapses
            .push((collapse.removed, collapse.onto));
        self.report.curve.push((
            self.polytope.view_count() as u32,
            self.error_sum / self.errors.len() as f64,
        ));
    }

    fn finish(mut self) -> (SilhouetteMap, SimplifyMapReport) {
        let dense = self.predictor.map();
        let (kept, triangles) = self.polytope.compact();
        let map = SilhouetteMap {
            views: kept
                .iter()
                .map(|&v| dense.views[v as usize].clone())
                .collect(),
            triangles,
            ..SilhouetteMap {
                views: Vec::new(),
                triangles: Vec::new(),
                ..dense.clone()
            }
        };
        self.report.kept = kept;
        self.report.misclassified_mean = self.error_sum.max(0.0) / self.errors.len().max(1) as f64;
        self.report.misclassified_max = self.errors.iter().copied().fold(0.0, f64::max);
        (map, self.report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{CaptureParams, capture, view_sphere};
    use crate::dense_map::{self, DenseMapParams};
    use crate::simplify_contour::{SimplifyContourParams, simplify_contours};
    use crate::trace::trace_contours;
    use silmap_geometry::{ClosedMesh, CoverageRule};
    use silmap_map::{CapturedView, ViewContour};

    fn torus_map(views: u32) -> (SilhouetteMap, Vec<Mask>) {
        let mesh = ClosedMesh::try_from(crate::models::torus(1024)).unwrap();
        let bounds = *mesh.bounds();
        let side = 96;
        let cameras = view_sphere(&bounds, 3.0 * bounds.radius, views, side).unwrap();
        let masks = capture(
            &mesh,
            &cameras,
            &CaptureParams::default(),
            &Monitor::silent(),
        )
        .unwrap();
        let views = cameras
            .iter()
            .zip(&masks)
            .map(|(&camera, mask)| {
                let loops =
                    simplify_contours(&trace_contours(mask), &SimplifyContourParams::default());
                let contours = loops.into_iter().map(|points| ViewContour {
                    points,
                    depths: Vec::new(),
                });
                CapturedView {
                    camera,
                    contours: contours.collect(),
                }
            })
            .collect();
        let params = DenseMapParams {
            center: bounds.center,
            radius: bounds.radius,
            resolution_px: side,
            tolerance_px: 0.5,
            coverage: CoverageRule::Center,
        };
        (dense_map::build(views, &params).unwrap(), masks)
    }

    #[test]
    fn every_collapse_leaves_a_star_shaped_polytope_and_true_errors() {
        let (dense, masks) = torus_map(60);
        let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
        work.evaluate_all(&Monitor::silent()).unwrap();
        while let Some(candidate) = work.cheapest_collapse() {
            let before = work.error_sum;
            work.apply(candidate.collapse);
            work.polytope.check();
            assert!(
                (work.error_sum - before - candidate.cost).abs() < 1e-9,
                "a cost was not kept"
            );
            let sum: f64 = work.errors.iter().sum();
            assert!((work.error_sum - sum).abs() < 1e-9);
        }
        assert!(
            work.polytope.view_count() <= 12,
            "stalled at {}",
            work.polytope.view_count()
        );
        assert!(work.error_sum > 0.0);
    }

    #[test]
    fn moving_views_lowers_the_error_and_leaves_a_polytope() {
        let (dense, masks) = torus_map(80);
        let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
        work.evaluate_all(&Monitor::silent()).unwrap();
        while work.polytope.view_count() > 24 {
            let candidate = work.cheapest_collapse().unwrap();
            work.apply(candidate.collapse);
        }
        let before = work.error_sum;
        work.refine(&Monitor::silent()).unwrap();
        work.polytope.check();
        assert_eq!(work.polytope.view_count(), 24);
        assert!(
            work.error_sum < before,
            "{before} stayed {}",
            work.error_sum
        );
        // The sum that was kept up to date is that of fresh predictions from the polytope as it is.
        let (kept, triangles) = work.polytope.compact();
        let triangles: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| kept[v as usize]))
            .collect();
        let mut scratch = work.predictor.scratch();
        let fresh: f64 = (0..80)
            .filter(|v| !kept.contains(v))
            .map(|v| {
                let known = HashMap::new();
                work.predictor
                    .predict(v, &triangles, &known, &mut scratch)
                    .unwrap()
                    .error
            })
            .sum();
        assert!(
            (fresh - work.error_sum).abs() < 1e-9,
            "{fresh} is not {}",
            work.error_sum
        );
    }

    #[test]
    fn the_curve_ends_where_it_was_told_to() {
        let (dense, masks) = torus_map(60);
        let monitor = Monitor::silent();
        let keep = SimplifyMapParams {
            keep: 20,
            ..SimplifyMapParams::default()
        };
        let (map, report) = simplify(&dense, &masks, &keep, &monitor).unwrap();
        assert_eq!(
            (map.views.len(), report.kept.len(), report.curve.len()),
            (20, 20, 40)
        );
        assert_eq!(map.triangles.len(), 36);
        let at_30 = report
            .curve
            .iter()
            .find(|(views, _)| *views == 30)
            .unwrap()
            .1;
        let limit = SimplifyMapParams {
            max_error: Some(at_30),
            ..keep
        };
        let (map, report) = simplify(&dense, &masks, &limit, &monitor).unwrap();
        assert!(report.misclassified_mean <= at_30 && map.views.len() <= 30);
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let (dense, masks) = torus_map(48);
        let params = SimplifyMapParams {
            keep: 16,
            ..SimplifyMapParams::default()
        };
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| simplify(&dense, &masks, &params, &Monitor::silent()).unwrap())
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn a_map_without_its_masks_is_refused() {
        let (dense, masks) = torus_map(12);
        let made = simplify(
            &dense,
            &masks[1..],
            &SimplifyMapParams::default(),
            &Monitor::silent(),
        );
        assert_eq!(
            made.err(),
            Some(SimplifyMapError::MaskCount {
                views: 12,
                masks: 11
            })
        );
    }
}
