//! An outline follows the eye: it does not jump where triangles meet or orders of interpolation would change.
//!
//! Source: beyond the paper, whose order of steps switches inside a triangle. The paper's method is the negative control.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh};
use silmap_map::{MapReader, Method, SilhouetteMap};
use silmap_models as models;
use silmap_preprocess::capture::cpu::rasterise;
use silmap_tests::dense_maps::dense;

const SIDE: u32 = 512;

/// Reads outlines from one map into a mask, all as one camera would see them.
struct Reader<'a> {
    map: &'a SilhouetteMap,
    scratch: MapReader,
}

impl<'a> Reader<'a> {
    fn new(map: &'a SilhouetteMap) -> Self {
        let scratch = MapReader::new(map).unwrap();
        Self { map, scratch }
    }

    fn camera(&self, eye: DVec3) -> Camera {
        Camera::fit_sphere(eye, self.map.center, self.map.radius, None, (SIDE, SIDE)).unwrap()
    }

    fn mask(&mut self, eye: DVec3, method: Method) -> Mask {
        let mut mask = Mask::new(SIDE, SIDE);
        let camera = self.camera(eye);
        self.scratch
            .interpolate(self.map, &camera, method.into())
            .unwrap();
        fill_even_odd(self.scratch.simple_loops().iter(), &mut mask);
        mask
    }

    /// The share of the inside that differs between two eyes.
    fn change(&mut self, eyes: [DVec3; 2], method: Method) -> f64 {
        let [one, two] = eyes.map(|eye| self.mask(eye, method));
        one.count_different(&two) as f64 / one.count() as f64
    }
}

/// Pairs of eyes a hair apart: across edges between triangles, and across the lines inside where the nearest edge changes.
fn pairs_a_hair_apart(map: &SilhouetteMap) -> Vec<[DVec3; 2]> {
    let mut pairs = Vec::new();
    for triangle in map.triangles.iter().step_by(2) {
        let [a, b, c] = triangle.map(|v| map.eye(v));
        for (p, q, r) in [(a, b, c), (b, c, a), (c, a, b)] {
            let hair = (r - p.lerp(q, 0.5)) * 1e-5;
            let on_edge = p.lerp(q, 0.37);
            pairs.push([on_edge - hair, on_edge + hair]);
            // Half-way between two edges: equal distances to both.
            let (to_q, to_r) = (p.distance(q), p.distance(r));
            let opposite = q.lerp(r, to_q / (to_q + to_r));
            let inside = p.lerp(opposite, 0.4);
            let across = (q - r) * 1e-5;
            pairs.push([inside - across, inside + across]);
        }
    }
    pairs
}

/// Beside an edge, what the third view of its triangle shows goes out evenly; where strands hide each other links may differ.
#[test]
fn tight_hardly_jumps_across_edges_or_inside_triangles() {
    let (map, _) = dense(&models::torus(2048), 48, 256, 0.5, CoverageRule::Center);
    let mut reader = Reader::new(&map);
    let pairs = pairs_a_hair_apart(&map);
    let mut changes = |method: Method| {
        let each: Vec<f64> = (pairs.iter())
            .map(|&eyes| reader.change(eyes, method))
            .collect();
        let mean = each.iter().sum::<f64>() / each.len() as f64;
        let jumps = each.iter().filter(|change| **change > 2e-3).count();
        (mean, jumps as f64 / each.len() as f64)
    };
    let (mean, jumps) = changes(Method::Tight);
    assert!(
        mean < 2e-3 && jumps < 0.1,
        "{mean} on average, {jumps} of places jump"
    );
    let (mean, jumps) = changes(Method::Paper);
    assert!(
        mean > 6e-3 && jumps > 0.3,
        "the paper's order goes unnoticed: {mean}, {jumps}"
    );
}

/// Coming nearer and going away, outlines are put together from sectors, more and more.
#[test]
fn outlines_follow_an_eye_that_leaves_the_polytope() {
    let (map, _) = dense(&models::torus(2048), 96, 256, 0.5, CoverageRule::Center);
    let mut reader = Reader::new(&map);
    let mut worst = 0.0_f64;
    let mut moved = 0.0;
    for direction in [DVec3::new(0.2, 1.0, 0.3), DVec3::new(1.0, 0.3, -0.4)] {
        let eye = |distance: f64| map.center + direction.normalize_or_zero() * distance;
        for k in 0..300 {
            let distance = map.radius * 1.8 * 1.004_f64.powi(k);
            let hair = [eye(distance), eye(distance * (1.0 + 1e-6))];
            worst = worst.max(reader.change(hair, Method::Tight));
            moved += reader.change([eye(distance), eye(distance * 1.004)], Method::Tight);
        }
    }
    assert!(moved > 0.05, "the walk moves nothing ({moved})");
    assert!(worst < 1e-3, "a hair moves {worst}");
}

/// As [`Reader::change`], of the true silhouette.
fn exact_change(mesh: &TriangleMesh, reader: &Reader<'_>, eyes: [DVec3; 2]) -> f64 {
    let [one, two] = eyes.map(|eye| {
        let mut mask = Mask::new(SIDE, SIDE);
        rasterise(mesh, &reader.camera(eye), CoverageRule::Center, &mut mask).unwrap();
        mask
    });
    one.count_different(&two) as f64 / one.count() as f64
}

/// Half the step changes half as much, but for steps over events of topology, which the true silhouette has as well.
#[test]
fn changes_shrink_with_the_step() {
    let mesh = models::trefoil_knot(4096);
    let (map, _) = dense(&mesh, 64, 256, 0.5, CoverageRule::Center);
    let mut reader = Reader::new(&map);
    let eye = |turn: f64| {
        let direction = DVec3::new(turn.cos(), 0.5 * (1.3 * turn).sin(), turn.sin());
        map.center + direction.normalize_or_zero() * (2.9 * map.radius)
    };
    // Whole walk, steps of a degree, and some of their sixteenth parts.
    let degree = 1_f64.to_radians();
    for method in [Method::Hull, Method::Tight] {
        let (mut events, mut exact_events, mut coarse, mut fine) = (0, 0, 0.0, 0.0);
        let n_steps = 90;
        for k in 0..n_steps {
            let turn = 4.0 * degree * f64::from(k);
            let whole = reader.change([eye(turn), eye(turn + degree)], method);
            let middle = turn + 0.5 * degree;
            let part = reader.change([eye(middle), eye(middle + degree / 16.0)], method);
            coarse += whole;
            fine += part;
            events += u32::from(part > 0.5 * whole);
            let whole = exact_change(&mesh, &reader, [eye(turn), eye(turn + degree)]);
            let middle = [eye(middle), eye(middle + degree / 16.0)];
            let part = exact_change(&mesh, &reader, middle);
            exact_events += u32::from(part > 0.5 * whole);
        }
        assert!(
            coarse > 0.5,
            "{method:?}: the walk moves nothing ({coarse})"
        );
        assert!(
            fine < coarse / 8.0,
            "{method:?}: steps change {coarse}, their sixteenths {fine}"
        );
        assert!(
            events <= exact_events + 2,
            "{method:?}: {events} events where the true silhouette has {exact_events}"
        );
    }
}
