//! Predicting a captured silhouette from three other views, and counting misclassified pixels.

use std::collections::HashMap;
use std::sync::Mutex;

use silmap_geometry::Mask;
use silmap_geometry::polygon::fill_non_zero;
use silmap_map::{
    FlatLoops, Location, Method, SeenLoops, SilhouetteMap, TriangleInterpolator,
    simplified_polytope,
};

/// What one view would look like after a collapse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prediction {
    /// The original view.
    pub(super) view: u32,
    /// Which of the triangles given faces its eye.
    pub(super) triangle: usize,
    /// That triangle, its smallest view first.
    pub(super) views: [u32; 3],
    /// Misclassified pixels over pixels inside the captured silhouette.
    pub(super) error: f64,
}

impl Prediction {
    /// Where the polytope is to look for the view.
    pub(super) fn facing(&self) -> simplified_polytope::Facing {
        simplified_polytope::Facing {
            view: self.view,
            triangle: self.triangle,
        }
    }
}

/// The triangle that faces the eye of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    view: u32,
    /// Which of the triangles given.
    triangle: usize,
    /// Its corners, the smallest view first.
    ids: [u32; 3],
    /// Their weights at the eye.
    weights: [f64; 3],
}

impl Facing {
    /// What a prediction depends on.
    pub(super) fn key(&self) -> (u32, [u32; 3]) {
        (self.view, self.ids)
    }

    /// The prediction with this error.
    pub(super) fn predicted(&self, error: f64) -> Prediction {
        Prediction {
            view: self.view,
            triangle: self.triangle,
            views: self.ids,
            error,
        }
    }
}

/// Buffers of one thread, with the pairs of views that it has prepared.
#[derive(Debug)]
pub(super) struct PredictScratch {
    interpolator: TriangleInterpolator,
    flat: FlatLoops,
    predicted: Mask,
    layer: Mask,
}

/// Buffers that a thread has for a while; others have them after it.
#[derive(Debug)]
pub(super) struct Lent<'p> {
    scratch: Option<PredictScratch>,
    pool: &'p Mutex<Vec<PredictScratch>>,
}

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        if let Ok(mut pool) = self.pool.lock() {
            pool.extend(self.scratch.take());
        }
    }
}

/// The original views and masks.
#[derive(Debug)]
pub(super) struct Predictor<'a> {
    map: &'a SilhouetteMap,
    masks: &'a [Mask],
    method: Method,
    /// Buffers that no thread has.
    pool: Mutex<Vec<PredictScratch>>,
}

impl<'a> Predictor<'a> {
    /// By `method`, or by the best one that does without depths where the map has none and the method needs them.
    pub(super) fn new(map: &'a SilhouetteMap, masks: &'a [Mask], method: Method) -> Self {
        let is_there = map.has_depth() || !method.needs_depth();
        let method = if is_there {
            method
        } else {
            Method::best_for(map)
        };
        Self {
            map,
            masks,
            method,
            pool: Mutex::default(),
        }
    }

    pub(super) fn map(&self) -> &'a SilhouetteMap {
        self.map
    }

    /// Buffers for one thread.
    pub(super) fn scratch(&self) -> Lent<'_> {
        let kept = self.pool.lock().ok().and_then(|mut pool| pool.pop());
        Lent {
            scratch: kept,
            pool: &self.pool,
        }
    }

    fn fresh_scratch(&self) -> PredictScratch {
        let side = self.map.resolution_px;
        PredictScratch {
            interpolator: TriangleInterpolator::default(),
            flat: FlatLoops::default(),
            predicted: Mask::new(side, side),
            layer: Mask::new(side, side),
        }
    }

    /// Predicts `view` at its own eye from whichever of `triangles` faces it, or looks the answer up in `known`; `None` when
    /// the views cannot be rectified.
    pub(super) fn predict(
        &self,
        view: u32,
        triangles: &[[u32; 3]],
        known: &HashMap<(u32, [u32; 3]), f64>,
        scratch: &mut Lent<'_>,
    ) -> Option<Prediction> {
        let facing = self.facing(view, triangles)?;
        let error = match known.get(&facing.key()) {
            Some(&error) => error,
            None => self.error(&facing, scratch)?,
        };
        Some(facing.predicted(error))
    }

    /// The misclassified share of a view that is interpolated; `None` when the views cannot be rectified.
    pub(super) fn error(&self, facing: &Facing, scratch: &mut Lent<'_>) -> Option<f64> {
        let scratch = (scratch.scratch).get_or_insert_with(|| self.fresh_scratch());
        let Facing {
            view,
            triangle,
            ids,
            weights,
        } = *facing;
        let point = (0..3).map(|k| self.map.eye(ids[k]) * weights[k]).sum();
        let location = Location {
            triangle: triangle as u32,
            barycentric: weights,
            point,
        };
        let camera = &self.map.views[view as usize].camera;
        let layers = scratch
            .interpolator
            .interpolate_regions(self.map, ids, &location, camera, self.method.into())
            .ok()?;
        fill_layers(
            layers,
            &mut scratch.flat,
            &mut scratch.predicted,
            &mut scratch.layer,
        );
        let truth = &self.masks[view as usize];
        let wrong = scratch.predicted.count_different(truth);
        Some(share(wrong, truth.count()))
    }

    /// The triangle whose cone from the center holds a view's eye best.
    pub(super) fn facing(&self, view: u32, triangles: &[[u32; 3]]) -> Option<Facing> {
        let direction = self.map.eye(view) - self.map.center;
        let mut best: Option<(usize, [f64; 3], f64)> = None;
        for (t, ids) in triangles.iter().enumerate() {
            let [a, b, c] = ids.map(|v| self.map.eye(v) - self.map.center);
            let signs = [
                direction.dot(b.cross(c)),
                direction.dot(c.cross(a)),
                direction.dot(a.cross(b)),
            ];
            let sum: f64 = signs.iter().map(|s| s.max(0.0)).sum();
            let least = signs.iter().copied().fold(f64::INFINITY, f64::min) / sum;
            if sum > 0.0 && best.is_none_or(|(_, _, most)| least > most) {
                best = Some((t, signs.map(|s| s.max(0.0) / sum), least));
            }
        }
        let (triangle, mut weights, _) = best?;
        let mut ids = triangles[triangle];
        let first = (0..3).min_by_key(|&k| ids[k]).unwrap_or(0);
        ids.rotate_left(first);
        weights.rotate_left(first);
        Some(Facing {
            view,
            triangle,
            ids,
            weights,
        })
    }
}

/// Fills what all regions cover.
fn fill_layers(layers: &[SeenLoops], flat: &mut FlatLoops, filled: &mut Mask, scratch: &mut Mask) {
    layers[0].flatten_to(flat);
    fill_non_zero(flat.iter(), filled);
    for layer in &layers[1..] {
        layer.flatten_to(flat);
        fill_non_zero(flat.iter(), scratch);
        filled.intersect(scratch);
    }
}

/// A count as a share of another; an empty whole counts as one pixel.
pub(crate) fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}
