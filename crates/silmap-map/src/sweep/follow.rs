//! Following the sides of silhouettes from vertex to vertex.

use glam::DVec4;

use crate::sweep::interval::Touch;
use crate::sweep::monotone_chain::{Chains, Strand};

/// Appends one side of the interpolated silhouette to `points`: a vertex wherever either view's chain has one.
pub(crate) fn follow_pair(
    (chains_one, chains_two): (&Chains, &Chains),
    [mut one, mut two]: [Strand; 2],
    (y_top, y_bottom): (f64, f64),
    rule: impl Fn(Touch, Touch) -> Touch,
    points: &mut Vec<DVec4>,
) {
    let mut y = y_top;
    loop {
        let touch = rule(one.at(y), two.at(y));
        points.push(DVec4::new(touch.x, y, touch.disparity, touch.slide));
        if y >= y_bottom {
            return;
        }
        if one.next_y() <= y {
            one.advance(chains_one, y);
        }
        if two.next_y() <= y {
            two.advance(chains_two, y);
        }
        y = one.next_y().min(two.next_y()).min(y_bottom);
    }
}

/// Whether two sides over the same heights meet: each vertex of one is compared with the other at its height.
pub(crate) fn do_cross(left: &[DVec4], right: &[DVec4]) -> bool {
    is_beyond(left, right, 1.0) || is_beyond(right, left, -1.0)
}

/// Whether a vertex of `line` lies beyond `other` in the direction of `sign`.
fn is_beyond(line: &[DVec4], other: &[DVec4], sign: f64) -> bool {
    let mut k = 0;
    line.iter().any(|p| {
        while k + 2 < other.len() && other[k + 1].y < p.y {
            k += 1;
        }
        let (a, b) = (other[k], other[k + 1]);
        // Compared without a division: the segment goes down.
        let height = b.y - a.y;
        sign * ((p.x - a.x) * height - (b.x - a.x) * (p.y - a.y)) > 0.0
    })
}
