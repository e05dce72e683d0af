//! The zero set of the field as a closed mesh: marching tetrahedra in the blocks that it passes through.
//!
//! Each cell is cut into six tetrahedra about its main diagonal. A change of sign along an edge of a tetrahedron is a vertex, named by
//! the edge, so that blocks need not know of each other. The result is a manifold without boundary whatever the signs are, as the
//! border of the box is outside.
//!
//! Source: Doi, Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells. IEICE Transactions
//! E74(1), 1991.
//! Deviations: crossings keep [`EDGE_MARGIN`] away from the nodes, so that no triangle is degenerate and every node that is kept lies
//! inside of the surface.

use glam::{DVec3, UVec3};
use rayon::prelude::*;
use silmap_geometry::TriangleMesh;
use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::field::Field;
use crate::octree::{Grid, LEAF, Leaf};

/// Least distance of a crossing from the ends of its edge, as a share of it.
const EDGE_MARGIN: f64 = 0.1;

/// Values along one side of a leaf.
const NODES: u32 = LEAF + 1;

/// Values farther from zero than so many cells are not told apart.
const FARTHEST_CELLS: f64 = 4.0;

/// The six tetrahedra of a cell, positively oriented; corners are numbered by bits x = 1, y = 2, z = 4.
const TETRAHEDRA: [[u8; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
    [0, 3, 2, 7],
    [0, 6, 4, 7],
];

/// The crossing of an edge: the edge's name, and where.
#[derive(Clone, Copy)]
struct Crossing {
    /// Number of the edge's first node times 8, and the bits of the axes that it runs along.
    edge: u64,
    position: DVec3,
}

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
    let corners: Vec<[Crossing; 3]> = triangles.into_iter().flatten().collect();
    let mut vertices: Vec<Crossing> = corners.iter().flatten().copied().collect();
    // Stable, so that of the leaves that share an edge the first decides.
    vertices.par_sort_by_key(|c| c.edge);
    vertices.dedup_by_key(|c| c.edge);
    let index_of = |c: Crossing| vertices.partition_point(|v| v.edge < c.edge) as u32;
    Ok(TriangleMesh {
        faces: corners.par_iter().map(|t| t.map(index_of)).collect(),
        positions: vertices.iter().map(|c| c.position).collect(),
        ..TriangleMesh::default()
    })
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
    let inside = (0..8).fold(0_u8, |m, bits| m | u8::from(value(bits) < 0.0) << bits);
    if inside == 0 || inside == u8::MAX {
        return;
    }
    let crossing = |a: u8, b: u8| {
        // An edge's lower end has the fewer bits: all cells that share the edge name it alike.
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let (start, end) = (first + corner(low), first + corner(high));
        let (from, to) = (value(low), value(high));
        let t = (from / (from - to)).clamp(EDGE_MARGIN, 1.0 - EDGE_MARGIN);
        let wide = |v: u32| u64::from(v) + 1;
        let node = (u64::from(start.z) * wide(grid.cells.y) + u64::from(start.y))
            * wide(grid.cells.x)
            + u64::from(start.x);
        Crossing {
            edge: node * 8 + u64::from(high & !low),
            position: grid.point(start).lerp(grid.point(end), t),
        }
    };
    for tetrahedron in TETRAHEDRA {
        let is_in = |k: usize| inside >> tetrahedron[k] & 1 == 1;
        let signs = (0..4).fold(0, |m, k| m | usize::from(is_in(k)) << k);
        // Even permutations of the corners that put the odd one out, or the inner pair, first.
        let order = match signs {
            0b0000 | 0b1111 => continue,
            0b0001 | 0b1110 | 0b0011 => [0, 1, 2, 3],
            0b0010 | 0b1101 => [1, 0, 3, 2],
            0b0100 | 0b1011 | 0b1100 => [2, 3, 0, 1],
            0b1000 | 0b0111 => [3, 2, 1, 0],
            0b0101 => [0, 2, 3, 1],
            0b1001 => [0, 3, 1, 2],
            0b0110 => [1, 2, 0, 3],
            _ => [1, 3, 2, 0],
        };
        let [a, b, c, d] = order.map(|k| tetrahedron[k]);
        match signs.count_ones() {
            1 => triangles.push([crossing(a, b), crossing(a, c), crossing(a, d)]),
            3 => triangles.push([crossing(a, b), crossing(a, d), crossing(a, c)]),
            _ => {
                let [p, q] = [crossing(a, c), crossing(b, d)];
                triangles.push([p, crossing(a, d), q]);
                triangles.push([p, q, crossing(b, c)]);
            }
        }
    }
}
