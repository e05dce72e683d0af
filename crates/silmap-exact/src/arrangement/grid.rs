//! A uniform grid over the image: the segments that pass through each cell and each row.

use glam::DVec2;

/// Grid cells along one side, for each root of the number of segments.
const CELLS_PER_ROOT: f64 = 2.0;
const MOST_CELLS: usize = 512;
/// Rows for rays, for each row of cells.
const ROWS_PER_CELL: usize = 4;

/// Which segments may meet.
pub(super) struct Grid {
    origin: DVec2,
    cells_per_unit: DVec2,
    pub(super) side: usize,
    /// Of each cell the range of its segments in `of_cells`; likewise of each of the finer rows.
    pub(super) cell_starts: Vec<u32>,
    pub(super) of_cells: Vec<u32>,
    pub(super) row_starts: Vec<u32>,
    pub(super) of_rows: Vec<u32>,
}

impl Grid {
    pub(super) fn new(lines: &[[DVec2; 2]]) -> Option<Self> {
        let (low, high) = lines
            .as_flattened()
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            });
        let side = ((lines.len() as f64).sqrt() * CELLS_PER_ROOT) as usize;
        let side = side.clamp(1, MOST_CELLS);
        let cells_per_unit = DVec2::splat(side as f64) / (high - low);
        if !cells_per_unit.is_finite() {
            return None;
        }
        let mut grid = Self {
            origin: low,
            cells_per_unit,
            side,
            cell_starts: vec![0; side * side + 1],
            of_cells: Vec::new(),
            row_starts: vec![0; side * ROWS_PER_CELL + 1],
            of_rows: Vec::new(),
        };
        let rows: Vec<[usize; 2]> = lines
            .iter()
            .map(|[a, b]| [a.y.min(b.y), a.y.max(b.y)].map(|y| grid.row_of(y)))
            .collect();
        for &[first, last] in &rows {
            for count in &mut grid.row_starts[first + 1..=last + 1] {
                *count += 1;
            }
        }
        let boxes: Vec<[usize; 4]> = lines
            .iter()
            .map(|&[a, b]| {
                let (x0, y0) = grid.cell_of(a.min(b));
                let (x1, y1) = grid.cell_of(a.max(b));
                [x0, y0, x1, y1]
            })
            .collect();
        for &[x0, y0, x1, y1] in &boxes {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    grid.cell_starts[y * side + x + 1] += 1;
                }
            }
        }
        let sum_up = |starts: &mut [u32]| {
            for k in 1..starts.len() {
                starts[k] += starts[k - 1];
            }
            starts[starts.len() - 1] as usize
        };
        grid.of_cells = vec![0; sum_up(&mut grid.cell_starts)];
        grid.of_rows = vec![0; sum_up(&mut grid.row_starts)];
        let mut cell_next = grid.cell_starts.clone();
        let mut row_next = grid.row_starts.clone();
        for (segment, &[first, last]) in (0..).zip(&rows) {
            for next in &mut row_next[first..=last] {
                grid.of_rows[*next as usize] = segment;
                *next += 1;
            }
        }
        for (segment, &[x0, y0, x1, y1]) in (0..).zip(&boxes) {
            for y in y0..=y1 {
                for next in &mut cell_next[y * side + x0..=y * side + x1] {
                    grid.of_cells[*next as usize] = segment;
                    *next += 1;
                }
            }
        }
        Some(grid)
    }

    pub(super) fn row_of(&self, y: f64) -> usize {
        let at = (y - self.origin.y) * self.cells_per_unit.y * ROWS_PER_CELL as f64;
        (at as usize).min(self.side * ROWS_PER_CELL - 1)
    }

    pub(super) fn cell_of(&self, p: DVec2) -> (usize, usize) {
        let at = (p - self.origin) * self.cells_per_unit;
        let last = self.side - 1;
        ((at.x as usize).min(last), (at.y as usize).min(last))
    }
}
