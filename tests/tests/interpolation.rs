//! Interpolated silhouettes of real meshes: identity at captured views, conservativeness, metamorphic checks.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh};
use silmap_map::{MapReader, Method, SilhouetteMap, Transfer, outline};
use silmap_measure::evaluate::{EvaluateParams, Place, evaluate, summarise};
use silmap_models as models;
use silmap_tests::dense_maps::dense;

fn misclassified_at_views(map: &SilhouetteMap, masks: &[Mask], moved: f64, method: Method) -> f64 {
    let mut scratch = MapReader::new(map).unwrap();
    let mut filled = Mask::new(map.resolution_px, map.resolution_px);
    let shares = map.triangles.iter().step_by(3).map(|t| {
        let [a, b, c] = t.map(|v| map.eye(v));
        let eye = a * (1.0 - 2.0 * moved) + (b + c) * moved;
        let camera = Camera {
            eye,
            ..map.views[t[0] as usize].camera
        };
        fill_even_odd(
            outline(map, &camera, method, &mut scratch)
                .unwrap()
                .simple_loops(),
            &mut filled,
        );
        let mask = &masks[t[0] as usize];
        filled.count_different(mask) as f64 / mask.count() as f64
    });
    let shares: Vec<f64> = shares.collect();
    shares.iter().sum::<f64>() / shares.len() as f64
}

#[test]
fn captured_viewpoints_give_the_captured_outline() {
    let mesh = models::trefoil_knot(4096);
    let (map, masks) = dense(&mesh, 96, 256, 0.0, CoverageRule::Center);
    for method in Method::ALL {
        assert_eq!(
            misclassified_at_views(&map, &masks, 0.0, method),
            0.0,
            "{method:?}"
        );
        let beside = misclassified_at_views(&map, &masks, 1e-7, method);
        // Where a strand covers a gap whose sides are seen apart, links differ: rims behind it are in no contour.
        let allowed = if method == Method::Tight {
            0.005
        } else {
            0.001
        };
        assert!(
            beside < allowed,
            "{method:?} beside the captured viewpoints: {beside}"
        );
        // Negative control: half-way to the neighbours the captured outline is no answer.
        let between = misclassified_at_views(&map, &masks, 0.3, method);
        assert!(
            between > 0.02,
            "{method:?} between the captured viewpoints: {between}"
        );
    }
}

fn hull_errors(map: &SilhouetteMap, mesh: &TriangleMesh) -> (f64, f64, f64) {
    let params = EvaluateParams {
        viewpoints: 40,
        methods: vec![Method::Hull],
        size_px: 256,
        ..EvaluateParams::default()
    };
    let errors = evaluate(map, mesh, &params, &Watch::silent()).unwrap();
    let s = summarise(&errors)[0].shares;
    (s.misclassified_mean, s.escaped_mean, s.escaped_max)
}

#[test]
fn hull_is_conservative_on_the_polytope() {
    // What may be misclassified is a tenth more than what is.
    for (name, mesh, most) in [
        ("torus", models::torus(4096), 0.0635),
        ("knot", models::trefoil_knot(4096), 0.199),
        ("three holes", models::three_holed_torus(4096), 0.136),
    ] {
        let (mut map, _) = dense(&mesh, 96, 256, 0.5, CoverageRule::Any);
        let (wrong, mean, max) = hull_errors(&map, &mesh);
        assert!(
            mean <= 1e-5 && max <= 1e-4,
            "{name}: escaped {mean} on average, {max} at most"
        );
        assert!(wrong < most, "{name}: {wrong} misclassified");
        // Negative control: silhouettes moved by three pixels let pixels escape.
        for p in map
            .views
            .iter_mut()
            .flat_map(|v| &mut v.contours)
            .flat_map(|c| &mut c.points)
        {
            p.x += 3.0;
        }
        let (_, moved, _) = hull_errors(&map, &mesh);
        assert!(
            moved > 0.002,
            "{name}: moved silhouettes went unnoticed ({moved})"
        );
    }
}

#[test]
fn swapped_views_are_noticed() {
    let mesh = models::torus(4096);
    let (mut map, _) = dense(&mesh, 64, 128, 0.5, CoverageRule::Center);
    let (before, ..) = hull_errors(&map, &mesh);
    let n = map.views.len();
    for k in 0..n / 2 {
        let other = map.views[k + n / 2].contours.clone();
        map.views[k].contours = other;
    }
    let (after, ..) = hull_errors(&map, &mesh);
    assert!(after > 2.0 * before, "{before} became {after}");
}

#[test]
fn scaling_and_moving_the_model_moves_nothing_in_the_image() {
    let mesh = models::three_holed_torus(2048);
    let (scale, shift) = (1024.0, DVec3::new(512.0, -2048.0, 64.0));
    let mut moved = mesh.clone();
    for p in &mut moved.positions {
        *p = *p * scale + shift;
    }
    let maps = [&mesh, &moved].map(|m| dense(m, 48, 128, 0.5, CoverageRule::Center).0);
    let direction = DVec3::new(0.3, 0.8, 0.52);
    for method in Method::ALL {
        let loops = maps.each_ref().map(|map| {
            let eye = map.center + direction * map.radius * 2.9;
            let camera = Camera::fit_sphere(eye, map.center, map.radius, None, (512, 512)).unwrap();
            let mut mask = Mask::new(512, 512);
            fill_even_odd(
                outline(map, &camera, method, &mut MapReader::new(map).unwrap())
                    .unwrap()
                    .simple_loops(),
                &mut mask,
            );
            mask
        });
        assert!(loops[0].count() > 10_000);
        let off = loops[0].count_different(&loops[1]);
        assert!(
            off * 1000 <= loops[0].count(),
            "{method:?}: {off} pixels moved"
        );
    }
}

fn mean_error(
    (map, mesh): (&SilhouetteMap, &TriangleMesh),
    method: Method,
    (place, transfer): (Place, Transfer),
) -> f64 {
    let params = EvaluateParams {
        viewpoints: 60,
        place,
        transfer,
        methods: vec![method],
        size_px: 256,
        ..EvaluateParams::default()
    };
    summarise(&evaluate(map, mesh, &params, &Watch::silent()).unwrap())[0]
        .shares
        .misclassified_mean
}

/// Off the polytope every ray is followed to where it crosses it. The homography of one plane is the negative control.
#[test]
fn errors_hardly_grow_off_the_polytope() {
    let mesh = models::torus(4096);
    let (mut map, _) = dense(&mesh, 96, 256, 0.5, CoverageRule::Center);
    let tight = |place, transfer| mean_error((&map, &mesh), Method::Tight, (place, transfer));
    let polytope = tight(Place::Polytope, Transfer::Depths);
    let shell = tight(Place::Shell, Transfer::Depths);
    let by_plane = tight(Place::Shell, Transfer::Homography);
    assert!(
        shell < 1.5 * polytope && by_plane > 3.0 * polytope,
        "polytope {polytope}, shell {shell}, by the homography {by_plane}"
    );
    // Without depths the homography carries each sector.
    for contour in map.views.iter_mut().flat_map(|v| &mut v.contours) {
        contour.depths.clear();
    }
    let hull = |transfer| mean_error((&map, &mesh), Method::Hull, (Place::Shell, transfer));
    let (by_sectors, by_plane) = (hull(Transfer::Depths), hull(Transfer::Homography));
    assert!(
        by_sectors < 0.6 * by_plane,
        "by sectors {by_sectors}, by the homography {by_plane}"
    );
}
