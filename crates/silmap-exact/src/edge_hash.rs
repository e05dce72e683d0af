//! The list of candidate edges as a table: one row for each vertex, a fixed number of columns.
//!
//! A row holds the ends of the candidates that start in its vertex. An edge of a front face empties the cell of its
//! reverse when there is one, and fills a cell of its own row otherwise.
//!
//! Source: Stencil shadows: silhouette determination. 2011, "Fast implementation".
//! Deviation: where the source fails on a full row, the table is made anew with twice the columns, up to a limit. What a row of a
//! vertex of very many edges then cannot hold goes into an ordered set: more columns for all vertices would take the square of memory.

use std::collections::BTreeSet;

use crate::edge_mesh::EdgeMesh;
use crate::{DirectedEdge, Viewpoint, Work};

/// Columns to begin with, as in the source's faster run; a row rarely holds more than two cells at the end.
const COLUMNS: usize = 8;
/// Most columns that the table is given.
const MOST_COLUMNS: usize = 32;
/// Marks an empty cell.
const EMPTY: u32 = u32::MAX;

/// The table, kept from one viewpoint to the next.
#[derive(Clone, Debug)]
pub(crate) struct EdgeHash {
    columns: usize,
    cells: Vec<u32>,
    /// Candidates whose row is full: where they start and end.
    beyond: BTreeSet<(u32, u32)>,
}

/// Some row has no empty cell left.
struct RowFull;

impl EdgeHash {
    pub(crate) fn new(mesh: &EdgeMesh) -> Self {
        Self::with_columns(mesh, COLUMNS)
    }

    fn with_columns(mesh: &EdgeMesh, columns: usize) -> Self {
        Self {
            columns,
            cells: vec![EMPTY; columns * mesh.positions().len()],
            beyond: BTreeSet::new(),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.cells)
    }

    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        loop {
            match self.toggle_front_faces(mesh, viewpoint) {
                Ok(toggled) => {
                    self.collect(out);
                    return Work::of_edges(toggled);
                }
                Err(RowFull) => *self = Self::with_columns(mesh, 2 * self.columns),
            }
        }
    }

    fn toggle_front_faces(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
    ) -> Result<usize, RowFull> {
        self.cells.fill(EMPTY);
        self.beyond.clear();
        let query = mesh.query(viewpoint);
        let mut toggled = 0;
        for (face, corners) in (0..).zip(mesh.faces()) {
            if !mesh.is_front(face, viewpoint, &query) {
                continue;
            }
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                toggled += 1;
                if let Some(cell) = self.row(to).iter_mut().find(|cell| **cell == from) {
                    *cell = EMPTY;
                    continue;
                }
                if !self.beyond.is_empty() && self.beyond.remove(&(to, from)) {
                    continue;
                }
                let is_widest = self.columns >= MOST_COLUMNS;
                match self.row(from).iter_mut().find(|cell| **cell == EMPTY) {
                    Some(cell) => *cell = to,
                    None if !is_widest => return Err(RowFull),
                    None => {
                        self.beyond.insert((from, to));
                    }
                }
            }
        }
        Ok(toggled)
    }

    fn row(&mut self, vertex: u32) -> &mut [u32] {
        let start = vertex as usize * self.columns;
        &mut self.cells[start..start + self.columns]
    }

    fn collect(&self, out: &mut Vec<DirectedEdge>) {
        for (from, row) in (0..).zip(self.cells.chunks_exact(self.columns)) {
            let filled = row.iter().filter(|&&to| to != EMPTY);
            out.extend(filled.map(|&to| DirectedEdge { from, to }));
        }
        let beyond = self.beyond.iter();
        out.extend(beyond.map(|&(from, to)| DirectedEdge { from, to }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use silmap_geometry::TriangleMesh;

    #[test]
    fn a_full_row_makes_the_table_wider_up_to_a_limit() {
        // A double cone: its apexes have more edges than a row has columns.
        check(20, COLUMNS + 1..=MOST_COLUMNS - 1);
        check(4 * MOST_COLUMNS as u32, MOST_COLUMNS..=MOST_COLUMNS);
    }

    fn check(sides: u32, columns: std::ops::RangeInclusive<usize>) {
        let mut mesh = TriangleMesh {
            positions: vec![DVec3::Z, -DVec3::Z],
            ..TriangleMesh::default()
        };
        for k in 0..sides {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(sides)).sin_cos();
            mesh.positions.push(DVec3::new(cos, sin, 0.0));
        }
        // Even sides first, so that no candidate finds its reverse before the row is full.
        for k in (0..sides).step_by(2).chain((1..sides).step_by(2)) {
            let (a, b) = (2 + k, 2 + (k + 1) % sides);
            mesh.faces.extend([[0, a, b], [1, b, a]]);
        }
        let mesh = EdgeMesh::new(&mesh).expect("a double cone is closed");
        let mut hash = EdgeHash::new(&mesh);
        let mut out = Vec::new();
        hash.extract(&mesh, &Viewpoint::Eye(DVec3::Z * 5.0), &mut out);
        assert_eq!(out.len(), sides as usize);
        assert!(columns.contains(&hash.columns), "{} columns", hash.columns);
    }
}
