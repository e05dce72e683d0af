//! Two independent ways to the same region: the exact outline's loops filled by winding number, and the faces drawn one
//! by one.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::LazyLock;

use glam::{DVec2, DVec3};
use silmap_exact::outline_loops;
use silmap_geometry::polygon::{self, Loop, fill_non_zero};
use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh};
use silmap_models::{self as models, ModelKind};
use silmap_preprocess::capture::cpu::rasterise;
use silmap_tests::tolerance::RASTERISED_EDGE_PX;

const SIZE_PX: u32 = 192;

/// Random viewpoints a model, besides those on the axes.
const RANDOM_EYES: u64 = 12;

/// Numbers in [0, 1) from a seed, by the splitmix64 generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Directions to look from, and distances in bounding radii: on the axes, where symmetric models have many faces edge-on
/// and vertices behind one another, and anywhere.
fn viewpoints(seed: u64) -> Vec<(DVec3, f64)> {
    let mut random = Random(seed);
    let mut found: Vec<_> = [DVec3::X, DVec3::NEG_Y, DVec3::Z]
        .map(|axis| (axis, 3.0))
        .to_vec();
    for _ in 0..RANDOM_EYES {
        let z = 2.0 * random.next() - 1.0;
        let across = DVec2::from_angle(std::f64::consts::TAU * random.next());
        let direction = (across * (1.0 - z * z).sqrt()).extend(z);
        found.push((direction, 1.1 * 9.0_f64.powf(random.next())));
    }
    found
}

fn cameras(mesh: &TriangleMesh, seed: u64) -> Vec<Camera> {
    let bounds = mesh.bounds();
    viewpoints(seed)
        .into_iter()
        .map(|(direction, distance)| {
            let eye = bounds.center + direction * (distance * bounds.radius);
            Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (SIZE_PX, SIZE_PX))
                .expect("the eye is outside the bounding sphere")
        })
        .collect()
}

static TEST_MODELS: LazyLock<Vec<(ModelKind, TriangleMesh)>> = LazyLock::new(|| {
    ModelKind::ALL
        .into_iter()
        .map(|kind| (kind, models::generate(kind, 3_000)))
        .collect()
});

fn drawn(mesh: &TriangleMesh, camera: &Camera, rule: CoverageRule) -> Mask {
    let mut mask = Mask::new(SIZE_PX, SIZE_PX);
    rasterise(mesh, camera, rule, &mut mask).expect("the whole model is in front of the camera");
    mask
}

fn filled(loops: &[Loop]) -> Mask {
    let mut mask = Mask::new(SIZE_PX, SIZE_PX);
    fill_non_zero(loops, &mut mask);
    mask
}

fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    p.distance(if t.is_finite() {
        a + along * t.clamp(0.0, 1.0)
    } else {
        a
    })
}

/// Pixels that differ though their centre is farther than [`RASTERISED_EDGE_PX`] from every edge of the loops.
fn true_differences(a: &Mask, b: &Mask, loops: &[Loop]) -> usize {
    let pixels = (0..SIZE_PX).flat_map(|y| (0..SIZE_PX).map(move |x| (x, y)));
    pixels
        .filter(|&(x, y)| a.get(x.into(), y.into()) != b.get(x.into(), y.into()))
        .filter(|&(x, y)| {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            loops
                .iter()
                .flat_map(|l| polygon::edges(l))
                .all(|(p, q)| distance_to_segment(centre, p, q) > RASTERISED_EDGE_PX)
        })
        .count()
}

#[test]
fn filled_loops_are_the_drawn_mask() {
    let (mut compared, mut covered, mut on_edges) = (0, 0, 0);
    for (kind, mesh) in &*TEST_MODELS {
        for camera in cameras(mesh, 1999) {
            let loops = outline_loops(mesh, &camera).expect("the model is in front of the eye");
            let (exact, captured) = (filled(&loops), drawn(mesh, &camera, CoverageRule::Center));
            assert_eq!(
                true_differences(&exact, &captured, &loops),
                0,
                "{kind} from {}",
                camera.eye
            );
            compared += 1;
            covered += exact.count();
            on_edges += exact.count_different(&captured);
        }
    }
    assert_eq!(compared, ModelKind::ALL.len() as u64 * (RANDOM_EYES + 3));
    // The tolerance must not swallow the comparison: next to no centre lies on an edge.
    assert!(covered > 100_000, "{covered} pixels covered");
    assert!(
        on_edges * 2_000 < covered,
        "{on_edges} of {covered} pixels left out"
    );
}

#[test]
fn every_centre_inside_is_touched() {
    for (kind, mesh) in &*TEST_MODELS {
        for camera in cameras(mesh, 2000) {
            let loops = outline_loops(mesh, &camera).expect("the model is in front of the eye");
            let touched = drawn(mesh, &camera, CoverageRule::Any);
            let exact = filled(&loops);
            assert_eq!(
                exact.count_missing_in(&touched),
                0,
                "{kind} from {}",
                camera.eye
            );
            assert!(
                touched.count() > exact.count(),
                "{kind} from {}",
                camera.eye
            );
        }
    }
}

#[test]
fn shifted_or_missing_loops_are_noticed() {
    for (kind, mesh) in &*TEST_MODELS {
        for camera in cameras(mesh, 2011) {
            let loops = outline_loops(mesh, &camera).expect("the model is in front of the eye");
            let captured = drawn(mesh, &camera, CoverageRule::Center);
            let differs = |changed: &[Loop]| true_differences(&filled(changed), &captured, changed);
            let shifted: Vec<Loop> = loops
                .iter()
                .map(|l| l.iter().map(|&p| p + DVec2::X * 2.0).collect())
                .collect();
            assert!(
                differs(&shifted) > 20,
                "{kind} shifted, from {}",
                camera.eye
            );
            let largest = (0..loops.len())
                .max_by(|&i, &j| {
                    let area = |k: usize| polygon::signed_area(&loops[k]).abs();
                    area(i).total_cmp(&area(j))
                })
                .expect("a model has an outline");
            let mut missing = loops.clone();
            missing.remove(largest);
            assert!(differs(&missing) > 20, "{kind} cut, from {}", camera.eye);
        }
    }
}
