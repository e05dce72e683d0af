//! Walking polygon sets slab by slab: between two consecutive vertex heights no contour has a vertex.
//!
//! Source: Silhouette Mapping, section 5.2: the active-edge scan conversion of two rectified silhouettes. Deviation: the
//! paper visits scanlines through vertices; here the slabs between them are visited, so that the result is made of
//! trapezoids and closed for every topology.

use crate::loops::FlatLoops;

/// A quantity that is linear across a slab: an x coordinate at its top and at its bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    /// Value at the slab's top (smaller y).
    pub top: f64,
    /// Value at the slab's bottom.
    pub bottom: f64,
}

impl Side {
    /// The value at `share` of the way from top to bottom; exact at 0 and 1.
    #[must_use]
    pub(crate) fn at(self, share: f64) -> f64 {
        if share <= 0.0 {
            self.top
        } else if share >= 1.0 {
            self.bottom
        } else {
            self.top + (self.bottom - self.top) * share
        }
    }

    /// The side moved by `factor` times another.
    pub(crate) fn plus(self, other: Self, factor: f64) -> Self {
        let top = self.top + other.top * factor;
        Self {
            top,
            bottom: self.bottom + other.bottom * factor,
        }
    }

    /// Linear interpolation between two sides: (1 − α) of `self` and α of `other`, exact at 0 and 1.
    #[must_use]
    pub(crate) fn lerp(self, other: Self, alpha: f64) -> Self {
        let mix = |a: f64, b: f64| a * (1.0 - alpha) + b * alpha;
        Self {
            top: mix(self.top, other.top),
            bottom: mix(self.bottom, other.bottom),
        }
    }

    /// Where in (0, 1) the two sides cross.
    #[must_use]
    pub(crate) fn crossing(self, other: Self) -> Option<f64> {
        let (above, below) = (self.top - other.top, self.bottom - other.bottom);
        if above * below >= 0.0 {
            return None;
        }
        let share = above / (above - below);
        (share > 0.0 && share < 1.0).then_some(share)
    }
}

/// An interval of a span across a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    /// Where a scanline enters the silhouette.
    pub enter: Side,
    /// Where it leaves again.
    pub exit: Side,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    y_top: f64,
    y_bottom: f64,
    x_top: f64,
    x_bottom: f64,
    slope: f64,
}

impl Edge {
    /// The x at height y; exact at both ends, so that neighbouring slabs agree to the bit.
    fn x_at(&self, y: f64) -> f64 {
        if y <= self.y_top {
            self.x_top
        } else if y >= self.y_bottom {
            self.x_bottom
        } else {
            self.x_top + (y - self.y_top) * self.slope
        }
    }
}

/// One polygon set on its way through the slabs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sweep {
    edges: Vec<Edge>,
    /// Sort keys of the edges' tops, and the edges, from the top.
    order: Vec<(u64, u32)>,
    next: usize,
    active: Vec<u32>,
    heights: Vec<f64>,
}

impl Sweep {
    /// Starts over with the edges of `loops`; horizontal edges bound nothing and are left out.
    pub(crate) fn restart(&mut self, loops: &FlatLoops) {
        self.edges.clear();
        self.heights.clear();
        for points in loops.iter() {
            let mut a = points[points.len() - 1];
            for &b in points {
                self.heights.push(b.y);
                let (top, bottom) = if a.y <= b.y { (a, b) } else { (b, a) };
                if top.y < bottom.y {
                    self.edges.push(Edge {
                        y_top: top.y,
                        y_bottom: bottom.y,
                        x_top: top.x,
                        x_bottom: bottom.x,
                        slope: (bottom.x - top.x) / (bottom.y - top.y),
                    });
                }
                a = b;
            }
        }
        self.order.clear();
        self.order.extend(
            (0_u32..)
                .zip(&self.edges)
                .map(|(e, edge)| (sort_key(edge.y_top), e)),
        );
        self.order.sort_unstable();
        self.heights.sort_unstable_by(f64::total_cmp);
        self.heights.dedup();
        self.rewind();
    }

    /// Goes back above the first slab.
    pub(crate) fn rewind(&mut self) {
        self.next = 0;
        self.active.clear();
    }

    /// The distinct vertex heights, from the top.
    #[must_use]
    pub(crate) fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Steps to the slab from `y_top` to `y_bottom`, which must lie below the last one and hold no vertex inside, and
    /// writes the silhouette's intervals there, from left to right.
    pub(crate) fn step(&mut self, y_top: f64, y_bottom: f64, intervals: &mut Vec<Interval>) {
        let edges = &self.edges;
        let before = self.active.len();
        self.active.retain(|&e| edges[e as usize].y_bottom > y_top);
        let mut changed = self.active.len() != before;
        while let Some(&(_, e)) = self.order.get(self.next) {
            let edge = &edges[e as usize];
            if edge.y_top > y_top {
                break;
            }
            if edge.y_bottom > y_top {
                self.active.push(e);
                changed = true;
            }
            self.next += 1;
        }
        if changed {
            // Nothing crosses within a polygon set, so the order holds until the set of edges changes.
            let middle = 0.5 * (y_top + y_bottom);
            insertion_sort(&mut self.active, |&e| edges[e as usize].x_at(middle));
        }
        intervals.clear();
        let side = |e: u32| {
            let edge = &edges[e as usize];
            Side {
                top: edge.x_at(y_top),
                bottom: edge.x_at(y_bottom),
            }
        };
        for pair in self.active.chunks_exact(2) {
            intervals.push(Interval {
                enter: side(pair[0]),
                exit: side(pair[1]),
            });
        }
    }
}

/// An integer that sorts as the number does (as `f64::total_cmp`): comparing integers is what makes sorting fast.
fn sort_key(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits >> 63 == 0 {
        bits | 1 << 63
    } else {
        !bits
    }
}

/// Sorts a short, almost sorted list by a key; equal keys keep their order.
pub(crate) fn insertion_sort<T: Copy>(items: &mut [T], key: impl Fn(&T) -> f64) {
    for i in 1..items.len() {
        let item = items[i];
        let k = key(&item);
        let mut j = i;
        while j > 0 && key(&items[j - 1]) > k {
            items[j] = items[j - 1];
            j -= 1;
        }
        items[j] = item;
    }
}

/// Merges sorted lists of heights into one without repetitions.
pub(crate) fn merge_heights(lists: &[&[f64]], merged: &mut Vec<f64>) {
    const MOST: usize = 3;
    debug_assert!(lists.len() <= MOST, "at most three lists are merged");
    merged.clear();
    let mut next = [0_usize; MOST];
    loop {
        let heads = lists.iter().zip(&next).filter_map(|(list, &n)| list.get(n));
        let Some(&lowest) = heads.min_by(|a, b| a.total_cmp(b)) else {
            return;
        };
        for (list, n) in lists.iter().zip(&mut next) {
            while list
                .get(*n)
                .is_some_and(|head| head.total_cmp(&lowest).is_le())
            {
                *n += 1;
            }
        }
        merged.push(lowest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn a_square_with_a_hole_has_the_right_intervals() {
        let mut loops = FlatLoops::default();
        let square = |low: f64, high: f64| {
            [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| DVec2::new(x, y))
        };
        loops.assign([&square(0.0, 9.0)[..], &square(3.0, 6.0)[..]]);
        let mut sweep = Sweep::default();
        sweep.restart(&loops);
        assert_eq!(sweep.heights(), [0.0, 3.0, 6.0, 9.0]);
        let mut intervals = Vec::new();
        let mut counts = Vec::new();
        for k in 0..3 {
            let (top, bottom) = (sweep.heights()[k], sweep.heights()[k + 1]);
            sweep.step(top, bottom, &mut intervals);
            counts.push(
                intervals
                    .iter()
                    .map(|i| i.exit.at(0.5) - i.enter.at(0.5))
                    .collect::<Vec<_>>(),
            );
        }
        assert_eq!(counts, [vec![9.0], vec![3.0, 3.0], vec![9.0]]);
    }
}
