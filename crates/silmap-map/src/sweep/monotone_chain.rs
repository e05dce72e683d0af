//! Silhouettes cut into y-monotone chains.
//!
//! Source: Silhouette Mapping, section 5.2: the active-edge scan conversion of two rectified silhouettes. Deviation: the
//! paper visits scanlines through vertices; here the slabs between them are visited, so that the result is made of
//! trapezoids and closed for every topology. And what is kept active are chains of edges from a local top to a local
//! bottom of a contour, not single edges: vertices along a chain are met in order without sorting, and between two chain
//! ends nothing changes but numbers.

use glam::DVec3;

/// A run of edges that go down: vertices `top` to `bottom` by index, in either direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct MonotoneChain {
    pub(super) y_top: f64,
    pub(super) y_bottom: f64,
    pub(super) top: u32,
    pub(super) bottom: u32,
}

/// Closed loops of points (x, y, disparity), cut into chains.
#[derive(Clone, Debug, Default)]
pub(crate) struct MonotoneChains {
    pub(super) points: Vec<DVec3>,
    /// By height of their tops, once sealed.
    pub(super) chains: Vec<MonotoneChain>,
    loop_start: usize,
}

impl MonotoneChains {
    /// Clears everything, keeping the storage.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.chains.clear();
        self.loop_start = 0;
    }

    /// Reserves capacity for loops of so many points in all.
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
        self.chains.push(MonotoneChain {
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
