//! Interpolated silhouettes against visual hulls by brute force: a pixel belongs to the hull of some views when a point of its ray,
//! within the bounding sphere, lies in all their silhouettes. Rays are sampled in depth and silhouettes looked up in masks, so that
//! nothing is shared with what is tested: no frames, no spans, no chains.
//!
//! Method `hull` must hold the hull of the three views, but for one pixel at the border, and must not hold more than any one of the
//! three orders with all pairs does. What method `paper` misses is counted and printed; it promises nothing.
#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::print_stdout,
    reason = "what the paper's method misses is to be read"
)]

use std::cell::RefCell;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, CoverageRule, Loop, Mask};
use silmap_map::{CapturedView, MapReader, Method, Polytope, SilhouetteMap, ViewContour, outline};
use silmap_models as models;
use silmap_preprocess::capture::view_sphere;
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_tests::dense_maps::dense;

/// Side of captures and pictures, pixels.
const SIDE: u32 = 64;
/// Masks that silhouettes are looked up in are so much finer.
const FINER: u32 = 4;
/// Points on a ray. Between neighbours nothing moves by more than a third of a pixel.
const SAMPLES: u32 = 160;
/// Upper bounds look in a larger sphere: pairs are limited to the bounding sphere with a slack of two pixels of a 512² capture.
const LARGER: f64 = 1.2;

/// A weight below this is none: the eye is on an edge.
const ON_EDGE: f64 = 1e-9;

/// A silhouette to look points up in.
struct Seen {
    camera: Camera,
    mask: Mask,
}

impl Seen {
    fn captured(view: &CapturedView) -> Self {
        let finer = |p: &DVec2| *p * f64::from(FINER);
        let loops = view
            .contours
            .iter()
            .map(|c| c.points.iter().map(finer).collect::<Loop>());
        let mut mask = Mask::new(SIDE * FINER, SIDE * FINER);
        fill_even_odd(loops, &mut mask);
        Self {
            camera: view.camera.resized((SIDE * FINER, SIDE * FINER)),
            mask,
        }
    }

    /// What it holds and a little more: upper bounds must not lose what is finer than a mask's pixels or a ray's samples.
    fn widened(&self) -> Self {
        Self {
            camera: self.camera,
            mask: grown(&self.mask),
        }
    }

    /// What it surely holds: looking up in pixels rounds, and three roundings make a sliver.
    fn narrowed(&self) -> Self {
        Self {
            camera: self.camera,
            mask: inverse(&grown(&inverse(&self.mask))),
        }
    }

    fn holds(&self, point: DVec3) -> bool {
        let p = self.camera.image_from_object(point).floor();
        self.mask.get(p.x as i64, p.y as i64)
    }
}

/// The pixels of `camera` with a point in all silhouettes and in a sphere about the center.
fn sampled_hull(map: &SilhouetteMap, camera: &Camera, seen: &[&Seen], radius: f64) -> Mask {
    let mut mask = Mask::new(camera.width_px, camera.height_px);
    let distance = camera.eye.distance(map.center);
    let (near, far) = (1.0 / (distance - radius), 1.0 / (distance + radius));
    for y in 0..camera.height_px {
        for x in 0..camera.width_px {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let is_inside = (0..SAMPLES).any(|s| {
                let t = (f64::from(s) + 0.5) / f64::from(SAMPLES);
                let point = camera.object_from_image(pixel, 1.0 / (near + (far - near) * t));
                point.distance_squared(map.center) <= radius * radius
                    && seen.iter().all(|view| view.holds(point))
            });
            mask.set(x, y, is_inside);
        }
    }
    mask
}

/// One order with all pairs by brute force: the hull of two views at the point between them, then of that and the third view.
fn sampled_order(map: &SilhouetteMap, at: &Between, last: usize) -> Mask {
    let (i, j) = ((last + 1) % 3, (last + 2) % 3);
    let alpha = at.weights[j] / (at.weights[i] + at.weights[j]);
    let eye = at.seen[i].camera.eye.lerp(at.seen[j].camera.eye, alpha);
    let radius = LARGER * map.radius;
    let camera = fitting(map, eye, 2 * SIDE);
    let [one, two, third] = [i, j, last].map(|k| at.seen[k].widened());
    let on_edge = Seen {
        mask: sampled_hull(map, &camera, &[&one, &two], radius),
        camera,
    };
    sampled_hull(map, &at.camera, &[&on_edge.widened(), &third], radius)
}

fn fitting(map: &SilhouetteMap, eye: DVec3, side: u32) -> Camera {
    Camera::fit_sphere(eye, map.center, map.radius, None, (side, side)).unwrap()
}

/// All pixels within one of a mask's.
fn grown(mask: &Mask) -> Mask {
    let mut all = Mask::new(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            let (x_mid, y_mid) = (i64::from(x), i64::from(y));
            let is_near = (0..9).any(|k| mask.get(x_mid + k % 3 - 1, y_mid + k / 3 - 1));
            all.set(x, y, is_near);
        }
    }
    all
}

/// The pixels that are not a mask's.
fn inverse(mask: &Mask) -> Mask {
    let mut others = Mask::new(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            others.set(x, y, !mask.get(x.into(), y.into()));
        }
    }
    others
}

/// The pixels that surely have a point in all three silhouettes, within the bounding sphere.
fn three_view_hull(map: &SilhouetteMap, at: &Between) -> Mask {
    let [one, two, three] = at.seen.each_ref().map(Seen::narrowed);
    sampled_hull(map, &at.camera, &[&one, &two, &three], map.radius)
}

/// An eye on a triangle of the polytope, with the silhouettes of its corners.
struct Between {
    camera: Camera,
    weights: [f64; 3],
    seen: [Seen; 3],
}

impl Between {
    fn new(map: &SilhouetteMap, triangle: usize, weights: [f64; 3]) -> Self {
        let eye_of = |v: u32| map.views[v as usize].camera.eye;
        let sum: f64 = weights.iter().sum();
        let eye = (0..3)
            .map(|k| eye_of(map.triangles[triangle][k]) * (weights[k] / sum))
            .sum();
        // On an edge it may be the neighbour that is read.
        let there = Polytope::new(map).unwrap().locate(eye, 0).unwrap();
        let views = map.triangles[there.triangle as usize].map(|v| &map.views[v as usize]);
        Self {
            camera: fitting(map, eye, SIDE),
            weights: there.barycentric.map(|w| if w < ON_EDGE { 0.0 } else { w }),
            seen: views.map(Seen::captured),
        }
    }

    fn drawn(&self, map: &SilhouetteMap, method: Method) -> Mask {
        let mut mask = Mask::new(SIDE, SIDE);
        let mut scratch = MapReader::new(map).unwrap();
        let seen = outline(map, &self.camera, method, &mut scratch).unwrap();
        fill_even_odd(seen.simple_loops(), &mut mask);
        mask
    }
}

/// Pixels over all cases of a test.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    cases: u32,
    in_hull: u64,
    drawn: u64,
    in_order: u64,
    missed_by_paper: u64,
    worst_of_paper: u64,
}

impl Totals {
    /// Prints what was counted; a test that looked at nothing must not pass.
    fn report(&self, name: &str) {
        println!("{name}: {self:?}");
        assert!(
            self.cases > 0 && self.in_hull > 50 * u64::from(self.cases),
            "{self:?}"
        );
        assert!(self.drawn >= self.in_hull / 2, "{self:?}");
    }
}

/// Pixels of the visual hull that a picture misses, and pixels that it has beyond some order, both by more than the border.
fn misses_and_excess(drawn: &Mask, hull: &Mask, orders: &[Mask]) -> (u64, u64) {
    let excess = orders
        .iter()
        .map(|order| drawn.count_missing_in(&grown(order)));
    (
        hull.count_missing_in(&grown(drawn)),
        excess.max().unwrap_or(0),
    )
}

/// Compares at one eye; with a weight of zero it is on an edge, where the order that ends with the third view begins with what
/// is there: the hull of two views.
fn compare(map: &SilhouetteMap, at: &Between, totals: &RefCell<Totals>) -> (u64, u64) {
    let hull = three_view_hull(map, at);
    let orders = [0, 1, 2].map(|last| sampled_order(map, at, last));
    let [paper, drawn] = [Method::Paper, Method::Hull].map(|method| at.drawn(map, method));
    let missed_by_paper = hull.count_missing_in(&grown(&paper));
    let mut totals = totals.borrow_mut();
    totals.cases += 1;
    totals.in_hull += hull.count();
    totals.drawn += drawn.count();
    totals.in_order += orders[0].count();
    totals.missed_by_paper += missed_by_paper;
    totals.worst_of_paper = totals.worst_of_paper.max(missed_by_paper);
    misses_and_excess(&drawn, &hull, &orders)
}

/// Cases are slow: they are the same each time, and what fails is printed as it is, not made smaller.
fn runner(cases: u32) -> TestRunner {
    let config = Config {
        cases,
        max_shrink_iters: 0,
        failure_persistence: None,
        ..Config::default()
    };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// Weights of an eye's three views: inside the triangle, or on one of its edges.
fn any_weights() -> impl Strategy<Value = [f64; 3]> {
    (
        0.05..1.0_f64,
        0.05..1.0_f64,
        prop::option::weighted(0.6, 0.05..1.0_f64),
        0_usize..3,
    )
        .prop_map(|(a, b, c, turn)| {
            let mut weights = [a, b, c.unwrap_or(0.0)];
            weights.rotate_left(turn);
            weights
        })
}

/// Up to nine stars side by side, some with a hole, in units of the bounding circle.
fn any_silhouette() -> impl Strategy<Value = Vec<Loop>> {
    let star = |lengths: std::ops::Range<f64>| prop::collection::vec(lengths, 5..10);
    let cell = prop::option::weighted(0.6, (star(0.12..0.22), prop::option::of(star(0.02..0.08))));
    prop::collection::vec(cell, 9).prop_map(|cells| {
        let mut loops = Vec::new();
        for (k, cell) in cells.into_iter().enumerate() {
            let middle = (DVec2::new((k % 3) as f64, (k / 3) as f64) - 1.0) * 0.45;
            let around = |lengths: &[f64]| -> Loop {
                let turn = std::f64::consts::TAU / lengths.len() as f64;
                let ray = |(k, r): (usize, &f64)| middle + DVec2::from_angle(turn * k as f64) * *r;
                lengths.iter().enumerate().map(ray).collect()
            };
            if let Some((outer, hole)) = cell {
                loops.push(around(&outer));
                loops.extend(hole.map(|hole| around(&hole).into_iter().rev().collect::<Loop>()));
            }
        }
        loops
    })
}

/// A map of twenty views that see what has nothing to do with each other.
fn map_of(silhouettes: &[Vec<Loop>]) -> SilhouetteMap {
    let bounds = models::torus(600).bounds();
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, 20, SIDE).unwrap();
    let in_pixels = |p: &DVec2| (DVec2::splat(0.5) + *p * (0.5 / 1.02)) * f64::from(SIDE);
    let views = cameras
        .into_iter()
        .enumerate()
        .map(|(k, camera)| CapturedView {
            camera,
            contours: (silhouettes[k % silhouettes.len()].iter())
                .map(|points| ViewContour {
                    points: points.iter().map(in_pixels).collect(),
                    ..ViewContour::default()
                })
                .collect(),
            photographed: None,
        });
    let params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px: SIDE,
        tolerance_px: 0.0,
        coverage: CoverageRule::Any,
    };
    dense_map::build(views.collect(), &params).unwrap()
}

#[test]
fn hulls_of_random_polygons() {
    let totals = RefCell::default();
    // More silhouettes than a triangle has corners, so that neighbours differ.
    let silhouettes = prop::collection::vec(any_silhouette(), 7);
    let cases = (silhouettes, 0_usize..36, any_weights());
    let mut runner = runner(20);
    let result = runner.run(&cases, |(silhouettes, triangle, weights)| {
        let map = map_of(&silhouettes);
        let at = Between::new(&map, triangle, weights);
        let (missed, excess) = compare(&map, &at, &totals);
        prop_assert_eq!((missed, excess), (0, 0), "missed by hull, beyond an order");
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    totals.borrow().report("random polygons");
}

#[test]
fn hulls_of_models() {
    for (name, mesh) in [
        ("torus", models::torus(2048)),
        ("knot", models::trefoil_knot(4096)),
        ("three holes", models::three_holed_torus(4096)),
        ("organic", models::organic(4096)),
    ] {
        let (map, _) = dense(&mesh, 24, SIDE, 0.0, CoverageRule::Any);
        let totals = RefCell::default();
        let mut runner = runner(5);
        let result = runner.run(
            &(0..map.triangles.len(), any_weights()),
            |(triangle, weights)| {
                let at = Between::new(&map, triangle, weights);
                let (missed, excess) = compare(&map, &at, &totals);
                prop_assert_eq!((missed, excess), (0, 0), "missed by hull, beyond an order");
                Ok(())
            },
        );
        if let Err(error) = result {
            panic!("{name}: {error}");
        }
        totals.borrow().report(name);
    }
}

/// What must be noticed: a picture that is beside its place, or grown, and a contour that is gone.
#[test]
fn wrong_pictures_are_noticed() {
    let (mut map, _) = dense(
        &models::trefoil_knot(4096),
        24,
        SIDE,
        0.0,
        CoverageRule::Any,
    );
    let at = Between::new(&map, 5, [0.4, 0.3, 0.3]);
    let hull = three_view_hull(&map, &at);
    let orders = [0, 1, 2].map(|last| sampled_order(&map, &at, last));
    let drawn = at.drawn(&map, Method::Hull);
    assert_eq!(misses_and_excess(&drawn, &hull, &orders), (0, 0));

    let mut moved = Mask::new(SIDE, SIDE);
    for y in 0..SIDE {
        for x in 0..SIDE {
            moved.set(x, y, drawn.get(i64::from(x) - 3, y.into()));
        }
    }
    let (missed, excess) = misses_and_excess(&moved, &hull, &orders);
    assert!(missed > 10 && excess > 10, "moved: {missed}, {excess}");
    let (_, excess) = misses_and_excess(&grown(&grown(&grown(&drawn))), &hull, &orders);
    assert!(excess > 10, "grown: {excess}");

    let view = &mut map.views[map.triangles[5][0] as usize];
    for contour in &mut view.contours {
        for p in &mut contour.points {
            *p = (*p - 32.0) * 0.8 + 32.0;
        }
    }
    let (missed, _) = misses_and_excess(&at.drawn(&map, Method::Hull), &hull, &orders);
    assert!(missed > 10, "a shrunk silhouette: {missed}");
}
