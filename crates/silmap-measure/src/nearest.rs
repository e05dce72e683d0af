//! The segment nearest to a point, among the segments of outlines: found in a grid, ring by ring around the point.
//!
//! An outline of some thousand segments is asked for as often as it has samples, so that looking at every segment each time would
//! take seconds for one picture.

use glam::DVec2;
use silmap_geometry::polygon::distance_squared_to_segment;

/// Length of a cell's side in mean lengths of a segment: a cell on the outline holds a handful.
const CELL_REL: f64 = 4.0;

/// Most cells along a side of the grid.
const MOST_CELLS: f64 = 1024.0;

/// Segments of the plane, sorted into square cells.
#[derive(Clone, Debug)]
pub(crate) struct SegmentGrid {
    segments: Vec<(DVec2, DVec2)>,
    corner: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
    /// The segments that pass through cell i are `held[starts[i]..starts[i + 1]]`; cells run along rows.
    starts: Vec<u32>,
    held: Vec<u32>,
}

/// The nearest segment and the square of how far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    segment: u32,
    pub(crate) distance_squared: f64,
}

impl SegmentGrid {
    /// Sorts the segments.
    pub(crate) fn new(segments: Vec<(DVec2, DVec2)>) -> Self {
        let ends = || segments.iter().flat_map(|&(a, b)| [a, b]);
        let corner = ends().reduce(DVec2::min).unwrap_or_default();
        let extent = ends().reduce(DVec2::max).unwrap_or_default() - corner;
        let length: f64 = segments.iter().map(|(a, b)| a.distance(*b)).sum();
        let wanted = CELL_REL * length / segments.len().max(1) as f64;
        let cell = wanted
            .max(extent.max_element() / MOST_CELLS)
            .max(f64::MIN_POSITIVE);
        let count = |side: f64| (side / cell).ceil().clamp(1.0, MOST_CELLS) as usize;
        let mut grid = Self {
            segments,
            corner,
            cell,
            columns: count(extent.x),
            rows: count(extent.y),
            starts: Vec::new(),
            held: Vec::new(),
        };
        grid.sort();
        grid
    }

    /// Counts, then places.
    fn sort(&mut self) {
        let mut ends = vec![0_u32; self.columns * self.rows + 1];
        for &segment in &self.segments {
            self.visit(segment, |cell| ends[cell] += 1);
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        // Filled from behind, an end becomes a start, and a cell's segments keep their order.
        self.held = vec![0; sum as usize];
        let mut held = std::mem::take(&mut self.held);
        for (number, &segment) in self.segments.iter().enumerate().rev() {
            self.visit(segment, |cell| {
                ends[cell] -= 1;
                held[ends[cell] as usize] = number as u32;
            });
        }
        self.held = held;
        self.starts = ends;
    }

    /// Calls `see` with each cell that a segment passes through, row by row.
    fn visit(&self, (a, b): (DVec2, DVec2), mut see: impl FnMut(usize)) {
        let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
        let (first, last) = (self.row(low.y), self.row(high.y));
        let slope = (high.x - low.x) / (high.y - low.y).max(f64::MIN_POSITIVE);
        for row in first..=last {
            let x_at = |row: usize| {
                let y = self.corner.y + row as f64 * self.cell;
                let x = low.x + (y - low.y) * slope;
                x.clamp(low.x.min(high.x), low.x.max(high.x))
            };
            let from = if row == first { low.x } else { x_at(row) };
            let to = if row == last { high.x } else { x_at(row + 1) };
            for column in self.column(from.min(to))..=self.column(from.max(to)) {
                see(row * self.columns + column);
            }
        }
    }

    fn column(&self, x: f64) -> usize {
        (((x - self.corner.x) / self.cell) as usize).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.corner.y) / self.cell) as usize).min(self.rows - 1)
    }

    /// The segment nearest to `p`; `None` where there is no segment.
    pub(crate) fn nearest(&self, p: DVec2) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        let (column, row) = (self.column(p.x), self.row(p.y));
        // No point of the grid is nearer to a point beside it than to the one that is nearest to that in the grid.
        let side = DVec2::new(self.columns as f64, self.rows as f64) * self.cell;
        let at = (p - self.corner).clamp(DVec2::ZERO, side);
        for ring in 0..self.columns.max(self.rows) {
            let (left, top) = (column as f64 - ring as f64, row as f64 - ring as f64);
            let (right, bottom) = (left + 2.0 * ring as f64, top + 2.0 * ring as f64);
            if ring > 0 {
                // What is not in the rings before lies beyond their border.
                let border = (at - (DVec2::new(left, top) + 1.0) * self.cell)
                    .min(DVec2::new(right, bottom) * self.cell - at)
                    .min_element()
                    .max(0.0);
                if best.is_some_and(|b| b.distance_squared <= border * border) {
                    break;
                }
            }
            let low_row = row.saturating_sub(ring);
            for y in low_row..=(row + ring).min(self.rows - 1) {
                let is_edge = y.abs_diff(row) == ring;
                let low = column.saturating_sub(ring);
                let high = (column + ring).min(self.columns - 1);
                let step = if is_edge { 1 } else { (2 * ring).max(1) };
                // Of a row between the ring's first and last only the two ends are in the ring.
                let start = if is_edge || left >= 0.0 {
                    low
                } else {
                    column + ring
                };
                for x in (start..=high).step_by(step) {
                    self.look(p, y * self.columns + x, &mut best);
                }
            }
        }
        best
    }

    fn look(&self, p: DVec2, cell: usize, best: &mut Option<Nearest>) {
        let held = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        for &segment in &self.held[held] {
            let (a, b) = self.segments[segment as usize];
            let distance_squared = distance_squared_to_segment(p, a, b);
            if best.is_none_or(|b| distance_squared < b.distance_squared) {
                *best = Some(Nearest {
                    segment,
                    distance_squared,
                });
            }
        }
    }

    /// The point of a segment that is nearest to `p`.
    pub(crate) fn point(&self, p: DVec2, nearest: Nearest) -> DVec2 {
        let (a, b) = self.segments[nearest.segment as usize];
        let along = b - a;
        let squared = along.length_squared().max(f64::MIN_POSITIVE);
        a + along * ((p - a).dot(along) / squared).clamp(0.0, 1.0)
    }

    /// The segments, as they came.
    pub(crate) fn segments(&self) -> &[(DVec2, DVec2)] {
        &self.segments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn check(segments: &[(DVec2, DVec2)], p: DVec2) {
        let grid = SegmentGrid::new(segments.to_vec());
        let found = grid.nearest(p).expect("there are segments");
        let distance = |&(a, b): &(DVec2, DVec2)| distance_squared_to_segment(p, a, b).sqrt();
        let truth = segments.iter().map(distance).fold(f64::INFINITY, f64::min);
        let off = (found.distance_squared.sqrt() - truth).abs();
        assert!(off < 1e-9, "{found:?} for {truth} at {p}");
        let point = grid.point(p, found);
        assert!((point.distance(p) - truth).abs() < 1e-9, "{point} from {p}");
    }

    #[test]
    fn the_nearest_is_that_of_looking_at_all() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for count in [1, 2, 5, 40, 300] {
            // Short ones and a few long ones, flat and upright ones among them; eyes within and far beside.
            let mut point = |reach: f64| {
                let mut coordinate = || random.random_range(-reach..reach);
                DVec2::new(coordinate(), coordinate())
            };
            let mut segments: Vec<(DVec2, DVec2)> = (0..count)
                .map(|k| {
                    let a = point(50.0);
                    let reach = if k % 17 == 3 { 90.0 } else { 2.0 };
                    let by = point(reach);
                    let by = [by, by * DVec2::X, by * DVec2::Y][k % 3];
                    (a, a + by)
                })
                .collect();
            segments.push((segments[0].0, segments[0].0));
            for k in 0..200 {
                check(&segments, point(if k % 5 == 0 { 400.0 } else { 60.0 }));
            }
        }
    }

    #[test]
    fn nothing_is_near_nothing_and_a_line_of_points_is_a_grid_too() {
        assert_eq!(SegmentGrid::new(Vec::new()).nearest(DVec2::ONE), None);
        let flat: Vec<(DVec2, DVec2)> = (0..9)
            .map(|k| {
                (
                    DVec2::new(f64::from(k), 1.0),
                    DVec2::new(f64::from(k) + 0.5, 1.0),
                )
            })
            .collect();
        check(&flat, DVec2::new(4.75, 3.0));
        check(&[(DVec2::ONE, DVec2::ONE)], DVec2::ZERO);
    }
}
