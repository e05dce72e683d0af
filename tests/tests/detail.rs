//! Contour level of detail: what coarser contours cost where the model is small on the screen, and that their changes are not visible.
#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(clippy::print_stdout, reason = "the errors are worth reading")]

use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::{Camera, CoverageRule, Mask, TriangleMesh};
use silmap_map::{
    DETAIL_BOUND_PX, Detail, Interpolation, MapReader, Method, SilhouetteMap, ViewContour, outline,
};
use silmap_measure::evaluate::{EvaluateParams, evaluate, summarise};
use silmap_models as models;
use silmap_preprocess::simplify_contour::add_levels;
use silmap_tests::dense_maps::dense;

fn map_with_levels(mesh: &TriangleMesh, coverage: CoverageRule) -> SilhouetteMap {
    let (mut map, _) = dense(mesh, 96, 512, 0.5, coverage);
    add_levels(&mut map);
    map
}

/// Mean misclassified and escaped shares of the model's pixels in pictures of some size.
fn errors(
    map: &SilhouetteMap,
    mesh: &TriangleMesh,
    (method, detail): (Method, Detail),
    size_px: u32,
) -> (f64, f64) {
    let params = EvaluateParams {
        viewpoints: 40,
        methods: vec![method],
        size_px,
        detail,
        ..EvaluateParams::default()
    };
    let errors = evaluate(map, mesh, &params, &Watch::silent()).unwrap();
    let summary = summarise(&errors)[0].shares;
    (summary.misclassified_mean, summary.escaped_mean)
}

fn camera(map: &SilhouetteMap, direction: DVec3, distance_rel: f64, size_px: u32) -> Camera {
    let eye = map.center + direction.normalize_or_zero() * (distance_rel * map.radius);
    Camera::fit_sphere(eye, map.center, map.radius, None, (size_px, size_px)).unwrap()
}

/// How many pixels of the picture the outline passes through, about: neighbours in a row or column that differ.
fn border_px(mask: &Mask) -> f64 {
    let (w, h) = (i64::from(mask.width()), i64::from(mask.height()));
    let differs = |x, y| {
        usize::from(mask.get(x, y) != mask.get(x + 1, y))
            + usize::from(mask.get(x, y) != mask.get(x, y + 1))
    };
    let all: usize = (-1..h)
        .map(|y| (-1..w).map(|x| differs(x, y)).sum::<usize>())
        .sum();
    all as f64
}

/// The stated price: the mean error grows by less than a fiftieth of a pixel along the outline, whatever the size.
const GROWTH_PX: f64 = 0.02;

#[test]
fn small_pictures_are_as_good_with_fewer_vertices() {
    for (name, mesh) in [
        ("knot", models::trefoil_knot(8192)),
        ("organic", models::organic(8192)),
    ] {
        let map = map_with_levels(&mesh, CoverageRule::Center);
        let counts = map.level_vertex_counts();
        println!(
            "{name}: {counts:?} contour vertices in {} views",
            map.views.len()
        );
        for (size_px, expected) in [(40, 2), (128, 1), (512, 0)] {
            let seen = camera(&map, DVec3::new(1.0, 0.4, 0.7), 3.0, size_px);
            assert_eq!(
                Detail::OnScreen.level(&map, &seen),
                expected,
                "{size_px} px"
            );
            let method = Method::Tight;
            let mut scratch = MapReader::new(&map).unwrap();
            let mut mask = Mask::new(size_px, size_px);
            let drawn = outline(&map, &seen, method, &mut scratch).unwrap();
            fill_non_zero(drawn.simple_loops(), &mut mask);
            let px_per_share = mask.count() as f64 / border_px(&mask);
            for method in Method::ALL {
                let price = |detail| {
                    let error = errors(&map, &mesh, (method, detail), size_px).0;
                    error * px_per_share
                };
                let (whole, fitting) = (price(Detail::Level(0)), price(Detail::OnScreen));
                println!(
                    "{name} {size_px} px, {method:?}: {whole:.4} px, with levels {fitting:.4}"
                );
                assert!(
                    fitting <= whole + GROWTH_PX,
                    "{name} {size_px} px, {method:?}: {whole} became {fitting}"
                );
                if expected == 0 {
                    assert_eq!(whole, fitting, "{name}, {method:?}");
                }
            }
            // Negative control: the coarsest level is no answer at full size.
            if size_px == 512 {
                let of = |level| errors(&map, &mesh, (method, Detail::Level(level)), size_px).0;
                let coarse = (of(ViewContour::COARSEST_LEVEL) - of(0)) * px_per_share;
                assert!(coarse > 10.0 * GROWTH_PX, "{name}: {coarse} went unnoticed");
            }
        }
        assert!(
            2 * counts[2] <= counts[0] && counts[6] < counts[2],
            "{name}: levels thin out slowly: {counts:?}"
        );
    }
}

/// In conservative capture each level contains the one before.
#[test]
fn hulls_stay_conservative_at_every_size() {
    let mesh = models::three_holed_torus(8192);
    let mut map = map_with_levels(&mesh, CoverageRule::Any);
    let method = Method::Hull;
    for size_px in [40, 128, 512] {
        let (wrong, escaped) = errors(&map, &mesh, (method, Detail::OnScreen), size_px);
        let (whole, before) = errors(&map, &mesh, (method, Detail::Level(0)), size_px);
        println!(
            "{size_px} px: {wrong:.4} misclassified, {escaped:.6} escaped; whole {whole:.4}, {before:.6}"
        );
        assert!(
            escaped <= 1e-4,
            "{size_px} px: escaped {escaped}, {before} with whole contours"
        );
    }
    // Negative control: levels made for the other rule lose pixels.
    map.coverage = CoverageRule::Center;
    add_levels(&mut map);
    let (_, escaped) = errors(&map, &mesh, (method, Detail::Level(4)), 128);
    assert!(
        escaped > 1e-3,
        "contours that were cut went unnoticed ({escaped})"
    );
}

/// Walking away, the outline changes by no more than a step of the walk changes it, also where the level does.
#[test]
fn nobody_sees_levels_change() {
    let mesh = models::trefoil_knot(8192);
    let map = map_with_levels(&mesh, CoverageRule::Center);
    let mut scratch = MapReader::new(&map).unwrap();
    // Pictures of growing size stand for a model that comes nearer: the eye stays.
    let direction = DVec3::new(0.3, 0.5, -0.8);
    let (mut changes, mut last_level) = (0, None);
    for size_px in 20..300 {
        let seen = camera(&map, direction, 2.9, size_px);
        let level = Detail::OnScreen.level(&map, &seen);
        if last_level.is_some_and(|last| last != level) {
            changes += 1;
            // Both sides of the change in the same picture, drawn eight times as large to see parts of pixels.
            let large = camera(&map, direction, 2.9, 8 * size_px);
            let masks = [level, last_level.unwrap()].map(|level| {
                let how = Interpolation {
                    detail: Detail::Level(level),
                    ..Method::Tight.into()
                };
                let mut mask = Mask::new(8 * size_px, 8 * size_px);
                let drawn = outline(&map, &large, how, &mut scratch).unwrap();
                fill_non_zero(drawn.simple_loops(), &mut mask);
                mask
            });
            let moved_px = masks[0].count_different(&masks[1]) as f64 / border_px(&masks[0]) / 8.0;
            println!(
                "{size_px} px, to level {level}: the outline moves by {moved_px:.4} px on average"
            );
            assert!(
                moved_px <= 0.3 * DETAIL_BOUND_PX,
                "{size_px} px: {moved_px}"
            );
            // Negative control: jumping over levels is seen.
            let how = Interpolation {
                detail: Detail::Level(last_level.unwrap() + 2),
                ..Method::Tight.into()
            };
            let mut far = Mask::new(8 * size_px, 8 * size_px);
            fill_non_zero(
                outline(&map, &large, how, &mut scratch)
                    .unwrap()
                    .simple_loops(),
                &mut far,
            );
            let jump_px = masks[0].count_different(&far) as f64 / border_px(&masks[0]) / 8.0;
            assert!(jump_px > 1.5 * moved_px, "{jump_px} after {moved_px}");
        }
        last_level = Some(level);
    }
    assert_eq!(changes, 3, "levels change from 20 to 300 pixels");
}
