//! Silhouettes survive where they are looked at.

use glam::DVec2;
use silmap_geometry::polygon::{Loop, fill_non_zero};
use silmap_geometry::{Camera, Mask};

use super::simplify as simplify_watched;
use super::*;
use crate::test_meshes::{bicone, flat_drum, torus};
use crate::{Outliner, silhouette_edges};

fn simplify(
    mesh: &ClosedMesh,
    eyes: &[DVec3],
    params: &SimplifyParams,
) -> Result<TriangleMesh, SimplifyError> {
    simplify_watched(mesh, eyes, params, &mut |_| true)
}

/// A fine torus with waves all over it.
fn wavy() -> ClosedMesh {
    let mut mesh = torus(96, 64);
    for p in &mut mesh.positions {
        let wave = (9.0 * p.x).sin() * (8.0 * p.y).cos() * (7.0 * p.z).sin();
        *p *= 1.0 + 0.06 * wave;
    }
    ClosedMesh::try_from(mesh).unwrap()
}

fn mask(mesh: &TriangleMesh, like: &ClosedMesh, eye: DVec3) -> Mask {
    let bounds = like.bounds();
    let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (512, 512)).unwrap();
    let loops: Vec<Loop> = Outliner::new(&mesh.positions)
        .outline(&silhouette_edges(mesh, eye), &camera)
        .unwrap();
    assert!(loops.iter().flatten().all(|p: &DVec2| p.is_finite()));
    let mut mask = Mask::new(512, 512);
    fill_non_zero(&loops, &mut mask);
    mask
}

/// The pixels that are wrong from `eye`, over those inside.
fn error(simple: &TriangleMesh, mesh: &ClosedMesh, eye: DVec3) -> f64 {
    let truth = mask(mesh.mesh(), mesh, eye);
    mask(simple, mesh, eye).count_different(&truth) as f64 / truth.count() as f64
}

fn params(target_faces: u32) -> SimplifyParams {
    SimplifyParams {
        target_faces,
        ..SimplifyParams::default()
    }
}

#[test]
fn silhouettes_that_are_looked_at_stay() {
    let mesh = wavy();
    let eye = DVec3::new(1.0, 4.0, 2.0);
    let plain = simplify(&mesh, &[], &params(600)).unwrap();
    let guided = simplify(&mesh, &[eye], &params(600)).unwrap();
    for simple in [&plain, &guided] {
        assert!(simple.faces.len() <= 600 && simple.faces.len() > 590);
        ClosedMesh::try_from(simple.clone()).unwrap();
    }
    let [before, after] = [&plain, &guided].map(|m| error(m, &mesh, eye));
    assert!(after < 0.5 * before, "{after} is not half of {before}");
    // From elsewhere there is nothing to gain.
    let elsewhere = DVec3::new(-1.0, 0.5, 4.0);
    let [plain, guided] = [&plain, &guided].map(|m| error(m, &mesh, elsewhere));
    assert!(guided > 0.8 * plain, "{guided} {plain}");
}

#[test]
fn nothing_depends_on_place_and_scale() {
    let mesh = wavy();
    let eye = DVec3::new(1.0, 4.0, 2.0);
    let reference = simplify(&mesh, &[eye], &params(400)).unwrap();
    let mut large = mesh.mesh().clone();
    for p in &mut large.positions {
        *p *= 1024.0;
    }
    let large = ClosedMesh::try_from(large).unwrap();
    let scaled = simplify(&large, &[eye * 1024.0], &params(400)).unwrap();
    assert_eq!(scaled.faces, reference.faces);
}

#[test]
fn nearness_is_one_at_silhouettes_and_zero_at_what_faces_the_eye() {
    let mesh = torus(64, 48);
    let eye = DVec3::Y * 50.0;
    let nearness = silhouette_nearness(&mesh, &[eye], 0.2);
    let mut on_silhouette = 0;
    for edge in silhouette_edges(&mesh, eye) {
        assert_eq!(nearness[edge.from as usize], 1.0);
        on_silhouette += 1;
    }
    assert!(on_silhouette > 100);
    for (p, near) in mesh.positions.iter().zip(&nearness) {
        // Radii are 1 and 0.4: these lie where the tube faces up or down.
        if p.y.abs() > 0.35 {
            assert_eq!(*near, 0.0, "{p}");
        }
    }
    assert!(
        silhouette_nearness(&mesh, &[], 0.2)
            .iter()
            .all(|&n| n == 0.0)
    );
}

#[test]
fn it_goes_as_far_as_it_can_and_bad_parameters_are_named() {
    let mesh = ClosedMesh::try_from(torus(12, 8)).unwrap();
    let least = simplify(&mesh, &[], &params(4)).unwrap();
    ClosedMesh::try_from(least.clone()).unwrap();
    // A torus cannot be made of fewer than 14 faces.
    assert!(
        (14..60).contains(&least.faces.len()),
        "{}",
        least.faces.len()
    );
    for (params, name) in [
        (params(3), "face count"),
        (
            SimplifyParams {
                band_rad: 0.0,
                ..params(9)
            },
            "band",
        ),
        (
            SimplifyParams {
                weight: f64::NAN,
                ..params(9)
            },
            "weight",
        ),
    ] {
        let error = simplify(&mesh, &[], &params).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
    let eyes = [DVec3::X, DVec3::NAN];
    assert_eq!(
        simplify(&mesh, &eyes, &SimplifyParams::default()),
        Err(SimplifyError::BadEye { index: 1 })
    );
}

#[test]
fn it_tells_how_far_it_is_and_stops_when_told() {
    let mesh = wavy();
    let eyes = [DVec3::new(1.0, 4.0, 2.0), DVec3::Z * 5.0];
    let mut told = Vec::new();
    let mut watch = |advance| {
        told.push(advance);
        true
    };
    simplify_watched(&mesh, &eyes, &params(600), &mut watch).unwrap();
    let last = told[told.len() - 1];
    assert!(told.len() > 10 && told.is_sorted_by_key(|a: &Advance| a.done));
    assert!(told.iter().all(|a| a.total == last.total));
    assert!(
        last.done <= last.total && last.done > last.total / 2,
        "{last:?}"
    );
    // Wherever it is told to stop, it calls no more.
    for stop_at in [0, 1, 5, told.len() - 1] {
        let mut calls = 0;
        let mut watch = |_| {
            calls += 1;
            calls <= stop_at
        };
        let stopped = simplify_watched(&mesh, &eyes, &params(600), &mut watch);
        assert_eq!(stopped, Err(SimplifyError::Interrupted));
        assert_eq!(calls, stop_at + 1);
    }
}

#[test]
fn a_vertex_of_many_faces_costs_no_more_than_many_vertices() {
    for fan in [bicone, flat_drum] {
        let looked_at = |sides: u32| {
            let mesh = ClosedMesh::try_from(fan(sides)).unwrap();
            shrinking::LOOKED_AT.set(0);
            let simple = simplify(&mesh, &[], &params(80)).unwrap();
            assert!(ClosedMesh::try_from(simple.clone()).is_ok());
            assert!(simple.faces.len() <= 80, "{} faces", simple.faces.len());
            shrinking::LOOKED_AT.get()
        };
        let (few, many) = (looked_at(500), looked_at(2_000));
        // Four times as many faces; the square would be sixteen times as much.
        assert!(many < 6 * few, "{few} and {many}");
    }
}
