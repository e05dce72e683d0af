//! Cutting off hairs and slits: lines that stick out of an outline, or cut into it, thinner than contours are precise.
//!
//! Source: beyond the paper. They appear between two views where one part of the object begins to hide another.

use glam::{DVec2, DVec4, Vec4Swizzles};

/// Hairs turn back at their tip by at least as much as 4 along turns 1 across.
const HAIR_LENGTH_TO_WIDTH: f64 = 4.0;

/// Cuts hairs and slits narrower than `width` off the loop that begins at `first` and is the last in `points`.
pub(crate) fn cut_hairs(points: &mut Vec<DVec4>, first: usize, width: f64) {
    let is_hair = |a: DVec4, tip: DVec4, b: DVec4| is_hair(a.xy(), tip.xy(), b.xy(), width);
    let mut end = first;
    for k in first..points.len() {
        points[end] = points[k];
        end += 1;
        while end >= first + 3 && is_hair(points[end - 3], points[end - 2], points[end - 1]) {
            points[end - 2] = points[end - 1];
            end -= 1;
        }
    }
    points.truncate(end);
    // Where the loop begins makes no difference.
    while let [start, second, .., before, tip] = points[first..] {
        if is_hair(before, tip, start) {
            points.pop();
        } else if is_hair(tip, start, second) {
            points.remove(first);
        } else {
            return;
        }
    }
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
        fn hairs_and_slits_are_cut(start in 0..12_usize, width in prop::sample::select(vec![0.05, 0.15, 0.5])) {
            let whole = [
                (0.0, 0.0),
                (4.0, 0.0),
                (4.1, -9.0),
                (4.2, 0.0),
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
            // The hair is 0.2 wide, the slit 0.1.
            prop_assert_eq!(has(whole[2]), width < 0.2);
            prop_assert_eq!(has(whole[7]), width < 0.1);
            prop_assert!([0, 4, 5, 10].iter().all(|&k| has(whole[k])), "real corners stay");
            prop_assert!(loop_of.len() + 4 >= before);
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
