//! Maps of generated models without simplification, for suites that look at interpolation alone.

use silmap_geometry::Watch;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{ClosedMesh, CoverageRule, Mask, TriangleMesh};
use silmap_map::{CapturedView, SilhouetteMap, ViewContour};
use silmap_preprocess::capture::{CaptureParams, capture, deep_contours, view_sphere};
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};

/// A map of evenly spread views with depths, all of them kept, and the masks it was traced from.
///
/// # Panics
/// When the mesh is not closed.
#[must_use]
pub fn dense(
    mesh: &TriangleMesh,
    views: u32,
    side: u32,
    tolerance_px: f64,
    coverage: CoverageRule,
) -> (SilhouetteMap, Vec<Mask>) {
    let bounds = mesh.bounds();
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, views, side).unwrap();
    let params = CaptureParams {
        coverage,
        ..CaptureParams::default()
    };
    let closed = ClosedMesh::try_from(mesh.clone()).unwrap();
    let masks = capture(&closed, &cameras, &params, &Watch::silent()).unwrap();
    let tree = Bvh::new(mesh);
    let contour_params = SimplifyContourParams {
        tolerance_px,
        outward_only: coverage == CoverageRule::Any,
    };
    let views = cameras
        .iter()
        .zip(&masks)
        .map(|(&camera, mask)| {
            let loops = simplify_contours(&trace_contours(mask), &contour_params);
            let outward_only = contour_params.outward_only;
            let (loops, depths) = deep_contours(&tree, &bounds, &camera, &loops, outward_only);
            let contours = loops
                .into_iter()
                .zip(depths)
                .map(|(points, depths)| ViewContour {
                    points,
                    depths,
                    ..ViewContour::default()
                });
            CapturedView {
                camera,
                contours: contours.collect(),
                photographed: None,
            }
        })
        .collect();
    let map_params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px: side,
        tolerance_px,
        coverage,
    };
    (dense_map::build(views, &map_params).unwrap(), masks)
}
