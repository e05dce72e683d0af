//! What a build made can be looked at from everywhere: on its polytope, on the view sphere, and around.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use proptest::prelude::*;
use silmap_geometry::Watch;
use silmap_geometry::{ClosedMesh, CoverageRule, TriangleMesh};
use silmap_map::Method;
use silmap_measure::evaluate::{EvaluateParams, Place, evaluate};
use silmap_models as models;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::pipeline::{BuildError, BuildParams, build};

fn model(which: usize) -> TriangleMesh {
    match which {
        0 => models::torus(400),
        1 => models::trefoil_knot(600),
        _ => {
            // A long thin one.
            let mut mesh = models::organic(400);
            for position in &mut mesh.positions {
                position.x *= 8.0;
                position.y *= 0.7;
            }
            mesh
        }
    }
}

fn params(views: u32, keep: u32, resolution_px: u32, any: bool, radius: f64) -> BuildParams {
    let mut params = BuildParams {
        views,
        resolution_px,
        view_radius_rel: radius,
        ..BuildParams::default()
    };
    params.capture.backend = Backend::Cpu;
    params.capture.coverage = if any {
        CoverageRule::Any
    } else {
        CoverageRule::Center
    };
    params.map.keep = keep;
    params.hull.target_faces = 60;
    params.textures.views = 1;
    params.textures.size_px = 16;
    params.textures.atlas_px = 16;
    params
}

/// Builds, and looks from everywhere by all methods; says how many views were kept, or that the build refused.
fn look(which: usize, params: &BuildParams) -> Option<usize> {
    let mesh = model(which);
    let closed = ClosedMesh::try_from(mesh.clone()).unwrap();
    let asset = match build(&closed, "model", params, &Watch::silent()) {
        Ok((asset, _)) => asset,
        Err(BuildError::TooFewViews { .. } | BuildError::NothingSeen { .. }) => return None,
        Err(other) => panic!("{other}"),
    };
    for place in [Place::Polytope, Place::Sphere, Place::Shell] {
        let asked = EvaluateParams {
            viewpoints: 40,
            place,
            methods: Method::ALL.to_vec(),
            size_px: 48,
            ..EvaluateParams::default()
        };
        let found = evaluate(&asset.map, &mesh, &asked, &Watch::silent());
        let found = found.unwrap_or_else(|e| panic!("{place:?}: {e}"));
        assert!(found.iter().all(|e| e.misclassified.is_finite()));
    }
    Some(asset.map.views.len())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10, ..ProptestConfig::default() })]

    #[test]
    fn small_odd_builds_are_read_everywhere(
        which in 0..3_usize,
        views in 12..64_u32,
        keep in 4..16_u32,
        resolution in prop::sample::select(vec![16_u32, 24, 48, 96]),
        any: bool,
        radius in prop::sample::select(vec![1.3, 2.0, 3.0, 3.0, 9.0]),
    ) {
        look(which, &params(views, keep, resolution, any, radius));
    }
}

/// Few views, kept where the error is least: before, sides of one triangle lay so far apart that the places between could not be
/// looked from.
#[test]
fn few_views_of_a_torus_are_read_everywhere() {
    assert_eq!(look(0, &params(64, 16, 128, false, 3.0)), Some(16));
}

/// A polytope that cuts into the model is refused by the build, not by the reader of the asset.
#[test]
fn too_few_views_close_by_are_refused() {
    assert_eq!(look(0, &params(12, 12, 96, false, 1.1)), None);
}
