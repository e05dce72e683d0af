//! Guarantees of contour simplification, checked by brute force on difficult masks.

use glam::DVec2;
use proptest::prelude::*;
use silmap_geometry::Mask;
use silmap_geometry::polygon::{distance_squared_to_segment, edges, fill_even_odd, signed_area};

use super::outline::{segments_meet, turn};
use super::*;
use silmap_geometry::trace::trace_contours;

fn noise_mask(width: u32, height: u32, density: u32, blur: bool, seed: u64) -> Mask {
    let mut mask = Mask::new(width, height);
    let mut state = seed | 1;
    for y in 0..height {
        for x in 0..width {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            mask.set(x, y, (state >> 40) % 8 < u64::from(density));
        }
    }
    if !blur {
        return mask;
    }
    // The majority of each 3 × 3 neighbourhood: blobs with staircases of all directions.
    let mut smooth = Mask::new(width, height);
    for y in 0..height {
        for x in 0..width {
            let count = (0..9)
                .filter(|k| mask.get(i64::from(x) + k % 3 - 1, i64::from(y) + k / 3 - 1))
                .count();
            smooth.set(x, y, count >= 5);
        }
    }
    smooth
}

fn disc(size: u32, middle: DVec2, radius: f64) -> Mask {
    let mut mask = Mask::new(size, size);
    for y in 0..size {
        for x in 0..size {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            mask.set(x, y, centre.distance(middle) <= radius);
        }
    }
    mask
}

/// Edges of different loops, or of one loop and not neighbours, that meet elsewhere than in `allowed` corners.
fn crossings(loops: &[Loop], allowed: &[DVec2]) -> usize {
    let mut all = Vec::new();
    for (owner, points) in loops.iter().enumerate() {
        for (k, edge) in edges(points).enumerate() {
            all.push((owner, k, points.len(), edge));
        }
    }
    let mut count = 0;
    for (i, &(owner, k, n, edge)) in all.iter().enumerate() {
        for &(other, m, _, with) in &all[i + 1..] {
            let neighbours = owner == other && ((k + 1) % n == m || (m + 1) % n == k);
            let shares_contact = [edge.0, edge.1]
                .iter()
                .any(|p| (*p == with.0 || *p == with.1) && allowed.contains(p));
            if neighbours || shares_contact {
                continue;
            }
            count += usize::from(segments_meet(edge, with));
        }
    }
    count
}

/// Corners in which two traced loops touch.
fn contacts(loops: &[Loop]) -> Vec<DVec2> {
    let mut all: Vec<DVec2> = loops.iter().flatten().copied().collect();
    all.sort_by(|a, b| (a.y, a.x).partial_cmp(&(b.y, b.x)).unwrap());
    let repeated = all.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]);
    repeated.collect()
}

/// Largest distance of points along the edges of `from` (eighths of a pixel apart) from the edges of `to`.
fn directed_distance(from: &Loop, to: &Loop) -> f64 {
    let mut worst = 0.0_f64;
    for (a, b) in edges(from) {
        let steps = (a.distance(b) * 8.0).ceil().max(1.0);
        for k in 0..steps as u32 {
            let p = a.lerp(b, f64::from(k) / steps);
            let nearest = edges(to)
                .map(|(c, d)| distance_squared_to_segment(p, c, d))
                .fold(f64::INFINITY, f64::min);
            worst = worst.max(nearest);
        }
    }
    worst.sqrt()
}

/// How deep each loop is nested: the number of other loops around its first vertex.
fn depth_of_each(loops: &[Loop]) -> Vec<usize> {
    let inside = |p: DVec2, points: &Loop| {
        edges(points)
            .filter(|(a, b)| (a.y <= p.y) != (b.y <= p.y) && (turn(*a, *b, p) > 0.0) == (b.y > a.y))
            .count()
            % 2
            == 1
    };
    (0..loops.len())
        .map(|i| {
            (0..loops.len())
                .filter(|&j| j != i && inside(loops[i][0], &loops[j]))
                .count()
        })
        .collect()
}

/// Everything promised for any loops.
fn check(mask: &Mask, params: &SimplifyContourParams) -> Result<(), TestCaseError> {
    let traced = trace_contours(mask);
    let simple = simplify_contours(&traced, params);
    prop_assert_eq!(simple.len(), traced.len());
    for (before, after) in traced.iter().zip(&simple) {
        prop_assert!(after.len() >= 3);
        prop_assert!(signed_area(before) * signed_area(after) > 0.0);
        // The other way round it is more, at corners that the new outline cuts.
        let limit = params.tolerance_px + 1e-9;
        let (there, back) = (
            directed_distance(before, after),
            directed_distance(after, before),
        );
        prop_assert!(
            there <= limit * 2.0_f64.sqrt(),
            "the traced outline is left by {}",
            there
        );
        prop_assert!(back <= limit, "the new outline strays by {}", back);
    }
    prop_assert_eq!(crossings(&simple, &contacts(&traced)), 0);
    let touching = !contacts(&traced).is_empty();
    if !touching {
        prop_assert_eq!(depth_of_each(&simple), depth_of_each(&traced));
    }
    if params.outward_only {
        check_superset(mask, &simple)?;
    }
    Ok(())
}

/// Fills at four times the resolution and compares with the mask's pixels.
fn check_superset(mask: &Mask, simple: &[Loop]) -> Result<(), TestCaseError> {
    let large: Vec<Loop> = simple
        .iter()
        .map(|l| l.iter().map(|p| *p * 4.0).collect())
        .collect();
    let mut filled = Mask::new(mask.width() * 4, mask.height() * 4);
    fill_even_odd(&large, &mut filled);
    for y in 0..mask.height() * 4 {
        for x in 0..mask.width() * 4 {
            if mask.get((x / 4).into(), (y / 4).into()) {
                prop_assert!(filled.get(x.into(), y.into()), "({}, {}) / 4 is lost", x, y);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    #[test]
    fn promises_hold(
        width in 2_u32..28, height in 2_u32..24, density in 1_u32..8, blur: bool, seed: u64,
        tolerance in prop::sample::select(vec![0.0, 0.2, 0.3536, 0.5, 0.75, 1.0, 2.0, 5.0]), outward_only: bool,
    ) {
        let mask = noise_mask(width, height, density, blur, seed);
        check(&mask, &SimplifyContourParams { tolerance_px: tolerance, outward_only })?;
    }
}

#[test]
fn promises_hold_on_discs_and_rings() {
    for tolerance_px in [0.5, 1.0, 3.0] {
        for outward_only in [false, true] {
            let mut mask = disc(80, DVec2::new(40.3, 39.1), 33.0);
            let hole = disc(80, DVec2::new(42.0, 40.0), 25.0);
            for (word, hole) in mask.words_mut().iter_mut().zip(hole.words()) {
                *word &= !hole;
            }
            check(
                &mask,
                &SimplifyContourParams {
                    tolerance_px,
                    outward_only,
                },
            )
            .unwrap();
        }
    }
}

#[test]
fn the_checks_notice_what_they_are_for() {
    let square = |x: f64, y: f64, s: f64| {
        [(0.0, 0.0), (s, 0.0), (s, s), (0.0, s)]
            .map(|(a, b)| DVec2::new(x + a, y + b))
            .to_vec()
    };
    assert_eq!(
        crossings(&[square(0.0, 0.0, 4.0), square(1.0, 1.0, 2.0)], &[]),
        0
    );
    assert!(crossings(&[square(0.0, 0.0, 4.0), square(1.0, 1.0, 9.0)], &[]) > 0);
    assert!(crossings(&[square(0.0, 0.0, 4.0), square(4.0, 4.0, 2.0)], &[]) > 0);
    assert_eq!(
        depth_of_each(&[square(0.0, 0.0, 4.0), square(1.0, 1.0, 2.0)]),
        [0, 1]
    );
    let moved = directed_distance(&square(0.0, 0.0, 4.0), &square(2.0, 0.0, 4.0));
    assert!((moved - 2.0).abs() < 1e-9, "{moved}");
    let mask = disc(40, DVec2::splat(20.0), 15.0);
    let shrunk: Vec<Loop> = trace_contours(&mask)
        .iter()
        .map(|l| l.iter().map(|p| *p * 0.99 + 0.2).collect())
        .collect();
    assert!(check_superset(&mask, &shrunk).is_err());
}

#[test]
fn tolerance_zero_changes_nothing() {
    for seed in 0..20 {
        let traced = trace_contours(&noise_mask(40, 30, 4, seed % 2 == 0, seed));
        for outward_only in [false, true] {
            let params = SimplifyContourParams {
                tolerance_px: 0.0,
                outward_only,
            };
            assert_eq!(simplify_contours(&traced, &params), traced);
        }
    }
}

#[test]
fn straight_edges_lose_their_inner_vertices_only() {
    let points = [(0, 0), (3, 0), (7, 0), (7, 5), (7, 6), (0, 6)];
    let square: Loop = points.map(|(x, y)| DVec2::new(x.into(), y.into())).to_vec();
    let params = SimplifyContourParams {
        tolerance_px: 0.0,
        outward_only: false,
    };
    assert_eq!(
        simplify_contours(std::slice::from_ref(&square), &params),
        vec![vec![square[0], square[2], square[4], square[5]]]
    );
    assert!(simplify_contours(&[], &params).is_empty());
}

/// Loops as contours of a view whose depths wave along them.
fn view_of(loops: &[Loop], side: u32, with_depths: bool) -> silmap_map::CapturedView {
    let eye = glam::DVec3::Z * 3.0;
    let camera =
        silmap_geometry::Camera::fit_sphere(eye, glam::DVec3::ZERO, 1.0, None, (side, side));
    let contours = loops.iter().map(|points| silmap_map::ViewContour {
        points: points.clone(),
        depths: (points.iter().filter(|_| with_depths))
            .map(|p| 3.0 + 0.3 * (p.x * 0.05).sin() + 0.2 * (p.y * 0.11).cos())
            .collect(),
        ..silmap_map::ViewContour::default()
    });
    silmap_map::CapturedView {
        camera: camera.unwrap(),
        contours: contours.collect(),
        photographed: None,
    }
}

/// Everything promised for the levels of any loops.
fn check_levels(
    mask: &Mask,
    params: &SimplifyContourParams,
    with_depths: bool,
) -> Result<(), TestCaseError> {
    let traced = trace_contours(mask);
    let whole = simplify_contours(&traced, params);
    let mut view = view_of(&whole, mask.width().max(mask.height()), with_depths);
    levels::add_levels_to_view(&mut view, params);
    check_levels_of(&view, (mask, &traced, &whole), params)
}

fn check_levels_of(
    view: &silmap_map::CapturedView,
    (mask, traced, whole): (&Mask, &[Loop], &[Loop]),
    params: &SimplifyContourParams,
) -> Result<(), TestCaseError> {
    let touching = contacts(traced);
    let at = |level: u8| -> Vec<Loop> {
        let pick =
            |c: &silmap_map::ViewContour| c.vertices_at(level).map(|k| c.points[k]).collect();
        view.contours.iter().map(pick).collect()
    };
    prop_assert_eq!(at(0), whole);
    for level in 1..=silmap_map::ViewContour::COARSEST_LEVEL {
        let (coarse, finer) = (at(level), at(level - 1));
        let scale = f64::from(1_u32 << level);
        for (k, (now, before)) in coarse.iter().zip(&finer).enumerate() {
            prop_assert!(now.len() >= 3, "loop {} is gone", k);
            prop_assert!(now.iter().all(|p| before.contains(p)), "not nested");
            prop_assert!(signed_area(now) * signed_area(before) > 0.0);
            let limit = params.tolerance_px * (scale - 1.0) + 1e-9;
            prop_assert!(directed_distance(now, &whole[k]) <= limit);
            prop_assert!(directed_distance(&whole[k], now) <= limit);
            let stray = directed_distance(now, &traced[k]);
            prop_assert!(
                stray <= params.tolerance_px * scale + 1e-9,
                "strays by {}",
                stray
            );
        }
        prop_assert_eq!(crossings(&coarse, &touching), 0, "level {}", level);
        if touching.is_empty() {
            prop_assert_eq!(depth_of_each(&coarse), depth_of_each(traced));
        }
        if params.outward_only {
            check_superset(mask, &coarse)?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    #[test]
    fn levels_keep_their_promises(
        width in 2_u32..40, height in 2_u32..32, density in 1_u32..8, blur: bool, seed: u64,
        tolerance in prop::sample::select(vec![0.0, 0.2, 0.5, 0.75, 1.0, 2.0]), outward_only: bool, with_depths: bool,
    ) {
        let mask = noise_mask(width, height, density, blur, seed);
        let params = SimplifyContourParams { tolerance_px: tolerance, outward_only };
        check_levels(&mask, &params, with_depths)?;
    }
}

#[test]
fn levels_of_a_disc_thin_out() {
    let count = |outward_only: bool, with_depths: bool| {
        let params = SimplifyContourParams {
            tolerance_px: 0.5,
            outward_only,
        };
        let mask = disc(400, DVec2::new(200.3, 199.1), 180.0);
        let mut view = view_of(
            &simplify_contours(&trace_contours(&mask), &params),
            400,
            with_depths,
        );
        levels::add_levels_to_view(&mut view, &params);
        let contour = &view.contours[0];
        [0, 1, 3].map(|level| contour.vertices_at(level).count())
    };
    // The chord of an arc of angle 2a is within r(1 − cos a) of it: twice the tolerance, 0.7 times the vertices.
    let [whole, one, three] = count(false, false);
    assert!(
        one <= whole && 10 * three <= 6 * whole,
        "{whole}, {one}, {three}"
    );
    // Depths that do not lie on lines keep some.
    let [deep_whole, _, deep_three] = count(false, true);
    assert!(
        deep_whole == whole && deep_three > three,
        "{deep_three} of {deep_whole}"
    );
    // A convex outline cannot lose a vertex and grow.
    let [whole, _, three] = count(true, false);
    assert!(three < whole, "{three} of {whole}");
}

#[test]
fn the_check_of_levels_notices_what_it_is_for() {
    let params = SimplifyContourParams::default();
    let mask = disc(80, DVec2::splat(40.0), 33.0);
    let traced = trace_contours(&mask);
    let whole = simplify_contours(&traced, &params);
    let levels_with = |tolerance_px| {
        let mut view = view_of(&whole, 80, false);
        let coarser = SimplifyContourParams {
            tolerance_px,
            ..params
        };
        levels::add_levels_to_view(&mut view, &coarser);
        view
    };
    let check =
        |view: &silmap_map::CapturedView| check_levels_of(view, (&mask, &traced, &whole), &params);
    check(&levels_with(0.5)).unwrap();
    assert!(check(&levels_with(4.0)).is_err(), "too coarse");
    let mut view = levels_with(0.5);
    view.contours[0].points.swap(2, 9);
    assert!(check(&view).is_err(), "crosses itself");
    let mut view = levels_with(0.5);
    view.contours[0].levels.fill(0);
    assert!(check(&view).is_err(), "no vertices");
}
