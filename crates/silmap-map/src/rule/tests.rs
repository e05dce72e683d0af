use super::*;
use crate::loops::FlatLoops;
use crate::pair_cache::{RectifiedPair, RectifyParams, ViewedSilhouette};
use glam::{DMat3, DVec2, DVec3, Vec4Swizzles};
use proptest::prelude::*;
use silmap_geometry::polygon::{edges, fill_even_odd, fill_non_zero, signed_area};
use silmap_geometry::{Loop, Mask};

/// A method, and the radius of the sphere that its pairs must meet in, if they must.
type Pairing = (Method, Option<f64>);

/// Every interval with every other.
const ALL: Pairing = (Method::Hull, None);
const CLIQUES: Pairing = (Method::Paper, None);

/// A star-shaped loop on an eighth-unit grid, so that heights coincide often; holes run the other way.
fn star(radii: &[f64], center: DVec2, is_hole: bool) -> Loop {
    let turn = std::f64::consts::TAU / radii.len() as f64;
    let mut points: Loop = radii
        .iter()
        .enumerate()
        .map(|(k, r)| ((center + DVec2::from_angle(k as f64 * turn) * *r) * 8.0).round() / 8.0)
        .collect();
    if is_hole {
        points.reverse();
    }
    points
}

/// Up to nine components in a 3 × 3 grid of cells, some with a hole.
fn any_silhouette() -> impl Strategy<Value = FlatLoops> {
    let radii = prop::collection::vec(prop::sample::select(vec![7.0, 9.0, 13.0, 14.5]), 3..9);
    let hole = prop::collection::vec(prop::sample::select(vec![1.0, 2.0, 3.0]), 3..7);
    let cell = prop::option::weighted(0.4, (radii, prop::option::of(hole)));
    prop::collection::vec(cell, 9).prop_map(|cells| {
        let mut loops: Vec<Loop> = Vec::new();
        for (k, cell) in cells.iter().enumerate() {
            let center = DVec2::new((k % 3) as f64, (k / 3) as f64) * 32.0 + 16.0;
            if let Some((radii, hole)) = cell {
                loops.push(star(radii, center, false));
                // A triangle's inner circle has half its corners' radius: only these holes surely fit.
                if let Some(hole) = hole.as_ref().filter(|_| radii.len() >= 5) {
                    loops.push(star(hole, center, true));
                }
            }
        }
        let mut flat = FlatLoops::default();
        flat.assign(loops.iter().map(Vec::as_slice));
        flat
    })
}

/// The intervals of loops on one scanline, by sorting all crossings.
fn spans_at(loops: &FlatLoops, y: f64) -> Vec<(f64, f64)> {
    let mut xs: Vec<f64> = loops
        .iter()
        .flat_map(edges)
        .filter(|(a, b)| (a.y <= y) != (b.y <= y))
        .map(|(a, b)| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)))
        .collect();
    xs.sort_by(f64::total_cmp);
    xs.chunks_exact(2).map(|p| (p[0], p[1])).collect()
}

/// The union of all interpolated pairs of intervals on one scanline.
fn union_at(one: &FlatLoops, two: &FlatLoops, alpha: f64, y: f64) -> Vec<(f64, f64)> {
    let mix = |a: f64, b: f64| a * (1.0 - alpha) + b * alpha;
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for i in spans_at(one, y) {
        for j in spans_at(two, y) {
            pairs.push((mix(i.0, j.0), mix(i.1, j.1)));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut union: Vec<(f64, f64)> = Vec::new();
    for p in pairs {
        match union.last_mut() {
            Some(last) if p.0 <= last.1 => last.1 = last.1.max(p.1),
            _ => union.push(p),
        }
    }
    union
}

/// Interpolates loops given in rectified coordinates as they are: the pair looks along +z from the x axis, and grid
/// units become tangents by `SCALE`.
const SCALE: f64 = 0.01;

fn interpolated(
    one: &FlatLoops,
    two: &FlatLoops,
    alpha: f64,
    (method, radius): Pairing,
) -> FlatLoops {
    let deep = [one, two].map(|loops| {
        let mut deep = DeepLoops::default();
        for points in loops.iter() {
            points
                .iter()
                .for_each(|p| deep.push(p.extend(1.0 / 3.0).extend(0.0)));
            deep.close();
        }
        deep
    });
    let [one, two] = &deep;
    let object_from_loops = DMat3::from_cols(DVec3::X * SCALE, DVec3::NEG_Y * SCALE, DVec3::NEG_Z);
    let eyes = [DVec3::new(-0.5, 0.0, 3.0), DVec3::new(0.5, 0.0, 3.0)];
    let seen = |eye, loops| ViewedSilhouette {
        eye,
        loops,
        object_from_loops,
    };
    let mut output = DeepLoops::default();
    let mut interpolator = PairInterpolator {
        keeps_all_vertices: true,
        ..PairInterpolator::default()
    };
    let mut pair = RectifiedPair::default();
    let params = RectifyParams {
        center: DVec3::ZERO,
        radius,
        turn_tangent: 0.0,
    };
    let frame = pair
        .assign([seen(eyes[0], one), seen(eyes[1], two)], &params)
        .unwrap();
    interpolator.interpolate(pair.parts_mut(), alpha, method, &mut output);
    assert!((frame.b - DVec3::X).length() < 1e-12 && (frame.u - DVec3::NEG_Y).length() < 1e-12);
    let mut flat = FlatLoops::default();
    for points in output.iter() {
        points.iter().for_each(|p| flat.push(p.xy() / SCALE));
        flat.close();
    }
    flat
}

/// Lengths of the parts in which two sorted spans differ.
fn difference(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let mut ends: Vec<f64> = a.iter().chain(b).flat_map(|i| [i.0, i.1]).collect();
    ends.sort_by(f64::total_cmp);
    let holds = |spans: &[(f64, f64)], x: f64| spans.iter().any(|i| i.0 <= x && x < i.1);
    ends.windows(2)
        .filter(|w| holds(a, 0.5 * (w[0] + w[1])) != holds(b, 0.5 * (w[0] + w[1])))
        .map(|w| w[1] - w[0])
        .sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// For every topology of the two silhouettes, the loops bound exactly the union of all interpolated pairs.
    #[test]
    fn all_pairs_give_the_union_on_every_scanline(
        one in any_silhouette(), two in any_silhouette(), alpha in 0.0..=1.0_f64, ys in prop::collection::vec(0.0..96.0_f64, 12),
    ) {
        let output = interpolated(&one, &two, alpha, ALL);
        for y in ys {
            // Heights are eighths: stay clear of vertices, where a scanline is ambiguous.
            let y = (y * 8.0).floor() / 8.0 + 0.0371;
            let (expected, got) = (union_at(&one, &two, alpha, y), spans_at(&output, y));
            let off = difference(&expected, &got);
            prop_assert!(off < 0.01, "y = {}: {:?} is not {:?}", y, got, expected);
        }
    }

    /// Outer loops run one way, holes the other, and nothing overlaps: both fill rules and the areas agree.
    #[test]
    fn loops_are_oriented_and_do_not_overlap(
        one in any_silhouette(), two in any_silhouette(), alpha in 0.0..=1.0_f64,
        pairing in prop::sample::select(vec![ALL, CLIQUES]),
    ) {
        let output = interpolated(&one, &two, alpha, pairing);
        // Bands four times as fine as a unit, so that counting pixels measures area.
        let mut fine = output.clone();
        fine.transform(|p| p * 4.0 + DVec2::splat(0.0313));
        let (mut odd, mut wound) = (Mask::new(400, 400), Mask::new(400, 400));
        fill_even_odd(fine.iter(), &mut odd);
        fill_non_zero(fine.iter(), &mut wound);
        prop_assert!(odd.count_different(&wound) <= 2, "{} pixels overlap", odd.count_different(&wound));
        let area: f64 = fine.iter().map(signed_area).sum();
        let perimeter: f64 = fine.iter().flat_map(edges).map(|(a, b)| a.distance(b)).sum();
        prop_assert!((area - odd.count() as f64).abs() <= 2.0 + 0.6 * perimeter, "area {} for {} pixels", area, odd.count());
    }

    /// Whatever lies at positive depth in both silhouettes is kept: sampled in depth, independently of spans.
    #[test]
    fn all_pairs_cover_the_two_view_visual_hull(
        one in any_silhouette(), two in any_silhouette(), alpha in 0.0..=1.0_f64,
    ) {
        let output = interpolated(&one, &two, alpha, ALL);
        let holds = |span: &[(f64, f64)], x: f64, slack: f64| span.iter().any(|i| i.0 - slack <= x && x <= i.1 + slack);
        for row in (0..96).step_by(3) {
            let y = f64::from(row) + 0.0371;
            let [seen_one, seen_two, kept] = [&one, &two, &output].map(|loops| spans_at(loops, y));
            for x in (0..192).map(|x| f64::from(x) * 0.5) {
                let in_hull = (0..192).map(|d| f64::from(d) * 0.5).any(|d| {
                    holds(&seen_one, x + alpha * d, 0.0) && holds(&seen_two, x - (1.0 - alpha) * d, 0.0)
                });
                prop_assert!(!in_hull || holds(&kept, x, 0.001), "({}, {}) is in the hull and was dropped", x, y);
            }
        }
    }

    /// Whatever lies in the bounding sphere and in both silhouettes is kept when pairs are limited to the sphere.
    #[test]
    fn pairs_within_the_sphere_cover_the_visual_hull_there(
        one in any_silhouette(), two in any_silhouette(), alpha in 0.0..=1.0_f64, radius in 0.3..2.0_f64,
    ) {
        let output = interpolated(&one, &two, alpha, (Method::Hull, Some(radius)));
        let all = interpolated(&one, &two, alpha, ALL);
        let holds = |span: &[(f64, f64)], x: f64, slack: f64| span.iter().any(|i| i.0 - slack <= x && x <= i.1 + slack);
        for row in (0..96).step_by(3) {
            let y = f64::from(row) + 0.0371;
            let [seen_one, seen_two, kept, all] = [&one, &two, &output, &all].map(|loops| spans_at(loops, y));
            for x in (0..192).map(|x| f64::from(x) * 0.5) {
                // A ray from (α − ½, 0, 3); points of it at depth z, in object space and in both images.
                let in_hull = (0..192).map(|k| 3.0 + radius * (f64::from(k) / 95.5 - 1.0)).any(|z| {
                    let point = DVec3::new(alpha - 0.5 + x * SCALE * z, -y * SCALE * z, 3.0 - z);
                    let parallax = 1.0 / (z * SCALE);
                    point.length() <= radius
                        && holds(&seen_one, x + alpha * parallax, 0.0)
                        && holds(&seen_two, x - (1.0 - alpha) * parallax, 0.0)
                });
                prop_assert!(!in_hull || holds(&kept, x, 0.001), "({}, {}) is in the hull and was dropped", x, y);
                prop_assert!(!holds(&kept, x, -0.001) || holds(&all, x, 0.001), "({}, {}) is more than all pairs give", x, y);
            }
        }
    }

    /// At the ends the captured silhouettes come back, on the scanlines that both views have.
    #[test]
    fn the_ends_are_the_captured_silhouettes(one in any_silhouette(), two in any_silhouette(), y in 0.0..96.0_f64) {
        let y = (y * 8.0).floor() / 8.0 + 0.0371;
        prop_assume!(!spans_at(&one, y).is_empty() && !spans_at(&two, y).is_empty());
        for (alpha, end) in [(0.0, &one), (1.0, &two)] {
            let output = interpolated(&one, &two, alpha, ALL);
            prop_assert!(difference(&spans_at(&output, y), &spans_at(end, y)) < 0.01);
        }
    }

    /// Cliques only ever drop pairs.
    #[test]
    fn cliques_lie_within_all_pairs(one in any_silhouette(), two in any_silhouette(), alpha in 0.0..=1.0_f64) {
        let (mut all, mut some) = (Mask::new(96, 96), Mask::new(96, 96));
        for (pairing, mask) in [(ALL, &mut all), (CLIQUES, &mut some)] {
            let mut output = interpolated(&one, &two, alpha, pairing);
            // Vertices lie on eighths: beside them, no pixel centre lies on an edge that both have.
            output.transform(|p| p + DVec2::new(0.0137, 0.0171));
            fill_even_odd(output.iter(), mask);
        }
        prop_assert!(some.count_missing_in(&all) <= 1);
    }
}

fn squares(at: &[(f64, f64, f64)]) -> FlatLoops {
    let loops: Vec<Loop> = at
        .iter()
        .map(|&(x, y, side)| {
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
                .map(|(i, j)| DVec2::new(x + side * i, y + side * j))
                .to_vec()
        })
        .collect();
    let mut flat = FlatLoops::default();
    flat.assign(loops.iter().map(Vec::as_slice));
    flat
}

/// The paper's figure 5: one interval against two opens a pair of legs where the ends cross.
#[test]
fn pants_open_where_their_legs_part() {
    let (torso, legs) = (
        squares(&[(10.0, 10.0, 40.0)]),
        squares(&[(0.0, 10.0, 40.0), (60.0, 10.0, 40.0)]),
    );
    let widths = |alpha: f64| spans_at(&interpolated(&torso, &legs, alpha, ALL), 30.037);
    assert_eq!(widths(0.2).len(), 1, "the legs still overlap");
    assert_eq!(widths(0.9).len(), 2, "the legs have parted");
}

/// Negative control for the cliques: matched gaps keep two shapes apart that all pairs join.
#[test]
fn cliques_keep_matched_shapes_apart() {
    let (one, two) = (
        squares(&[(0.0, 0.0, 30.0), (40.0, 0.0, 30.0)]),
        squares(&[(5.0, 0.0, 30.0), (45.0, 0.0, 30.0)]),
    );
    let count = |pairing| spans_at(&interpolated(&one, &two, 0.5, pairing), 15.037).len();
    assert_eq!((count(CLIQUES), count(ALL)), (2, 1));
}
