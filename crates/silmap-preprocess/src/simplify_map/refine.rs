//! Refining the kept views: edge flips, and exchange with removed views nearby.
//!
//! Source: beyond the paper. A greedy sequence of collapses never takes a choice back. Once it has ended, an edge between two
//! triangles may be turned, and a kept view may give its place to a removed one whose eye its triangles face; both are done
//! where they lower the sum of errors over all original views.

use rayon::prelude::*;

use super::Simplification;
use super::predict::Prediction;
use crate::progress;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_map::simplified_polytope::Patch;

/// Most rounds over all edges and views.
const ROUNDS: usize = 4;
/// A round that lowers the error by a smaller share is the last.
const LEAST_GAIN: f64 = 0.005;
/// Removed views that are tried in the place of a kept one: those nearest to the middle of its triangles.
const REPLACEMENTS: usize = 8;
/// Of the error that is left to be predicted, a change that is any good takes away no more than this share: one that would have to is given
/// up before all its views are predicted.
const MOST_GAIN: f64 = 0.1;
/// Changes that gain less than this, as a share of one view's inside, are rounding.
const LEAST_COST: f64 = 1e-9;

/// A patch and what it would change.
struct Tried {
    patch: Patch,
    /// Of all its views, or of the first when these are already worse than all were.
    predictions: Vec<Prediction>,
    /// Infinite when no more is known than that nothing is gained.
    cost: f64,
}

/// An edge that was turned.
#[derive(Clone, Copy, Debug)]
pub(super) struct TurnedEdge {
    /// Its ends before.
    pub(super) edge: [u32; 2],
    /// Its ends now.
    pub(super) now: [u32; 2],
}

impl Simplification<'_> {
    /// Lowers the error without changing the number of views.
    pub(super) fn refine(&mut self, watch: &Watch<'_>) -> Result<(), Interrupted> {
        let kept = self.polytope.kept();
        watch.start(progress::REFINE, (ROUNDS * kept.len()) as u64);
        for _ in 0..ROUNDS {
            let before = self.error_sum;
            watch.check()?;
            self.turn_edges(&self.polytope.edges());
            for view in self.polytope.kept() {
                watch.check()?;
                if !self.must_stay(view) {
                    self.replace(view);
                }
                watch.advance(progress::REFINE, 1);
            }
            if self.error_sum > before * (1.0 - LEAST_GAIN) {
                break;
            }
        }
        self.turn_edges(&self.polytope.edges());
        watch.finish(progress::REFINE);
        Ok(())
    }

    /// Turns those of some edges that are better turned, the best first; says which, in the order in which it was done.
    pub(super) fn turn_edges(&mut self, edges: &[[u32; 2]]) -> Vec<TurnedEdge> {
        let mut turned = Vec::new();
        let mut gains: Vec<(f64, [u32; 2])> = self
            .try_all(edges, |work, &edge| work.polytope.flip(edge))
            .into_iter()
            .zip(edges)
            .filter_map(|(tried, &edge)| Some((tried?.cost, edge)))
            .filter(|(cost, _)| *cost < -LEAST_COST)
            .collect();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, edge) in gains {
            // An edge turned before may have changed what this one gains.
            let tried = self.try_all(&[edge], |work, &edge| work.polytope.flip(edge));
            if let Some(tried) = tried.into_iter().flatten().next()
                && tried.cost < -LEAST_COST
            {
                self.apply_patch(&tried);
                let [_, to, from] = tried.patch.new[0];
                turned.push(TurnedEdge {
                    edge,
                    now: [from, to],
                });
            }
        }
        turned
    }

    /// Gives the place of `view` to the removed view beside it that lowers the error most.
    fn replace(&mut self, view: u32) {
        let others = self.polytope.views_beside(view, REPLACEMENTS);
        let tried = self.try_all(&others, |work, &other| {
            work.polytope.replacement(view, other)
        });
        let best = (tried.into_iter().flatten()).min_by(|a, b| a.cost.total_cmp(&b.cost));
        if let Some(best) = best.filter(|tried| tried.cost < -LEAST_COST) {
            self.apply_patch(&best);
        }
    }

    /// Evaluates a patch for each item; `None` where it is not allowed.
    fn try_all<T: Sync>(
        &mut self,
        items: &[T],
        patch: impl Fn(&Self, &T) -> Option<Patch> + Sync,
    ) -> Vec<Option<Tried>> {
        let work = &*self;
        let tried: Vec<Option<Tried>> = items
            .par_iter()
            .map_init(
                || work.predictor.scratch(),
                |scratch, item| {
                    let patch = patch(work, item)?;
                    let error = |view: u32| work.errors[view as usize];
                    let views = patch.views.iter().copied();
                    let before: f64 = views.clone().chain(patch.kept).map(error).sum();
                    let mut left: f64 = views.clone().map(error).sum();
                    let mut predictions = Vec::with_capacity(patch.views.len());
                    let mut after = 0.0;
                    for view in views {
                        let p = (work.predictor).predict(view, &patch.new, &work.known, scratch)?;
                        after += p.error;
                        left -= error(view);
                        predictions.push(p);
                        if after + (1.0 - MOST_GAIN) * left > before {
                            break;
                        }
                    }
                    let is_whole = predictions.len() == patch.views.len();
                    let cost = if is_whole {
                        after - before
                    } else {
                        f64::INFINITY
                    };
                    Some(Tried {
                        patch,
                        predictions,
                        cost,
                    })
                },
            )
            .collect();
        for p in tried.iter().flatten().flat_map(|t| &t.predictions) {
            if self.known.insert((p.view, p.views), p.error).is_none() {
                self.report.predictions += 1;
            }
        }
        tried
    }

    fn apply_patch(&mut self, tried: &Tried) {
        for p in &tried.predictions {
            self.error_sum += p.error - self.errors[p.view as usize];
            self.errors[p.view as usize] = p.error;
        }
        if let Some(kept) = tried.patch.kept {
            self.error_sum -= self.errors[kept as usize];
            self.errors[kept as usize] = 0.0;
        }
        self.polytope.apply_patch(
            &tried.patch,
            tried.predictions.iter().map(Prediction::facing),
        );
        if tried.patch.kept.is_some() {
            self.photographs = self.photographs_left();
        }
    }
}
