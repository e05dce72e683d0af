//! Cutting off hairs and slits: lines that stick out of an outline, or cut into it, thinner than contours are precise.
//!
//! Source: beyond the paper. They appear between two views where one part of the object begins to hide another.

use glam::{DVec2, DVec4, Vec4Swizzles};

use crate::loops::DeepLoops;

/// Hairs turn back at their tip by at least as much as 4 along turns 1 across.
const HAIR_LENGTH_TO_WIDTH: f64 = 4.0;

/// Cuts hairs off, with its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct HairCutter {
    /// All points before anything is cut, and where each loop ends.
    before: Vec<DVec4>,
    ends: Vec<usize>,
    cut: Vec<DVec4>,
}

impl HairCutter {
    /// Cuts hairs and slits narrower than `width` off the loops from number `first` on. One that holds another piece of them stays:
    /// without it they would cross.
    pub(super) fn cut(&mut self, loops: &mut DeepLoops, first: usize, width: f64) {
        let is_cut = |points: &[DVec4]| !has_hair(points, width);
        if loops.iter().skip(first).all(is_cut) {
            return;
        }
        self.before.clear();
        self.ends.clear();
        for points in loops.iter().skip(first) {
            self.before.extend_from_slice(points);
            self.ends.push(self.before.len());
        }
        loops.retain_from(first, |_| false);
        let mut start = 0;
        for &end in &self.ends {
            self.cut.clear();
            self.cut.extend_from_slice(&self.before[start..end]);
            cut_between_ends(&mut self.cut, width, &self.before);
            if has_tip_at_ends(&self.cut, width) {
                // Where the loop begins makes no difference.
                let half = self.cut.len() / 2;
                self.cut.rotate_left(half);
                cut_between_ends(&mut self.cut, width, &self.before);
            }
            loops.open_loop().extend_from_slice(&self.cut);
            loops.close();
            start = end;
        }
    }
}

/// Whether a loop has a hair.
fn has_hair(points: &[DVec4], width: f64) -> bool {
    points
        .windows(4)
        .any(|w| tip_before_last(w, width).is_some())
        || has_tip_at_ends(points, width)
}

/// Cuts those off a loop whose tip is neither where it begins nor where it ends, and which hold none of `all` points.
fn cut_between_ends(points: &mut Vec<DVec4>, width: f64, all: &[DVec4]) {
    let mut end = 0;
    for k in 0..points.len() {
        points[end] = points[k];
        end += 1;
        while let Some(tip) = tip_before_last(&points[..end], width) {
            if holds_any(&points[end - 2 - tip..end], all) {
                break;
            }
            points[end - 1 - tip] = points[end - 1];
            end -= tip;
        }
    }
    points.truncate(end);
}

/// Whether a hair has its tip where a loop begins or ends.
fn has_tip_at_ends(points: &[DVec4], width: f64) -> bool {
    let [start, second, third, .., sooner, before, last] = *points else {
        return false;
    };
    let around = [sooner, before, last, start, second, third];
    (around.windows(4)).any(|w| tip_before_last(w, width).is_some())
}

/// Whether a hair, from one root over its tip to the other, holds any of some points that is not one of its own.
fn holds_any(hair: &[DVec4], others: &[DVec4]) -> bool {
    let corners = hair.iter().map(|p| p.xy());
    let low = corners.clone().fold(DVec2::INFINITY, DVec2::min);
    let high = corners.clone().fold(DVec2::NEG_INFINITY, DVec2::max);
    others.iter().map(|p| p.xy()).any(|p| {
        let is_near = p.cmpge(low).all() && p.cmple(high).all();
        is_near && !corners.clone().any(|corner| corner == p) && is_inside(p, hair)
    })
}

/// Whether a polygon, even-odd, holds a point.
fn is_inside(p: DVec2, polygon: &[DVec4]) -> bool {
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let crossed = ends.filter(|(a, b)| {
        let (a, b) = (a.xy(), b.xy());
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
    });
    crossed.count() % 2 == 1
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
    let along = there.dot(back);
    if along <= 0.0 {
        // As nearly everywhere.
        return false;
    }
    let across = there.perp_dot(back).abs();
    // The end of the shorter way is near the longer way.
    let longer = there.length_squared().max(back.length_squared());
    HAIR_LENGTH_TO_WIDTH * across < along && across * across < width * width * longer
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points(coordinates: &[(f64, f64)]) -> Vec<DVec4> {
        let point = |&(x, y): &(f64, f64)| DVec4::new(x, y, 1.0, 0.0);
        coordinates.iter().map(point).collect()
    }

    /// A loop without its hairs, between others.
    fn cut(loop_of: &[DVec4], others: &[&[DVec4]], width: f64) -> Vec<DVec4> {
        let mut loops = DeepLoops::default();
        let all = others.iter().copied().chain([loop_of]);
        for points in all {
            points.iter().for_each(|&p| loops.push(p));
            loops.close();
        }
        HairCutter::default().cut(&mut loops, 0, width);
        let kept = loops.iter().nth(others.len());
        kept.map_or_else(Vec::new, <[DVec4]>::to_vec)
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
            let loop_of = cut(&loop_of, &[], width);
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
    fn a_hair_that_holds_another_stays() {
        // A slit with a blunt tip, into which a thinner spike reaches from below.
        let whole = points(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 6.0),
            (4.2, 6.0),
            (4.2, 0.0),
            (8.0, 0.0),
            (8.0, -2.0),
            (4.15, -1.0),
            (4.1, 5.0),
            (4.05, -1.0),
            (0.0, -2.0),
        ]);
        assert_eq!(cut(&whole, &[], 0.01), whole, "all are wide");
        let kept = cut(&whole, &[], 0.5);
        let has = |kept: &[DVec4], x: f64, y: f64| kept.iter().any(|q| q.x == x && q.y == y);
        assert!(
            has(&kept, 4.0, 6.0) || !has(&kept, 4.1, 5.0),
            "the loop crosses itself"
        );
        // Whether what is in the slit is of the same loop makes no difference.
        let slit = [&whole[..7], &whole[10..]].concat();
        let island = points(&[(4.05, 1.0), (4.15, 1.0), (4.1, 5.0)]);
        assert!(has(&cut(&slit, &[&island], 0.5), 4.0, 6.0));
        assert!(!has(&cut(&slit, &[], 0.5), 4.0, 6.0), "an empty slit goes");
    }

    #[test]
    fn a_loop_that_is_all_hair_keeps_two_points_at_most() {
        let mut all = points(&[(0.0, 0.0), (5.0, 0.001), (9.0, 0.0), (3.0, 0.002)]);
        assert!(cut(&all, &[], 0.1).len() <= 4);
        all.truncate(3);
        assert!(cut(&all, &[], 0.1).len() <= 3);
    }
}
