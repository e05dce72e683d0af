//! An octree of the points of a chart.
//!
//! Source: as for the parent module, section 2.1.

use super::points::{Draft, LEAF_POINTS, Point};

/// Cubes are halved at most so often: points may coincide.
const MOST_DEPTH: u32 = 24;

/// Divides the points of one chart, whose places begin with `first`.
pub(super) fn divide(points: &mut [Point], first: usize, drafts: &mut Vec<Draft>) {
    divide_cube(points, first, ([0.0; 4], 1.0), MOST_DEPTH, drafts);
}

/// Divides points that are within `half` of `center` along each axis but the chart's.
fn divide_cube(
    points: &mut [Point],
    first: usize,
    (center, half): ([f64; 4], f64),
    depth: u32,
    drafts: &mut Vec<Draft>,
) {
    let place = drafts.len();
    drafts.push(Draft {
        points: first..first + points.len(),
        child_count: 0,
    });
    if points.len() <= LEAF_POINTS || depth == 0 {
        return;
    }
    let axis = (points[0].chart / 2) as usize;
    let octant = |p: &Point| {
        let above = |k: usize| usize::from(k != axis && p.at[k] >= center[k]);
        above(0) | above(1) << 1 | above(2) << 2 | above(3) << 3
    };
    points.sort_by_key(|p| (octant(p), p.face));
    let mut start = first;
    for part in points.chunk_by_mut(|a, b| octant(a) == octant(b)) {
        let of_part = octant(&part[0]);
        let middle = std::array::from_fn(|k| {
            let step = if of_part >> k & 1 == 1 { 0.5 } else { -0.5 };
            center[k] + step * half
        });
        divide_cube(part, start, (middle, half * 0.5), depth - 1, drafts);
        drafts[place].child_count += 1;
        start += part.len();
    }
}
