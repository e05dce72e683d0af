//! Leaving out the crumbs of an outline: small pieces that no view shows.
//!
//! Source: beyond the paper. Between two views, where one part of the object begins to hide another, small pieces may come off.

use glam::{DVec3, Vec3Swizzles};

use crate::loops::{InPlane, SeenLoops};

/// Crumbs are smaller than this share of the outline's area.
const CRUMB_AREA_REL: f64 = 1e-3;

/// Loops of a smaller area, in square pixels, are specks that thinned-out sides leave where they cross.
const SPECK_PX2: f64 = 0.05;

/// Whether a loop, in pixels, is too small to be more than a trace of where sides cross.
pub(crate) fn is_speck<P: InPlane>(points: &[P]) -> bool {
    double_area(points).abs() <= 2.0 * SPECK_PX2
}

fn double_area<P: InPlane>(points: &[P]) -> f64 {
    let Some(&last) = points.last() else {
        return 0.0;
    };
    let steps = std::iter::once(&last).chain(points).zip(points);
    steps.map(|(a, b)| a.place().perp_dot(b.place())).sum()
}

/// Signed area.
fn area_of(points: &[DVec3]) -> f64 {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return 0.0;
    };
    let origin = first.xy();
    let closing = std::iter::once((last, first));
    let steps = points.iter().zip(&points[1..]).chain(closing);
    let twice: f64 = steps
        .map(|(a, b)| (a.xy() - origin).perp_dot(b.xy() - origin))
        .sum();
    twice * 0.5
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
            if area_of(points) > 0.0 {
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
    /// Copies the loops of `outline` to `output`, but for the smallest of a kind of which there are more than in `views`, where they
    /// are crumbs, and for those that `is_nothing` says are nothing.
    pub(crate) fn leave_out_crumbs(
        &mut self,
        outline: &SeenLoops,
        views: PieceCounts,
        is_nothing: impl Fn(&[DVec3]) -> bool,
        output: &mut SeenLoops,
    ) {
        let areas = &mut self.areas;
        areas.clear();
        areas.extend(outline.iter().map(area_of));
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
            square(10.0, 1.0, false),
        ];
        let mut outline = SeenLoops::default();
        for points in &loops {
            points.iter().for_each(|p| outline.push(p.extend(0.25)));
            outline.close();
        }
        let kept = |outer, holes| {
            let mut output = SeenLoops::default();
            let views = PieceCounts { outer, holes };
            CrumbScratch::default().leave_out_crumbs(&outline, views, |_| false, &mut output);
            let mut flat = FlatLoops::default();
            output.flatten_to(&mut flat);
            flat.to_loops()
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
