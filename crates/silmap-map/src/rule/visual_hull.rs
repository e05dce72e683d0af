//! All pairs of intervals of two views, as far as they can meet within a sphere, row by row: the conservative rule prepared.
//!
//! Source: Silhouette Mapping, section 5.3: the two-view visual hull is the union of all pairs. Deviation: points x₁ and x₂ of a
//! pair have the parallax x₁ − x₂, and only what a sphere around the model allows is kept. The pairs of points of two intervals are
//! a rectangle, the parallax cuts a band out of it, and an end of the interpolated interval is a corner of what is left: which
//! corner does not depend on the viewpoint between the views. So the corners are found once for a polytope edge, and a frame
//! interpolates them, and unites the intervals.

use glam::DVec2;

use crate::pair_cache::SphereDepths;
use crate::sweep::coverage::Cover;
use crate::sweep::loop_builder::Connector;
use crate::sweep::monotone_chain::{Chains, Strand, Walker, first_range, next_range};

/// A range of parallax, or of heights.
type Range = (f64, f64);

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
type Side = [u32; 2];

/// The points of either view that an end is interpolated from: places and disparities.
type Corner = (DVec2, DVec2);

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
pub(crate) struct PairRows {
    parts: Vec<Part>,
    /// Per part, those of its pairs: the left and the right one in turn.
    sides: Vec<Side>,
    rows: Vec<Row>,
    /// Per row, where the chains are, and their disparities: of the first view from left to right, then of the second.
    places: Vec<DVec2>,
    corners: Vec<Corner>,
}

/// Two silhouettes and what bounds the model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairSource<'a> {
    pub(crate) chains: &'a [Chains; 2],
    pub(crate) depths: SphereDepths,
    /// Radius of the sphere that pairs must meet in, if they must.
    pub(crate) radius: Option<f64>,
}

impl PairSource<'_> {
    /// The parallax that is allowed at height `y`.
    fn limits(&self, y: f64) -> Range {
        (self.radius).map_or(EVERYTHING, |radius| self.depths.parallax_at(radius, y))
    }
}

const EVERYTHING: Range = (f64::NEG_INFINITY, f64::INFINITY);

/// Buffers for finding pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairScratch {
    walkers: [Walker; 2],
    sides: Vec<Side>,
    /// By what the sides are bounded on the last two rows.
    above: Vec<Bound>,
    below: Vec<Bound>,
    kinks: Vec<f64>,
    lower: Vec<DVec2>,
}

/// Which points of its two intervals an end is seen by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Bound {
    /// The ends of both, which meet at an allowed depth.
    #[default]
    Both,
    /// An end of one, with the parallax of the farthest allowed depth.
    Farthest,
    /// An end of one, with the parallax of the nearest allowed depth.
    Nearest,
}

fn parallax((one, two): Corner) -> f64 {
    one.x - two.x
}

/// Moves the left or right corner of a whole pair to that of a band of parallax.
fn keep_within((least, greatest): Range, corner: &mut Corner, is_left: bool) -> Bound {
    let (limit, bound) = if parallax(*corner) < least {
        (least, Bound::Farthest)
    } else if parallax(*corner) > greatest {
        (greatest, Bound::Nearest)
    } else {
        return Bound::Both;
    };
    // From the rectangle's corner the band lies along the interval of the first view or of the second.
    let (one, two) = if (bound == Bound::Farthest) == is_left {
        (corner.1.x + limit, corner.1.x)
    } else {
        (corner.0.x, corner.0.x - limit)
    };
    *corner = (DVec2::new(one, limit), DVec2::new(two, limit));
    bound
}

impl PairRows {
    /// For how much there is room without asking for more.
    pub(crate) fn room(&self) -> Room {
        Room([
            self.parts.capacity(),
            self.sides.capacity(),
            self.rows.capacity(),
            self.places.capacity(),
            self.corners.capacity(),
        ])
    }

    /// Forgets everything, and makes as much room.
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
    pub(crate) fn assign(&mut self, source: &PairSource<'_>, scratch: &mut PairScratch) {
        self.clear();
        let chains = source.chains;
        let mut range = first_range(&mut scratch.walkers, chains);
        while let Some(heights) = range {
            self.add_part(source, heights, scratch);
            range = next_range(&mut scratch.walkers, chains, heights.1);
        }
    }

    /// Adds the rows between two heights where no chain ends.
    fn add_part(
        &mut self,
        source: &PairSource<'_>,
        (y_top, y_bottom): Range,
        scratch: &mut PairScratch,
    ) {
        let narrowest = scratch.find_sides(source, (y_top, y_bottom));
        if scratch.sides.is_empty() {
            return;
        }
        let mut y = y_top;
        self.add_row(y, narrowest, source, scratch);
        while y < y_bottom {
            for (walker, chains) in scratch.walkers.iter_mut().zip(source.chains) {
                walker.advance(chains, y);
            }
            let vertices = scratch.walkers.iter().map(Walker::next_vertex);
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
        source: &PairSource<'_>,
        scratch: &mut PairScratch,
    ) {
        let start = self.places.len();
        let mut turning = Flags::NONE;
        let mut n_chains = 0;
        for walker in &scratch.walkers {
            let strands = walker.strands().iter();
            self.places.extend(strands.map(|s: &Strand| {
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
        let is_allowed = |&[i, j]: &Side| {
            let parallax = places[i as usize].x - places[j as usize].x;
            (narrowest.0 <= parallax) & (parallax <= narrowest.1)
        };
        if !scratch.sides.iter().all(is_allowed) {
            self.limit_row(start, source.limits(y), scratch);
        }
    }

    /// Keeps the sides of the last row, whose places begin at `start`, within what is allowed.
    fn limit_row(&mut self, start: usize, limits: Range, scratch: &mut PairScratch) {
        let Some(row) = self.rows.last_mut() else {
            return;
        };
        let first = self.corners.len();
        let places = &self.places[start..];
        let corner = |&[i, j]: &Side| (places[i as usize], places[j as usize]);
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
    fn add_kinks(&mut self, source: &PairSource<'_>, scratch: &mut PairScratch) {
        let n = scratch.n_chains();
        let (Some(below), Some(&above)) = (self.rows.pop(), self.rows.last()) else {
            return;
        };
        scratch.find_kinks(
            &self.places[self.places.len() - 2 * n..],
            [source.limits(above.y), source.limits(below.y)],
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
            let (a, b) = (source.limits(above.y), source.limits(below.y));
            self.limit_row(start, (blend(a.0, b.0), blend(a.1, b.1)), scratch);
        }
        let start = self.places.len();
        self.places.extend_from_slice(&scratch.lower);
        self.rows.push(below);
        self.limit_row(start, source.limits(below.y), scratch);
    }

    /// Adds the silhouette seen from the viewpoint at `alpha` to `output`.
    pub(crate) fn interpolate(&self, alpha: f64, cover: &mut Cover, output: &mut Connector) {
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

/// How many of each thing there is room for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Room([usize; 5]);

impl Room {
    /// How much memory that is.
    pub(crate) fn bytes(self) -> usize {
        let sizes = [
            size_of::<Part>(),
            size_of::<Side>(),
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

    /// Room for either.
    pub(crate) fn max(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k].max(other.0[k])))
    }
}

impl PairScratch {
    /// How many chains of both views a row meets.
    fn n_chains(&self) -> usize {
        self.walkers.iter().map(|w| w.strands().len()).sum()
    }

    /// Finds the sides of the pairs of which anything may be allowed between two heights; returns the parallax that is allowed at
    /// all of them.
    fn find_sides(&mut self, source: &PairSource<'_>, heights: Range) -> Range {
        let [one, two] = [0, 1].map(|k: usize| self.walkers[k].n_intervals());
        let sides_of = |i: usize, j: usize| {
            let (i, j) = (2 * i as u32, (2 * one + 2 * j) as u32);
            [[i, j], [i + 1, j + 1]]
        };
        self.sides.clear();
        if one == 1 && two == 1 {
            self.sides.extend(sides_of(0, 0));
        } else {
            let (least, greatest) =
                (source.radius).map_or(EVERYTHING, |radius| source.depths.widest(radius, heights));
            let range = |k: usize, at: usize| {
                self.walkers[k].strands()[at].x_range(&source.chains[k], heights.1)
            };
            let may_meet = |i: usize, j: usize| {
                range(0, 2 * i).0 - range(1, 2 * j + 1).1 < greatest
                    && range(0, 2 * i + 1).1 - range(1, 2 * j).0 > least
            };
            let pairs = (0..one).flat_map(|i| (0..two).map(move |j| (i, j)));
            let pairs = pairs.filter(|&(i, j)| may_meet(i, j));
            self.sides.extend(pairs.flat_map(|(i, j)| sides_of(i, j)));
        }
        (source.radius).map_or(EVERYTHING, |radius| {
            source.depths.narrowest(radius, heights)
        })
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
