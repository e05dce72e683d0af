//! How long each stage of reading a map takes, over contours of 50 to 5,000 vertices, and how the time grows with them.
//!
//! The model is a body with bumps that every ray from its middle leaves once, so its outline from anywhere is found to any number of
//! vertices by maximising along half-planes, and contours of all sizes are of the same shape. The exponents are fitted to the medians
//! from 200 vertices on; that of a whole outline is to be 1.1 at most.
#![allow(
    missing_docs,
    clippy::print_stdout,
    reason = "criterion's macros make undocumented functions; the exponents are for reading"
)]

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{DVec2, DVec3};
use silmap_geometry::{Camera, CoverageRule};
use silmap_map::{
    CapturedView, DeepLoops, Interpolation, MapReader, Method, PairInterpolator, Polytope,
    RectifiedPair, RegionIntersection, SeenLoops, SilhouetteMap, TriangleInterpolator, ViewContour,
};

/// Vertices of every contour of a map.
const SIZES: [usize; 7] = [50, 100, 200, 500, 1000, 2000, 5000];
/// Exponents are fitted from here on: before, what does not depend on the contours counts.
const FITTED_FROM: usize = 200;
/// The most that the time of a whole outline may grow.
const MOST_EXPONENT: f64 = 1.1;
/// Side of the captures, pixels.
const SIDE: u32 = 1024;
/// Edges of an octahedron are divided into so many: 66 views.
const DIVISIONS: i32 = 4;

/// Distance of the surface from the middle.
fn surface(direction: DVec3) -> f64 {
    let d = direction * 4.0;
    0.8 + 0.1 * (d.x * 1.3 + 0.4).sin() * (d.y * 1.1).cos() + 0.08 * (d.z * 1.7 + d.x).sin()
}

/// The outline seen by a camera that looks at the middle: `n` points in pixels with depths.
fn contour(camera: &Camera, n: usize) -> ViewContour {
    let distance = camera.eye.length();
    let mut contour = ViewContour::default();
    // Outer loops have positive area with y down.
    for k in 0..n {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        let aside = camera.right * cos - camera.up * sin;
        let seen = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let radius = surface(aside * sin - camera.forward * cos);
            let depth = distance - radius * cos;
            (radius * sin / depth, depth)
        };
        const SAMPLES: u32 = 96;
        let at = |s: u32| PI * f64::from(s) / f64::from(SAMPLES);
        let best = (0..=SAMPLES).fold(0, |best, s| {
            if seen(at(s)).0 > seen(at(best)).0 {
                s
            } else {
                best
            }
        });
        // Thirds between the neighbours of the best sample, each time leaving out the lower end.
        let (mut low, mut high) = (at(best.saturating_sub(1)), at(best + 1));
        for _ in 0..40 {
            let third = (high - low) / 3.0;
            if seen(low + third).0 < seen(high - third).0 {
                low += third;
            } else {
                high -= third;
            }
        }
        let (tangent, depth) = seen(0.5 * (low + high));
        let px = 0.5 * f64::from(SIDE) / camera.half_tangent.x;
        let middle = DVec2::splat(0.5 * f64::from(SIDE));
        contour
            .points
            .push(middle + DVec2::new(cos, sin) * (tangent * px));
        contour.depths.push(depth);
    }
    contour
}

/// The unit sphere's points above a divided octahedron, and its triangles, counter-clockwise from outside.
fn divided_octahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut corners: Vec<[i32; 3]> = Vec::new();
    let mut triangles = Vec::new();
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { 1 } else { -1 });
        let mut id = |i: i32, j: i32| {
            let corner = [i * sign[0], j * sign[1], (DIVISIONS - i - j) * sign[2]];
            let found = corners.iter().position(|c| *c == corner);
            found.unwrap_or_else(|| {
                corners.push(corner);
                corners.len() - 1
            }) as u32
        };
        let is_mirrored = sign.iter().product::<i32>() < 0;
        let mut add = |[a, b, c]: [u32; 3]| {
            triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
        };
        for i in 0..DIVISIONS {
            for j in 0..DIVISIONS - i {
                add([id(i, j), id(i + 1, j), id(i, j + 1)]);
                if i + j + 1 < DIVISIONS {
                    add([id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]);
                }
            }
        }
    }
    let directions = corners
        .iter()
        .map(|c| DVec3::from_array(c.map(f64::from)).normalize_or_zero());
    (directions.collect(), triangles)
}

/// A map of the body whose contours have `n` vertices each.
fn map(n: usize) -> SilhouetteMap {
    let (directions, triangles) = divided_octahedron();
    let views = directions.iter().map(|&direction| {
        let camera = camera(direction * 3.0, SIDE);
        CapturedView {
            camera,
            contours: vec![contour(&camera, n)],
            photographed: None,
        }
    });
    SilhouetteMap {
        center: DVec3::ZERO,
        radius: 1.0,
        resolution_px: SIDE,
        tolerance_px: 0.0,
        coverage: CoverageRule::Center,
        views: views.collect(),
        triangles,
    }
}

fn camera(eye: DVec3, side: u32) -> Camera {
    Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (side, side)).expect("the eye lies outside")
}

/// The camera at a step of a walk around the body.
fn walk(step: u32) -> Camera {
    let turn = f64::from(step) * 0.01;
    let direction = DVec3::new(turn.cos(), 0.4 * (0.7 * turn).sin(), turn.sin());
    camera(direction.normalize_or_zero() * 2.9, 512)
}

/// The medians of one stage by contour size.
struct Growth<'a> {
    group: BenchmarkGroup<'a, WallTime>,
    name: String,
    medians: Vec<(usize, f64)>,
}

impl<'a> Growth<'a> {
    fn new(c: &'a mut Criterion, name: &str) -> Self {
        let mut group = c.benchmark_group(name);
        group
            .sample_size(20)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_millis(900));
        Self {
            group,
            name: name.to_owned(),
            medians: Vec::new(),
        }
    }

    /// Times `work` on contours of `n` vertices.
    fn measure(&mut self, n: usize, mut work: impl FnMut()) {
        let mut samples = Vec::new();
        self.group
            .bench_function(BenchmarkId::from_parameter(n), |b| {
                b.iter_custom(|calls| {
                    let since = Instant::now();
                    (0..calls).for_each(|_| work());
                    let taken = since.elapsed();
                    samples.push(taken.as_secs_f64() / calls as f64);
                    taken
                });
            });
        samples.sort_by(f64::total_cmp);
        if let Some(&median) = samples.get(samples.len() / 2) {
            self.medians.push((n, median));
        }
    }

    /// Prints the medians and the exponent of the line through their logarithms.
    fn finish(self, limit: Option<f64>) {
        self.group.finish();
        let large = self.medians.iter().filter(|(n, _)| *n >= FITTED_FROM);
        let logs: Vec<DVec2> = large
            .map(|&(n, s)| DVec2::new((n as f64).ln(), s.ln()))
            .collect();
        if logs.len() < 2 {
            // A filter on the command line left out too much.
            return;
        }
        let mean = logs.iter().sum::<DVec2>() / logs.len() as f64;
        let (up, across) = logs.iter().fold((0.0, 0.0), |(up, across), p| {
            let d = *p - mean;
            (up + d.x * d.y, across + d.x * d.x)
        });
        let exponent = up / across;
        let times: Vec<String> = (self.medians.iter())
            .map(|(n, s)| format!("{n}: {:.1} µs", 1e6 * s))
            .collect();
        println!(
            "growth of {}: n^{exponent:.3} from {FITTED_FROM} vertices on ({})",
            self.name,
            times.join(", ")
        );
        if let Some(limit) = limit {
            let verdict = if exponent <= limit { "met" } else { "NOT MET" };
            println!("  at most n^{limit} is asked: {verdict}");
        }
    }
}

fn locating(c: &mut Criterion) {
    let polytope = Polytope::new(&map(3)).expect("the polytope is star-shaped");
    let (mut step, mut last) = (0, 0);
    c.bench_function("locate/walk", |b| {
        b.iter(|| {
            step += 1;
            let location = polytope.locate(black_box(walk(step).eye), last);
            last = location.map_or(0, |l| l.triangle);
        });
    });
    c.bench_function("locate/the other side", |b| {
        b.iter(|| {
            step += 1;
            let eye = walk(step).eye;
            let there = polytope.locate(black_box(eye), last);
            last = polytope
                .locate(black_box(-eye), there.map_or(0, |l| l.triangle))
                .map_or(0, |l| l.triangle);
        });
    });
}

fn steps(c: &mut Criterion) {
    let maps = SIZES.map(|n| (n, map(n)));
    let mut growth = Growth::new(c, "prepare an edge");
    for (n, map) in &maps {
        let (mut pair, mut captured) = <(RectifiedPair, [DeepLoops; 2])>::default();
        let [a, b, _] = map.triangles[0];
        growth.measure(*n, || {
            let frame = pair.assign_views(black_box(map), [a, b], 0, &mut captured);
            assert!(frame.is_some(), "the views can be rectified");
        });
    }
    growth.finish(None);
    for method in Method::ALL {
        let mut growth = Growth::new(c, &format!("one step, {}", method.name()));
        for (n, map) in &maps {
            let (mut pair, mut captured) = <(RectifiedPair, [DeepLoops; 2])>::default();
            let (mut interpolator, mut seen) = <(PairInterpolator, DeepLoops)>::default();
            let [a, b, _] = map.triangles[0];
            let frame = pair.assign_views(map, [a, b], 0, &mut captured);
            assert!(frame.is_some(), "the views can be rectified");
            let mut step = 0_u32;
            growth.measure(*n, || {
                step += 1;
                let alpha = 0.1 + 0.8 * (f64::from(step) * 0.618).fract();
                interpolator.interpolate(pair.parts_mut(), black_box(alpha), method, &mut seen);
                assert!(!seen.is_empty(), "there is an outline");
            });
        }
        growth.finish(None);
    }
}

fn intersecting(c: &mut Criterion) {
    let mut growth = Growth::new(c, "intersect three orders");
    for n in SIZES {
        let map = map(n);
        let polytope = Polytope::new(&map).expect("the polytope is star-shaped");
        let camera = walk(40);
        let at = polytope.locate(camera.eye, 0).expect("the eye is outside");
        let ids = map.triangles[at.triangle as usize];
        let mut triangle = TriangleInterpolator::default();
        let regions = triangle.interpolate_regions(&map, ids, &at, &camera, Method::Hull.into());
        let [one, two, three] = regions.expect("the views can be rectified") else {
            panic!("three orders give three regions");
        };
        let (mut intersection, mut shared) = <(RegionIntersection, SeenLoops)>::default();
        growth.measure(n, || {
            intersection.intersect(black_box([one, two, three]), &mut shared);
            assert!(!shared.is_empty(), "there is an outline");
        });
    }
    growth.finish(None);
}

fn outlines(c: &mut Criterion) {
    let maps = SIZES.map(|n| (n, map(n)));
    for method in Method::ALL {
        let mut growth = Growth::new(c, &format!("contour, {}", method.name()));
        for (n, map) in &maps {
            let mut reader = MapReader::new(map).expect("the map is whole");
            let mut step = 0;
            growth.measure(*n, || {
                step += 1;
                let how = Interpolation::from(method);
                let location = reader.interpolate(map, black_box(&walk(step)), how);
                black_box(location.expect("the views can be rectified"));
            });
        }
        growth.finish(Some(MOST_EXPONENT));
    }
}

criterion_group!(benches, locating, steps, intersecting, outlines);
criterion_main!(benches);
