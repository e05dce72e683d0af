//! Pairs of span intervals of two views, row by row: what methods `paper` and `hull` prepare of a polytope edge.
//!
//! Source: Silhouette Mapping, section 5.3: an interval i of the first view and an interval j of the second interpolate to one
//! interval, end by end; the span is the union over the pairs that are kept. Which are kept is up to the method: those within
//! cliques ([`paper_cliques`](super::paper_cliques)), or all that can meet in the bounding sphere
//! ([`visual_hull`](super::visual_hull)). Deviation: the pairs do not depend on the viewpoint between the views, so they are found
//! once for a polytope edge; a frame interpolates them and unites the intervals.

use glam::DVec2;

use super::method::Method;
use super::paper_cliques::CliqueCuts;
use super::visual_hull::{Bound, Corner, EVERYTHING, Range, SphereParallax, keep_within};
use crate::sweep::coverage::CoverageSweep;
use crate::sweep::cursor::{ChainCursor, SweepCursor, first_range, next_range};
use crate::sweep::loop_builder::LoopBuilder;
use crate::sweep::monotone_chain::MonotoneChains;

/// Rows between two heights where the same pairs are there.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// How many chains of both views a row meets.
    n_chains: u32,
    /// Where its sides end in the list of all.
    sides_end: u32,
    /// Where its rows end in the list of all.
    rows_end: u32,
}

/// What bounds a pair of intervals on one side: a chain of the first view, and one of the second. Chains are counted through both.
type ChainPair = [u32; 2];

/// A row.
#[derive(Clone, Copy, Debug)]
struct Row {
    y: f64,
    /// Chains that turn here.
    turning: Flags,
    /// Sides that are bounded by what is allowed.
    limited: Flags,
    /// Where the corners of its sides begin in the list of all, if any is limited: without, they are where the chains are.
    corners: Option<u32>,
}

/// A bit for each of some things in order, and the last for all that are beyond.
#[derive(Clone, Copy, Debug, Default)]
struct Flags(u64);

impl Flags {
    const NONE: Self = Self(0);
    const ALL: Self = Self(u64::MAX);

    fn add(&mut self, k: u32, flag: bool) {
        self.0 |= u64::from(flag) << k.min(63);
    }

    fn has(self, k: u32) -> bool {
        self.0 >> k.min(63) & 1 != 0
    }
}

/// All pairs of two silhouettes, row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanPairs {
    parts: Vec<Part>,
    /// Per part, those of its pairs: the left and the right one in turn.
    sides: Vec<ChainPair>,
    rows: Vec<Row>,
    /// Per row, where the chains are, and their disparities: of the first view from left to right, then of the second.
    places: Vec<DVec2>,
    corners: Vec<Corner>,
}

/// Two rectified silhouettes, and which pairs of their intervals are kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    pub(super) chains: &'a [MonotoneChains; 2],
    pub(super) parallax: SphereParallax,
    pub(super) method: Method,
}

/// Buffers for finding pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanPairsScratch {
    cliques: CliqueCuts,
    cursors: [SweepCursor; 2],
    sides: Vec<ChainPair>,
    /// By what the sides are bounded on the last two rows.
    above: Vec<Bound>,
    below: Vec<Bound>,
    kinks: Vec<f64>,
    lower: Vec<DVec2>,
}

impl SpanPairs {
    /// The capacity without another allocation.
    pub(crate) fn room(&self) -> Room {
        Room([
            self.parts.capacity(),
            self.sides.capacity(),
            self.rows.capacity(),
            self.places.capacity(),
            self.corners.capacity(),
        ])
    }

    /// Clears everything, and reserves this capacity.
    pub(crate) fn make_room(&mut self, room: Room) {
        self.clear();
        let [parts, sides, rows, places, corners] = room.0;
        self.parts.reserve_exact(parts);
        self.sides.reserve_exact(sides);
        self.rows.reserve_exact(rows);
        self.places.reserve_exact(places);
        self.corners.reserve_exact(corners);
    }

    fn clear(&mut self) {
        self.parts.clear();
        self.sides.clear();
        self.rows.clear();
        self.places.clear();
        self.corners.clear();
    }

    /// Finds the pairs of two silhouettes.
    pub(super) fn assign(&mut self, source: &Source<'_>, scratch: &mut SpanPairsScratch) {
        self.clear();
        let chains = source.chains;
        if source.method == Method::Paper {
            scratch.cliques.assign(chains, &mut scratch.cursors[0]);
        }
        let mut range = first_range(&mut scratch.cursors, chains);
        while let Some(heights) = range {
            self.add_part(source, heights, scratch);
            range = next_range(&mut scratch.cursors, chains, heights.1);
        }
    }

    /// Adds the rows between two heights where no chain ends.
    fn add_part(
        &mut self,
        source: &Source<'_>,
        (y_top, y_bottom): Range,
        scratch: &mut SpanPairsScratch,
    ) {
        let narrowest = scratch.find_sides(source, (y_top, y_bottom));
        if scratch.sides.is_empty() {
            return;
        }
        let mut y = y_top;
        self.add_row(y, narrowest, source, scratch);
        while y < y_bottom {
            for (cursor, chains) in scratch.cursors.iter_mut().zip(source.chains) {
                cursor.advance(chains, y);
            }
            let vertices = scratch.cursors.iter().map(SweepCursor::next_vertex);
            y = vertices.fold(y_bottom, f64::min);
            std::mem::swap(&mut scratch.above, &mut scratch.below);
            self.add_row(y, narrowest, source, scratch);
            if scratch.above != scratch.below {
                self.add_kinks(source, scratch);
            }
        }
        self.sides.extend_from_slice(&scratch.sides);
        self.parts.push(Part {
            n_chains: scratch.n_chains() as u32,
            sides_end: self.sides.len() as u32,
            rows_end: self.rows.len() as u32,
        });
    }

    /// Adds a row. Parallax within `narrowest` is allowed at any rate.
    fn add_row(
        &mut self,
        y: f64,
        narrowest: Range,
        source: &Source<'_>,
        scratch: &mut SpanPairsScratch,
    ) {
        let start = self.places.len();
        let mut turning = Flags::NONE;
        let mut n_chains = 0;
        for cursor in &scratch.cursors {
            let chain_cursors = cursor.chain_cursors().iter();
            self.places.extend(chain_cursors.map(|s: &ChainCursor| {
                turning.add(n_chains, s.next_y() <= y);
                n_chains += 1;
                s.place(y)
            }));
        }
        self.rows.push(Row {
            y,
            turning,
            limited: Flags::NONE,
            corners: None,
        });
        scratch.below.clear();
        let places = &self.places[start..];
        let is_allowed = |&[i, j]: &ChainPair| {
            let parallax = places[i as usize].x - places[j as usize].x;
            (narrowest.0 <= parallax) & (parallax <= narrowest.1)
        };
        if !scratch.sides.iter().all(is_allowed) {
            self.limit_row(start, source.parallax.at(y), scratch);
        }
    }

    /// Keeps the sides of the last row, whose places begin at `start`, within what is allowed.
    fn limit_row(&mut self, start: usize, limits: Range, scratch: &mut SpanPairsScratch) {
        let Some(row) = self.rows.last_mut() else {
            return;
        };
        let first = self.corners.len();
        let places = &self.places[start..];
        let corner = |&[i, j]: &ChainPair| (places[i as usize], places[j as usize]);
        self.corners.extend(scratch.sides.iter().map(corner));
        let corners = (0_u32..).zip(&mut self.corners[first..]);
        let limited = &mut row.limited;
        *limited = Flags::NONE;
        scratch.below.clear();
        scratch.below.extend(corners.map(|(k, corner)| {
            let bound = keep_within(limits, corner, k.is_multiple_of(2));
            limited.add(k, bound != Bound::Both);
            bound
        }));
        row.corners = Some(first as u32);
    }

    /// Adds rows before the last one, where between it and the one before it sides come to be bounded by something else.
    fn add_kinks(&mut self, source: &Source<'_>, scratch: &mut SpanPairsScratch) {
        let n = scratch.n_chains();
        let (Some(below), Some(&above)) = (self.rows.pop(), self.rows.last()) else {
            return;
        };
        scratch.find_kinks(
            &self.places[self.places.len() - 2 * n..],
            [source.parallax.at(above.y), source.parallax.at(below.y)],
        );
        let upper = self.places.len() - 2 * n;
        scratch.lower.clear();
        scratch.lower.extend(self.places.drain(upper + n..));
        for k in 0..scratch.kinks.len() {
            let share = scratch.kinks[k];
            let blend = |a: f64, b: f64| a + (b - a) * share;
            let y = blend(above.y, below.y);
            let start = self.places.len();
            for k in 0..n {
                let from = self.places[upper + k];
                self.places.push(from + (scratch.lower[k] - from) * share);
            }
            self.rows.push(Row {
                y,
                turning: Flags::ALL,
                ..below
            });
            let (a, b) = (source.parallax.at(above.y), source.parallax.at(below.y));
            self.limit_row(start, (blend(a.0, b.0), blend(a.1, b.1)), scratch);
        }
        let start = self.places.len();
        self.places.extend_from_slice(&scratch.lower);
        self.rows.push(below);
        self.limit_row(start, source.parallax.at(below.y), scratch);
    }

    /// Adds the silhouette seen from the viewpoint at `alpha` to `output`.
    pub(crate) fn interpolate(
        &self,
        alpha: f64,
        cover: &mut CoverageSweep,
        output: &mut LoopBuilder,
    ) {
        let beta = 1.0 - alpha;
        let (mut side, mut row, mut places) = (0, 0, &self.places[..]);
        for part in &self.parts {
            let sides = &self.sides[side..part.sides_end as usize];
            cover.begin(1, sides.len());
            for row in &self.rows[row..part.rows_end as usize] {
                let (here, rest) = places.split_at(part.n_chains as usize);
                places = rest;
                let ends = cover.next_row().iter_mut();
                if let Some(first) = row.corners {
                    for (end, (one, two)) in ends.zip(&self.corners[first as usize..]) {
                        *end = (*one * beta + *two * alpha).extend(0.0);
                    }
                } else {
                    for (end, &[i, j]) in ends.zip(sides) {
                        *end = (here[i as usize] * beta + here[j as usize] * alpha).extend(0.0);
                    }
                }
                let is_bent = |end: usize| {
                    let [i, j] = sides[end];
                    row.turning.has(i) || row.turning.has(j) || row.limited.has(end as u32)
                };
                cover.step(row.y, is_bent, output);
            }
            cover.end();
            (side, row) = (part.sides_end as usize, part.rows_end as usize);
        }
        cover.finish(output);
    }
}

/// Capacities: how many of each thing fit without another allocation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Room([usize; 5]);

impl Room {
    /// How much memory that is.
    pub(crate) fn bytes(self) -> usize {
        let sizes = [
            size_of::<Part>(),
            size_of::<ChainPair>(),
            size_of::<Row>(),
            size_of::<DVec2>(),
            size_of::<Corner>(),
        ];
        self.0
            .iter()
            .zip(sizes)
            .map(|(count, size)| count * size)
            .sum()
    }

    #[cfg(test)]
    pub(crate) fn of_corners(count: usize) -> Self {
        Self([0, 0, 0, 0, count])
    }

    /// The capacity that suffices for either.
    pub(crate) fn max(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k].max(other.0[k])))
    }
}

impl SpanPairsScratch {
    /// How many chains of both views a row meets.
    fn n_chains(&self) -> usize {
        self.cursors.iter().map(|w| w.chain_cursors().len()).sum()
    }

    /// Finds the sides of the pairs of which anything may be allowed between two heights; returns the parallax that is allowed at
    /// all of them.
    fn find_sides(&mut self, source: &Source<'_>, heights: Range) -> Range {
        let [one, two] = [0, 1].map(|k: usize| self.cursors[k].n_intervals());
        let sides_of = |i: usize, j: usize| {
            let (i, j) = (2 * i as u32, (2 * one + 2 * j) as u32);
            [[i, j], [i + 1, j + 1]]
        };
        self.sides.clear();
        if source.method == Method::Paper {
            let cuts = self.cliques.at(0.5 * (heights.0 + heights.1));
            let (mut i0, mut j0) = (0, 0);
            for &(i1, j1) in cuts.iter().chain(&[(one, two)]) {
                let pairs = (i0..i1).flat_map(|i| (j0..j1).map(move |j| (i, j)));
                self.sides.extend(pairs.flat_map(|(i, j)| sides_of(i, j)));
                (i0, j0) = (i1, j1);
            }
            return EVERYTHING;
        }
        if one == 1 && two == 1 {
            self.sides.extend(sides_of(0, 0));
        } else {
            let (least, greatest) = source.parallax.widest(heights);
            let range = |k: usize, at: usize| {
                self.cursors[k].chain_cursors()[at].x_range(&source.chains[k], heights.1)
            };
            let may_meet = |i: usize, j: usize| {
                range(0, 2 * i).0 - range(1, 2 * j + 1).1 < greatest
                    && range(0, 2 * i + 1).1 - range(1, 2 * j).0 > least
            };
            let pairs = (0..one).flat_map(|i| (0..two).map(move |j| (i, j)));
            let pairs = pairs.filter(|&(i, j)| may_meet(i, j));
            self.sides.extend(pairs.flat_map(|(i, j)| sides_of(i, j)));
        }
        source.parallax.narrowest(heights)
    }

    /// Finds the shares of the way between the last two rows at which sides come to be bounded by something else, given the places on
    /// both and what is allowed there.
    fn find_kinks(&mut self, places: &[DVec2], [upper, lower]: [Range; 2]) {
        let (above, below) = places.split_at(places.len() / 2);
        let bound = |bounds: &[Bound], k: usize| bounds.get(k).copied().unwrap_or_default();
        self.kinks.clear();
        for (k, &[i, j]) in self.sides.iter().enumerate() {
            if bound(&self.above, k) == bound(&self.below, k) {
                continue;
            }
            let [from, to] = [above, below].map(|row| row[i as usize].x - row[j as usize].x);
            for (a, b) in [
                (from - upper.0, to - lower.0),
                (from - upper.1, to - lower.1),
            ] {
                if a * b < 0.0 {
                    self.kinks.push(a / (a - b));
                }
            }
        }
        self.kinks.sort_unstable_by(f64::total_cmp);
        self.kinks.dedup();
    }
}
