//! Hulls enclose: every level the finer ones and the model, outer and inner, in double and single precision.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use silmap_geometry::ClosedMesh;
use silmap_geometry::Watch;
use silmap_hull::{self as hull, HullParams, ProgressiveHull, Tightening, VerifyParams, verify};
use silmap_mesh_io::{self as mesh_io, LoadOptions};
use silmap_models as models;
use silmap_tests::outside;

/// What rounding to single precision may cost, in radii of the model.
const LEAK_REL: f64 = 1e-6;

/// Real models that need no repair, with bounds on the volumes of their hulls of 500 faces over their own, collapsed and tightened:
/// what was measured, and a twentieth more of what is above one.
const REAL_MODELS: [(&str, f64, f64); 6] = [
    ("stanford-bunny-closed.off", 1.104, 1.068),
    ("spot/spot_triangulated.obj", 1.073, 1.056),
    ("cheburashka.off", 1.112, 1.073),
    ("knot-quads.obj", 1.127, 1.112),
    ("fuze/fuze.obj", 1.0145, 1.0145),
    ("decimated-knight.off", 1.137, 1.132),
];

fn hull_of(mesh: &ClosedMesh, target_faces: u32, inner: bool) -> ProgressiveHull {
    let params = HullParams {
        target_faces,
        inner,
        ..HullParams::default()
    };
    hull::build(mesh, &params, &Watch::silent()).unwrap()
}

fn generated() -> Vec<(&'static str, ClosedMesh)> {
    [
        ("torus", models::torus(3000)),
        ("knot", models::trefoil_knot(4000)),
        ("three holes", models::three_holed_torus(4000)),
        ("organic", models::organic(6000)),
    ]
    .into_iter()
    .map(|(name, mesh)| (name, ClosedMesh::try_from(mesh).unwrap()))
    .collect()
}

#[test]
fn every_level_encloses_the_finer_one_and_the_model() {
    let params = VerifyParams {
        tolerance_rel: 1e-9,
        samples: 1000,
    };
    for (name, mesh) in generated() {
        for inner in [false, true] {
            let hull = hull_of(&mesh, 200, inner);
            let mut finer = mesh.mesh().clone();
            let mut volume_ratio = 1.0;
            for faces in [2000, 1000, 500, 300, 200] {
                let level = hull.level(faces);
                let towards = if inner { -1.0 } else { 1.0 };
                assert!(
                    (level.volume_ratio - volume_ratio) * towards > 0.0,
                    "{name}, {faces} faces: the volume must not turn back"
                );
                for other in [&finer, mesh.mesh()] {
                    let (inside, outside) = if inner {
                        (&level.mesh, other)
                    } else {
                        (other, &level.mesh)
                    };
                    let report = verify(inside, outside, &params);
                    assert!(
                        report.encloses,
                        "{name}, inner {inner}, {faces} faces: {report:?}"
                    );
                }
                ClosedMesh::try_from(level.mesh.clone()).unwrap();
                volume_ratio = level.volume_ratio;
                finer = level.mesh;
            }
        }
    }
}

#[test]
fn a_coarse_level_does_not_enclose_a_coarser_one() {
    for (name, mesh) in generated() {
        let hull = hull_of(&mesh, 200, false);
        let (fine, coarse) = (hull.level(600).mesh, hull.level(200).mesh);
        let report = verify(&coarse, &fine, &VerifyParams::default());
        assert!(!report.encloses, "{name}: {report:?}");
        assert!(report.vertices_outside > 0 && report.samples_outside > 0);
    }
}

#[test]
fn single_precision_hulls_enclose() {
    for (name, mesh) in generated() {
        let rounded = hull_of(&mesh, 300, false).level(300).round();
        let report = verify(mesh.mesh(), &rounded.mesh(), &VerifyParams::default());
        assert!(report.encloses, "{name}: {report:?}");
        assert!(report.escaped_rel <= LEAK_REL);
        assert!(rounded.leak <= LEAK_REL * mesh.bounds().radius);
        assert_eq!(rounded.surface_points.len(), rounded.positions.len());
    }
}

#[test]
fn the_same_model_gives_the_same_hull() {
    for (name, mesh) in generated() {
        let first = hull_of(&mesh, 300, false).level(300).round();
        let second = hull_of(&mesh, 300, false).level(300).round();
        assert_eq!(first, second, "{name}");
    }
}

#[test]
fn real_models_get_tight_hulls_of_500_faces() {
    for (name, most_collapsed, most_tightened) in REAL_MODELS {
        let Some(path) = outside::shared(&format!("models/{name}")) else {
            continue;
        };
        let loaded = mesh_io::load(&path, &LoadOptions::default()).unwrap();
        let mesh = &loaded.mesh;
        let hull = hull_of(mesh, 500, false);
        assert_eq!(hull.least_faces(), 500, "{}", loaded.name);
        let tightened = hull
            .tightened_level(500, Tightening::Fast, &Watch::silent())
            .unwrap();
        let report = verify(mesh.mesh(), &tightened.mesh, &VerifyParams::default());
        assert!(report.encloses, "{}: {report:?}", loaded.name);
        let level = hull.level(500);
        assert!(
            tightened.volume_ratio <= most_tightened.min(level.volume_ratio),
            "{}: {} after {}",
            loaded.name,
            tightened.volume_ratio,
            level.volume_ratio
        );
        let coarse = hull.level(500).round();
        assert!(
            coarse.volume_ratio <= most_collapsed,
            "{}: {}",
            loaded.name,
            coarse.volume_ratio
        );
        let report = verify(mesh.mesh(), &coarse.mesh(), &VerifyParams::default());
        assert!(
            report.encloses && report.escaped_rel <= LEAK_REL,
            "{}: {report:?}",
            loaded.name
        );
    }
}
