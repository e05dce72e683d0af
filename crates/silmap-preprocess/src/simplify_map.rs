//! Silhouette map simplification: removing views that their neighbours predict (section 6).
//!
//! Source: Silhouette Mapping, section 6: greedy collapses of polytope edges onto one of their ends, by the number of
//! misclassified pixels over all original views that the collapse would add.
//! Deviation: pixels are counted as a share of the view's inside, the measure of figure 11, so that all views weigh the same.
//! Costs in the neighbourhood of a collapse are re-evaluated when they come up in the queue, not at once: first estimated from a few
//! views, then, of the cheapest, evaluated. Afterwards the
//! views that are left are moved where that lowers the error, and the collapses go on from there to the smallest polytope:
//! that part is only noted, so that an asset can lose further views later.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use silmap_geometry::{CostQueue, Mask};
use silmap_map::simplified_polytope::{Collapse, Rule, SimplifiedPolytope};
use silmap_map::{CapturedErrors, CapturedView, CollapseOrder, Method, SilhouetteMap};
use thiserror::Error;

use crate::progress;
use silmap_geometry::watch::{Interrupted, Watch};

mod order;
mod predict;
mod refine;
#[cfg(test)]
mod tests;

use predict::{Facing, Lent, Prediction, Predictor};

/// When to stop removing views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimplifyMapParams {
    /// Views to keep.
    pub keep: u32,
    /// Stop before the mean misclassified share over all original views exceeds this; overrides `keep`.
    pub max_error: Option<f64>,
    /// The method that predicts: by default the one that outlines are drawn by. Where a map has no depths and it needs them, the best
    /// one without.
    #[serde(with = "crate::recipe::MethodName")]
    pub method: Method,
}

impl Default for SimplifyMapParams {
    fn default() -> Self {
        Self {
            keep: 128,
            max_error: None,
            method: Method::Tight,
        }
    }
}

/// So many candidates are there for each view that is kept. With all of 1024 for 128 kept ones, outlines are no better.
const CANDIDATES_PER_KEPT: u32 = 5;

/// Of fewer candidates there may be too few left to choose from.
const LEAST_CANDIDATES: u32 = 256;

impl SimplifyMapParams {
    /// How many of the captured views need be on the polytope at first; `None` where that is not known.
    #[must_use]
    pub fn candidates(&self) -> Option<u32> {
        let count = CANDIDATES_PER_KEPT.saturating_mul(self.keep);
        (self.max_error.is_none()).then_some(count.max(LEAST_CANDIDATES))
    }
}

/// What simplifying did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimplifyMapReport {
    /// Views left and mean misclassified share over all original views, after each collapse (figure 11); the last is that of
    /// the map after its views were moved.
    pub curve: Vec<(u32, f64)>,
    /// Per collapse: the view that was removed and the neighbour it collapsed onto, as indices into the dense map.
    pub collapses: Vec<(u32, u32)>,
    /// Per view kept: its index in the dense map.
    pub kept: Vec<u32>,
    /// The errors over all original views, and how the map can lose further ones.
    pub order: CollapseOrder,
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

/// Estimated candidates evaluated at a time, likewise.
const CONFIRMED: usize = 4;

/// Views whose error is not known yet that are predicted to estimate what a collapse costs.
const ESTIMATE_PROBES: usize = 3;

/// First evaluations between two looks at the watch.
const CHUNK: usize = 256;

/// Of the views that are kept, photographs stay up to this share: the others close the polytope where nobody took one.
const KEPT_PHOTOGRAPHS: f64 = 0.5;

fn is_photograph(view: &CapturedView) -> bool {
    view.photographed.is_some_and(|share| share > 0.0)
}

/// A collapse as it was when its cost was last evaluated. Of equal costs the smaller view numbers go first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    collapse: Collapse,
    /// Version of the removed view's star at that time.
    version: u32,
    /// Whether its cost is an estimate: not all views around were predicted.
    is_estimate: bool,
}

/// Removes views from `dense` until `params` says to stop or no collapse is possible.
///
/// `masks` are the captured silhouettes of all views, against which predictions are counted. Views that are not on the polytope of `dense` need
/// no contours: they are there to be predicted.
///
/// # Errors
/// When interrupted, or when views and masks do not belong together.
pub fn simplify(
    dense: &SilhouetteMap,
    masks: &[Mask],
    params: &SimplifyMapParams,
    watch: &Watch<'_>,
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
    let mut work = Simplification::new(dense, masks, params);
    let on_polytope = work.polytope.view_count();
    let to_remove = on_polytope.saturating_sub(target as usize);
    watch.start(progress::MAP, to_remove as u64);
    work.predict_others(watch)?;
    work.evaluate_all(watch)?;
    while work.polytope.view_count() > target as usize {
        watch.check()?;
        let Some((cost, collapse)) = work.next_collapse(watch)? else {
            break;
        };
        let total = work.error_sum + cost;
        if params
            .max_error
            .is_some_and(|limit| total / views as f64 > limit)
        {
            break;
        }
        if work.apply(collapse) {
            work.note_collapse(collapse);
        }
        watch.advance(progress::MAP, 1);
    }
    watch.finish(progress::MAP);
    work.refine(watch)?;
    let moved = work.captured_errors();
    if let Some(last) = work.report.curve.last_mut() {
        last.1 = moved.mean;
    }
    let map = work.chosen_map();
    work.report.order = work.order(watch)?;
    Ok((map, work.report))
}

/// The state of a simplification.
struct Simplification<'a> {
    predictor: Predictor<'a>,
    polytope: SimplifiedPolytope,
    /// Per original view: its misclassified share as the polytope is now.
    errors: Vec<f64>,
    error_sum: f64,
    queue: CostQueue<Candidate>,
    /// Errors predicted so far: most triangles around a candidate outlive the collapses beside it.
    known: HashMap<(u32, [u32; 3]), f64>,
    /// Views around a removed one that are predicted to find out what a collapse costs; with fewer than there are, the cost is
    /// an estimate.
    probes: usize,
    /// Whether an estimate is evaluated before a collapse is carried out.
    confirms: bool,
    /// Collapses that an estimate allowed and that were not allowed after all, as the polytope is now: they must not come back.
    refused: Vec<Collapse>,
    /// Views of the polytope that are photographs.
    photographs: usize,
    /// So many of them stay.
    kept_photographs: usize,
    report: SimplifyMapReport,
}

impl<'a> Simplification<'a> {
    fn new(dense: &'a SilhouetteMap, masks: &'a [Mask], params: &SimplifyMapParams) -> Self {
        Self {
            predictor: Predictor::new(dense, masks, params.method),
            polytope: SimplifiedPolytope::new(dense, Rule::Readable),
            errors: vec![0.0; masks.len()],
            error_sum: 0.0,
            queue: CostQueue::default(),
            known: HashMap::new(),
            probes: ESTIMATE_PROBES,
            confirms: true,
            refused: Vec::new(),
            photographs: dense.views.iter().filter(|v| is_photograph(v)).count(),
            kept_photographs: match params.max_error {
                // Whoever asks for an error gets the fewest views that have it.
                Some(_) => 0,
                None => (KEPT_PHOTOGRAPHS * f64::from(params.keep)) as usize,
            },
            report: SimplifyMapReport::default(),
        }
    }

    fn photographs_left(&self) -> usize {
        let views = &self.predictor.map().views;
        let kept = self.polytope.kept();
        kept.iter()
            .filter(|&&v| is_photograph(&views[v as usize]))
            .count()
    }

    /// Whether a view must stay: a photograph's silhouette is what was seen. Its neighbours predict it badly or well as its mask is noisy
    /// or not, which says nothing about how much it is worth.
    fn must_stay(&self, view: u32) -> bool {
        self.photographs <= self.kept_photographs
            && is_photograph(&self.predictor.map().views[view as usize])
    }

    /// Predicts the views that are not on the polytope.
    fn predict_others(&mut self, watch: &Watch<'_>) -> Result<(), Interrupted> {
        let map = self.predictor.map();
        let others = self.polytope.gone();
        let predictor = &self.predictor;
        let predictions: Vec<Option<Prediction>> = (others.par_iter())
            .map_init(
                || predictor.scratch(),
                |scratch, &view| {
                    watch.check()?;
                    let predicted = predictor.facing(view, &map.triangles).map(|facing| {
                        // What cannot be predicted is all wrong.
                        let error = predictor.error(&facing, scratch).unwrap_or(1.0);
                        facing.predicted(error)
                    });
                    Ok(predicted)
                },
            )
            .collect::<Result<_, Interrupted>>()?;
        for p in predictions.iter().flatten() {
            self.polytope.place(p.view, p.triangle as u32);
            self.errors[p.view as usize] = p.error;
            self.error_sum += p.error;
            self.known.insert((p.view, p.views), p.error);
        }
        self.report.predictions += predictions.len() as u64;
        Ok(())
    }

    /// Puts every possible collapse into the queue.
    fn evaluate_all(&mut self, watch: &Watch<'_>) -> Result<(), Interrupted> {
        let collapses: Vec<Collapse> = self.polytope.collapses().collect();
        for chunk in collapses.chunks(CHUNK) {
            watch.check()?;
            self.evaluate(chunk, self.probes);
        }
        Ok(())
    }

    /// Evaluates collapses and puts those that are allowed into the queue.
    fn evaluate(&mut self, collapses: &[Collapse], probes: usize) {
        let evaluated: Vec<Option<(f64, Candidate, Vec<Prediction>)>> = collapses
            .par_iter()
            .filter(|collapse| {
                !self.refused.contains(collapse) && !self.must_stay(collapse.removed)
            })
            .map_init(
                || self.predictor.scratch(),
                |scratch, &collapse| self.probe(collapse, probes, scratch),
            )
            .collect();
        for (cost, candidate, predictions) in evaluated.into_iter().flatten() {
            for p in predictions {
                if self.known.insert((p.view, p.views), p.error).is_none() {
                    self.report.predictions += 1;
                }
            }
            self.queue.push(cost, candidate);
        }
    }

    /// A collapse with its cost, and the predictions that say so; `None` when it is not allowed.
    fn probe(
        &self,
        collapse: Collapse,
        probes: usize,
        scratch: &mut Lent<'_>,
    ) -> Option<(f64, Candidate, Vec<Prediction>)> {
        let triangles = self.polytope.triangles_after(collapse)?;
        let mut views = self.polytope.views_around(collapse.removed);
        views.retain(|&v| v != collapse.removed);
        // The removed view itself counts by itself: before, it is right.
        let own = (self.predictor).predict(collapse.removed, &triangles, &self.known, scratch)?;
        let mut cost = own.error;
        let mut predictions = vec![own];
        let mut unknown = Vec::new();
        for view in views {
            let facing = self.predictor.facing(view, &triangles)?;
            match self.known.get(&facing.key()) {
                Some(error) => cost += error - self.errors[view as usize],
                None => unknown.push(view),
            }
        }
        let stride = unknown.len().div_ceil(probes).max(1);
        let probed = unknown.iter().step_by(stride);
        let scale = unknown.len() as f64 / probed.len().max(1) as f64;
        for &view in probed {
            let p = (self.predictor).predict(view, &triangles, &self.known, scratch)?;
            cost += scale * (p.error - self.errors[view as usize]);
            predictions.push(p);
        }
        let candidate = Candidate {
            collapse,
            version: self.polytope.version(collapse.removed),
            is_estimate: stride > 1,
        };
        Some((cost, candidate, predictions))
    }

    /// The errors that `views` around a collapse would have after it; `None` when it is not allowed.
    fn predict(
        &self,
        collapse: Collapse,
        views: &[u32],
        scratch: &mut Lent<'_>,
    ) -> Option<Vec<Prediction>> {
        let triangles = self.polytope.triangles_after(collapse)?;
        let known = &self.known;
        (views.iter())
            .map(|&view| self.predictor.predict(view, &triangles, known, scratch))
            .collect()
    }

    /// Takes the cheapest collapse, and what it costs, off the queue. Those whose neighbourhood changed are estimated anew, and those whose
    /// cost is an estimate are evaluated, as they come up.
    fn cheapest_collapse(&mut self) -> Option<(f64, Collapse)> {
        loop {
            let (mut stale, mut estimated) = (Vec::new(), Vec::new());
            while stale.len() < BATCH && estimated.len() < CONFIRMED {
                let Some((cost, &top)) = self.queue.peek() else {
                    break;
                };
                let is_first = stale.is_empty() && estimated.is_empty();
                if !self.polytope.is_edge(top.collapse) || self.must_stay(top.collapse.removed) {
                    self.queue.pop();
                } else if self.polytope.version(top.collapse.removed) != top.version {
                    self.queue.pop();
                    stale.push(top.collapse);
                } else if top.is_estimate && self.confirms {
                    self.queue.pop();
                    estimated.push(top.collapse);
                } else if is_first {
                    self.queue.pop();
                    if self.polytope.triangles_after(top.collapse).is_some() {
                        return Some((cost, top.collapse));
                    }
                } else {
                    break;
                }
            }
            if stale.is_empty() && estimated.is_empty() {
                return None;
            }
            self.evaluate(&stale, self.probes);
            self.learn(&estimated);
            self.evaluate(&estimated, usize::MAX);
        }
    }

    /// Predicts all that decides what collapses cost.
    fn learn(&mut self, collapses: &[Collapse]) {
        let mut unknown: Vec<Facing> = Vec::new();
        for &collapse in collapses {
            let triangles = self.polytope.triangles_after(collapse).unwrap_or_default();
            let views = self.polytope.views_around(collapse.removed).into_iter();
            let facings = views.filter_map(|view| self.predictor.facing(view, &triangles));
            unknown.extend(facings.filter(|facing| !self.known.contains_key(&facing.key())));
        }
        unknown.sort_unstable_by_key(Facing::key);
        unknown.dedup_by_key(|facing| facing.key());
        let predictor = &self.predictor;
        let errors: Vec<Option<f64>> = (unknown.par_iter())
            .map_init(
                || predictor.scratch(),
                |scratch, facing| predictor.error(facing, scratch),
            )
            .collect();
        for (facing, error) in unknown.iter().zip(errors) {
            if let Some(error) = error {
                self.known.insert(facing.key(), error);
                self.report.predictions += 1;
            }
        }
    }

    /// The cheapest collapse; before there is none, those that were not allowed once are tried again.
    fn next_collapse(&mut self, watch: &Watch<'_>) -> Result<Option<(f64, Collapse)>, Interrupted> {
        if let Some(cheapest) = self.cheapest_collapse() {
            return Ok(Some(cheapest));
        }
        self.evaluate_all(watch)?;
        Ok(self.cheapest_collapse())
    }

    /// Carries a collapse out and enters the edges it made; false when it is not allowed.
    fn apply(&mut self, collapse: Collapse) -> bool {
        let views = self.polytope.views_around(collapse.removed);
        let work = &*self;
        let predicted: Option<Vec<Vec<Prediction>>> = views
            .par_chunks(8)
            .map_init(
                || work.predictor.scratch(),
                |scratch, views| work.predict(collapse, views, scratch),
            )
            .collect();
        let Some(predictions) = predicted else {
            self.refused.push(collapse);
            return false;
        };
        self.refused.clear();
        let predictions = predictions.concat();
        for p in &predictions {
            self.error_sum += p.error - self.errors[p.view as usize];
            self.errors[p.view as usize] = p.error;
        }
        let fresh = self
            .polytope
            .apply(collapse, predictions.iter().map(Prediction::facing));
        let removed = &self.predictor.map().views[collapse.removed as usize];
        self.photographs -= usize::from(is_photograph(removed));
        self.evaluate(&fresh, self.probes);
        true
    }

    fn note_collapse(&mut self, collapse: Collapse) {
        self.report
            .collapses
            .push((collapse.removed, collapse.onto));
        self.report.curve.push((
            self.polytope.view_count() as u32,
            self.captured_errors().mean,
        ));
    }

    fn captured_errors(&self) -> CapturedErrors {
        CapturedErrors {
            mean: self.error_sum.max(0.0) / self.errors.len().max(1) as f64,
            max: self.errors.iter().copied().fold(0.0, f64::max),
        }
    }

    /// The map of the views that are left.
    fn chosen_map(&mut self) -> SilhouetteMap {
        let (kept, triangles) = self.polytope.compact();
        let map = self.predictor.map().of_views(&kept, triangles);
        self.report.kept = kept;
        map
    }
}
