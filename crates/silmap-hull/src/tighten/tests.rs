//! Tightened hulls: smaller, and enclosing all the same.

use glam::DVec3;
use silmap_geometry::{Bvh, ClosedMesh, TriangleMesh};

use super::is_inside_out;
use crate::{
    HullLevel, HullParams, ProgressiveHull, Tightening, VerifyParams, build, verify, verify_inner,
};
use silmap_geometry::Watch;
use silmap_models as models;

/// Rounding of the places where faces meet, in radii.
const ROUNDING: VerifyParams = VerifyParams {
    tolerance_rel: 1e-12,
    samples: 5000,
};

fn hull_of(mesh: &ClosedMesh, params: &HullParams) -> ProgressiveHull {
    build(mesh, params, &Watch::silent()).unwrap()
}

fn params(target_faces: u32) -> HullParams {
    HullParams {
        target_faces,
        ..HullParams::default()
    }
}

fn tightened(hull: &ProgressiveHull, faces: usize, how: Tightening) -> HullLevel {
    hull.tightened_level(faces, how, &Watch::silent()).unwrap()
}

fn assert_encloses(mesh: &ClosedMesh, level: &HullLevel, name: &str) {
    let report = if level.is_inner {
        verify_inner(&level.mesh, mesh.mesh(), &ROUNDING)
    } else {
        verify(mesh.mesh(), &level.mesh, &ROUNDING)
    };
    assert!(report.encloses, "{name}: {report:?}");
    ClosedMesh::try_from(level.mesh.clone()).unwrap();
    assert!((level.mesh.volume() - level.volume).abs() < 1e-9 * level.volume);
}

#[test]
fn it_takes_a_good_part_of_what_is_too_much() {
    let shapes = [
        ("torus", models::torus(4000)),
        ("knot", models::trefoil_knot(4000)),
        ("organic", models::organic(6000)),
    ];
    for (name, mesh) in shapes {
        let mesh = ClosedMesh::try_from(mesh).unwrap();
        for inner in [false, true] {
            let hull = hull_of(
                &mesh,
                &HullParams {
                    inner,
                    ..params(200)
                },
            );
            let excess = |level: &HullLevel| (level.volume_ratio - 1.0).abs();
            let off = tightened(&hull, 200, Tightening::Off);
            let fast = tightened(&hull, 200, Tightening::Fast);
            let best = tightened(&hull, 200, Tightening::Best);
            assert_eq!(off, hull.level(200));
            for level in [&fast, &best] {
                assert_eq!(level.mesh.faces.len(), 200, "{name}, inner {inner}");
                assert_encloses(&mesh, level, name);
            }
            // The inner hull of a round shape has little left to give.
            let most = if inner { 0.99 } else { 0.8 };
            assert!(
                excess(&fast) < most * excess(&off) && excess(&best) <= excess(&fast),
                "{name}, inner {inner}: {} {} {}",
                excess(&off),
                excess(&fast),
                excess(&best)
            );
        }
    }
}

#[test]
fn no_part_of_it_is_inside_out() {
    // Few faces around a hole: placed freely, they pass through one another, and what they then wind around the wrong way counts
    // as negative volume.
    let mut thick = models::torus(8700);
    for p in &mut thick.positions {
        let ring = DVec3::new(p.x, p.y, 0.0).normalize_or_zero();
        *p = ring + (*p - ring) * 1.25;
    }
    let mesh = ClosedMesh::try_from(thick).unwrap();
    let mut n_wrong = 0;
    for faces in [60, 80, 100] {
        let hull = hull_of(&mesh, &params(faces));
        for schedule in Tightening::Best.schedules() {
            let free = (hull.tightened(
                faces as usize,
                schedule,
                true,
                f64::INFINITY,
                &Watch::silent(),
            ))
            .unwrap();
            n_wrong += u32::from(is_inside_out(&free.mesh));
        }
        for how in [Tightening::Fast, Tightening::Best] {
            let level = tightened(&hull, faces as usize, how);
            assert!(level.volume_ratio > 1.0, "{}", level.volume_ratio);
            assert!(!is_inside_out(&level.mesh));
            assert_encloses(&mesh, &level, "torus");
        }
    }
    assert!(n_wrong > 0, "the test does not see what it is for");
}

#[test]
fn it_does_not_depend_on_scale() {
    let mesh = models::trefoil_knot(2000);
    let reference = hull_of(&ClosedMesh::try_from(mesh.clone()).unwrap(), &params(150));
    let reference = tightened(&reference, 150, Tightening::Best);
    for exponent in [-30, 7] {
        let factor = f64::from(exponent).exp2();
        let mut scaled = mesh.clone();
        for p in &mut scaled.positions {
            *p *= factor;
        }
        let hull = hull_of(&ClosedMesh::try_from(scaled).unwrap(), &params(150));
        let level = tightened(&hull, 150, Tightening::Best);
        assert_eq!(level.mesh.faces, reference.mesh.faces, "2^{exponent}");
        for (a, b) in level.mesh.positions.iter().zip(&reference.mesh.positions) {
            assert_eq!(*a, *b * factor);
        }
    }
}

#[test]
fn several_parts_and_far_away_ones_stay_enclosed() {
    let part = models::torus(1500);
    let mut all = TriangleMesh::default();
    // Two rings that pass through one another, far from the origin.
    for (turned, by) in [(false, DVec3::ZERO), (true, DVec3::X)] {
        let shift = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|&p| {
            let p = if turned {
                DVec3::new(p.x, -p.z, p.y)
            } else {
                p
            };
            p + by + DVec3::new(3e3, -2e3, 1e3)
        }));
        let faces = part.faces.iter().map(|f| f.map(|v| v + shift));
        all.faces.extend(faces);
    }
    let mesh = ClosedMesh::try_from(all).unwrap();
    let hull = hull_of(&mesh, &params(160));
    for how in [Tightening::Fast, Tightening::Best] {
        let level = tightened(&hull, 160, how);
        assert!(level.volume_ratio < hull.level(160).volume_ratio);
        // As far away as this, coordinates have fewer digits left.
        let report = verify(mesh.mesh(), &level.mesh, &VerifyParams::default());
        assert!(report.encloses && report.escaped_rel < 1e-10, "{report:?}");
    }
}

#[test]
fn the_limit_on_distance_holds_for_it_too() {
    let mesh = ClosedMesh::try_from(models::torus(3000)).unwrap();
    let limit = 0.02 * mesh.bounds().radius;
    let params = HullParams {
        max_distance: Some(limit),
        ..params(20)
    };
    let hull = hull_of(&mesh, &params);
    let tree = Bvh::new(mesh.mesh());
    let faces = hull.least_faces();
    for how in [Tightening::Fast, Tightening::Best] {
        let level = tightened(&hull, faces, how);
        assert!(level.volume_ratio < hull.level(faces).volume_ratio);
        assert!(level.distance <= limit * (1.0 + 1e-9));
        for p in &level.mesh.positions {
            assert!(tree.closest_point(*p).0.distance(*p) <= limit * (1.0 + 1e-9));
        }
    }
}
