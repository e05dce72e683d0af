//! Maps of evenly spread views, to compare the simplified one with.
//!
//! Source: Silhouette Mapping, section 6 and figure 11.
//! Deviation: the curve of uniform sampling beside that of simplification is beyond the paper.

use crate::evaluate::EVALUATE;
use rayon::prelude::*;
use silmap_geometry::Watch;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Bvh, Camera, ClosedMesh, Mask};
use silmap_map::{
    CapturedErrors, InterpolateError, Interpolation, MapReader, Method, SilhouetteMap,
};
use silmap_preprocess::parts::{Part, parts};
use silmap_preprocess::pipeline::{BuildError, BuildParams, Captured, without_unseen};

use crate::evaluate::compare;

/// Fewest evenly spread views of the curve: with fewer, edges of the polytope are too long to interpolate along.
const FEWEST_VIEWS: u32 = 16;

/// Most numbers of views on the curve, each half of the one before. All together are captured in half the time that the
/// captured views took.
const MOST_POINTS: usize = 4;

/// The numbers of views that a build of `views` captured views is compared at, most first.
#[must_use]
pub fn uniform_counts(views: u32) -> Vec<u32> {
    let quarter = views / 4;
    let halved = std::iter::successors(Some(quarter), |n| Some(n / 2));
    let counts = halved.take_while(|&n| n >= FEWEST_VIEWS);
    counts.take(MOST_POINTS).collect()
}

/// A map of `views` evenly spread views, all kept; what else `params` say holds for it too.
///
/// # Errors
/// As [`silmap_preprocess::pipeline::build`].
pub fn uniform_map(
    model: &ClosedMesh,
    params: &BuildParams,
    views: u32,
    watch: &Watch<'_>,
) -> Result<SilhouetteMap, BuildError> {
    let parts = parts(model, &params.parts, watch)?;
    let tree = Bvh::new(model.mesh());
    uniform_map_of((model, &tree, &parts), params, views, watch)
}

fn uniform_map_of(
    (model, tree, parts): (&ClosedMesh, &Bvh, &[Part]),
    params: &BuildParams,
    views: u32,
    watch: &Watch<'_>,
) -> Result<SilhouetteMap, BuildError> {
    let captured = Captured::evenly(model, params, views, watch)?;
    captured.map_by_parts(model, (tree, parts), params, watch)
}

/// Views and mean errors of maps of evenly spread views, most views first, measured at the views that a build by `params`
/// captures; without those numbers of views that make no map.
///
/// # Errors
/// When interrupted, or the views of the build cannot be captured.
pub fn uniform_curve(
    model: &ClosedMesh,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<Vec<(u32, f64)>, BuildError> {
    let seen = without_unseen(model, params);
    let model = seen.as_ref().map_or(model, |(seen, _)| seen);
    let tree = Bvh::new(model.mesh());
    let parts = parts(model, &params.parts, watch)?;
    let captured = Captured::evenly(model, params, params.views, watch)?;
    let counts = uniform_counts(params.views);
    watch.start(EVALUATE, counts.len() as u64);
    let mut curve = Vec::with_capacity(counts.len());
    for views in counts {
        watch.check()?;
        if let Ok(map) = uniform_map_of((model, &tree, &parts), params, views, &watch.quiet())
            && let Ok(errors) = captured_errors(
                &map,
                (&captured.cameras, &captured.masks),
                params.map.method,
            )
        {
            curve.push((views, errors.mean));
        }
        watch.advance(EVALUATE, 1);
    }
    watch.finish(EVALUATE);
    watch.check()?;
    Ok(curve)
}

/// How wrong the outlines of `map` are at some cameras, as shares of what `masks`, the true pictures, have inside.
///
/// A view of the map counts as any other: its outline is as wrong as its contour. Simplification counts the views it keeps as
/// right, so over the views it started from its errors are smaller by the share of those.
///
/// # Errors
/// When the map cannot be interpolated: broken, without depths that the method needs, or with views too far apart.
pub fn captured_errors(
    map: &SilhouetteMap,
    (cameras, masks): (&[Camera], &[Mask]),
    method: Method,
) -> Result<CapturedErrors, InterpolateError> {
    let prepared = MapReader::new(map)?;
    let shares: Vec<f64> = cameras
        .par_iter()
        .zip(masks)
        .map_init(
            || (prepared.clone(), Mask::new(1, 1)),
            |(scratch, predicted), (camera, truth)| {
                if (predicted.width(), predicted.height()) != (truth.width(), truth.height()) {
                    *predicted = Mask::new(truth.width(), truth.height());
                }
                scratch.interpolate(map, camera, Interpolation::from(method))?;
                fill_even_odd(scratch.simple_loops().iter(), predicted);
                Ok(compare(predicted, truth).0)
            },
        )
        .collect::<Result<_, InterpolateError>>()?;
    Ok(CapturedErrors {
        mean: shares.iter().sum::<f64>() / shares.len().max(1) as f64,
        max: shares.iter().copied().fold(0.0, f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use silmap_models as models;
    use silmap_preprocess::capture::{Backend, CaptureParams, capture, view_sphere};
    use silmap_preprocess::pipeline::build;

    fn small_params() -> BuildParams {
        let mut params = BuildParams {
            views: 128,
            resolution_px: 64,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        params.map.keep = 32;
        params.hull.target_faces = 100;
        params.textures.views = 1;
        params.textures.size_px = 16;
        params
    }

    #[test]
    fn counts_are_halved_down_to_a_limit() {
        assert_eq!(uniform_counts(1024), [256, 128, 64, 32]);
        assert_eq!(uniform_counts(300), [75, 37, 18]);
        assert!(uniform_counts(63).is_empty());
    }

    #[test]
    fn more_views_are_better_and_chosen_views_are_best() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let (asset, _) = build(&model, "torus", &small_params(), &Watch::silent()).unwrap();
        assert_eq!(asset.record.uniform_curve, []);
        let curve = uniform_curve(&model, &small_params(), &Watch::silent()).unwrap();
        let counts: Vec<u32> = curve.iter().map(|(views, _)| *views).collect();
        assert_eq!(counts, uniform_counts(128));
        assert!(curve[0].1 < curve[1].1, "{curve:?}");
        let chosen = asset.record.order.as_ref().unwrap().errors.mean;
        assert!(chosen < curve[0].1, "{chosen} is not below {curve:?}");
    }

    #[test]
    fn the_measure_sees_pictures_of_other_views() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let bounds = *model.bounds();
        let params = small_params();
        let cameras = view_sphere(&bounds, 3.0 * bounds.radius, 60, 64).unwrap();
        let capture_params = CaptureParams {
            backend: Backend::Cpu,
            ..CaptureParams::default()
        };
        let mut masks = capture(&model, &cameras, &capture_params, &Watch::silent()).unwrap();
        let map = uniform_map(&model, &params, 60, &Watch::silent()).unwrap();
        let measure = |masks: &[Mask]| captured_errors(&map, (&cameras, masks), Method::Tight);
        // The map's own views: nothing but what simplified contours cut off.
        let own = measure(&masks).unwrap();
        assert!(own.mean < 0.03, "{own:?}");
        let mixed_up = masks.len() / 2;
        masks.rotate_left(mixed_up);
        let other = measure(&masks).unwrap();
        assert!(
            other.mean > 10.0 * own.mean && other.max > other.mean,
            "{other:?}"
        );
    }
}
