//! Capture on whole models: the two coverage rules, simplified outlines against the true ones, depths, threads.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, ClosedMesh, CoverageRule, Loop, Mask, TriangleMesh};
use silmap_geometry::{StageEvent, Watch};
use silmap_mesh_io::{self as mesh_io, LoadOptions};
use silmap_models as models;
use silmap_preprocess::capture::cpu::rasterise;
use silmap_preprocess::capture::{CaptureError, CaptureParams, capture, view_sphere};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};
use silmap_tests::outside;

fn cameras(mesh: &TriangleMesh, count: u32, side: u32) -> Vec<Camera> {
    let bounds = mesh.bounds();
    view_sphere(&bounds, 3.0 * bounds.radius, count, side).unwrap()
}

fn drawn(mesh: &TriangleMesh, camera: &Camera, rule: CoverageRule) -> Mask {
    let mut mask = Mask::new(camera.width_px, camera.height_px);
    rasterise(mesh, camera, rule, &mut mask).unwrap();
    mask
}

fn filled(loops: &[Loop], scale: f64, camera: &Camera) -> Mask {
    let scaled: Vec<Loop> = loops
        .iter()
        .map(|l| l.iter().map(|p| *p * scale).collect())
        .collect();
    let mut mask = Mask::new(camera.width_px, camera.height_px);
    fill_even_odd(&scaled, &mut mask);
    mask
}

/// What simplification does to the outlines of a few views, against masks of 8 times the resolution.
struct Accuracy {
    /// Misclassified share of the traced outlines.
    traced: f64,
    /// Misclassified share of the simplified outlines.
    simplified: f64,
    /// Share of the true region outside the simplified one.
    escaped: f64,
    /// Mean number of vertices of a view.
    vertices: f64,
}

fn accuracy(mesh: &TriangleMesh, rule: CoverageRule, params: &SimplifyContourParams) -> Accuracy {
    const FINER: u32 = 8;
    let (mut inside, mut traced_wrong, mut simplified_wrong) = (0, 0, 0);
    let (mut escaped, mut vertices) = (0, 0);
    let views = cameras(mesh, 8, 256);
    for camera in &views {
        let traced = trace_contours(&drawn(mesh, camera, rule));
        let simplified = simplify_contours(&traced, params);
        let fine = camera.resized((256 * FINER, 256 * FINER));
        let truth = drawn(mesh, &fine, CoverageRule::Center);
        inside += truth.count();
        traced_wrong += truth.count_different(&filled(&traced, FINER.into(), &fine));
        let region = filled(&simplified, FINER.into(), &fine);
        simplified_wrong += truth.count_different(&region);
        escaped += truth.count_missing_in(&region);
        vertices += simplified.iter().map(Vec::len).sum::<usize>();
    }
    let share = |wrong: u64| wrong as f64 / inside as f64;
    Accuracy {
        traced: share(traced_wrong),
        simplified: share(simplified_wrong),
        escaped: share(escaped),
        vertices: vertices as f64 / views.len() as f64,
    }
}

#[test]
fn simplified_outlines_are_nearer_to_the_truth_than_traced_ones() {
    // The share of a traced outline's error that remains, and the vertices: a tenth more than measured.
    for (mesh, most, vertices) in [
        (models::torus(16_384), 0.45, 104.0),
        (models::trefoil_knot(16_384), 0.49, 152.0),
    ] {
        let params = SimplifyContourParams::default();
        let fitted = accuracy(&mesh, CoverageRule::Center, &params);
        assert!(
            fitted.simplified < most * fitted.traced,
            "{} of {}",
            fitted.simplified,
            fitted.traced
        );
        assert!(fitted.vertices < vertices, "{} vertices", fitted.vertices);
        // A tolerance of pixels is seen in the numbers.
        let coarse = SimplifyContourParams {
            tolerance_px: 3.0,
            ..params
        };
        let coarse = accuracy(&mesh, CoverageRule::Center, &coarse);
        assert!(coarse.vertices < fitted.vertices && coarse.simplified > fitted.simplified);
    }
}

#[test]
fn conservative_outlines_lose_nothing() {
    let mesh = models::trefoil_knot(16_384);
    for tolerance_px in [0.5, 1.0, 2.0] {
        let params = SimplifyContourParams {
            tolerance_px,
            outward_only: true,
        };
        assert_eq!(accuracy(&mesh, CoverageRule::Any, &params).escaped, 0.0);
    }
    // The control: sampling centres loses some.
    let params = SimplifyContourParams {
        tolerance_px: 1.0,
        outward_only: true,
    };
    assert!(accuracy(&mesh, CoverageRule::Center, &params).escaped > 0.0);
}

#[test]
fn any_covers_all_that_center_does_and_only_its_rim_more() {
    let mesh = models::organic(20_000);
    for camera in cameras(&mesh, 6, 200) {
        let centre = drawn(&mesh, &camera, CoverageRule::Center);
        let any = drawn(&mesh, &camera, CoverageRule::Any);
        assert!(centre.count() > 1000, "{centre:?}");
        assert_eq!(centre.count_missing_in(&any), 0);
        // Every touched pixel has a covered one in its neighbourhood, but for parts thinner than a pixel.
        let near = |x: i64, y: i64| (-2..=2).any(|i| (-2..=2).any(|j| centre.get(x + i, y + j)));
        let lonely = (0..200)
            .flat_map(|y| (0..200).map(move |x| (x, y)))
            .filter(|&(x, y)| any.get(x, y) && !near(x, y))
            .count() as u64;
        assert!(lonely * 100 < any.count(), "{lonely} of {any:?}");
        assert!(any.count() > centre.count());
    }
}

#[test]
fn masks_do_not_depend_on_the_number_of_threads() {
    let mesh = ClosedMesh::try_from(models::torus(2000)).unwrap();
    let views = cameras(mesh.mesh(), 40, 100);
    let advanced = AtomicU64::new(0);
    let on_event = |event: StageEvent| {
        if let StageEvent::Advanced { count, .. } = event {
            advanced.fetch_add(count, Ordering::Relaxed);
        }
    };
    let stop = AtomicBool::new(false);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let watch = Watch::new(&on_event, &stop);
            capture(&mesh, &views, &CaptureParams::default(), &watch)
        })
    };
    let one = run(1).unwrap();
    assert_eq!(one.len(), 40);
    assert_eq!(advanced.load(Ordering::Relaxed), 40);
    assert_eq!(run(4).unwrap(), one);
    for (camera, mask) in views.iter().zip(&one) {
        assert_eq!(&drawn(mesh.mesh(), camera, CoverageRule::Center), mask);
    }
    stop.store(true, Ordering::Relaxed);
    assert!(matches!(run(2), Err(CaptureError::Interrupted(_))));
}

#[test]
fn the_bunny_takes_few_vertices() {
    let Some(path) = outside::shared("models/stanford-bunny-closed.off") else {
        return;
    };
    let loaded = mesh_io::load(&path, &LoadOptions::default()).unwrap();
    let fitted = accuracy(
        loaded.mesh.mesh(),
        CoverageRule::Center,
        &SimplifyContourParams::default(),
    );
    assert!(fitted.simplified < 0.56 * fitted.traced);
    assert!(fitted.vertices < 110.0, "{} vertices", fitted.vertices);
}
