//! Predicting a captured silhouette from three other views, and counting misclassified pixels.

use std::collections::HashMap;

use glam::DVec3;
use silmap_geometry::Mask;
use silmap_geometry::polygon::fill_non_zero;
use silmap_map::{FlatLoops, Location, Method, SeenLoops, SilhouetteMap, TriangleInterpolator};

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

/// Buffers of one thread.
#[derive(Debug)]
pub(super) struct PredictScratch {
    interpolator: TriangleInterpolator,
    flat: FlatLoops,
    predicted: Mask,
    layer: Mask,
}

/// The original views and masks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predictor<'a> {
    map: &'a SilhouetteMap,
    masks: &'a [Mask],
    method: Method,
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
        Self { map, masks, method }
    }

    pub(super) fn map(&self) -> &'a SilhouetteMap {
        self.map
    }

    pub(super) fn scratch(&self) -> PredictScratch {
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
        scratch: &mut PredictScratch,
    ) -> Option<Prediction> {
        let eye = self.map.eye(view);
        let (triangle, weights) = self.facing(eye, triangles)?;
        let mut ids = triangles[triangle];
        let mut weights = weights;
        let first = (0..3).min_by_key(|&k| ids[k]).unwrap_or(0);
        ids.rotate_left(first);
        weights.rotate_left(first);
        if let Some(&error) = known.get(&(view, ids)) {
            return Some(Prediction {
                view,
                triangle,
                views: ids,
                error,
            });
        }
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
        Some(Prediction {
            view,
            triangle,
            views: ids,
            error: share(wrong, truth.count()),
        })
    }

    /// The triangle whose cone from the center holds `eye` best, and the weights of its corners.
    fn facing(&self, eye: DVec3, triangles: &[[u32; 3]]) -> Option<(usize, [f64; 3])> {
        let direction = eye - self.map.center;
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
        best.map(|(t, weights, _)| (t, weights))
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
