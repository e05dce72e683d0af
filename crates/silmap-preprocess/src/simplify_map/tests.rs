//! Simplified maps of a small torus: invariants after every collapse, and the stored order.

use super::*;
use crate::capture::{CaptureParams, capture, view_sphere};
use crate::dense_map::{self, DenseMapParams};
use crate::simplify_contour::{SimplifyContourParams, simplify_contours};
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{ClosedMesh, CoverageRule};
use silmap_map::replay::{ReplayError, replay};
use silmap_map::{CapturedView, ViewContour};

fn torus_map(views: u32) -> (SilhouetteMap, Vec<Mask>) {
    let mesh = ClosedMesh::try_from(silmap_models::torus(1024)).unwrap();
    let bounds = *mesh.bounds();
    let side = 96;
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, views, side).unwrap();
    let masks = capture(&mesh, &cameras, &CaptureParams::default(), &Watch::silent()).unwrap();
    let views = cameras
        .iter()
        .zip(&masks)
        .map(|(&camera, mask)| {
            let loops = simplify_contours(&trace_contours(mask), &SimplifyContourParams::default());
            let contours = loops.into_iter().map(|points| ViewContour {
                points,
                depths: Vec::new(),
                ..ViewContour::default()
            });
            CapturedView {
                camera,
                contours: contours.collect(),
                photographed: None,
            }
        })
        .collect();
    let params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px: side,
        tolerance_px: 0.5,
        coverage: CoverageRule::Center,
    };
    (dense_map::build(views, &params).unwrap(), masks)
}

#[test]
fn every_collapse_leaves_a_star_shaped_polytope_and_true_errors() {
    let (dense, masks) = torus_map(60);
    let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
    work.evaluate_all(&Watch::silent()).unwrap();
    while let Some((cost, collapse)) = work.cheapest_collapse() {
        let before = work.error_sum;
        work.apply(collapse);
        assert!(work.polytope.is_consistent());
        assert!(
            (work.error_sum - before - cost).abs() < 1e-9,
            "a cost was not kept"
        );
        let sum: f64 = work.errors.iter().sum();
        assert!((work.error_sum - sum).abs() < 1e-9);
    }
    assert!(
        work.polytope.view_count() <= 12,
        "stalled at {}",
        work.polytope.view_count()
    );
    assert!(work.error_sum > 0.0);
}

#[test]
fn moving_views_lowers_the_error_and_leaves_a_polytope() {
    let (dense, masks) = torus_map(80);
    let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
    work.evaluate_all(&Watch::silent()).unwrap();
    while work.polytope.view_count() > 24 {
        let (_, collapse) = work.cheapest_collapse().unwrap();
        work.apply(collapse);
    }
    let before = work.error_sum;
    work.refine(&Watch::silent()).unwrap();
    assert!(work.polytope.is_consistent());
    assert_eq!(work.polytope.view_count(), 24);
    assert!(
        work.error_sum < before,
        "{before} stayed {}",
        work.error_sum
    );
    // The sum that was kept up to date is that of fresh predictions from the polytope as it is.
    let (kept, triangles) = work.polytope.compact();
    let triangles: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| t.map(|v| kept[v as usize]))
        .collect();
    let mut scratch = work.predictor.scratch();
    let fresh: f64 = (0..80)
        .filter(|v| !kept.contains(v))
        .map(|v| {
            let known = HashMap::new();
            work.predictor
                .predict(v, &triangles, &known, &mut scratch)
                .unwrap()
                .error
        })
        .sum();
    assert!(
        (fresh - work.error_sum).abs() < 1e-9,
        "{fresh} is not {}",
        work.error_sum
    );
}

/// A map with every third view off its polytope, without contours.
fn with_others(views: u32) -> (SilhouetteMap, Vec<Mask>, Vec<u32>) {
    let (mut dense, masks) = torus_map(views);
    let corners: Vec<u32> = (0..views).filter(|v| v % 3 != 1).collect();
    let others = (0..views).filter(|v| v % 3 == 1);
    others.for_each(|v| dense.views[v as usize].contours.clear());
    let params = DenseMapParams {
        center: dense.center,
        radius: dense.radius,
        resolution_px: dense.resolution_px,
        tolerance_px: dense.tolerance_px,
        coverage: dense.coverage,
    };
    let map = dense_map::build_on(dense.views, &corners, &params).unwrap();
    (map, masks, corners)
}

#[test]
fn views_off_the_polytope_count_and_are_never_kept() {
    let (dense, masks, corners) = with_others(90);
    let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
    work.predict_others(&Watch::silent()).unwrap();
    assert!(work.polytope.is_consistent());
    let before = work.error_sum;
    assert!(before > 0.0, "the others are not predicted");
    work.evaluate_all(&Watch::silent()).unwrap();
    while work.polytope.view_count() > 24 {
        let (_, collapse) = work.cheapest_collapse().unwrap();
        work.apply(collapse);
    }
    work.refine(&Watch::silent()).unwrap();
    assert!(work.polytope.is_consistent());
    assert!(work.error_sum > before);
    let kept = work.polytope.kept();
    assert!(kept.iter().all(|v| corners.binary_search(v).is_ok()));
    // Each of them has the error that the polytope as it is gives it.
    let (_, triangles) = work.polytope.compact();
    let triangles: Vec<[u32; 3]> = (triangles.iter())
        .map(|t| t.map(|v| kept[v as usize]))
        .collect();
    let mut scratch = work.predictor.scratch();
    for view in (0..90).filter(|v| v % 3 == 1) {
        let known = HashMap::new();
        let fresh = work
            .predictor
            .predict(view, &triangles, &known, &mut scratch);
        let error = work.errors[view as usize];
        assert!((fresh.unwrap().error - error).abs() < 1e-9);
    }
}

#[test]
fn five_candidates_are_there_for_each_view_that_is_kept() {
    let count = |keep, max_error| {
        SimplifyMapParams {
            keep,
            max_error,
            ..SimplifyMapParams::default()
        }
        .candidates()
    };
    assert_eq!(count(128, None), Some(640));
    assert_eq!(count(6, None), Some(256));
    assert_eq!(count(u32::MAX, None), Some(u32::MAX));
    assert_eq!(
        count(128, Some(0.01)),
        None,
        "nobody knows how many are kept"
    );
}

#[test]
fn the_curve_ends_where_it_was_told_to() {
    let (dense, masks) = torus_map(60);
    let watch = Watch::silent();
    let keep = SimplifyMapParams {
        keep: 20,
        ..SimplifyMapParams::default()
    };
    let (map, report) = simplify(&dense, &masks, &keep, &watch).unwrap();
    assert_eq!(
        (map.views.len(), report.kept.len(), report.curve.len()),
        (20, 20, 40)
    );
    assert_eq!(map.triangles.len(), 36);
    let at_30 = report
        .curve
        .iter()
        .find(|(views, _)| *views == 30)
        .unwrap()
        .1;
    let limit = SimplifyMapParams {
        max_error: Some(at_30),
        ..keep
    };
    let (map, report) = simplify(&dense, &masks, &limit, &watch).unwrap();
    assert!(report.order.errors.mean <= at_30 && map.views.len() <= 30);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (dense, masks) = torus_map(48);
    let params = SimplifyMapParams {
        keep: 16,
        ..SimplifyMapParams::default()
    };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| simplify(&dense, &masks, &params, &Watch::silent()).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_map_without_its_masks_is_refused() {
    let (dense, masks) = torus_map(12);
    let made = simplify(
        &dense,
        &masks[1..],
        &SimplifyMapParams::default(),
        &Watch::silent(),
    );
    assert_eq!(
        made.err(),
        Some(SimplifyMapError::MaskCount {
            views: 12,
            masks: 11
        })
    );
}

/// A torus's map of 24 views and what simplifying reported.
fn small_torus() -> (SilhouetteMap, SimplifyMapReport, (SilhouetteMap, Vec<Mask>)) {
    let (dense, masks) = torus_map(80);
    let params = SimplifyMapParams {
        keep: 24,
        ..SimplifyMapParams::default()
    };
    let (map, report) = simplify(&dense, &masks, &params, &Watch::silent()).unwrap();
    (map, report, (dense, masks))
}

#[test]
fn replaying_the_order_gives_the_maps_it_was_noted_for() {
    let (map, report, (dense, masks)) = small_torus();
    // The same once more, but stopped after each step.
    let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
    work.evaluate_all(&Watch::silent()).unwrap();
    for _ in 24..80 {
        let (_, collapse) = work.cheapest_collapse().unwrap();
        work.apply(collapse);
    }
    work.refine(&Watch::silent()).unwrap();
    work.restart(&Watch::silent()).unwrap();
    let steps = &report.order.steps;
    assert!(steps.len() >= 12, "{} steps", steps.len());
    assert!(steps.iter().any(|s| !s.turned.is_empty()), "no edge turned");
    for done in 0..=steps.len() {
        let (smaller, kept) = replay(&map, &steps[..done]).unwrap();
        assert_eq!(smaller, work.chosen_map(), "after {done} steps");
        assert_eq!((smaller.views.len(), kept.len()), (24 - done, 24 - done));
        silmap_map::Polytope::new(&smaller).unwrap();
        work.next_step(&Watch::silent()).unwrap();
    }
    // And the very last map loses no further view.
    assert!(work.next_step(&Watch::silent()).unwrap().is_none());
}

/// An estimate from some views may allow what all views do not: taken up again and again, the order would never end.
#[test]
fn refused_collapses_do_not_come_back() {
    let (dense, masks) = torus_map(40);
    let mut work = Simplification::new(&dense, &masks, &SimplifyMapParams::default());
    let all: Vec<Collapse> = work.polytope.collapses().collect();
    let is_allowed = |c: &&Collapse| work.polytope.triangles_after(**c).is_some();
    let allowed = *all.iter().find(is_allowed).unwrap();
    work.refused = all.into_iter().filter(|c| *c != allowed).collect();
    work.restart(&Watch::silent()).unwrap();
    let (_, only) = work.next_collapse(&Watch::silent()).unwrap().unwrap();
    assert_eq!(only, allowed);
    work.refused.push(allowed);
    let none = work.next_collapse(&Watch::silent()).unwrap();
    assert_eq!(none, None);
    // A polytope that has changed may allow them again.
    assert!(work.apply(allowed));
    assert!(work.next_collapse(&Watch::silent()).unwrap().is_some());
}

#[test]
fn an_order_that_does_not_fit_is_refused() {
    let (map, report, _) = small_torus();
    let steps = &report.order.steps;
    assert!(replay(&map, steps).is_ok());
    type Break = fn(&mut silmap_map::CollapseStep, u32);
    let breaks: [Break; 5] = [
        |s, _| s.removed = 24,
        |s, _| s.onto = 1000,
        |s, _| s.onto = s.removed,
        |s, stranger| s.onto = stranger,
        |s, _| s.turned.push([0, 99]),
    ];
    let removed = steps[0].removed;
    let is_beside = |v: u32| {
        let mut triangles = map.triangles.iter();
        triangles.any(|t| t.contains(&v) && t.contains(&removed))
    };
    let stranger = (0..24).find(|&v| !is_beside(v)).unwrap();
    for break_it in breaks {
        let mut steps = steps.clone();
        break_it(&mut steps[0], stranger);
        let refused = replay(&map, &steps).unwrap_err();
        assert!(
            matches!(
                refused,
                ReplayError::Collapse { step: 0, .. } | ReplayError::Edge { step: 0, .. }
            ),
            "{refused}"
        );
    }
}

/// Half of the views that are kept may be photographs, and they stay; an error that is asked for decides alone.
#[test]
fn photographs_stay() {
    let (mut dense, masks) = torus_map(60);
    let photographs = 10_u32;
    for (k, view) in dense.views.iter_mut().enumerate() {
        view.photographed = Some(f64::from(u8::from(k < photographs as usize)));
    }
    let kept = |params: SimplifyMapParams| {
        let (map, report) = simplify(&dense, &masks, &params, &Watch::silent()).unwrap();
        let seen = report.kept.iter().filter(|&&v| v < photographs).count();
        assert_eq!(map.views.len(), report.kept.len());
        (map.views.len(), seen)
    };
    let keep = |keep| SimplifyMapParams {
        keep,
        ..SimplifyMapParams::default()
    };
    assert_eq!(kept(keep(20)), (20, 10));
    // Of more than half, half stay.
    let (views, seen) = kept(keep(12));
    assert!(views == 12 && seen >= 6, "{views} {seen}");
    let by_error = |keep| SimplifyMapParams {
        max_error: Some(0.2),
        keep,
        ..SimplifyMapParams::default()
    };
    assert_eq!(kept(by_error(20)), kept(by_error(40)));
}
