//! Poses are found again from outlines that the model itself made.

use super::refine_pose as refine_pose_watched;
use super::*;
use crate::test_meshes::torus;
use crate::watch::heard;
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::{Mask, StageEvent};

const SIZE: (u32, u32) = (256, 256);

fn refine_pose(
    mesh: &ClosedMesh,
    outline: &[Loop],
    start: &Camera,
    params: &AlignParams,
) -> Result<Pose, AlignError> {
    refine_pose_watched(mesh, outline, start, params, &Watch::silent())
}

/// A ring that is thicker on one side, bent, and with a bump: no turn leaves it as it is.
fn crooked() -> ClosedMesh {
    let mut mesh = torus(48, 24);
    for p in &mut mesh.positions {
        let (angle, height) = (p.z.atan2(p.x), p.y);
        let bump = 0.35 * (-(angle - 0.8).powi(2) / 0.1).exp();
        *p *= 1.0 + 0.2 * angle.cos() + bump;
        p.y = height * (1.2 + 0.5 * angle.sin()) + 0.25 * p.x * p.x;
    }
    ClosedMesh::try_from(mesh).unwrap()
}

fn camera(mesh: &ClosedMesh, towards: DVec3) -> Camera {
    let bounds = mesh.bounds();
    let eye = bounds.center + towards.normalize_or_zero() * 3.0 * bounds.radius;
    Camera::fit_sphere(eye, bounds.center, bounds.radius, None, SIZE).unwrap()
}

fn outline_of(mesh: &ClosedMesh, camera: &Camera) -> Vec<Loop> {
    let edges = crate::silhouette_edges(mesh.mesh(), camera.eye);
    let mut outliner = Outliner::new(&mesh.mesh().positions);
    outliner.outline(&edges, camera).unwrap()
}

/// A pose beside the right one: turned by 5° and moved by 5 % of the radius, in directions that depend on `k`.
fn beside(camera: &Camera, mesh: &ClosedMesh, k: u32) -> Camera {
    let wave = |s: f64| (s * f64::from(k + 1)).sin();
    let axis = DVec3::new(wave(1.1), wave(2.3), wave(3.7)).normalize_or_zero();
    let way = DVec3::new(wave(0.9), wave(1.7), wave(2.9)).normalize_or_zero();
    let bounds = mesh.bounds();
    let turn = DMat3::from_axis_angle(axis, 5.0_f64.to_radians());
    moved(camera, bounds.center, turn, way * 0.05 * bounds.radius)
}

/// How far off a pose is: radians, and radii.
fn errors(found: &Camera, truth: &Camera, mesh: &ClosedMesh) -> (f64, f64) {
    let bounds = mesh.bounds();
    let seen = |c: &Camera| {
        let offset = bounds.center - c.eye;
        DVec3::new(offset.dot(c.right), offset.dot(c.up), offset.dot(c.forward))
    };
    let shift = seen(found).distance(seen(truth)) / bounds.radius;
    (angle_between(found, truth), shift)
}

#[test]
fn a_pose_is_found_again_from_its_outline() {
    let mesh = crooked();
    let mut n_found = 0;
    for k in 0..10 {
        let truth = camera(&mesh, DVec3::new(0.4 + 0.1 * f64::from(k), 0.9, 1.0));
        let start = beside(&truth, &mesh, k);
        let before = errors(&start, &truth, &mesh);
        assert!(before.0 > 0.08 && before.1 > 0.045, "{before:?}");
        let outline = outline_of(&mesh, &truth);
        let pose = refine_pose(&mesh, &outline, &start, &AlignParams::default()).unwrap();
        let (angle, shift) = errors(&pose.camera, &truth, &mesh);
        n_found += u32::from(angle < 0.3_f64.to_radians() && shift < 0.003);
    }
    assert!(n_found >= 9, "{n_found} of 10");
}

#[test]
fn a_mask_is_enough() {
    let mesh = crooked();
    let truth = camera(&mesh, DVec3::new(1.0, 0.8, 0.3));
    let mut mask = Mask::new(SIZE.0, SIZE.1);
    fill_non_zero(outline_of(&mesh, &truth), &mut mask);
    // The sides of pixels, as a tracer would follow them.
    let loops = pixel_sides(&mask);
    let start = beside(&truth, &mesh, 3);
    let pose = refine_pose(&mesh, &loops, &start, &AlignParams::default()).unwrap();
    let (angle, shift) = errors(&pose.camera, &truth, &mesh);
    assert!(
        angle < 0.3_f64.to_radians() && shift < 0.004,
        "{angle} {shift}"
    );
    assert!(pose.distance_px < 0.5);
}

/// The outline of a mask whose rows and columns are all met in one run each way round: its left sides up, its right sides down,
/// with holes the other way.
fn pixel_sides(mask: &Mask) -> Vec<Loop> {
    // Each pixel side between inside and outside, directed with the inside on its right as seen; joined end to start.
    let mut next = std::collections::BTreeMap::new();
    let inside = |x: i64, y: i64| mask.get(x, y);
    for y in 0..i64::from(mask.height()) {
        for x in 0..i64::from(mask.width()) {
            if !inside(x, y) {
                continue;
            }
            for ((dx, dy), from, to) in [
                ((0, -1), (x, y), (x + 1, y)),
                ((1, 0), (x + 1, y), (x + 1, y + 1)),
                ((0, 1), (x + 1, y + 1), (x, y + 1)),
                ((-1, 0), (x, y + 1), (x, y)),
            ] {
                if !inside(x + dx, y + dy) {
                    next.insert(from, to);
                }
            }
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let (mut points, mut at) = (Vec::new(), start);
        while let Some(to) = next.remove(&at) {
            points.push(DVec2::new(at.0 as f64, at.1 as f64));
            at = to;
        }
        loops.push(points);
    }
    loops
}

#[test]
fn the_right_pose_stays_and_another_models_outline_does_not_fit() {
    let mesh = crooked();
    let truth = camera(&mesh, DVec3::new(0.6, 0.9, 1.0));
    let outline = outline_of(&mesh, &truth);
    let params = AlignParams::default();
    let pose = refine_pose(&mesh, &outline, &truth, &params).unwrap();
    let (angle, shift) = errors(&pose.camera, &truth, &mesh);
    assert!(angle < 1e-3 && shift < 1e-3, "{angle} {shift}");
    assert!(pose.distance_px < 0.1 && pose.fits(), "{pose:?}");
    let other = ClosedMesh::try_from(torus(24, 12)).unwrap();
    let strange = outline_of(&other, &camera(&other, DVec3::new(0.6, 0.9, 1.0)));
    let pose = refine_pose(&mesh, &strange, &truth, &params).unwrap();
    assert!(pose.distance_px > 1.0, "{}", pose.distance_px);
    assert!(!pose.fits(), "{pose:?}");
    let lenient = AlignParams {
        fits_within_px: Some(100.0),
        ..params
    };
    let pose = refine_pose(&mesh, &strange, &truth, &lenient).unwrap();
    assert!(pose.fits() && pose.fits_within_px == 100.0);
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let mesh = crooked();
    let start = camera(&mesh, DVec3::X);
    let params = AlignParams::default();
    let refined = |outline: &[Loop], camera: &Camera| refine_pose(&mesh, outline, camera, &params);
    assert_eq!(refined(&[], &start), Err(AlignError::NoOutline));
    let away = Camera {
        forward: -start.forward,
        right: -start.right,
        ..start
    };
    let outline = outline_of(&mesh, &start);
    assert!(matches!(
        refined(&outline, &away),
        Err(AlignError::Outline(_))
    ));
}

#[test]
fn an_eye_close_to_the_model_is_no_trouble() {
    let mesh = crooked();
    let truth = camera(&mesh, DVec3::X);
    let outline = outline_of(&mesh, &truth);
    // Within a hair of a vertex, which is seen millions of pixels beside the image.
    let corner = mesh.mesh().positions[0];
    for away in [1e-3, 1e-7] {
        let eye = corner + truth.right * away;
        let close = Camera { eye, ..truth };
        let _ = refine_pose(&mesh, &outline, &close, &AlignParams::default());
    }
}

#[test]
fn it_counts_rounds_and_stops_when_told() {
    let mesh = crooked();
    let truth = camera(&mesh, DVec3::new(0.6, 0.9, 1.0));
    // Another model's outline: every start is tried.
    let other = ClosedMesh::try_from(torus(24, 12)).unwrap();
    let strange = outline_of(&other, &camera(&other, DVec3::new(0.6, 0.9, 1.0)));
    let params = AlignParams {
        rounds: 4,
        ..AlignParams::default()
    };
    let told = heard(usize::MAX, |watch| {
        let pose = refine_pose_watched(&mesh, &strange, &truth, &params, watch).unwrap();
        assert!(pose.rounds > 4, "one start alone");
    });
    let stage = FIT;
    assert_eq!(told[0], StageEvent::Started { stage, total: 28 });
    assert_eq!(told.last(), Some(&StageEvent::Finished { stage }));
    let round = StageEvent::Advanced { stage, count: 1 };
    let rounds = &told[1..told.len() - 1];
    assert!(rounds.len() > 4 && rounds.iter().all(|event| *event == round));
    for last in [1, 2, 7] {
        let heard = heard(last, |watch| {
            let stopped = refine_pose_watched(&mesh, &strange, &truth, &params, watch);
            assert_eq!(stopped, Err(AlignError::Interrupted(Interrupted)));
        });
        assert_eq!(heard, told[..last]);
    }
}
