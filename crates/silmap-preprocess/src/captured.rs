//! The silhouettes that a map is made of: drawn of a model from evenly spread viewpoints, or seen by photographs and drawn where there is none.
//!
//! Source: Silhouette Mapping, sections 3 and 4.

use rayon::prelude::*;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::watch::Watch;
use silmap_geometry::{Camera, ClosedMesh, CoverageRule, Loop, Mask, SeenSilhouette};
use silmap_map::{CapturedView, SilhouetteMap, ViewContour};

use crate::build_error::BuildError;
use crate::build_params::BuildParams;
use crate::capture::{capture, deep_contours, view_sphere};
use crate::dense_map::{self, DenseMapParams};
use crate::progress::{self, Unused};
use crate::seen::{Viewpoints, covered, outline_in, viewpoints};
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
    /// Which views have outlines: all of them where it is empty.
    needed: Vec<bool>,
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

    /// The silhouettes that photographs show, and those that the model has where there is no photograph; of a model that nobody
    /// photographed, evenly spread ones.
    ///
    /// # Errors
    /// As [`Captured::evenly`].
    pub fn all_around(
        model: &ClosedMesh,
        silhouettes: &[SeenSilhouette],
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        if silhouettes.is_empty() {
            return Self::evenly(model, params, params.views, watch);
        }
        Self::where_needed(model, silhouettes, params, &|_| true, watch)
    }

    /// As [`Captured::all_around`], with no outlines but for cameras that are needed: the others are there for the polytope.
    ///
    /// # Errors
    /// As [`Captured::evenly`].
    pub fn where_needed(
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
        let empty = |camera: &Camera| Mask::new(camera.width_px, camera.height_px);
        let outline = |(camera, &k): (&Camera, &usize)| {
            let silhouette = &silhouettes[k];
            let loops = outline_in(silhouette, camera, params.tolerance_px);
            (loops, silhouette.photographed)
        };
        let seen: Vec<_> = cameras.par_iter().zip(&seen).map(outline).collect();
        let mut masks: Vec<Mask> = (cameras.iter().zip(&seen))
            .map(|(camera, (loops, _))| covered(loops, camera))
            .collect();
        let drawn: Vec<Camera> = (cameras.iter().zip(&needed).skip(seen.len()))
            .filter(|(_, needed)| **needed)
            .map(|(camera, _)| *camera)
            .collect();
        let mut drawn = capture(model, &drawn, &params.capture, watch)?.into_iter();
        for (camera, needed) in cameras.iter().zip(&needed).skip(seen.len()) {
            let mask = needed.then(|| drawn.next()).flatten();
            masks.push(mask.unwrap_or_else(|| empty(camera)));
        }
        Ok(Self {
            cameras,
            masks,
            seen,
            needed,
            unused,
        })
    }

    /// The map of all views, on the polytope that connects them. `tree` is over the model's faces.
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
        let views = self.views(model, tree, params, watch)?;
        Ok(dense_map::build(views, &map_params(model, params))?)
    }

    /// Traces and simplifies the outline of every mask, and finds how deep the contour generator lies at its vertices.
    ///
    /// # Errors
    /// When interrupted, or nothing of the model is seen from a view.
    fn views(
        &self,
        model: &ClosedMesh,
        tree: &Bvh,
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<Vec<CapturedView>, BuildError> {
        let simplification = SimplifyContourParams {
            tolerance_px: params.tolerance_px,
            // What is captured conservatively must stay so.
            outward_only: params.capture.coverage == CoverageRule::Any,
        };
        let is_of_photographs = !self.seen.is_empty();
        watch.start(progress::CONTOURS, self.cameras.len() as u64);
        let views = (self.cameras.par_iter().zip(&self.masks).enumerate())
            .map(|(view, (&camera, mask))| {
                watch.check()?;
                if self.needed.get(view) == Some(&false) {
                    return Ok(CapturedView {
                        camera,
                        contours: Vec::new(),
                        photographed: Some(0.0),
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
    use glam::{DMat3, DVec3};

    use super::*;
    use silmap_models as models;

    /// A photograph from within the model says nothing: the views are those of a model that nobody photographed.
    #[test]
    fn silhouettes_that_cannot_be_used_leave_evenly_spread_views() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let params = BuildParams {
            views: 20,
            resolution_px: 32,
            ..BuildParams::default()
        };
        let silhouette = SeenSilhouette {
            name: "within".to_owned(),
            eye: model.bounds().center + DVec3::X * 0.5 * model.bounds().radius,
            outline: Vec::new(),
            ray_from_image: DMat3::IDENTITY,
            photographed: 1.0,
        };
        let watch = Watch::silent();
        let found = Captured::all_around(&model, &[silhouette], &params, &watch).unwrap();
        let evenly = Captured::evenly(&model, &params, 20, &watch).unwrap();
        assert_eq!(found.cameras, evenly.cameras);
        assert_eq!(found.unused, [(0, Unused::Behind)]);
    }
}
