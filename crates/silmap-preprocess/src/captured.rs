//! The silhouettes that a map is made of: drawn of a model from evenly spread viewpoints, or seen by photographs and drawn where there is none.
//!
//! Source: Silhouette Mapping, sections 3 and 4.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{Bounds, Camera, ClosedMesh, CoverageRule, Loop, Mask, SeenSilhouette};
use silmap_map::simplified_polytope::is_readable;
use silmap_map::{CapturedView, SilhouetteMap, ViewContour};

use crate::build_error::BuildError;
use crate::build_params::BuildParams;
use crate::capture::{capture, deep_contours, spiral_directions, view_sphere};
use crate::dense_map::{self, DenseMapParams, triangulate_view_sphere};
use crate::part_outlines::PartOutlines;
use crate::parts::{Part, parts};
use crate::progress::{self, Unused};
use crate::seen::{Viewpoints, covered, outline_in, reaching, viewpoints};
use crate::simplify_contour::{SimplifyContourParams, simplify_contours};

/// The silhouettes of a model from many viewpoints.
#[derive(Clone, Debug, Default)]
pub struct Captured {
    /// Where they are seen from.
    pub cameras: Vec<Camera>,
    /// The pixels that each has inside.
    pub masks: Vec<Mask>,
    /// The outlines of the first views, which photographs show, and what share of them they do. Those of all others are drawn.
    pub seen: Vec<(Vec<Loop>, f64)>,
    /// The model's own silhouettes in the cameras of the photographs, where they have outlines.
    pub(crate) drawn: Vec<Option<Mask>>,
    /// Which views have outlines: all of them where it is empty.
    needed: Vec<bool>,
    /// Which views may be kept in a map, and have outlines for it: all of them where it is empty. At the others it is only found out how well
    /// those predict them.
    candidates: Vec<bool>,
    /// Photographs' silhouettes that are none of the views, by their numbers.
    pub unused: Vec<(usize, Unused)>,
}

impl Captured {
    /// The pixels that the model covers from `views` evenly spread views; all else is as `params` say.
    ///
    /// # Errors
    /// When interrupted, the view sphere is too small, or a view cannot be drawn.
    pub fn evenly(
        model: &ClosedMesh,
        params: &BuildParams,
        views: u32,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        let bounds = model.bounds();
        let distance = params.view_radius_rel * bounds.radius;
        let cameras = view_sphere(bounds, distance, views, params.resolution_px)?;
        let masks = capture(model, &cameras, &params.capture, watch)?;
        Ok(Self {
            cameras,
            masks,
            ..Self::default()
        })
    }

    /// The silhouettes that photographs show, and those that the model has wherever no photograph is near; evenly spread ones where no
    /// photograph can be used. Only cameras that are needed have outlines: the others are there for the polytope.
    ///
    /// # Errors
    /// As [`Captured::evenly`].
    pub(crate) fn around_photographs(
        model: &ClosedMesh,
        silhouettes: &[SeenSilhouette],
        params: &BuildParams,
        is_needed: &dyn Fn(&Camera) -> bool,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        let Viewpoints {
            seen,
            cameras,
            unused,
        } = viewpoints(
            silhouettes,
            model.bounds(),
            (params.views, params.resolution_px),
        )?;
        if seen.is_empty() {
            let evenly = Self::evenly(model, params, params.views, watch)?;
            return Ok(Self { unused, ..evenly });
        }
        let needed: Vec<bool> = cameras.iter().map(is_needed).collect();
        let outline = |(camera, &k): (&Camera, &usize)| {
            let silhouette = &silhouettes[k];
            let loops = outline_in(silhouette, camera, params.tolerance_px);
            (loops, silhouette.photographed)
        };
        let seen: Vec<_> = cameras.par_iter().zip(&seen).map(outline).collect();
        let wanted: Vec<Camera> = (cameras.iter().zip(&needed))
            .filter(|(_, needed)| **needed)
            .map(|(camera, _)| *camera)
            .collect();
        let mut drawn = capture(model, &wanted, &params.capture, watch)?.into_iter();
        let mut drawn: Vec<Option<Mask>> = needed
            .iter()
            .map(|needed| needed.then(|| drawn.next()).flatten())
            .collect();
        let of_others = drawn.split_off(seen.len());
        let own = (cameras.iter().zip(&seen)).map(|(camera, (loops, _))| covered(loops, camera));
        let others = (cameras.iter().skip(seen.len()).zip(of_others)).map(|(camera, drawn)| {
            let empty = || Mask::new(camera.width_px, camera.height_px);
            drawn.unwrap_or_else(empty)
        });
        Ok(Self {
            masks: own.chain(others).collect(),
            cameras,
            seen,
            needed,
            drawn,
            unused,
            candidates: Vec::new(),
        })
    }

    /// Only about so many views may be kept, evenly spread ones; all of them where these make no polytope from which all of a model with these
    /// bounds can be looked at.
    ///
    /// # Errors
    /// When interrupted.
    pub(crate) fn with_candidates(
        mut self,
        count: u32,
        bounds: &Bounds,
        watch: &Watch<'_>,
    ) -> Result<Self, Interrupted> {
        if count as usize >= self.cameras.len() {
            return Ok(self);
        }
        let directions: Vec<DVec3> = (self.cameras.iter())
            .map(|camera| (camera.eye - bounds.center).normalize_or_zero())
            .collect();
        let mut is_candidate = vec![false; directions.len()];
        for wanted in spiral_directions(count) {
            watch.check()?;
            let nearness = |&v: &usize| directions[v].dot(wanted);
            let free = (0..directions.len()).filter(|&v| !is_candidate[v]);
            if let Some(nearest) = free.max_by(|a, b| nearness(a).total_cmp(&nearness(b))) {
                is_candidate[nearest] = true;
            }
        }
        if self.is_polytope(&is_candidate, bounds) {
            self.candidates = is_candidate;
        }
        Ok(self)
    }

    /// Some of the views: all photographs', and of the others those that are marked.
    pub(crate) fn subset(&self, is_kept: &[bool]) -> Self {
        fn kept<T: Clone>(values: &[T], is_kept: &[bool]) -> Vec<T> {
            let marked = values.iter().zip(is_kept).filter(|(_, kept)| **kept);
            marked.map(|(value, _)| value.clone()).collect()
        }
        Self {
            cameras: kept(&self.cameras, is_kept),
            masks: kept(&self.masks, is_kept),
            needed: kept(&self.needed, is_kept),
            candidates: kept(&self.candidates, is_kept),
            seen: self.seen.clone(),
            drawn: self.drawn.clone(),
            unused: self.unused.clone(),
        }
    }

    /// Whether the views that are marked make a polytope from which all of a model with these bounds can be looked at.
    pub(crate) fn is_polytope(&self, is_kept: &[bool], bounds: &Bounds) -> bool {
        let kept = self.cameras.iter().zip(is_kept).filter(|(_, kept)| **kept);
        let eyes: Vec<DVec3> = kept.map(|(camera, _)| camera.eye).collect();
        let radius = reaching(bounds, self.cameras.first().map_or(0, |c| c.width_px));
        let arm = |v: u32| eyes[v as usize] - bounds.center;
        triangulate_view_sphere(bounds.center, &eyes)
            .is_ok_and(|t| t.iter().all(|t| is_readable(t.map(arm), radius)))
    }

    /// Whether a view has an outline.
    pub(crate) fn has_outline(&self, view: usize) -> bool {
        self.needed.get(view) != Some(&false) && self.is_candidate(view)
    }

    fn is_candidate(&self, view: usize) -> bool {
        self.candidates.get(view) != Some(&false)
    }

    /// The map of all views, on the polytope that connects those that may be kept. `tree` is over the model's faces.
    ///
    /// # Errors
    /// When interrupted, nothing of the model is seen from a view, or the views do not make a polytope.
    pub fn map(
        &self,
        model: &ClosedMesh,
        tree: &Bvh,
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<SilhouetteMap, BuildError> {
        // What photographs show is not cut.
        let parts = match self.seen.is_empty() {
            true => parts(model, &params.parts, watch)?,
            false => Vec::new(),
        };
        self.map_by_parts(model, (tree, &parts), params, watch)
    }

    /// As [`Captured::map`], with the model's parts, where they are known already.
    ///
    /// # Errors
    /// As [`Captured::map`].
    pub fn map_by_parts(
        &self,
        model: &ClosedMesh,
        shape: (&Bvh, &[Part]),
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<SilhouetteMap, BuildError> {
        let views = self.views(model, shape, params, watch)?;
        let corners: Vec<u32> = (0..views.len() as u32)
            .filter(|&v| self.is_candidate(v as usize))
            .collect();
        Ok(dense_map::build_on(
            views,
            &corners,
            &map_params(model, params),
        )?)
    }

    /// Traces and simplifies the outline of every mask, and finds how deep the contour generator lies at its vertices.
    ///
    /// # Errors
    /// When interrupted, or nothing of the model is seen from a view.
    fn views(
        &self,
        model: &ClosedMesh,
        (tree, parts): (&Bvh, &[Part]),
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<Vec<CapturedView>, BuildError> {
        let simplification = SimplifyContourParams {
            tolerance_px: params.tolerance_px,
            // What is captured conservatively must stay so.
            outward_only: params.capture.coverage == CoverageRule::Any,
        };
        let is_of_photographs = !self.seen.is_empty();
        let of_parts = (!is_of_photographs).then(|| {
            let seen = (self.cameras.as_slice(), self.masks.as_slice());
            PartOutlines::new(model, parts, seen, (params, simplification))
        });
        let n_outlines = (0..self.cameras.len()).filter(|&v| self.has_outline(v));
        watch.start(progress::CONTOURS, n_outlines.count() as u64);
        let views = (self.cameras.par_iter().zip(&self.masks).enumerate())
            .map(|(view, (&camera, mask))| {
                watch.check()?;
                if !self.has_outline(view) {
                    if !self.is_candidate(view) && mask.count() == 0 {
                        return Err(BuildError::NothingSeen { view: view as u32 });
                    }
                    return Ok(CapturedView {
                        camera,
                        contours: Vec::new(),
                        photographed: is_of_photographs.then_some(0.0),
                    });
                }
                if let Some(of_parts) = &of_parts {
                    let contours = of_parts.contours(view, &camera)?;
                    if contours.is_empty() {
                        return Err(BuildError::NothingSeen { view: view as u32 });
                    }
                    watch.advance(progress::CONTOURS, 1);
                    return Ok(CapturedView {
                        camera,
                        contours,
                        photographed: None,
                    });
                }
                let (loops, photographed) = match self.seen.get(view) {
                    Some((loops, share)) => (loops.clone(), *share),
                    None => {
                        let loops = simplify_contours(&trace_contours(mask), &simplification);
                        (loops, 0.0)
                    }
                };
                if loops.is_empty() {
                    return Err(BuildError::NothingSeen { view: view as u32 });
                }
                let outward_only = simplification.outward_only;
                let (loops, depths) =
                    deep_contours(tree, model.bounds(), &camera, &loops, outward_only);
                let contours = (loops.into_iter().zip(depths))
                    .map(|(points, depths)| ViewContour {
                        points,
                        depths,
                        ..ViewContour::default()
                    })
                    .collect();
                watch.advance(progress::CONTOURS, 1);
                Ok(CapturedView {
                    camera,
                    contours,
                    photographed: is_of_photographs.then_some(photographed),
                })
            })
            .collect::<Result<_, _>>()?;
        watch.finish(progress::CONTOURS);
        Ok(views)
    }
}

/// What all views of a model's map have in common.
fn map_params(model: &ClosedMesh, params: &BuildParams) -> DenseMapParams {
    DenseMapParams {
        center: model.bounds().center,
        radius: model.bounds().radius,
        resolution_px: params.resolution_px,
        tolerance_px: params.tolerance_px,
        coverage: params.capture.coverage,
    }
}

#[cfg(test)]
mod tests {
    use silmap_models as models;

    use super::*;
    use crate::parts::PartParams;

    #[test]
    fn candidates_alone_have_outlines_and_are_spread_evenly() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let params = BuildParams {
            views: 300,
            resolution_px: 48,
            parts: PartParams::whole(),
            ..BuildParams::default()
        };
        let watch = Watch::silent();
        let all = || Captured::evenly(&model, &params, params.views, &watch).unwrap();
        let with_candidates = |count| {
            all()
                .with_candidates(count, model.bounds(), &watch)
                .unwrap()
        };
        let captured = with_candidates(100);
        let tree = Bvh::new(model.mesh());
        let map = captured.map(&model, &tree, &params, &watch).unwrap();
        assert_eq!((map.views.len(), map.triangles.len()), (300, 2 * 100 - 4));
        let mut corners: Vec<u32> = map.triangles.concat();
        corners.sort_unstable();
        corners.dedup();
        for (v, view) in (0_u32..).zip(&map.views) {
            let is_corner = corners.binary_search(&v).is_ok();
            assert_eq!(is_corner, !view.contours.is_empty(), "view {v}");
            // No view is farther from a candidate than about the distance between these.
            let nearest = corners.iter().map(|&c| map.eye(c).distance(map.eye(v)));
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.4 * view.camera.eye.length());
        }
        let whole = with_candidates(300);
        assert!((0..300).all(|v| whole.has_outline(v)));
    }
}
