//! Time of the hull stage: collapsing, taking out a level, verifying.

use criterion::{Criterion, criterion_group, criterion_main};
use silmap_geometry::ClosedMesh;
use silmap_preprocess::hull::{HullParams, VerifyParams, build, verify};
use silmap_preprocess::{Monitor, models};

const MODEL_FACES: usize = 20_000;

fn hull_stage(c: &mut Criterion) {
    let mesh = ClosedMesh::try_from(models::trefoil_knot(MODEL_FACES))
        .expect("the knot is a closed manifold");
    let params = HullParams::default();
    let faces = params.target_faces as usize;
    let hull = build(&mesh, &params, &Monitor::silent()).expect("nobody interrupts");
    let level = hull.level(faces).mesh;
    let mut group = c.benchmark_group("hull");
    group.sample_size(10);
    group.bench_function("build", |b| {
        b.iter(|| build(&mesh, &params, &Monitor::silent()));
    });
    group.bench_function("level", |b| b.iter(|| hull.level(faces)));
    group.bench_function("verify", |b| {
        b.iter(|| verify(mesh.mesh(), &level, &VerifyParams::default()));
    });
    group.finish();
}

criterion_group!(benches, hull_stage);
criterion_main!(benches);
