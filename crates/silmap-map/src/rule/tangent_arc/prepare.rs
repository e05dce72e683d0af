//! The tight rule prepared: which touching points of two silhouettes lie beside each other, row by row.
//!
//! Between two heights where no chain ends, and the intervals of both views are linked in one way, each side of the outline comes
//! from one side of either view, or of both. Which they are does not depend on the viewpoint between the views: so it is found
//! once for a polytope edge, and a frame runs the rule down arrays. Only where sides of the result cross are intervals united, and
//! only over the heights where they do.

use glam::{DVec3, DVec4};

use crate::rule::tangent_arc::rule::{self as tight, Homes, Linked, Origin, SideRule};
use crate::sweep::coverage::CoverageSweep;
use crate::sweep::crossing::{NOWHERE, widen_by_crossing};
use crate::sweep::cursor::{ChainCursor, SweepCursor, first_range, next_range};
use crate::sweep::interval::{Side, SpanInterval, TangentRay};
use crate::sweep::loop_builder::LoopBuilder;
use crate::sweep::monotone_chain::MonotoneChains;

/// Parts with fewer vertices than this are linked slab by slab at once.
const FEWEST_LINKED: u32 = 12;

/// On parts of less height, about two pixels of a 512² capture, links are taken to be those half-way.
const LOW_TANGENT: f64 = 3e-3;

/// The outline between two heights.
#[derive(Clone, Copy, Debug)]
struct Part {
    y_top: f64,
    y_bottom: f64,
    /// Where its sides end in the list of all; left and right ones take turns.
    sides_end: u32,
}

/// A side of a part.
#[derive(Clone, Copy, Debug)]
struct SideRows {
    rule: SideRule,
    /// Where its rows end in the list of all.
    rows_end: u32,
}

/// Two silhouettes row by row, as arrays.
#[derive(Clone, Debug, Default)]
pub(crate) struct PreparedArcs {
    parts: Vec<Part>,
    sides: Vec<SideRows>,
    y: Vec<f64>,
    x: [Vec<f64>; 2],
    disparity: [Vec<f64>; 2],
}

/// Buffers for finding rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct PrepareArcsScratch {
    cursors: [SweepCursor; 2],
    intervals: [Vec<SpanInterval>; 2],
    homes: Vec<Homes>,
    links: Vec<Linked>,
    other_links: Vec<Linked>,
}

impl PrepareArcsScratch {
    /// Links the intervals of both views at one height.
    fn link_at(&mut self, chains: &[MonotoneChains; 2], y: f64) {
        let views = self.cursors.iter().zip(chains);
        for ((cursor, chains), intervals) in views.zip(&mut self.intervals) {
            cursor.intervals(chains, y, intervals);
        }
        let [one, two] = &self.intervals;
        tight::link(one, two, &mut self.homes, &mut self.links);
    }

    /// Links the intervals of both views; false when the links are not the same all the way down.
    fn link(&mut self, chains: &[MonotoneChains; 2], (y_top, y_bottom): (f64, f64)) -> bool {
        if self.cursors.iter().all(|w| w.n_intervals() == 1) {
            self.links.clear();
            self.links.push(Linked::SINGLE);
            return true;
        }
        let height = y_bottom - y_top;
        if height < LOW_TANGENT {
            self.link_at(chains, y_top + 0.5 * height);
            return true;
        }
        self.link_at(chains, y_top + 0.1 * height);
        std::mem::swap(&mut self.links, &mut self.other_links);
        self.link_at(chains, y_top + 0.9 * height);
        self.links == self.other_links
    }

    /// Vertices of both views from where the walks are down to height `y`.
    fn count_vertices(&self, chains: &[MonotoneChains; 2], y: f64) -> u32 {
        let views = self.cursors.iter().zip(chains);
        views.map(|(w, c)| w.count_vertices(c, y)).sum()
    }
}

impl PreparedArcs {
    /// Clears everything, and reserves capacity for silhouettes of so many vertices together.
    pub(crate) fn reserve(&mut self, n_vertices: usize) {
        self.clear();
        // A row for each vertex on each side of a part that passes it; parts end where chains do.
        let n_rows = 3 * n_vertices;
        self.parts.reserve(n_vertices);
        self.sides.reserve(2 * n_vertices);
        self.y.reserve(n_rows);
        for values in self.x.iter_mut().chain(&mut self.disparity) {
            values.reserve(n_rows);
        }
    }

    fn clear(&mut self) {
        self.parts.clear();
        self.sides.clear();
        self.y.clear();
        for values in self.x.iter_mut().chain(&mut self.disparity) {
            values.clear();
        }
    }

    /// Finds the rows of two silhouettes.
    pub(crate) fn assign(
        &mut self,
        chains: &[MonotoneChains; 2],
        scratch: &mut PrepareArcsScratch,
    ) {
        self.clear();
        let mut range = first_range(&mut scratch.cursors, chains);
        while let Some(heights) = range {
            self.add_range(chains, heights, scratch);
            range = next_range(&mut scratch.cursors, chains, heights.1);
        }
    }

    /// Adds the parts between two heights where no chain ends.
    fn add_range(
        &mut self,
        chains: &[MonotoneChains; 2],
        (mut y, end): (f64, f64),
        scratch: &mut PrepareArcsScratch,
    ) {
        while y < end {
            let mut bottom = end;
            while !scratch.link(chains, (y, bottom)) {
                let middle = 0.5 * (y + bottom);
                if scratch.count_vertices(chains, bottom) < FEWEST_LINKED || middle <= y {
                    let vertex = scratch.cursors.iter().map(SweepCursor::next_vertex);
                    bottom = vertex.fold(bottom, f64::min);
                    scratch.link_at(chains, 0.5 * (y + bottom));
                    break;
                }
                bottom = middle;
            }
            self.add_part(chains, (y, bottom), scratch);
            for (cursor, chains) in scratch.cursors.iter_mut().zip(chains) {
                cursor.advance(chains, bottom);
            }
            y = bottom;
        }
    }

    /// Adds a part with the sides that the links name.
    fn add_part(
        &mut self,
        chains: &[MonotoneChains; 2],
        heights: (f64, f64),
        scratch: &PrepareArcsScratch,
    ) {
        let (one, two) = (
            scratch.cursors[0].chain_cursors(),
            scratch.cursors[1].chain_cursors(),
        );
        let (first, second) = (&chains[0], &chains[1]);
        for link in &scratch.links {
            for (origin, at) in [(link.enter, 0), (link.exit, 1)] {
                let side = Side::of_end(at);
                let across = 1 - at;
                let rule = match origin {
                    Origin::Both(i, j) => {
                        let pair = (one[2 * i + at], two[2 * j + at]);
                        self.add_rows((first, second), pair, heights);
                        SideRule::Between(side)
                    }
                    Origin::Linear(i, j) => {
                        let pair = (one[2 * i + at], two[2 * j + at]);
                        self.add_rows((first, second), pair, heights);
                        SideRule::Linear
                    }
                    Origin::First(i) => {
                        let side = one[2 * i + at];
                        self.add_rows((first, first), (side, side), heights);
                        SideRule::First
                    }
                    Origin::Second(j) => {
                        let side = two[2 * j + at];
                        self.add_rows((second, second), (side, side), heights);
                        SideRule::Second
                    }
                    Origin::FirstGap(i, other) => {
                        let pair = (one[2 * i + at], one[2 * other + across]);
                        self.add_rows((first, first), pair, heights);
                        SideRule::FirstGap(side)
                    }
                    Origin::SecondGap(j, other) => {
                        let pair = (two[2 * j + at], two[2 * other + across]);
                        self.add_rows((second, second), pair, heights);
                        SideRule::SecondGap(side)
                    }
                };
                let rows_end = self.y.len() as u32;
                self.sides.push(SideRows { rule, rows_end });
            }
        }
        self.parts.push(Part {
            y_top: heights.0,
            y_bottom: heights.1,
            sides_end: self.sides.len() as u32,
        });
    }

    /// Adds the rows of a side: one wherever either of two chains has a vertex.
    fn add_rows(
        &mut self,
        chains: (&MonotoneChains, &MonotoneChains),
        (mut one, mut two): (ChainCursor, ChainCursor),
        (y_top, y_bottom): (f64, f64),
    ) {
        let mut y = y_top;
        loop {
            self.y.push(y);
            for (k, touch) in [one.at(y), two.at(y)].into_iter().enumerate() {
                self.x[k].push(touch.x);
                self.disparity[k].push(touch.disparity);
            }
            if y >= y_bottom {
                return;
            }
            if one.next_y() <= y {
                one.advance(chains.0, y);
            }
            if two.next_y() <= y {
                two.advance(chains.1, y);
            }
            y = one.next_y().min(two.next_y()).min(y_bottom);
        }
    }

    /// Adds the silhouette seen from the viewpoint at `alpha` to `output`.
    pub(crate) fn interpolate(
        &self,
        alpha: f64,
        scratch: &mut CrossingScratch,
        output: &mut LoopBuilder,
    ) {
        let (mut side, mut row) = (0, 0);
        for part in &self.parts {
            output.begin_slab(part.y_top);
            scratch.side_ends.clear();
            let points = output.points();
            let start = points.len();
            let (mut before, mut from) = (None, start);
            let mut crossing = NOWHERE;
            for s in &self.sides[side..part.sides_end as usize] {
                self.follow(s.rule, row..s.rows_end as usize, alpha, points);
                row = s.rows_end as usize;
                let end = points.len();
                if let Some(before) = before {
                    widen_by_crossing(&points[before..from], &points[from..end], &mut crossing);
                }
                scratch.side_ends.push(end);
                (before, from) = (Some(from), end);
            }
            side = part.sides_end as usize;
            let heights = (part.y_top, part.y_bottom);
            if crossing.0 > crossing.1 {
                output.end_followed(start, &scratch.side_ends, part.y_bottom);
            } else {
                scratch.take(start, output);
                scratch.push(heights, crossing, output);
            }
        }
    }

    /// Appends the points of one side to `points`.
    fn follow(
        &self,
        rule: SideRule,
        rows: std::ops::Range<usize>,
        alpha: f64,
        points: &mut Vec<DVec4>,
    ) {
        match rule {
            SideRule::Between(Side::Left) => {
                self.follow_by(rows, points, |a, b| tight::between(a, b, alpha, Side::Left))
            }
            SideRule::Between(Side::Right) => self.follow_by(rows, points, |a, b| {
                tight::between(a, b, alpha, Side::Right)
            }),
            rule => self.follow_by(rows, points, |a, b| rule.touch(a, b, alpha)),
        }
    }

    #[inline]
    fn follow_by(
        &self,
        rows: std::ops::Range<usize>,
        points: &mut Vec<DVec4>,
        touch: impl Fn(TangentRay, TangentRay) -> TangentRay,
    ) {
        let at = |x: f64, disparity: f64| TangentRay {
            x,
            disparity,
            slide: 0.0,
        };
        let one = self.x[0][rows.clone()]
            .iter()
            .zip(&self.disparity[0][rows.clone()]);
        let two = self.x[1][rows.clone()]
            .iter()
            .zip(&self.disparity[1][rows.clone()]);
        let rows = self.y[rows].iter().zip(one.zip(two));
        points.extend(rows.map(|(&y, ((&x_one, &d_one), (&x_two, &d_two)))| {
            let seen = touch(at(x_one, d_one), at(x_two, d_two));
            DVec4::new(seen.x, y, seen.disparity, seen.slide)
        }));
    }
}

/// Buffers for parts in which sides cross.
#[derive(Clone, Debug, Default)]
pub(crate) struct CrossingScratch {
    side_ends: Vec<usize>,
    /// All sides of the part, one after the other, with where each ends and where on it the sweep is.
    points: Vec<DVec4>,
    places: Vec<Place>,
    are_turning: Vec<bool>,
    cover: CoverageSweep,
}

/// A side's points, and the edge that the sweep has come to.
#[derive(Clone, Copy, Debug)]
struct Place {
    at: usize,
    end: usize,
}

impl Place {
    /// Goes on to the edge that leads below height `y`, or to the last.
    fn advance(&mut self, points: &[DVec4], y: f64) {
        while self.at + 2 < self.end && points[self.at + 1].y <= y {
            self.at += 1;
        }
    }

    /// The point at a height on the edge that the sweep has come to; exact at both ends.
    fn point(&self, points: &[DVec4], y: f64) -> DVec4 {
        let (a, b) = (points[self.at], points[self.at + 1]);
        if y <= a.y {
            a
        } else if y >= b.y {
            b
        } else {
            let p = a + (b - a) * ((y - a.y) / (b.y - a.y));
            DVec4::new(p.x, y, p.z, p.w)
        }
    }
}

impl CrossingScratch {
    /// Takes the points of a part's sides, from `start` on, out of a builder.
    fn take(&mut self, start: usize, output: &mut LoopBuilder) {
        let points = output.points();
        self.points.clear();
        self.points.extend_from_slice(&points[start..]);
        points.truncate(start);
        self.places.clear();
        let mut at = 0;
        for end in self.side_ends.iter().map(|end| end - start) {
            self.places.push(Place { at, end });
            at = end;
        }
    }

    /// Adds a part: side by side where nothing crosses, and the union of its intervals between the heights `crossing`.
    fn push(
        &mut self,
        (y_top, y_bottom): (f64, f64),
        crossing: (f64, f64),
        output: &mut LoopBuilder,
    ) {
        let (first, last) = (crossing.0.max(y_top), crossing.1.min(y_bottom));
        if y_top < first {
            self.push_sides((y_top, first), output);
        }
        self.push_union((first, last), output);
        if last < y_bottom {
            self.push_sides((last, y_bottom), output);
        }
    }

    fn push_sides(&mut self, (y_top, y_bottom): (f64, f64), output: &mut LoopBuilder) {
        output.begin_slab(y_top);
        self.side_ends.clear();
        let start = output.points().len();
        for place in &mut self.places {
            let output = output.points();
            place.advance(&self.points, y_top);
            output.push(place.point(&self.points, y_top));
            while place.at + 2 < place.end && self.points[place.at + 1].y < y_bottom {
                place.at += 1;
                output.push(self.points[place.at]);
            }
            output.push(place.point(&self.points, y_bottom));
            self.side_ends.push(output.len());
        }
        output.end_followed(start, &self.side_ends, y_bottom);
    }

    /// Adds the union of the intervals, row by row.
    fn push_union(&mut self, (y_top, y_bottom): (f64, f64), output: &mut LoopBuilder) {
        self.cover.begin(1, self.places.len());
        let points = &self.points;
        let mut y = y_top;
        loop {
            self.are_turning.clear();
            for (end, place) in self.cover.next_row().iter_mut().zip(&mut self.places) {
                let p = place.point(points, y);
                *end = DVec3::new(p.x, p.z, p.w);
                self.are_turning.push(points[place.at + 1].y <= y);
                place.advance(points, y);
            }
            let is_bent = |end: usize| self.are_turning[end];
            self.cover.step(y, is_bent, output);
            if y >= y_bottom {
                break;
            }
            let next = self.places.iter().map(|place| points[place.at + 1].y);
            y = next.filter(|&next| next > y).fold(y_bottom, f64::min);
        }
        self.cover.end();
        self.cover.finish(output);
    }
}
