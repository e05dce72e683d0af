//! What is promised of the loops of every mask, and a follower that goes crack by crack to compare with.

use super::*;
use crate::polygon::{fill_even_odd, signed_area};
use proptest::prelude::*;
use std::collections::BTreeSet;

fn mask_of(rows: &[&str]) -> Mask {
    let mut mask = Mask::new(rows[0].len() as u32, rows.len() as u32);
    for (y, row) in rows.iter().enumerate() {
        for (x, c) in row.bytes().enumerate() {
            mask.set(x as u32, y as u32, c == b'#');
        }
    }
    mask
}

/// The loops by a crack at a time, for comparison: those of [`trace_contours`] must be the same to the last corner.
///
/// Only loops that touch themselves nowhere, since cutting is shared: `None` when there is another.
fn trace_cracks(mask: &Mask) -> Option<Vec<Loop>> {
    /// Steps along a crack: right, down, left, up, with the covered pixel on the right hand.
    const STEPS: [Corner; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
    /// From a corner, the pixel ahead on the right hand for each step; the one on the left hand is that of the step before.
    const AHEAD_RIGHT: [Corner; 4] = [[0, 0], [-1, 0], [-1, -1], [0, -1]];
    let covers = |at: Corner, offset: Corner| {
        let [x, y] = [at[0] + offset[0], at[1] + offset[1]];
        mask.get(x.into(), y.into())
    };
    let mut passed = BTreeSet::new();
    let mut loops = Vec::new();
    for (y, x) in
        (0..mask.height() as i32).flat_map(|y| (0..mask.width() as i32).map(move |x| (y, x)))
    {
        if !covers([x, y], [0, 0]) || covers([x, y], [0, -1]) || passed.contains(&[x, y]) {
            continue;
        }
        let (mut at, mut heading, mut corners) = ([x, y], 0, Vec::new());
        loop {
            if heading == 0 {
                passed.insert(at);
            }
            at = [at[0] + STEPS[heading][0], at[1] + STEPS[heading][1]];
            let turned = if !covers(at, AHEAD_RIGHT[heading]) {
                (heading + 1) % 4
            } else if covers(at, AHEAD_RIGHT[(heading + 3) % 4]) {
                (heading + 3) % 4
            } else {
                heading
            };
            if turned != heading {
                corners.push(at);
                heading = turned;
            }
            if at == [x, y] && heading == 0 {
                break;
            }
        }
        if corners.iter().collect::<BTreeSet<_>>().len() < corners.len() {
            return None;
        }
        let first = (0..corners.len()).min_by_key(|&k| (corners[k][1], corners[k][0]));
        corners.rotate_left(first.unwrap());
        loops.push(corners);
    }
    loops.sort_by_key(|corners| (corners[0][1], corners[0][0]));
    Some(loops.iter().map(|corners| points(corners)).collect())
}

/// Everything that is promised of the loops of any mask.
fn check(mask: &Mask) -> Result<(), TestCaseError> {
    let loops = trace_contours(mask);
    let area: f64 = loops.iter().map(|l| signed_area(l)).sum();
    prop_assert_eq!(area, mask.count() as f64);
    if let Some(expected) = trace_cracks(mask) {
        prop_assert_eq!(&loops, &expected);
    }
    let mut filled = Mask::new(mask.width(), mask.height());
    fill_even_odd(&loops, &mut filled);
    prop_assert_eq!(filled.count_different(mask), 0);
    let mut previous = None;
    for points in &loops {
        prop_assert!(points.len() >= 4);
        let keys: Vec<_> = points.iter().map(|p| (p.y as i64, p.x as i64)).collect();
        let distinct: BTreeSet<_> = keys.iter().collect();
        prop_assert_eq!(distinct.len(), keys.len(), "a corner is repeated");
        prop_assert_eq!(keys.iter().min(), keys.first());
        prop_assert!(previous < keys.first().copied(), "loops are out of order");
        previous = keys.first().copied();
        for k in 0..points.len() {
            let (a, b, c) = (
                points[k],
                points[(k + 1) % points.len()],
                points[(k + 2) % points.len()],
            );
            prop_assert!((a.x == b.x) != (a.y == b.y), "not an axis-aligned edge");
            prop_assert!((b - a).perp_dot(c - b) != 0.0, "not a corner");
        }
        // The pixel right of (x) and below the first, topmost-leftmost corner distinguishes outer loops from holes.
        let first = points[0];
        let is_outer = mask.get(first.x as i64, first.y as i64);
        prop_assert_eq!(signed_area(points) > 0.0, is_outer);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn noise(width in 1_u32..140, height in 1_u32..40, density in 0_u32..=8, seed in any::<u64>()) {
        let mut mask = Mask::new(width, height);
        let mut state = seed | 1;
        for y in 0..height {
            for x in 0..width {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                mask.set(x, y, (state >> 40) % 8 < u64::from(density));
            }
        }
        check(&mask)?;
    }

    #[test]
    fn boxes_and_bridges(boxes in prop::collection::vec((0_u32..90, 0_u32..30, 1_u32..40, 1_u32..4, any::<bool>()), 1..20)) {
        let mut mask = Mask::new(100, 32);
        for (x0, y0, long, short, is_wide) in boxes {
            let (w, h) = if is_wide { (long, short) } else { (short, long) };
            for y in y0..(y0 + h).min(32) {
                for x in x0..(x0 + w).min(100) {
                    let flipped = !mask.get(x.into(), y.into());
                    mask.set(x, y, flipped);
                }
            }
        }
        check(&mask)?;
    }
}

#[test]
fn checkerboard_is_all_single_pixels() {
    let mut mask = Mask::new(65, 9);
    for y in 0..9 {
        for x in 0..65 {
            mask.set(x, y, (x + y) % 2 == 0);
        }
    }
    check(&mask).unwrap();
    assert_eq!(trace_contours(&mask).len() as u64, mask.count());
}

#[test]
fn a_full_image_is_one_rectangle_and_an_empty_one_nothing() {
    let mut mask = Mask::new(70, 3);
    assert!(trace_contours(&mask).is_empty());
    for y in 0..3 {
        mask.set_span(y, 0, 70);
    }
    let corners = [(0.0, 0.0), (70.0, 0.0), (70.0, 3.0), (0.0, 3.0)];
    assert_eq!(
        trace_contours(&mask),
        vec![corners.map(|(x, y)| DVec2::new(x, y)).to_vec()]
    );
}

#[test]
fn a_ring_that_touches_itself_becomes_an_outer_loop_and_a_hole() {
    // The two ends meet only in a corner: followed as one loop, the corner would be passed twice.
    let mask = mask_of(&[
        "######.", //
        "#....#.", "#....#.", "#...#..", "#####..",
    ]);
    check(&mask).unwrap();
    let closed = mask_of(&[
        "#####.", //
        "#...#.", "#....#", "#....#", "######",
    ]);
    check(&closed).unwrap();
    let loops = trace_contours(&closed);
    let areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
    assert_eq!(loops.len(), 2, "{loops:?}");
    assert!(areas[0] > 0.0 && areas[1] < 0.0, "{areas:?}");
}

#[test]
fn holes_in_islands_in_holes() {
    let mask = mask_of(&[
        "#######", //
        "#.....#", "#.###.#", "#.#.#.#", "#.###.#", "#.....#", "#######",
    ]);
    check(&mask).unwrap();
    let areas: Vec<f64> = trace_contours(&mask)
        .iter()
        .map(|l| signed_area(l))
        .collect();
    assert_eq!(areas, [49.0, -25.0, 9.0, -1.0]);
}
