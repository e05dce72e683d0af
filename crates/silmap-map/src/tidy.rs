//! Leaving out the crumbs of an outline: small pieces that no view shows.
//!
//! Source: beyond the paper. Between two views, where one part of the object begins to hide another, small pieces may come off.

use glam::DVec3;

use crate::loops::{DeepLoops, InPlane, SeenLoops};

/// Crumbs are pieces smaller than this share of the outline's area.
const CRUMB_AREA_REL: f64 = 1e-3;

/// Holes of an outline of several parts are crumbs below this share: between parts a gap opens and closes where it does in space, so most
/// are there.
const CRUMB_GAP_AREA_REL: f64 = 3e-5;

/// Between two views, pieces of one part are crumbs below this share of what is seen of the part.
const CRUMB_PART_AREA_REL: f64 = 0.02;

/// Loops of a smaller area, in square pixels, are specks that thinned-out sides leave where they cross.
const SPECK_PX2: f64 = 0.05;

/// Whether a loop, in pixels, is too small to be more than a trace of where sides cross.
pub(crate) fn is_speck<P: InPlane>(points: &[P]) -> bool {
    double_area(points).abs() <= 2.0 * SPECK_PX2
}

/// Twice the signed area.
pub(crate) fn double_area<P: InPlane>(points: &[P]) -> f64 {
    let Some(&last) = points.last() else {
        return 0.0;
    };
    let origin = last.place();
    // The steps from the last point and to it add nothing.
    let steps = points.iter().zip(points.iter().skip(1));
    steps
        .map(|(a, b)| (a.place() - origin).perp_dot(b.place() - origin))
        .sum()
}

/// How many loops of each kind there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PieceCounts {
    outer: usize,
    holes: usize,
}

impl PieceCounts {
    /// Those of an outline.
    pub(crate) fn of(outline: &SeenLoops) -> Self {
        let mut counts = Self::default();
        for points in outline.iter() {
            if double_area(points) > 0.0 {
                counts.outer += 1;
            } else {
                counts.holes += 1;
            }
        }
        counts
    }

    /// Outer loops and holes.
    pub(crate) fn to_array(self) -> [usize; 2] {
        [self.outer, self.holes]
    }

    pub(crate) fn from_array([outer, holes]: [usize; 2]) -> Self {
        Self { outer, holes }
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
    /// Copies the loops of `outline`, of several parts or one, to `output`, but for the smallest of a kind of which there are more than in
    /// `views`, where they are crumbs, and for those that `is_nothing` says are nothing.
    pub(crate) fn leave_out_crumbs(
        &mut self,
        (outline, is_of_parts): (&SeenLoops, bool),
        views: PieceCounts,
        is_nothing: impl Fn(&[DVec3]) -> bool,
        output: &mut SeenLoops,
    ) {
        self.areas.clear();
        self.areas.extend(outline.iter().map(double_area));
        let hole = match is_of_parts {
            true => CRUMB_GAP_AREA_REL,
            false => CRUMB_AREA_REL,
        };
        self.mark(views, [CRUMB_AREA_REL, hole]);
        let loops = outline.iter().zip(&self.areas);
        let kept = loops.filter(|(points, area)| **area != 0.0 && !is_nothing(points));
        output.assign(kept.map(|(points, _)| points));
    }

    /// Removes the smallest pieces of one part, whose loops are those of `seen` from number `first` on, where there are more than `most` and
    /// they are crumbs. Holes stay: there is something else of the model in most.
    pub(crate) fn leave_out_pieces(&mut self, most: usize, first: usize, seen: &mut DeepLoops) {
        if seen.n_loops() - first <= most {
            return;
        }
        self.areas.clear();
        self.areas.extend(seen.iter().skip(first).map(double_area));
        let views = PieceCounts {
            outer: most,
            holes: 0,
        };
        self.mark(views, [CRUMB_PART_AREA_REL, 0.0]);
        seen.retain_from(first, |k| self.areas[k] != 0.0);
    }

    /// Sets the areas of crumbs to zero: of the smallest pieces and holes of which there are more than in `views`, those below the shares
    /// of the whole for either kind.
    fn mark(&mut self, views: PieceCounts, [piece, hole]: [f64; 2]) {
        let areas = &mut self.areas;
        let whole = areas.iter().sum::<f64>();
        self.order.clear();
        self.order.extend(0..areas.len());
        // Equal ones in their order.
        let key = |k: &usize| (std::cmp::Reverse(areas[*k].abs().to_bits()), *k);
        self.order.sort_unstable_by_key(key);
        let mut found = PieceCounts::default();
        for &k in &self.order {
            let (n, n_views, share) = if areas[k] > 0.0 {
                (&mut found.outer, views.outer, piece)
            } else {
                (&mut found.holes, views.holes, hole)
            };
            *n += 1;
            if *n > n_views && areas[k].abs() < share * whole {
                areas[k] = 0.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loops::FlatLoops;
    use glam::DVec2;
    use silmap_geometry::polygon::signed_area;

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
            square(10.0, 0.5, false),
            square(20.0, 2.0, false),
        ];
        let mut outline = SeenLoops::default();
        for points in &loops {
            points.iter().for_each(|p| outline.push(p.extend(0.25)));
            outline.close();
        }
        let kept_of = |is_of_parts, outer, holes| {
            let mut output = SeenLoops::default();
            let views = PieceCounts { outer, holes };
            CrumbScratch::default().leave_out_crumbs(
                (&outline, is_of_parts),
                views,
                |_| false,
                &mut output,
            );
            let mut flat = FlatLoops::default();
            output.flatten_to(&mut flat);
            flat.to_loops()
        };
        let kept = |outer, holes| kept_of(true, outer, holes);
        assert_eq!(kept_of(false, 3, 0), loops[..3].to_vec());
        assert_eq!(
            kept(1, 0),
            [0, 2, 4].map(|k| loops[k].clone()),
            "a large piece stays, and a hole of its size"
        );
        assert_eq!(kept(3, 1), [0, 1, 2, 4].map(|k| loops[k].clone()));
        assert_eq!(kept(3, 2), loops.to_vec());
    }

    /// Only the part at hand loses pieces, and never the largest that a view has.
    #[test]
    fn pieces_of_a_part_go_where_neither_view_has_as_many() {
        let mut seen = DeepLoops::default();
        let mut add = |part: u16, x: f64, side: f64, is_outer: bool| {
            seen.set_part(part);
            for p in square(x, side, is_outer) {
                seen.push(p.extend(1.0).extend(0.0));
            }
            seen.close();
        };
        add(0, 0.0, 1.0, true);
        for (x, side, is_outer) in [
            (10.0, 1.0, true),
            (30.0, 20.0, true),
            (31.0, 1.0, false),
            (60.0, 9.0, true),
            (80.0, 2.0, true),
        ] {
            add(1, x, side, is_outer);
        }
        let kept = |most: usize| -> Vec<f64> {
            let mut seen = seen.clone();
            CrumbScratch::default().leave_out_pieces(most, 1, &mut seen);
            assert!(seen.of_parts().skip(1).all(|(part, _)| part == 1));
            let firsts = seen
                .iter()
                .map(|l| l.iter().fold(f64::INFINITY, |x, p| x.min(p.x)));
            firsts.collect()
        };
        assert_eq!(kept(1), [0.0, 30.0, 31.0, 60.0], "a large piece stays");
        assert_eq!(kept(3), [0.0, 30.0, 31.0, 60.0, 80.0]);
        assert_eq!(kept(4), [0.0, 10.0, 30.0, 31.0, 60.0, 80.0]);
    }
}
