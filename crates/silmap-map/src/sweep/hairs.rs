//! Cutting off hairs and slits: lines that stick out of an outline, or cut into it, thinner than contours are precise.
//!
//! Source: beyond the paper. They appear between two views where one part of the object begins to hide another.

use glam::{DVec2, DVec4, Vec4Swizzles};

/// Hairs turn back at their tip by at least as much as 4 along turns 1 across.
const HAIR_LENGTH_TO_WIDTH: f64 = 4.0;

/// Cuts hairs and slits narrower than `width` off the loop that begins at `first` and is the last in `points`.
pub(crate) fn cut_hairs(points: &mut Vec<DVec4>, first: usize, width: f64) {
    let mut end = first;
    for k in first..points.len() {
        points[end] = points[k];
        end += 1;
        while let Some(tip) = tip_before_last(&points[first..end], width) {
            points[end - 1 - tip] = points[end - 1];
            end -= tip;
        }
    }
    points.truncate(end);
    while cut_at_start(points, first, width) {}
}

/// Cuts a hair off whose tip is where the loop begins: that makes no difference. Says whether there was one.
fn cut_at_start(points: &mut Vec<DVec4>, first: usize, width: f64) -> bool {
    let [start, second, .., before, last] = points[first..] else {
        return false;
    };
    let tip = |around: &[DVec4]| tip_before_last(around, width);
    if tip(&[before, last, start]).is_some() {
        points.pop();
    } else if tip(&[last, start, second]).is_some() {
        points.remove(first);
    } else if let [_, _, third, .., sooner, _, _] = points[first..] {
        if tip(&[sooner, before, last, start]).is_some() {
            points.truncate(points.len() - 2);
        } else if tip(&[before, last, start, second]).is_some() {
            points.pop();
            points.remove(first);
        } else if tip(&[last, start, second, third]).is_some() {
            points.drain(first..first + 2);
        } else {
            return false;
        }
    } else {
        return false;
    }
    true
}

/// How many points before the last are the tip of a hair: one, or two where the tip is blunt.
fn tip_before_last(points: &[DVec4], width: f64) -> Option<usize> {
    let is_tip = |a: &DVec4, tip: &DVec4, b: &DVec4| is_hair(a.xy(), tip.xy(), b.xy(), width);
    let [.., one, tip, b] = points else {
        return None;
    };
    if is_tip(one, tip, b) {
        return Some(1);
    }
    let [.., a, _, _, _] = points else {
        return None;
    };
    let is_blunt = one.xy().distance_squared(tip.xy()) < width * width;
    (is_blunt && is_tip(a, one, b) && is_tip(a, tip, b)).then_some(2)
}

/// Whether the line from `a` over `tip` to `b` turns back so sharply that less than `width` is between its two ways.
fn is_hair(a: DVec2, tip: DVec2, b: DVec2, width: f64) -> bool {
    let (there, back) = (a - tip, b - tip);
    let across = there.perp_dot(back).abs();
    // The end of the shorter way is near the longer way.
    let longer = there.length_squared().max(back.length_squared());
    HAIR_LENGTH_TO_WIDTH * across < there.dot(back) && across * across < width * width * longer
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points(coordinates: &[(f64, f64)]) -> Vec<DVec4> {
        let point = |&(x, y): &(f64, f64)| DVec4::new(x, y, 1.0, 0.0);
        coordinates.iter().map(point).collect()
    }

    proptest! {
        /// Wherever the loop begins, a hair and a slit go, and nothing else.
        #[test]
        fn hairs_and_slits_are_cut(start in 0..16_usize, width in prop::sample::select(vec![0.05, 0.15, 0.5])) {
            let whole = [
                (0.0, 0.0),
                (4.0, 0.0),
                (4.1, -9.0),
                (4.2, 0.0),
                (7.0, 0.0),
                (7.05, -6.0),
                (7.15, -6.0),
                (7.2, 0.0),
                (10.0, 0.0),
                (10.0, 10.0),
                (6.0, 10.0),
                (5.95, 3.0),
                (5.9, 10.0),
                (0.0, 10.0),
                (-3.0, 9.0),
                (0.0, 8.0),
            ];
            let mut loop_of = points(&whole);
            loop_of.rotate_left(start);
            let before = loop_of.len();
            cut_hairs(&mut loop_of, 0, width);
            let has = |p: (f64, f64)| loop_of.iter().any(|q| q.x == p.0 && q.y == p.1);
            // The hairs are 0.2 wide, the slit 0.1, and one hair has a blunt tip.
            prop_assert_eq!(has(whole[2]), width < 0.2);
            prop_assert_eq!((has(whole[5]), has(whole[6])), (width < 0.2, width < 0.2));
            prop_assert_eq!(has(whole[11]), width < 0.1);
            prop_assert!([0, 8, 9, 14].iter().all(|&k| has(whole[k])), "real corners stay");
            prop_assert!(loop_of.len() + 7 >= before);
        }
    }

    #[test]
    fn a_loop_that_is_all_hair_keeps_two_points_at_most() {
        let mut before = points(&[(7.0, 7.0)]);
        before.extend(points(&[
            (0.0, 0.0),
            (5.0, 0.001),
            (9.0, 0.0),
            (3.0, 0.002),
        ]));
        cut_hairs(&mut before, 1, 0.1);
        assert!(before.len() <= 4 && before[0].x == 7.0);
    }
}
