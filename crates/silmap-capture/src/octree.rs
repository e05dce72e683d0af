//! Which blocks of a grid the surface of a field may pass through.

use glam::{DVec3, UVec3};
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::field::{Block, Field, Place, Votes};

/// Cells along the side of the smallest blocks.
pub(crate) const LEAF: u32 = 8;

/// Cells along the side of the largest blocks.
const ROOT: u32 = 32;

/// A grid of cubic cells over a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// The first node.
    pub(crate) first: DVec3,
    /// Side of a cell.
    pub(crate) cell: f64,
    /// Cells along each axis.
    pub(crate) cells: UVec3,
}

impl Grid {
    /// Over a box, with that many cells along its longest side and a layer more around it.
    pub(crate) fn over([low, high]: [DVec3; 2], along_longest: u32) -> Self {
        let size = high - low;
        let cell = size.max_element() / f64::from(along_longest);
        let cells = (size / cell).ceil().as_uvec3() + UVec3::splat(2);
        let first = 0.5 * (low + high) - 0.5 * cell * cells.as_dvec3();
        Self { first, cell, cells }
    }

    /// Where a node lies.
    pub(crate) fn point(&self, node: UVec3) -> DVec3 {
        self.first + node.as_dvec3() * self.cell
    }

    /// Whether a node lies on the border of the box or beyond: outside, whatever the field says.
    pub(crate) fn is_border(&self, node: UVec3) -> bool {
        node.cmpeq(UVec3::ZERO).any() || node.cmpge(self.cells).any()
    }

    fn block(&self, first: UVec3, side: u32) -> Block {
        let half = 0.5 * f64::from(side) * self.cell;
        Block {
            middle: self.point(first) + DVec3::splat(half),
            half,
        }
    }
}

/// A smallest block that is not outside.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    /// Its first node.
    pub(crate) first: UVec3,
    pub(crate) votes: Votes,
    /// Whether all of it is inside, so that no surface passes through it.
    pub(crate) is_full: bool,
}

/// All leaves that are not outside, in an order that depends on nothing but the grid. Counts a unit of `stage` for each of
/// [`root_count`] blocks.
pub(crate) fn leaves(
    field: &Field<'_>,
    grid: &Grid,
    (stage, watch): (Stage, &Watch<'_>),
) -> Result<Vec<Leaf>, Interrupted> {
    let roots = grid.cells.map(|c| c.div_ceil(ROOT));
    let found: Vec<Vec<Leaf>> = (0..root_count(grid))
        .into_par_iter()
        .map(|k| {
            let k = k as u32;
            let root = UVec3::new(k % roots.x, k / roots.x % roots.y, k / (roots.x * roots.y));
            let mut found = Vec::new();
            let votes = field.all_undecided();
            divide(
                field,
                grid,
                (root * ROOT, ROOT),
                &votes,
                (watch, &mut found),
            )?;
            watch.advance(stage, 1);
            Ok(found)
        })
        .collect::<Result<_, Interrupted>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// Units of work that [`leaves`] counts.
pub(crate) fn root_count(grid: &Grid) -> u64 {
    let roots = grid.cells.map(|c| c.div_ceil(ROOT));
    u64::from(roots.x) * u64::from(roots.y) * u64::from(roots.z)
}

fn divide(
    field: &Field<'_>,
    grid: &Grid,
    (first, side): (UVec3, u32),
    votes: &Votes,
    (watch, found): (&Watch<'_>, &mut Vec<Leaf>),
) -> Result<(), Interrupted> {
    watch.check()?;
    if first.cmpge(grid.cells).any() {
        return Ok(());
    }
    let (place, votes) = field.vote(&grid.block(first, side), votes);
    if place == Place::Outside {
        return Ok(());
    }
    if side == LEAF {
        let last = first + UVec3::splat(LEAF);
        let is_full = place == Place::Inside && !grid.is_border(first) && !grid.is_border(last);
        found.push(Leaf {
            first,
            votes,
            is_full,
        });
        return Ok(());
    }
    let half = side / 2;
    for k in 0..8 {
        let step = UVec3::new(k & 1, k >> 1 & 1, k >> 2) * half;
        divide(field, grid, (first + step, half), &votes, (watch, found))?;
    }
    Ok(())
}
