//! Silhouettes are preserved from the given viewpoints.

use glam::DVec2;
use silmap_geometry::polygon::{Loop, fill_non_zero};
use silmap_geometry::{Camera, Mask, Material, StageEvent};

use super::simplify as simplify_watched;
use super::*;
use crate::test_meshes::torus;
use crate::watch::heard;
use crate::{Outliner, silhouette_edges};
use silmap_models::{bicone, flat_drum};

fn simplify(
    mesh: &ClosedMesh,
    eyes: &[DVec3],
    params: &SimplifyParams,
) -> Result<TriangleMesh, SimplifyError> {
    simplify_watched(mesh, eyes, params, &Watch::silent()).map(|simplified| simplified.mesh)
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
    let told = heard(usize::MAX, |watch| {
        simplify_watched(&mesh, &eyes, &params(600), watch).unwrap();
    });
    let Some(StageEvent::Started { stage, total }) = told.first().copied() else {
        panic!("it does not start: {told:?}");
    };
    assert_eq!(told.last(), Some(&StageEvent::Finished { stage }));
    let counts = told.iter().filter_map(|event| match event {
        StageEvent::Advanced { count, .. } => Some(*count),
        _ => None,
    });
    let counts: Vec<u64> = counts.collect();
    let done: u64 = counts.iter().sum();
    assert!(counts.len() > 9 && counts.iter().all(|&count| count > 0));
    assert!(done <= total && done > total / 2, "{done} of {total}");
    // Wherever it is asked to stop, it reports nothing more.
    for last in [1, 2, 6, told.len() - 2] {
        let heard = heard(last, |watch| {
            let stopped = simplify_watched(&mesh, &eyes, &params(600), watch);
            assert_eq!(stopped, Err(SimplifyError::Interrupted(Interrupted)));
        });
        assert_eq!(heard, told[..last]);
    }
}

/// A torus with the texture coordinates of its two angles: seams where each begins again; and colours by place.
fn painted(n_around: u32, n_across: u32) -> ClosedMesh {
    let mut mesh = torus(n_around, n_across);
    let colour = |p: DVec3| [p.x, p.y, p.z].map(|x| (0.5 + 0.2 * x) as f32);
    let angles = |p: DVec3| {
        let around = p.z.atan2(p.x).rem_euclid(std::f64::consts::TAU);
        // The circle in the middle of the tube, whatever its radius.
        let middle = mesh
            .positions
            .iter()
            .map(|q| q.x.hypot(q.z))
            .fold(0.0, f64::max)
            + (mesh.positions.iter())
                .map(|q| q.x.hypot(q.z))
                .fold(f64::INFINITY, f64::min);
        let across =
            p.y.atan2(p.x.hypot(p.z) - 0.5 * middle)
                .rem_euclid(std::f64::consts::TAU);
        [around, across].map(|a| a / std::f64::consts::TAU)
    };
    let mut uvs = Vec::new();
    for face in &mesh.faces {
        let middle: DVec3 = face
            .iter()
            .map(|&v| mesh.positions[v as usize])
            .sum::<DVec3>()
            / 3.0;
        let near = angles(middle);
        uvs.push(face.map(|v| {
            let of_corner = angles(mesh.positions[v as usize]);
            [0, 1].map(|k| {
                // On the side of the seam where the face is.
                let turns = (near[k] - of_corner[k]).round();
                (of_corner[k] + turns) as f32
            })
        }));
    }
    mesh.appearance.corner_uvs = uvs;
    mesh.appearance.corner_colours = (mesh.faces.iter())
        .map(|face| face.map(|v| colour(mesh.positions[v as usize])))
        .collect();
    mesh.appearance.face_materials = vec![0; mesh.faces.len()];
    mesh.appearance.materials = vec![Material {
        base_colour: [1.0; 3],
        ..Material::default()
    }];
    ClosedMesh::try_from(mesh).unwrap()
}

#[test]
fn colours_and_texture_coordinates_stay_with_the_surface() {
    let mesh = painted(64, 32);
    let simplified = simplify_watched(
        &mesh,
        &[DVec3::new(1.0, 4.0, 2.0)],
        &params(500),
        &Watch::silent(),
    )
    .unwrap();
    assert_eq!(simplified.stretched, 0);
    let simple = simplified.mesh;
    assert!(simple.faces.len() <= 500);
    let paint = &simple.appearance;
    assert_eq!(paint.corner_uvs.len(), simple.faces.len());
    assert_eq!(paint.face_materials.len(), simple.faces.len());
    let mut widest = 0.0_f32;
    for (f, face) in simple.faces.iter().enumerate() {
        for (k, &v) in face.iter().enumerate() {
            let p = simple.positions[v as usize];
            let found = paint.corner_colours[f][k];
            for (c, x) in [p.x, p.y, p.z].into_iter().enumerate() {
                let wanted = (0.5 + 0.2 * x) as f32;
                assert!((found[c] - wanted).abs() < 0.02, "{found:?} at {p}");
            }
            let around = (p.z.atan2(p.x) / std::f64::consts::TAU).rem_euclid(1.0) as f32;
            let off = paint.corner_uvs[f][k][0] - around;
            // To a whole turn at the seam.
            assert!((off - off.round()).abs() < 0.02, "{off} at {p}");
        }
        // No face reaches across a seam: its coordinates are as close together as its corners.
        for axis in 0..2 {
            let values = paint.corner_uvs[f].map(|uv| uv[axis]);
            let low = values.into_iter().fold(f32::INFINITY, f32::min);
            let high = values.into_iter().fold(f32::NEG_INFINITY, f32::max);
            widest = widest.max(high - low);
            assert!(
                (-0.001..=1.001).contains(&low) && high <= 1.001,
                "{values:?}"
            );
        }
    }
    assert!(widest < 0.45, "{widest}");
    let plain = {
        let mut bare = mesh.mesh().clone();
        bare.appearance = Appearance::default();
        ClosedMesh::try_from(bare).unwrap()
    };
    let bare = simplify(&plain, &[], &params(500)).unwrap();
    assert_eq!(bare.appearance, Appearance::default());
}

#[test]
fn seams_everywhere_are_torn_rather_than_the_goal_missed() {
    // Each face a colour of its own: no vertex has one look.
    let mut mesh = torus(40, 20);
    mesh.appearance.corner_colours = (0..mesh.faces.len())
        .map(|f| [[(f % 17) as f32 / 17.0, (f % 5) as f32 / 5.0, 0.5]; 3])
        .collect();
    let mesh = ClosedMesh::try_from(mesh).unwrap();
    let simplified = simplify_watched(&mesh, &[], &params(300), &Watch::silent()).unwrap();
    assert!(simplified.mesh.faces.len() <= 300);
    assert!(simplified.stretched > 0);
    // Of one colour each, still.
    let is_plain = |corners: &[[f32; 3]; 3]| corners[0] == corners[1] && corners[1] == corners[2];
    let colours = &simplified.mesh.appearance.corner_colours;
    let n_plain = colours.iter().filter(|c| is_plain(c)).count();
    assert!(
        n_plain * 10 > colours.len() * 9,
        "{n_plain} of {}",
        colours.len()
    );
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
