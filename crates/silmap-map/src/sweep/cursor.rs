//! The sweep cursor: the monotone chains that a horizontal line meets on its way down a silhouette.
//!
//! Source: Silhouette Mapping, section 5.2, the active-edge list of the scan conversion; see [`monotone_chain`](super::monotone_chain).

use glam::{DVec2, DVec3};

use super::interval::{SpanInterval, TangentRay, insertion_sort};
use super::monotone_chain::{MonotoneChain, MonotoneChains};

/// A chain on which a walk is, with the edge it has come to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChainCursor {
    upper: DVec3,
    lower: DVec3,
    inverse_height: f64,
    /// Index of `lower`.
    at: u32,
    bottom: u32,
    y_bottom: f64,
}

impl ChainCursor {
    fn new(points: &[DVec3], chain: &MonotoneChain) -> Self {
        let upper = points[chain.top as usize];
        let mut cursor = Self {
            upper,
            lower: upper,
            inverse_height: 0.0,
            at: chain.top,
            bottom: chain.bottom,
            y_bottom: chain.y_bottom,
        };
        cursor.step(points);
        cursor
    }

    /// Goes on to the next edge.
    fn step(&mut self, points: &[DVec3]) {
        self.at = if self.bottom > self.at {
            self.at + 1
        } else {
            self.at - 1
        };
        self.upper = self.lower;
        self.lower = points[self.at as usize];
        self.inverse_height = 1.0 / (self.lower.y - self.upper.y);
    }

    /// Goes on to the edge that leads below height `y`, or to the last.
    pub(crate) fn advance(&mut self, chains: &MonotoneChains, y: f64) {
        while self.lower.y <= y && self.at != self.bottom {
            self.step(&chains.points);
        }
    }

    /// Where the edge ends that the walk is on.
    pub(crate) fn next_y(&self) -> f64 {
        self.lower.y
    }

    /// The point of the edge at height `y`; exact at both ends, so that neighbouring slabs agree to the bit.
    pub(crate) fn at(&self, y: f64) -> TangentRay {
        let (a, b) = (self.upper, self.lower);
        if y <= a.y {
            TangentRay {
                x: a.x,
                disparity: a.z,
                slide: 0.0,
            }
        } else if y >= b.y {
            TangentRay {
                x: b.x,
                disparity: b.z,
                slide: 0.0,
            }
        } else {
            let share = (y - a.y) * self.inverse_height;
            TangentRay {
                x: a.x + (b.x - a.x) * share,
                disparity: a.z + (b.z - a.z) * share,
                slide: 0.0,
            }
        }
    }

    /// The place and the disparity of the point at height `y`, as [`ChainCursor::at`].
    #[inline]
    pub(crate) fn place(&self, y: f64) -> DVec2 {
        let (a, b) = (self.upper, self.lower);
        if y >= b.y {
            DVec2::new(b.x, b.z)
        } else {
            let share = ((y - a.y) * self.inverse_height).max(0.0);
            DVec2::new(a.x + (b.x - a.x) * share, a.z + (b.z - a.z) * share)
        }
    }

    /// Numbers of the vertices between which the chain passes height `y`, edges below where the walk is.
    fn edge_below(&self, chains: &MonotoneChains, y: f64) -> (u32, u32) {
        let steps = self.at.abs_diff(self.bottom);
        let at = |steps: u32| {
            if self.bottom > self.at {
                self.at + steps
            } else {
                self.at - steps
            }
        };
        // Heights that are asked for mostly lie near: first in growing strides, then by halves.
        let (mut near, mut stride) = (0, 1);
        while near + stride < steps && chains.points[at(near + stride) as usize].y < y {
            near += stride;
            stride *= 2;
        }
        let mut far = (near + stride).min(steps);
        while far - near > 1 {
            let middle = u32::midpoint(near, far);
            if chains.points[at(middle) as usize].y < y {
                near = middle;
            } else {
                far = middle;
            }
        }
        (at(near), at(far))
    }

    /// The point at a height that may lie edges below.
    fn at_below(&self, chains: &MonotoneChains, y: f64) -> TangentRay {
        if self.lower.y >= y {
            return self.at(y);
        }
        let (near, far) = self.edge_below(chains, y);
        let (a, b) = (chains.points[near as usize], chains.points[far as usize]);
        let p = a.lerp(b, ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0));
        TangentRay {
            x: p.x,
            disparity: p.z,
            slide: 0.0,
        }
    }

    /// Vertices from where the walk is down to height `y`.
    fn count_vertices(&self, chains: &MonotoneChains, y: f64) -> u32 {
        if self.lower.y >= y {
            return 0;
        }
        self.edge_below(chains, y).0.abs_diff(self.at) + 1
    }

    /// The least and the greatest x from where the walk is down to height `y`.
    pub(crate) fn x_range(&self, chains: &MonotoneChains, y: f64) -> (f64, f64) {
        let first = self.upper.x;
        let (mut least, mut greatest) = (first, first);
        let mut at = self.at;
        loop {
            let p = chains.points[at as usize];
            least = least.min(p.x);
            greatest = greatest.max(p.x);
            if p.y >= y || at == self.bottom {
                return (least, greatest);
            }
            at = if self.bottom > at { at + 1 } else { at - 1 };
        }
    }
}

/// The chains that a horizontal line meets, on its way down.
#[derive(Clone, Debug, Default)]
pub(crate) struct SweepCursor {
    next: usize,
    chain_cursors: Vec<ChainCursor>,
}

impl SweepCursor {
    /// Goes back above everything.
    pub(crate) fn restart(&mut self) {
        self.next = 0;
        self.chain_cursors.clear();
    }

    /// The chains met, from left to right: a silhouette is entered at the first, third, … and left at the others.
    pub(crate) fn chain_cursors(&self) -> &[ChainCursor] {
        &self.chain_cursors
    }

    /// How many intervals the line meets.
    pub(crate) fn n_intervals(&self) -> usize {
        self.chain_cursors.len() / 2
    }

    /// Goes down to height `y`, not below the next of [`SweepCursor::end`]: chains that end there are left, those that begin there
    /// are met.
    pub(crate) fn enter(&mut self, chains: &MonotoneChains, y: f64) {
        let before = self.chain_cursors.len();
        self.chain_cursors.retain(|cursor| cursor.y_bottom > y);
        let mut is_changed = self.chain_cursors.len() != before;
        for cursor in &mut self.chain_cursors {
            cursor.advance(chains, y);
        }
        while let Some(chain) = chains.chains.get(self.next).filter(|c| c.y_top <= y) {
            if chain.y_bottom > y {
                self.chain_cursors
                    .push(ChainCursor::new(&chains.points, chain));
                is_changed = true;
            }
            self.next += 1;
        }
        if is_changed && self.chain_cursors.len() > 1 {
            // Nothing crosses within a silhouette, so the order holds until the set of chains changes.
            let middle = 0.5 * (y + self.end(chains));
            let x = |s: ChainCursor| s.at_below(chains, middle).x;
            insertion_sort(&mut self.chain_cursors, x, |_, _| {});
        }
    }

    /// The height at which a chain ends or begins next; infinite when there is none.
    pub(crate) fn end(&self, chains: &MonotoneChains) -> f64 {
        let begins = chains
            .chains
            .get(self.next)
            .map_or(f64::INFINITY, |c| c.y_top);
        self.chain_cursors
            .iter()
            .fold(begins, |least, s| least.min(s.y_bottom))
    }

    /// The height of the next vertex on a chain that is met; infinite when there is none.
    pub(crate) fn next_vertex(&self) -> f64 {
        self.chain_cursors
            .iter()
            .fold(f64::INFINITY, |least, s| least.min(s.lower.y))
    }

    /// Vertices on all chains from where the walk is down to height `y`.
    pub(crate) fn count_vertices(&self, chains: &MonotoneChains, y: f64) -> u32 {
        let chain_cursors = self.chain_cursors.iter();
        chain_cursors.map(|s| s.count_vertices(chains, y)).sum()
    }

    /// Goes down to height `y`, not below the next of [`SweepCursor::end`], keeping the chains.
    pub(crate) fn advance(&mut self, chains: &MonotoneChains, y: f64) {
        for cursor in &mut self.chain_cursors {
            cursor.advance(chains, y);
        }
    }

    /// The intervals on the scanline at height `y`, where no chain ends above, from left to right; vertices before are skipped.
    pub(crate) fn intervals(
        &self,
        chains: &MonotoneChains,
        y: f64,
        output: &mut Vec<SpanInterval>,
    ) {
        output.clear();
        output.extend(self.chain_cursors.chunks_exact(2).map(|pair| SpanInterval {
            enter: pair[0].at_below(chains, y),
            exit: pair[1].at_below(chains, y),
        }));
    }
}

/// The first heights between which no chain of two silhouettes ends and a line meets both; the cursors are brought there.
pub(crate) fn first_range(
    cursors: &mut [SweepCursor; 2],
    chains: &[MonotoneChains; 2],
) -> Option<(f64, f64)> {
    cursors.iter_mut().for_each(SweepCursor::restart);
    next_range(
        cursors,
        chains,
        chains[0].first_y().min(chains[1].first_y()),
    )
}

/// The next such heights from `y` down, which is where the last ones ended.
pub(crate) fn next_range(
    cursors: &mut [SweepCursor; 2],
    chains: &[MonotoneChains; 2],
    mut y: f64,
) -> Option<(f64, f64)> {
    while y.is_finite() {
        let mut end = f64::INFINITY;
        for (cursor, chains) in cursors.iter_mut().zip(chains) {
            cursor.enter(chains, y);
            end = end.min(cursor.end(chains));
        }
        if end.is_finite() && cursors.iter().all(|w| w.n_intervals() > 0) {
            return Some((y, end));
        }
        y = end;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_with_a_hole_has_the_right_intervals() {
        let mut chains = MonotoneChains::default();
        for (low, high) in [(0.0, 9.0), (3.0, 6.0)] {
            for (x, y) in [(low, high), (low, low), (high, low), (high, high)] {
                chains.push(DVec3::new(x, y, 1.0));
            }
            chains.close(0.0);
        }
        chains.seal();
        let mut cursor = SweepCursor::default();
        cursor.restart();
        let (mut y, mut widths) = (chains.first_y(), Vec::new());
        loop {
            cursor.enter(&chains, y);
            let end = cursor.end(&chains).min(cursor.next_vertex());
            if !end.is_finite() {
                break;
            }
            let mut intervals = Vec::new();
            cursor.intervals(&chains, 0.5 * (y + end), &mut intervals);
            // Level edges are tilted by next to nothing.
            let is_thin = end - y < 1e-6;
            y = end;
            if is_thin {
                continue;
            }
            widths.push(
                intervals
                    .iter()
                    .map(|i| i.exit.x - i.enter.x)
                    .collect::<Vec<_>>(),
            );
        }
        let rounded: Vec<Vec<f64>> = widths
            .iter()
            .map(|w| w.iter().map(|x| (x * 1e6).round() / 1e6).collect())
            .collect();
        assert_eq!(rounded, [vec![9.0], vec![3.0, 3.0], vec![9.0]]);
    }

    #[test]
    fn a_zigzag_is_cut_at_its_turns() {
        let mut chains = MonotoneChains::default();
        for (x, y) in [
            (0.0, 4.0),
            (1.0, 1.0),
            (2.0, 3.0),
            (3.0, 0.0),
            (4.0, 2.0),
            (4.0, 4.0),
        ] {
            chains.push(DVec3::new(x, y, 0.0));
        }
        chains.close(0.0);
        chains.seal();
        let tops: Vec<f64> = chains.chains.iter().map(|c| c.y_top).collect();
        assert_eq!(tops, [0.0, 0.0, 1.0, 1.0]);
        let mut cursor = SweepCursor::default();
        cursor.enter(&chains, 0.0);
        cursor.enter(&chains, 1.0);
        let xs: Vec<f64> = cursor.chain_cursors().iter().map(|s| s.at(2.0).x).collect();
        assert_eq!(xs.len(), 4);
        assert!(xs.is_sorted());
    }
}
