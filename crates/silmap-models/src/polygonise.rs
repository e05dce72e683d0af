//! The zero set of a field as a closed mesh: marching tetrahedra on a grid that skips what is far from the surface.
//!
//! Each cell of a cubic grid is cut into six tetrahedra about its main diagonal, the same way in every cell, so that
//! neighbours agree on their shared faces. A sign change along a tetrahedron's edge is one vertex, named by the edge;
//! each tetrahedron adds at most two triangles over its edges' vertices. The result is a manifold without boundary
//! whatever the signs are, provided that the field is positive on the border of the box.
//!
//! Source: Doi, Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells. IEICE
//! Transactions E74(1), 1991. The cells' cut is Freudenthal's triangulation of the cube.
//! Deviations: crossings keep [`EDGE_MARGIN`] away from the grid's vertices, so that no triangle is degenerate; a caller
//! that needs vertices exactly on the surface projects them afterwards.

use glam::{DVec3, U64Vec3};
use rayon::prelude::*;
use silmap_geometry::TriangleMesh;

/// A shape given by a field: negative inside, positive outside.
pub(super) trait Field: Sync {
    /// The field's value at a point.
    fn value(&self, point: DVec3) -> f64;

    /// A half-size of a cube about the origin that holds the surface with a margin.
    fn extent(&self) -> f64;

    /// A bound of the field's slope.
    fn slope_bound(&self) -> f64;

    /// How short edges should be near a point of the surface, as a factor.
    fn fineness(&self, _point: DVec3) -> f64 {
        1.0
    }

    /// The field's gradient, by differences over `step`.
    fn gradient(&self, point: DVec3, step: f64) -> DVec3 {
        // The corners of a tetrahedron: four values do.
        let corners = [
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::ONE,
        ];
        let sum: DVec3 = corners
            .iter()
            .map(|&c| c * self.value(point + c * step))
            .sum();
        sum / (4.0 * step)
    }
}

/// Least distance of a crossing from the ends of its grid edge, as a fraction of it.
const EDGE_MARGIN: f64 = 0.05;

/// Cells along one side of a block: blocks are skipped or meshed as a whole.
const BLOCK: u64 = 8;

/// Values along one side of a block.
const BLOCK_VALUES: usize = BLOCK as usize + 1;

/// The six tetrahedra of a cell, positively oriented; corners are numbered by bits x = 1, y = 2, z = 4.
const TETRAHEDRA: [[u8; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
    [0, 3, 2, 7],
    [0, 6, 4, 7],
];

/// A crossing of a grid edge: the edge's name and the crossing's position.
#[derive(Clone, Copy)]
struct Crossing {
    /// Number of the edge's first grid vertex times 8, plus the bits of the axes that it runs along.
    edge: u64,
    position: DVec3,
}

/// The surface of `field`, meshed on a grid of `cells`³ cells over the cube of half-size [`Field::extent`].
pub(super) fn polygonise(field: &impl Field, cells: u64) -> TriangleMesh {
    let grid = Grid {
        field,
        cells: cells.next_multiple_of(BLOCK),
        cell: 2.0 * field.extent() / cells.next_multiple_of(BLOCK) as f64,
    };
    let blocks = grid.cells / BLOCK;
    let corners: Vec<[Crossing; 3]> = (0..blocks.pow(3))
        .into_par_iter()
        .flat_map_iter(|b| {
            let block = U64Vec3::new(b % blocks, b / blocks % blocks, b / (blocks * blocks));
            grid.block_triangles(block * BLOCK)
        })
        .collect();

    let mut vertices: Vec<Crossing> = corners.iter().flatten().copied().collect();
    vertices.par_sort_unstable_by_key(|c| c.edge);
    vertices.dedup_by_key(|c| c.edge);
    let index_of = |c: Crossing| vertices.partition_point(|v| v.edge < c.edge) as u32;
    TriangleMesh {
        faces: corners.par_iter().map(|t| t.map(index_of)).collect(),
        positions: vertices.iter().map(|c| c.position).collect(),
        ..TriangleMesh::default()
    }
}

struct Grid<'a, F> {
    field: &'a F,
    cells: u64,
    /// Side of a cell, model units.
    cell: f64,
}

impl<F: Field> Grid<'_, F> {
    fn point(&self, vertex: U64Vec3) -> DVec3 {
        vertex.as_dvec3() * self.cell - DVec3::splat(self.field.extent())
    }

    /// The triangles in the block of cells whose first cell is `first`.
    fn block_triangles(&self, first: U64Vec3) -> Vec<[Crossing; 3]> {
        let mut triangles = Vec::new();
        let half = 0.5 * BLOCK as f64 * self.cell;
        let middle = self.point(first) + DVec3::splat(half);
        if self.field.value(middle).abs() > self.field.slope_bound() * half * 3.0_f64.sqrt() {
            return triangles;
        }
        let values = self.block_values(first);
        for z in 0..BLOCK {
            for y in 0..BLOCK {
                for x in 0..BLOCK {
                    self.cell_triangles(first, U64Vec3::new(x, y, z), &values, &mut triangles);
                }
            }
        }
        triangles
    }

    fn block_values(&self, first: U64Vec3) -> Vec<f64> {
        let mut values = Vec::with_capacity(BLOCK_VALUES.pow(3));
        for z in 0..=BLOCK {
            for y in 0..=BLOCK {
                for x in 0..=BLOCK {
                    values.push(self.field.value(self.point(first + U64Vec3::new(x, y, z))));
                }
            }
        }
        values
    }

    fn cell_triangles(
        &self,
        first: U64Vec3,
        cell: U64Vec3,
        values: &[f64],
        triangles: &mut Vec<[Crossing; 3]>,
    ) {
        let corner = |bits: u8| {
            let bits = u64::from(bits);
            cell + U64Vec3::new(bits & 1, bits >> 1 & 1, bits >> 2)
        };
        let value = |bits: u8| {
            let c = corner(bits);
            values[(c.x as usize) + BLOCK_VALUES * (c.y as usize + BLOCK_VALUES * c.z as usize)]
        };
        let inside = (0..8).fold(0_u8, |m, bits| m | u8::from(value(bits) < 0.0) << bits);
        if inside == 0 || inside == u8::MAX {
            return;
        }
        let crossing = |a: u8, b: u8| {
            // An edge's lower end has the fewer bits: both cells that share the edge name it alike.
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            let start = first + corner(low);
            let (from, to) = (value(low), value(high));
            let t = (from / (from - to)).clamp(EDGE_MARGIN, 1.0 - EDGE_MARGIN);
            let side = self.cells + 1;
            Crossing {
                edge: ((start.z * side + start.y) * side + start.x) * 8 + u64::from(high & !low),
                position: self.point(start).lerp(self.point(first + corner(high)), t),
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
}
