//! Time of the hull stage and of its parts: one linear program, setting up, collapsing over the model's size, tightening, taking out a
//! level, saving and loading, verifying.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::lp::{self, HalfSpace};
use silmap_geometry::{ClosedMesh, TriangleMesh};
use silmap_hull::{HullParams, ProgressiveHull, Tightening, VerifyParams, build, verify};
use silmap_models as models;

const MODEL_FACES: usize = 20_000;

/// Faces of the models that growth is looked at with.
const SIZES: [usize; 4] = [5_000, 20_000, 80_000, 320_000];

fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::try_from(mesh).expect("the knot is a closed manifold")
}

/// Planes around an edge of a bent strip: as many as a collapse has.
fn planes() -> Vec<HalfSpace> {
    (0..12)
        .map(|k| {
            let (sin, cos) = (f64::from(k) / 12.0 * std::f64::consts::TAU).sin_cos();
            let normal = DVec3::new(0.4 * cos, 0.4 * sin, 1.0).normalize_or_zero();
            HalfSpace {
                normal,
                offset: 0.02 * f64::from(k % 3),
            }
        })
        .collect()
}

fn hull_stage(c: &mut Criterion) {
    let mesh = closed(models::trefoil_knot(MODEL_FACES));
    let silent = Watch::silent();
    let params = HullParams::default();
    let faces = params.target_faces as usize;
    let hull = build(&mesh, &params, &silent).expect("nobody interrupts");
    let level = hull.level(faces).mesh;
    let bytes = hull.to_bytes();
    let mut group = c.benchmark_group("hull");
    group.sample_size(10);
    let planes = planes();
    group.bench_function("one linear program of 12 planes", |b| {
        let mut scratch = planes.clone();
        b.iter(|| {
            scratch.clone_from(&planes);
            lp::minimise(DVec3::Z, &mut scratch, 100.0)
        });
    });
    // With nothing to collapse: copying, half-edges, the tree of the model.
    let all = HullParams {
        target_faces: mesh.mesh().faces.len() as u32,
        ..params.clone()
    };
    group.bench_function("set up", |b| b.iter(|| build(&mesh, &all, &silent)));
    // One collapse: every edge is looked at once before it.
    let one = HullParams {
        target_faces: mesh.mesh().faces.len() as u32 - 2,
        ..params.clone()
    };
    group.bench_function("set up and first look", |b| {
        b.iter(|| build(&mesh, &one, &silent));
    });
    group.bench_function("build", |b| b.iter(|| build(&mesh, &params, &silent)));
    let clear = HullParams {
        no_self_intersections: true,
        ..params.clone()
    };
    group.bench_function("build, not through itself", |b| {
        b.iter(|| build(&mesh, &clear, &silent));
    });
    for (name, how) in [("fast", Tightening::Fast), ("best", Tightening::Best)] {
        group.bench_function(format!("tighten {name}"), |b| {
            b.iter(|| hull.tightened_level(faces, how, &silent));
        });
    }
    group.bench_function("level", |b| b.iter(|| hull.level(faces)));
    group.bench_function("save", |b| b.iter(|| hull.to_bytes()));
    group.bench_function("load", |b| b.iter(|| ProgressiveHull::from_bytes(&bytes)));
    group.bench_function("verify", |b| {
        b.iter(|| verify(mesh.mesh(), &level, &VerifyParams::default()));
    });
    group.finish();
}

fn growth(c: &mut Criterion) {
    let params = HullParams::default();
    let mut group = c.benchmark_group("hull of 500 faces");
    group.sample_size(10);
    for size in SIZES {
        let mesh = closed(models::trefoil_knot(size));
        group.throughput(Throughput::Elements(mesh.mesh().faces.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(size), &mesh, |b, mesh| {
            b.iter(|| build(mesh, &params, &Watch::silent()));
        });
    }
    group.finish();
}

criterion_group!(benches, hull_stage, growth);
criterion_main!(benches);
