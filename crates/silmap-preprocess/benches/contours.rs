//! How long one view takes: rasterising, tracing, simplifying, and the depth of the rim.
#![allow(
    missing_docs,
    reason = "criterion's macros make undocumented functions"
)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use silmap_geometry::bvh::Bvh;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh};
use silmap_models as models;
use silmap_preprocess::capture::cpu::rasterise;
use silmap_preprocess::capture::{tangent_depths, view_sphere};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};

/// Faces of the model, about those of the Stanford bunny.
const FACES: usize = 65_536;

fn view(mesh: &TriangleMesh, side: u32) -> Camera {
    let bounds = mesh.bounds();
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, 16, side);
    cameras.expect("the eyes lie outside the model")[5]
}

fn draw(mesh: &TriangleMesh, camera: &Camera, rule: CoverageRule, mask: &mut Mask) {
    rasterise(mesh, camera, rule, mask).expect("the image holds the model");
}

fn rasterising(c: &mut Criterion) {
    let mesh = models::trefoil_knot(FACES);
    let camera = view(&mesh, 512);
    let mut mask = Mask::new(512, 512);
    for rule in [CoverageRule::Center, CoverageRule::Any] {
        let id = BenchmarkId::new("rasterise", format!("{rule:?}"));
        c.bench_with_input(id, &rule, |b, &rule| {
            b.iter(|| draw(&mesh, &camera, rule, black_box(&mut mask)));
        });
    }
}

fn tracing(c: &mut Criterion) {
    for (name, mesh) in [
        ("knot", models::trefoil_knot(FACES)),
        ("organic", models::organic(FACES)),
    ] {
        for side in [512, 1024, 2048] {
            let mut mask = Mask::new(side, side);
            draw(&mesh, &view(&mesh, side), CoverageRule::Center, &mut mask);
            let id = BenchmarkId::new(format!("trace/{name}"), side);
            c.bench_with_input(id, &mask, |b, mask| {
                b.iter(|| trace_contours(black_box(mask)));
            });
        }
    }
}

fn simplifying(c: &mut Criterion) {
    let mesh = models::trefoil_knot(FACES);
    for side in [512, 1024, 2048] {
        let mut mask = Mask::new(side, side);
        draw(&mesh, &view(&mesh, side), CoverageRule::Center, &mut mask);
        let traced = trace_contours(&mask);
        for outward_only in [false, true] {
            let params = SimplifyContourParams {
                tolerance_px: if outward_only { 1.0 } else { 0.5 },
                outward_only,
            };
            let name = if outward_only {
                "simplify outward"
            } else {
                "simplify"
            };
            c.bench_with_input(BenchmarkId::new(name, side), &traced, |b, traced| {
                b.iter(|| simplify_contours(black_box(traced), &params));
            });
        }
    }
}

fn depths(c: &mut Criterion) {
    let mesh = models::trefoil_knot(FACES);
    let camera = view(&mesh, 512);
    let mut mask = Mask::new(512, 512);
    draw(&mesh, &camera, CoverageRule::Center, &mut mask);
    let loops = simplify_contours(&trace_contours(&mask), &SimplifyContourParams::default());
    let (bvh, bounds) = (Bvh::new(&mesh), mesh.bounds());
    c.bench_function("depths", |b| {
        b.iter(|| tangent_depths(&bvh, &bounds, &camera, black_box(&loops)));
    });
}

criterion_group!(benches, rasterising, tracing, simplifying, depths);
criterion_main!(benches);
