//! Points of dual space, and regions of them while a tree is built.

use std::ops::Range;

/// Points of a region that is not divided further.
pub(super) const LEAF_POINTS: usize = 32;

/// A face's point: its chart, and its homogeneous coordinates over the largest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) face: u32,
    pub(super) chart: u8,
    pub(super) at: [f64; 4],
}

/// A region while the tree is built: its points, and how many regions are directly below it.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    pub(super) points: Range<usize>,
    pub(super) child_count: u32,
}
