//! What an interpolated outline has that no view shows: hairs, slits and crumbs.
//!
//! Where one part of the object begins to hide another between two views, contours are known to their tolerance only, and what
//! is interpolated there may stick out, or be cut in, by a line thinner than that; and small pieces may come off. A line is cut
//! off where it is thinner than contours are precise, and a small piece left out where no view has as many.
//!
//! Source: beyond the paper, whose cliques bring the same.

use glam::{DVec2, DVec4, Vec4Swizzles};
use silmap_geometry::Loop;
use silmap_geometry::polygon::signed_area;

use crate::CapturedView;
use crate::loops::FlatLoops;

/// Crumbs are smaller than this share of the outline's area.
const CRUMB_AREA_REL: f64 = 1e-3;

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

/// How many loops of each kind there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PieceCounts {
    outer: usize,
    holes: usize,
}

impl PieceCounts {
    /// Those of a view's contours.
    pub(crate) fn of_view(view: &CapturedView) -> Self {
        let is_outer = |points: &Loop| signed_area(points) > 0.0;
        let outer = (view.contours.iter())
            .filter(|c| is_outer(&c.points))
            .count();
        Self {
            outer,
            holes: view.contours.len() - outer,
        }
    }

    /// The greater number of each kind.
    pub(crate) fn max(self, other: Self) -> Self {
        Self {
            outer: self.outer.max(other.outer),
            holes: self.holes.max(other.holes),
        }
    }
}

/// Buffers for leaving out crumbs.
#[derive(Clone, Debug, Default)]
pub(crate) struct CrumbScratch {
    areas: Vec<f64>,
    order: Vec<usize>,
}

impl CrumbScratch {
    /// Copies the loops of `outline` to `output`, but for the smallest of a kind of which there are more than in `views`, where they
    /// are crumbs, and for those that `is_nothing` says are nothing.
    pub(crate) fn leave_out_crumbs(
        &mut self,
        outline: &FlatLoops,
        views: PieceCounts,
        is_nothing: impl Fn(&[DVec2]) -> bool,
        output: &mut FlatLoops,
    ) {
        let areas = &mut self.areas;
        areas.clear();
        areas.extend(outline.iter().map(signed_area));
        let largest_crumb = CRUMB_AREA_REL * areas.iter().sum::<f64>();
        self.order.clear();
        self.order.extend(0..areas.len());
        // Equal ones in their order.
        let key = |k: &usize| (std::cmp::Reverse(areas[*k].abs().to_bits()), *k);
        self.order.sort_unstable_by_key(key);
        let mut found = PieceCounts::default();
        for &k in &self.order {
            let (n, n_views) = if areas[k] > 0.0 {
                (&mut found.outer, views.outer)
            } else {
                (&mut found.holes, views.holes)
            };
            *n += 1;
            if *n > n_views && areas[k].abs() < largest_crumb {
                areas[k] = 0.0;
            }
        }
        let loops = outline.iter().zip(areas).filter(|(_, area)| **area != 0.0);
        output.assign(loops.map(|(points, _)| points).filter(|l| !is_nothing(l)));
    }
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

    fn square(x: f64, side: f64, is_outer: bool) -> Vec<DVec2> {
        let mut corners: Vec<DVec2> = [(x, 0.0), (x + side, 0.0), (x + side, side), (x, side)]
            .map(DVec2::from)
            .to_vec();
        if (signed_area(&corners) > 0.0) != is_outer {
            corners.reverse();
        }
        corners
    }

    #[test]
    fn crumbs_go_where_no_view_has_as_many_pieces() {
        let loops = [
            square(0.0, 100.0, true),
            square(200.0, 2.0, true),
            square(300.0, 20.0, true),
            square(10.0, 1.0, false),
        ];
        let mut outline = FlatLoops::default();
        outline.assign(loops.iter().map(Vec::as_slice));
        let kept = |outer, holes| {
            let mut output = FlatLoops::default();
            let views = PieceCounts { outer, holes };
            CrumbScratch::default().leave_out_crumbs(&outline, views, |_| false, &mut output);
            output.to_loops()
        };
        assert_eq!(
            kept(1, 0),
            [loops[0].clone(), loops[2].clone()],
            "a large piece stays"
        );
        assert_eq!(kept(3, 0), loops[..3].to_vec());
        assert_eq!(kept(3, 1), loops.to_vec());
    }
}
