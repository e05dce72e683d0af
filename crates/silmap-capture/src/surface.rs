//! The zero set of the field as a closed mesh: marching tetrahedra in the blocks that it passes through.
//!
//! Crossings keep [`EDGE_MARGIN`] away from the nodes, so that every node that is kept lies inside of the surface; the border of the box is
//! outside.

use glam::UVec3;
use rayon::prelude::*;
use silmap_geometry::TriangleMesh;
use silmap_geometry::tetrahedra::{Cell, Crossing, mesh};
use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::field::Field;
use crate::octree::{Grid, LEAF, Leaf};

/// Least distance of a crossing from the ends of its edge, as a share of it.
const EDGE_MARGIN: f64 = 0.1;

/// Values along one side of a leaf.
const NODES: u32 = LEAF + 1;

/// Values farther from zero than so many cells are not told apart.
const FARTHEST_CELLS: f64 = 4.0;

/// The surface within the leaves; counts a unit of `stage` for each leaf.
pub(crate) fn surface(
    field: &Field<'_>,
    grid: &Grid,
    leaves: &[Leaf],
    (stage, watch): (Stage, &Watch<'_>),
) -> Result<TriangleMesh, Interrupted> {
    let triangles: Vec<Vec<[Crossing; 3]>> = leaves
        .par_iter()
        .map(|leaf| {
            watch.check()?;
            watch.advance(stage, 1);
            if leaf.is_full {
                return Ok(Vec::new());
            }
            Ok(leaf_triangles(field, grid, leaf))
        })
        .collect::<Result<_, Interrupted>>()?;
    let triangles: Vec<[Crossing; 3]> = triangles.into_iter().flatten().collect();
    Ok(mesh(&triangles))
}

fn leaf_triangles(field: &Field<'_>, grid: &Grid, leaf: &Leaf) -> Vec<[Crossing; 3]> {
    let most = FARTHEST_CELLS * grid.cell;
    let (mut values, mut room) = (Vec::with_capacity(NODES.pow(3) as usize), Vec::new());
    for k in 0..NODES.pow(3) {
        let node = leaf.first + UVec3::new(k % NODES, k / NODES % NODES, k / (NODES * NODES));
        values.push(match grid.is_border(node) {
            true => most,
            false => field.value(grid.point(node), &leaf.votes, most, &mut room),
        });
    }
    let mut triangles = Vec::new();
    for k in 0..LEAF.pow(3) {
        let cell = UVec3::new(k % LEAF, k / LEAF % LEAF, k / (LEAF * LEAF));
        if (leaf.first + cell).cmplt(grid.cells).all() {
            cell_triangles(grid, leaf.first, cell, &values, &mut triangles);
        }
    }
    triangles
}

fn cell_triangles(
    grid: &Grid,
    first: UVec3,
    cell: UVec3,
    values: &[f64],
    triangles: &mut Vec<[Crossing; 3]>,
) {
    let corner = |bits: u8| {
        let bits = u32::from(bits);
        cell + UVec3::new(bits & 1, bits >> 1 & 1, bits >> 2)
    };
    let value = |bits: u8| {
        let c = corner(bits);
        values[(c.x + NODES * (c.y + NODES * c.z)) as usize]
    };
    let wide = |v: u32| u64::from(v) + 1;
    let of_grid = Cell {
        values: std::array::from_fn(|bits| value(bits as u8)),
        node: |bits| {
            let c = first + corner(bits);
            (u64::from(c.z) * wide(grid.cells.y) + u64::from(c.y)) * wide(grid.cells.x)
                + u64::from(c.x)
        },
        position: |bits| grid.point(first + corner(bits)),
        margin: EDGE_MARGIN,
    };
    of_grid.append(triangles);
}
