//! How long an outline takes, by method and by the number of contour vertices, on a walk of the eye with warm buffers.
#![allow(
    missing_docs,
    reason = "criterion's macros make undocumented functions"
)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, ClosedMesh, CoverageRule};
use silmap_map::{CapturedView, MapReader, Method, SilhouetteMap, ViewContour};
use silmap_models as models;
use silmap_preprocess::capture::{CaptureParams, capture, tangent_depths, view_sphere};
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};

/// Views of the map, all of them kept.
const VIEWS: u32 = 128;

/// A map of the knot, captured and simplified so that contours have more or fewer vertices.
fn map(resolution_px: u32, tolerance_px: f64) -> SilhouetteMap {
    let mesh = models::trefoil_knot(16_384);
    let bounds = mesh.bounds();
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, VIEWS, resolution_px)
        .expect("the eyes lie outside the model");
    let closed = ClosedMesh::try_from(mesh).expect("the knot is closed");
    let params = CaptureParams::default();
    let masks = capture(&closed, &cameras, &params, &Watch::silent()).expect("nothing stops it");
    let tree = Bvh::new(closed.mesh());
    let simplification = SimplifyContourParams {
        tolerance_px,
        outward_only: false,
    };
    let views = (cameras.iter().zip(&masks))
        .map(|(&camera, mask)| {
            let loops = simplify_contours(&trace_contours(mask), &simplification);
            let depths = tangent_depths(&tree, &bounds, &camera, &loops);
            let contours = (loops.into_iter().zip(depths))
                .map(|(points, depths)| ViewContour {
                    points,
                    depths,
                    ..ViewContour::default()
                })
                .collect();
            CapturedView {
                camera,
                contours,
                photographed: None,
            }
        })
        .collect();
    let params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px,
        tolerance_px,
        coverage: CoverageRule::Center,
    };
    dense_map::build(views, &params).expect("the views surround the knot")
}

/// The camera at a step of a walk around the model.
fn camera(map: &SilhouetteMap, step: u32) -> Camera {
    let turn = f64::from(step) * 0.01;
    let direction = DVec3::new(turn.cos(), 0.4 * (0.7 * turn).sin(), turn.sin());
    let eye = map.center + direction.normalize_or_zero() * (2.9 * map.radius);
    Camera::fit_sphere(eye, map.center, map.radius, None, (512, 512))
        .expect("the eye lies outside the model")
}

fn outlines(c: &mut Criterion) {
    for (resolution_px, tolerance_px) in [(256, 1.0), (512, 0.5), (1024, 0.5), (2048, 0.3)] {
        let map = map(resolution_px, tolerance_px);
        let vertices: usize = map.contour_vertex_counts().sum();
        let mean = vertices / map.views.len();
        for method in Method::ALL {
            let mut scratch = MapReader::new(&map).expect("the map is whole");
            let mut step = 0;
            c.bench_function(&format!("outline/{}/{mean} vertices", method.name()), |b| {
                b.iter(|| {
                    step += 1;
                    let camera = camera(&map, step);
                    let location = scratch.interpolate(&map, black_box(&camera), method.into());
                    black_box(location.expect("the views can be rectified"));
                });
            });
        }
    }
}

criterion_group!(benches, outlines);
criterion_main!(benches);
