//! A uniform grid of edges, to find those near a change.

use glam::DVec2;
use silmap_geometry::Loop;

/// Side of a cell, pixels: about the length of a simplified edge.
const CELL_PX: f64 = 8.0;
/// Ends a cell's list.
const NONE: u32 = u32::MAX;

/// Edges, each in every cell its box meets. Entries are never taken out; the caller must know which edges still exist.
#[derive(Debug)]
pub(super) struct EdgeGrid {
    low: DVec2,
    columns: usize,
    rows: usize,
    /// The latest entry of each cell.
    latest: Vec<u32>,
    /// An edge's id and the entry before it in the same cell.
    entries: Vec<(u32, u32)>,
}

impl EdgeGrid {
    /// A grid over the box of all loops; what lies outside belongs to its border cells.
    pub(super) fn new(loops: &[Loop]) -> Self {
        let points = || loops.iter().flatten().copied();
        let low = points().fold(DVec2::INFINITY, DVec2::min);
        let high = points().fold(DVec2::NEG_INFINITY, DVec2::max);
        let cells = ((high - low) / CELL_PX).floor().max(DVec2::ZERO);
        let (columns, rows) = (cells.x as usize + 1, cells.y as usize + 1);
        Self {
            low,
            columns,
            rows,
            latest: vec![NONE; columns * rows],
            entries: Vec::new(),
        }
    }

    fn column_row(&self, p: DVec2) -> (usize, usize) {
        // Casting clamps at zero.
        let place = (p - self.low) / CELL_PX;
        (
            (place.x as usize).min(self.columns - 1),
            (place.y as usize).min(self.rows - 1),
        )
    }

    /// Puts an edge in.
    pub(super) fn insert(&mut self, edge: u32, a: DVec2, b: DVec2) {
        let (left, top) = self.column_row(a.min(b));
        let (right, bottom) = self.column_row(a.max(b));
        for row in top..=bottom {
            for column in left..=right {
                let cell = &mut self.latest[row * self.columns + column];
                self.entries.push((edge, *cell));
                *cell = self.entries.len() as u32 - 1;
            }
        }
    }

    /// Whether `test` holds for an edge in the cells of a box; an edge may be asked for several times.
    pub(super) fn any_edge(&self, low: DVec2, high: DVec2, test: impl Fn(u32) -> bool) -> bool {
        let (left, top) = self.column_row(low);
        let (right, bottom) = self.column_row(high);
        for row in top..=bottom {
            for column in left..=right {
                let mut at = self.latest[row * self.columns + column];
                while at != NONE {
                    let (edge, before) = self.entries[at as usize];
                    if test(edge) {
                        return true;
                    }
                    at = before;
                }
            }
        }
        false
    }
}
