//! How long the silhouette of a generated model of about 65,000 faces takes, by method, and its outline, on a walk of the eye.
#![allow(
    missing_docs,
    reason = "criterion's macros make undocumented functions"
)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use silmap_exact::{EdgeMesh, ExtractionMethod, Extractor, Outliner, Viewpoint, walk_around};
use silmap_geometry::{Camera, TriangleMesh};

const RINGS: u32 = 256;
const SIDES: u32 = 128;
/// Viewpoints of the walk, 0.5° apart.
const STEPS: usize = 720;

/// A torus with waves on it.
fn wavy_torus() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let turn = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    for i in 0..RINGS {
        let u = turn(i, RINGS);
        for j in 0..SIDES {
            let v = turn(j, SIDES);
            let tube = 0.4 + 0.02 * (7.0 * u + 3.0 * v).sin() + 0.01 * (13.0 * v - 11.0 * u).cos();
            let r = 1.0 + tube * v.cos();
            mesh.positions
                .push(DVec3::new(r * u.cos(), tube * v.sin(), r * u.sin()));
            let id = |i: u32, j: u32| i % RINGS * SIDES + j % SIDES;
            let [a, b, c, d] = [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn extraction(c: &mut Criterion) {
    let mesh = EdgeMesh::new(&wavy_torus()).expect("a torus is manifold");
    let start = Viewpoint::Eye(DVec3::new(4.0, 1.5, 0.0));
    let walk: Vec<Viewpoint> = walk_around(start, DVec3::ZERO, STEPS).collect();
    let mut group = c.benchmark_group("extraction, 65536 faces");
    let mut edges = Vec::new();
    for &method in ExtractionMethod::ALL {
        if method == ExtractionMethod::List {
            // The source's quadratic method takes thousands of times as long.
            group.sample_size(10);
        }
        let mut extractor = Extractor::new(&mesh, method);
        let mut at = 0;
        group.bench_function(method.name(), |b| {
            b.iter(|| {
                at = (at + 1) % walk.len();
                black_box(extractor.extract(&walk[at], &mut edges))
            });
        });
        group.sample_size(100);
    }
    group.finish();
}

/// From the edges to polygons.
fn outline(c: &mut Criterion) {
    let torus = wavy_torus();
    let mesh = EdgeMesh::new(&torus).expect("a torus is manifold");
    let bounds = torus.bounds();
    let eye = DVec3::new(4.0, 1.5, 1.0);
    let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (1024, 1024))
        .expect("the eye is outside");
    let mut edges = Vec::new();
    Extractor::new(&mesh, ExtractionMethod::Brute).extract(&Viewpoint::Eye(eye), &mut edges);
    let mut outliner = Outliner::new(mesh.positions());
    c.bench_function("outline, 65536 faces", |b| {
        b.iter(|| black_box(outliner.outline(&edges, &camera)));
    });
}

criterion_group!(benches, extraction, outline);
criterion_main!(benches);
