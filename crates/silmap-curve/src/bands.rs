//! An outline sorted for the fragment shader: horizontal bands, each with the edges that a pixel in it has to look at, and a grid of
//! cells, each inside, outside or at the border.
//!
//! A pixel in a cell that is inside or outside is done. One at the border counts the edges of its band that cross the half-line to its
//! right, which is how often the outline winds about it, and takes the distance to the nearest for its coverage. Points may move by a
//! margin before any of this is wrong, so that an outline serves eyes near the one that it was sorted for.
//!
//! Source: beyond the papers; bands as in Lengyel. GPU-Centered Font Rendering Directly from Glyph Outlines. JCGT 6(2), 2017, where
//! they hold the curves of glyphs.

use std::ops::RangeInclusive;

use glam::DVec2;

/// Most bands, and most cells a side.
const MOST_BANDS: usize = 128;
const MOST_CELLS: usize = 64;

/// Rows of pixels in a band, and pixels of a cell's side.
const BAND_PX: f64 = 4.0;
const CELL_PX: f64 = 8.0;

/// How finely an outline is sorted. Coordinates go from −1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandParams {
    /// How many bands there are.
    pub bands: usize,
    /// How many cells there are a side.
    pub cells: usize,
    /// How far a point may move, and coverage reach.
    pub margin: f64,
}

impl BandParams {
    /// For a picture in which the square from −1 to 1 has sides of so many pixels.
    #[must_use]
    pub fn for_size(side_px: f64, margin: f64) -> Self {
        let count = |px: f64, most: usize| ((side_px / px).ceil() as usize).clamp(1, most);
        Self {
            bands: count(BAND_PX, MOST_BANDS),
            cells: count(CELL_PX, MOST_CELLS),
            margin,
        }
    }
}

/// State of a cell that the outline does not wind about.
pub const OUTSIDE: u8 = 0;
/// Of one that it winds about.
pub const INSIDE: u8 = 1;
/// Of one that an edge comes near.
pub const BORDER: u8 = 2;

/// A sorted outline, and buffers.
#[derive(Clone, Debug, Default)]
pub struct Bands {
    /// Where each band's edges begin in `edges`, and where the last ends.
    pub starts: Vec<u16>,
    /// Edges, band by band, by the number of their first point.
    pub edges: Vec<u16>,
    /// State of each cell, row by row from y = −1 up.
    pub cells: Vec<u8>,
    /// Of the cells of one row: by how much the windings change.
    changes: Vec<i32>,
}

/// The bands or cells of `count` over [−1, 1] that a stretch touches; those at the ends take what is beyond.
fn touched(least: f64, most: f64, count: usize) -> RangeInclusive<usize> {
    let place = |x: f64| {
        let at = ((x + 1.0) * 0.5 * count as f64).floor();
        at.clamp(0.0, (count - 1) as f64) as usize
    };
    place(least)..=place(most)
}

impl Bands {
    /// Sorts the edges from each of `points` to the next; `is_edge` says which there are. False where there are more than can be
    /// numbered.
    pub fn sort(&mut self, points: &[DVec2], is_edge: &[bool], params: &BandParams) -> bool {
        let numbered = || {
            let edges = points.windows(2).zip(is_edge).enumerate();
            edges.filter(|(_, (_, is_edge))| **is_edge)
        };
        let edges = || numbered().map(|(i, (pair, _))| (i, pair[0], pair[1]));
        let band_range = |a: DVec2, b: DVec2| {
            let (least, most) = (a.y.min(b.y), a.y.max(b.y));
            touched(least - params.margin, most + params.margin, params.bands)
        };
        // How many edges each band has, then where they end, then where they begin.
        let mut counts = [0_usize; MOST_BANDS];
        for (_, a, b) in edges() {
            band_range(a, b).for_each(|band| counts[band] += 1);
        }
        let total: usize = counts[..params.bands].iter().sum();
        if total > usize::from(u16::MAX) || points.len() > usize::from(u16::MAX) {
            return false;
        }
        self.starts.clear();
        let mut end = 0;
        for count in &mut counts[..params.bands] {
            self.starts.push(end as u16);
            end += std::mem::replace(count, end);
        }
        self.starts.push(end as u16);
        self.edges.clear();
        self.edges.resize(total, 0);
        for (i, a, b) in edges() {
            for band in band_range(a, b) {
                self.edges[counts[band]] = i as u16;
                counts[band] += 1;
            }
        }
        self.find_border(edges(), params);
        self.find_inside(edges(), params);
        true
    }

    /// Marks the cells that come near an edge.
    fn find_border(
        &mut self,
        edges: impl Iterator<Item = (usize, DVec2, DVec2)>,
        params: &BandParams,
    ) {
        let (count, margin) = (params.cells, params.margin);
        self.cells.clear();
        self.cells.resize(count * count, OUTSIDE);
        let height = 2.0 / count as f64;
        for (_, a, b) in edges {
            let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
            for row in touched(low.y - margin, high.y + margin, count) {
                let bottom = row as f64 * height - 1.0 - margin;
                let top = bottom + height + 2.0 * margin;
                // The edge's part beside this row.
                let at = |y: f64| {
                    let share = ((y - low.y) / (high.y - low.y)).clamp(0.0, 1.0);
                    low.x + (high.x - low.x) * share
                };
                let (one, two) = if high.y > low.y {
                    (at(bottom), at(top))
                } else {
                    (low.x, high.x)
                };
                for column in touched(one.min(two) - margin, one.max(two) + margin, count) {
                    self.cells[row * count + column] = BORDER;
                }
            }
        }
    }

    /// Finds whether the cells away from edges are inside.
    fn find_inside(
        &mut self,
        edges: impl Iterator<Item = (usize, DVec2, DVec2)> + Clone,
        params: &BandParams,
    ) {
        let count = params.cells;
        let middle = |k: usize| (k as f64 + 0.5) * 2.0 / count as f64 - 1.0;
        // One row after the other, in one buffer: windings change by so much at this column.
        self.changes.clear();
        self.changes.resize(count * (count + 1), 0);
        for (_, a, b) in edges {
            let (least, most) = (a.y.min(b.y), a.y.max(b.y));
            for row in touched(least, most, count) {
                let y = middle(row);
                if (a.y <= y) == (b.y <= y) {
                    continue;
                }
                let x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
                // Columns whose middles have the crossing to their right.
                let columns = ((x + 1.0) * 0.5 * count as f64 - 0.5).ceil();
                let columns = columns.clamp(0.0, count as f64) as usize;
                self.changes[row * (count + 1) + columns] += if b.y > a.y { 1 } else { -1 };
            }
        }
        for row in 0..count {
            let changes = &self.changes[row * (count + 1)..][..=count];
            let mut winding = 0;
            for column in (0..count).rev() {
                winding += changes[column + 1];
                let cell = &mut self.cells[row * count + column];
                if *cell != BORDER && winding != 0 {
                    *cell = INSIDE;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Loops one after the other, each closed by its first point.
    fn outline() -> impl Strategy<Value = (Vec<DVec2>, Vec<bool>)> {
        let point = (-1.1..1.1_f64, -1.1..1.1_f64).prop_map(DVec2::from);
        let one = prop::collection::vec(point, 3..9);
        prop::collection::vec(one, 1..4).prop_map(|loops| {
            let (mut points, mut is_edge) = (Vec::new(), Vec::new());
            for l in loops {
                points.extend(l.iter().chain(&l[..1]));
                is_edge.extend(vec![true; l.len()]);
                is_edge.push(false);
            }
            (points, is_edge)
        })
    }

    fn winding(edges: impl Iterator<Item = (DVec2, DVec2)>, p: DVec2) -> i32 {
        edges
            .filter(|(a, b)| (a.y <= p.y) != (b.y <= p.y))
            .filter(|(a, b)| a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) > p.x)
            .map(|(a, b)| if b.y > a.y { 1 } else { -1 })
            .sum()
    }

    proptest! {
        /// Whatever the points have moved by, up to the margin, a pixel's cell and band say what all edges say.
        #[test]
        fn bands_and_cells_say_what_the_outline_says(
            (points, is_edge) in outline(), side_px in 1.0..200.0_f64, margin in 0.0..0.3_f64,
            moves in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 36), probes in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 60),
        ) {
            let params = BandParams::for_size(side_px, margin);
            let mut bands = Bands::default();
            prop_assert!(bands.sort(&points, &is_edge, &params));
            // A loop's last point is its first, and moves with it.
            let mut moved = points.clone();
            let mut first = 0;
            for k in 0..moved.len() {
                if is_edge[k] {
                    moved[k] += DVec2::from(moves[k % moves.len()]) * margin * std::f64::consts::FRAC_1_SQRT_2;
                } else {
                    moved[k] = moved[first];
                    first = k + 1;
                }
            }
            let edge = |i: usize| (moved[i], moved[i + 1]);
            let all = || (0..moved.len() - 1).filter(|&i| is_edge[i]).map(edge);
            for p in probes.into_iter().map(DVec2::from) {
                let band = *touched(p.y, p.y, params.bands).start();
                let (start, end) = (bands.starts[band], bands.starts[band + 1]);
                let own = bands.edges[start.into()..end.into()].iter().map(|&i| edge(i.into()));
                let wanted = winding(all(), p);
                prop_assert_eq!(winding(own, p), wanted, "band {}", band);
                let column = *touched(p.x, p.x, params.cells).start();
                let row = *touched(p.y, p.y, params.cells).start();
                match bands.cells[row * params.cells + column] {
                    INSIDE => prop_assert!(wanted != 0, "{p} is inside"),
                    OUTSIDE => prop_assert!(wanted == 0, "{p} is outside"),
                    state => prop_assert_eq!(state, BORDER),
                }
            }
        }
    }

    #[test]
    fn a_large_square_is_border_only_at_its_sides() {
        let corners = [
            (-0.8, -0.8),
            (0.8, -0.8),
            (0.8, 0.8),
            (-0.8, 0.8),
            (-0.8, -0.8),
        ];
        let points = corners.map(DVec2::from);
        let params = BandParams::for_size(256.0, 0.01);
        let mut bands = Bands::default();
        assert!(bands.sort(&points, &[true, true, true, true, false], &params));
        let count = |state: u8| bands.cells.iter().filter(|&&c| c == state).count();
        // 32 cells a side: the square is about 26 wide.
        assert!(
            count(INSIDE) > 500 && count(BORDER) < 220,
            "{}",
            count(BORDER)
        );
        assert_eq!(count(INSIDE) + count(BORDER) + count(OUTSIDE), 32 * 32);
    }
}
