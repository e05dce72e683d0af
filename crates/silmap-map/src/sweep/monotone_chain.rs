//! Silhouettes as y-monotone chains, and walking down them.
//!
//! Source: Silhouette Mapping, section 5.2: the active-edge scan conversion of two rectified silhouettes. Deviation: the
//! paper visits scanlines through vertices; here the slabs between them are visited, so that the result is made of
//! trapezoids and closed for every topology. And what is kept active are chains of edges from a local top to a local
//! bottom of a contour, not single edges: vertices along a chain are met in order without sorting, and between two chain
//! ends nothing changes but numbers.

use glam::{DVec2, DVec3};

use crate::sweep::interval::{Interval, Section, Side, Touch, insertion_sort};

/// A run of edges that go down: vertices `top` to `bottom` by index, in either direction.
#[derive(Clone, Copy, Debug)]
struct Chain {
    y_top: f64,
    y_bottom: f64,
    top: u32,
    bottom: u32,
}

/// Closed loops of points (x, y, disparity), cut into chains.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chains {
    points: Vec<DVec3>,
    /// By height of their tops, once sealed.
    chains: Vec<Chain>,
    loop_start: usize,
}

impl Chains {
    /// Forgets everything, keeping the storage.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.chains.clear();
        self.loop_start = 0;
    }

    /// Makes room for loops of so many points in all.
    pub(crate) fn reserve(&mut self, n_points: usize) {
        // Each loop of at least three points ends where it begins.
        self.points.reserve(n_points + n_points / 3);
        self.chains.reserve(n_points);
    }

    /// Appends a point to the loop being written.
    pub(crate) fn push(&mut self, point: DVec3) {
        self.points.push(point);
    }

    /// Ends the loop being written. Turns by less than `slack` in height are levelled, so that a stretch of contour along the
    /// scanlines is one chain and not one for every wiggle.
    pub(crate) fn close(&mut self, slack: f64) {
        let points = &mut self.points[self.loop_start..];
        let by_height = |a: &usize, b: &usize| points[*a].y.total_cmp(&points[*b].y);
        let top = (0..points.len()).min_by(by_height).unwrap_or(0);
        points.rotate_left(top);
        let Some(&first) = points.first() else {
            return;
        };
        self.points.push(first);
        self.cut_loop(slack);
        self.loop_start = self.points.len();
    }

    /// Cuts the points from `loop_start`, which end where they begin at the top, into chains, and makes these strictly
    /// monotone.
    fn cut_loop(&mut self, slack: f64) {
        let last = self.points.len() - 1;
        let (mut start, mut extreme, mut is_down) = (self.loop_start, self.loop_start, true);
        for k in self.loop_start + 1..=last {
            let beyond = self.points[k].y - self.points[extreme].y;
            let beyond = if is_down { beyond } else { -beyond };
            if beyond >= 0.0 {
                extreme = k;
            } else if -beyond > slack {
                self.add_chain(start, extreme, is_down);
                (start, extreme, is_down) = (extreme, k, !is_down);
            }
        }
        // A loop that never turned is lower than the slack.
        if !is_down {
            self.add_chain(start, last, is_down);
        }
    }

    fn add_chain(&mut self, from: usize, to: usize, is_down: bool) {
        let run = &mut self.points[from..=to];
        let (y_top, y_bottom) = if is_down {
            level(run.iter_mut());
            (run[0].y, run[run.len() - 1].y)
        } else {
            level(run.iter_mut().rev());
            (run[run.len() - 1].y, run[0].y)
        };
        let (top, bottom) = if is_down { (from, to) } else { (to, from) };
        self.chains.push(Chain {
            y_top,
            y_bottom,
            top: top as u32,
            bottom: bottom as u32,
        });
    }

    /// Ends the last loop and sorts the chains: now they can be walked.
    pub(crate) fn seal(&mut self) {
        self.chains
            .sort_unstable_by(|a, b| a.y_top.total_cmp(&b.y_top).then(a.top.cmp(&b.top)));
    }

    /// The height of the highest point; infinite when there is none.
    pub(crate) fn first_y(&self) -> f64 {
        self.chains.first().map_or(f64::INFINITY, |c| c.y_top)
    }
}

/// Least height of an edge: far below any slack, and far above rounding.
const LEAST_HEIGHT: f64 = 1e-11;

/// Makes points from a top to a bottom strictly descend, leaving the first and the last where they are.
fn level<'a>(mut run: impl DoubleEndedIterator<Item = &'a mut DVec3> + ExactSizeIterator) {
    let (Some(top), Some(bottom)) = (run.next(), run.next_back()) else {
        return;
    };
    let step = LEAST_HEIGHT.min((bottom.y - top.y) / (run.len() + 2) as f64);
    let mut lowest = bottom.y - step * run.len() as f64;
    let mut highest = top.y;
    for p in run {
        highest += step;
        p.y = p.y.clamp(highest, lowest.max(highest));
        highest = p.y;
        lowest += step;
    }
}

/// A chain on which a walk is, with the edge it has come to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strand {
    upper: DVec3,
    lower: DVec3,
    inverse_height: f64,
    /// Index of `lower`.
    at: u32,
    bottom: u32,
    y_bottom: f64,
}

impl Strand {
    fn new(points: &[DVec3], chain: &Chain) -> Self {
        let upper = points[chain.top as usize];
        let mut strand = Self {
            upper,
            lower: upper,
            inverse_height: 0.0,
            at: chain.top,
            bottom: chain.bottom,
            y_bottom: chain.y_bottom,
        };
        strand.step(points);
        strand
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
    pub(crate) fn advance(&mut self, chains: &Chains, y: f64) {
        while self.lower.y <= y && self.at != self.bottom {
            self.step(&chains.points);
        }
    }

    /// Where the edge ends that the walk is on.
    pub(crate) fn next_y(&self) -> f64 {
        self.lower.y
    }

    /// The point of the edge at height `y`; exact at both ends, so that neighbouring slabs agree to the bit.
    pub(crate) fn at(&self, y: f64) -> Touch {
        let (a, b) = (self.upper, self.lower);
        if y <= a.y {
            Touch {
                x: a.x,
                disparity: a.z,
                slide: 0.0,
            }
        } else if y >= b.y {
            Touch {
                x: b.x,
                disparity: b.z,
                slide: 0.0,
            }
        } else {
            let share = (y - a.y) * self.inverse_height;
            Touch {
                x: a.x + (b.x - a.x) * share,
                disparity: a.z + (b.z - a.z) * share,
                slide: 0.0,
            }
        }
    }

    /// The place and the disparity of the point at height `y`, as [`Strand::at`].
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
    fn edge_below(&self, chains: &Chains, y: f64) -> (u32, u32) {
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
    fn at_below(&self, chains: &Chains, y: f64) -> Touch {
        if self.lower.y >= y {
            return self.at(y);
        }
        let (near, far) = self.edge_below(chains, y);
        let (a, b) = (chains.points[near as usize], chains.points[far as usize]);
        let p = a.lerp(b, ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0));
        Touch {
            x: p.x,
            disparity: p.z,
            slide: 0.0,
        }
    }

    /// Vertices from where the walk is down to height `y`.
    fn count_vertices(&self, chains: &Chains, y: f64) -> u32 {
        if self.lower.y >= y {
            return 0;
        }
        self.edge_below(chains, y).0.abs_diff(self.at) + 1
    }

    /// The least and the greatest x from where the walk is down to height `y`.
    pub(crate) fn x_range(&self, chains: &Chains, y: f64) -> (f64, f64) {
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
pub(crate) struct Walker {
    next: usize,
    strands: Vec<Strand>,
}

impl Walker {
    /// Goes back above everything.
    pub(crate) fn restart(&mut self) {
        self.next = 0;
        self.strands.clear();
    }

    /// The chains met, from left to right: a silhouette is entered at the first, third, … and left at the others.
    pub(crate) fn strands(&self) -> &[Strand] {
        &self.strands
    }

    /// How many intervals the line meets.
    pub(crate) fn n_intervals(&self) -> usize {
        self.strands.len() / 2
    }

    /// Goes down to height `y`, not below the next of [`Walker::end`]: chains that end there are left, those that begin there
    /// are met.
    pub(crate) fn enter(&mut self, chains: &Chains, y: f64) {
        let before = self.strands.len();
        self.strands.retain(|strand| strand.y_bottom > y);
        let mut is_changed = self.strands.len() != before;
        for strand in &mut self.strands {
            strand.advance(chains, y);
        }
        while let Some(chain) = chains.chains.get(self.next).filter(|c| c.y_top <= y) {
            if chain.y_bottom > y {
                self.strands.push(Strand::new(&chains.points, chain));
                is_changed = true;
            }
            self.next += 1;
        }
        if is_changed && self.strands.len() > 1 {
            // Nothing crosses within a silhouette, so the order holds until the set of chains changes.
            let middle = 0.5 * (y + self.end(chains));
            insertion_sort(&mut self.strands, |s| s.at_below(chains, middle).x);
        }
    }

    /// The height at which a chain ends or begins next; infinite when there is none.
    pub(crate) fn end(&self, chains: &Chains) -> f64 {
        let begins = chains
            .chains
            .get(self.next)
            .map_or(f64::INFINITY, |c| c.y_top);
        self.strands
            .iter()
            .fold(begins, |least, s| least.min(s.y_bottom))
    }

    /// The height of the next vertex on a chain that is met; infinite when there is none.
    pub(crate) fn next_vertex(&self) -> f64 {
        self.strands
            .iter()
            .fold(f64::INFINITY, |least, s| least.min(s.lower.y))
    }

    /// Vertices on all chains from where the walk is down to height `y`.
    pub(crate) fn count_vertices(&self, chains: &Chains, y: f64) -> u32 {
        let strands = self.strands.iter();
        strands.map(|s| s.count_vertices(chains, y)).sum()
    }

    /// Goes down to height `y`, not below the next of [`Walker::end`], keeping the chains.
    pub(crate) fn advance(&mut self, chains: &Chains, y: f64) {
        for strand in &mut self.strands {
            strand.advance(chains, y);
        }
    }

    /// The intervals on the slab between two heights with no vertex between them, from left to right.
    pub(crate) fn intervals(&self, (y_top, y_bottom): (f64, f64), output: &mut Vec<Interval>) {
        self.collect(output, |s| Side {
            top: s.at(y_top),
            bottom: s.at(y_bottom),
        });
    }

    /// The intervals between two heights where no chain ends, taken at these heights; vertices before and between them are
    /// skipped.
    pub(crate) fn intervals_across(
        &self,
        chains: &Chains,
        (y_top, y_bottom): (f64, f64),
        output: &mut Vec<Interval>,
    ) {
        self.collect(output, |s| Side {
            top: s.at_below(chains, y_top),
            bottom: s.at_below(chains, y_bottom),
        });
    }

    /// The intervals on the scanline at height `y`, where no chain ends above; vertices before are skipped.
    pub(crate) fn sections(&self, chains: &Chains, y: f64, output: &mut Vec<Section>) {
        output.clear();
        output.extend(self.strands.chunks_exact(2).map(|pair| Section {
            enter: pair[0].at_below(chains, y),
            exit: pair[1].at_below(chains, y),
        }));
    }

    fn collect(&self, output: &mut Vec<Interval>, side: impl Fn(&Strand) -> Side) {
        output.clear();
        output.extend(self.strands.chunks_exact(2).map(|pair| Interval {
            enter: side(&pair[0]),
            exit: side(&pair[1]),
        }));
    }
}

/// The first heights between which no chain of two silhouettes ends and a line meets both; the walkers are brought there.
pub(crate) fn first_range(walkers: &mut [Walker; 2], chains: &[Chains; 2]) -> Option<(f64, f64)> {
    walkers.iter_mut().for_each(Walker::restart);
    next_range(
        walkers,
        chains,
        chains[0].first_y().min(chains[1].first_y()),
    )
}

/// The next such heights from `y` down, which is where the last ones ended.
pub(crate) fn next_range(
    walkers: &mut [Walker; 2],
    chains: &[Chains; 2],
    mut y: f64,
) -> Option<(f64, f64)> {
    while y.is_finite() {
        let mut end = f64::INFINITY;
        for (walker, chains) in walkers.iter_mut().zip(chains) {
            walker.enter(chains, y);
            end = end.min(walker.end(chains));
        }
        if end.is_finite() && walkers.iter().all(|w| w.n_intervals() > 0) {
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
        let mut chains = Chains::default();
        for (low, high) in [(0.0, 9.0), (3.0, 6.0)] {
            for (x, y) in [(low, high), (low, low), (high, low), (high, high)] {
                chains.push(DVec3::new(x, y, 1.0));
            }
            chains.close(0.0);
        }
        chains.seal();
        let mut walker = Walker::default();
        walker.restart();
        let (mut y, mut widths) = (chains.first_y(), Vec::new());
        loop {
            walker.enter(&chains, y);
            let end = walker.end(&chains).min(walker.next_vertex());
            if !end.is_finite() {
                break;
            }
            let mut intervals = Vec::new();
            walker.intervals((y, end), &mut intervals);
            // Level edges are tilted by next to nothing.
            let is_thin = end - y < 1e-6;
            y = end;
            if is_thin {
                continue;
            }
            widths.push(
                intervals
                    .iter()
                    .map(|i| i.exit.at(0.5) - i.enter.at(0.5))
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
        let mut chains = Chains::default();
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
        let mut walker = Walker::default();
        walker.enter(&chains, 0.0);
        walker.enter(&chains, 1.0);
        let xs: Vec<f64> = walker.strands().iter().map(|s| s.at(2.0).x).collect();
        assert_eq!(xs.len(), 4);
        assert!(xs.is_sorted());
    }
}
