//! The zero set of a field as a closed mesh: marching tetrahedra on a grid that skips what is far from the surface.
//!
//! A caller that needs vertices exactly on the surface projects them afterwards: they keep [`EDGE_MARGIN`] away from the grid's nodes.

use glam::{DVec3, U64Vec3};
use rayon::prelude::*;
use silmap_geometry::TriangleMesh;
use silmap_geometry::tetrahedra::{Cell, Crossing, mesh};

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

/// The surface of `field`, meshed on a grid of `cells`³ cells over the cube of half-size [`Field::extent`].
pub(super) fn polygonise(field: &impl Field, cells: u64) -> TriangleMesh {
    let grid = Grid {
        field,
        cells: cells.next_multiple_of(BLOCK),
        cell: 2.0 * field.extent() / cells.next_multiple_of(BLOCK) as f64,
    };
    let blocks = grid.cells / BLOCK;
    let triangles: Vec<[Crossing; 3]> = (0..blocks.pow(3))
        .into_par_iter()
        .flat_map_iter(|b| {
            let block = U64Vec3::new(b % blocks, b / blocks % blocks, b / (blocks * blocks));
            grid.block_triangles(block * BLOCK)
        })
        .collect();
    mesh(&triangles)
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
        let side = self.cells + 1;
        let of_grid = Cell {
            values: std::array::from_fn(|bits| value(bits as u8)),
            node: |bits| {
                let c = first + corner(bits);
                (c.z * side + c.y) * side + c.x
            },
            position: |bits| self.point(first + corner(bits)),
            margin: EDGE_MARGIN,
        };
        of_grid.append(triangles);
    }
}
