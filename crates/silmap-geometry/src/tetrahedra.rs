//! Marching tetrahedra: the triangles in one cell of a grid where a field changes its sign, and all cells' triangles as a mesh.
//!
//! Each cell is cut into six tetrahedra about its main diagonal, the same way in every cell, so that neighbours agree on their shared
//! faces. A change of sign along an edge of a tetrahedron is a vertex, named by the edge, so that cells need not know of each other. The
//! mesh is a manifold without boundary whatever the signs are, provided that the field is positive on the border of the grid.
//!
//! Source: Doi, Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells. IEICE Transactions
//! E74(1), 1991. The cells' cut is Freudenthal's triangulation of the cube.
//! Deviation: crossings keep a margin away from the nodes, so that no triangle is degenerate.

use glam::DVec3;

use crate::TriangleMesh;

/// The six tetrahedra of a cell, positively oriented; corners are numbered by bits x = 1, y = 2, z = 4.
const TETRAHEDRA: [[u8; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
    [0, 3, 2, 7],
    [0, 6, 4, 7],
];

/// Where the field changes its sign on an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Number of the edge's first node times 8, and the bits of the axes that it runs along.
    pub edge: u64,
    /// Where.
    pub position: DVec3,
}

/// A cell of the grid; its corners are numbered by bits x = 1, y = 2, z = 4.
#[derive(Clone, Copy, Debug)]
pub struct Cell<N, P> {
    /// The field at its corners, negative inside.
    pub values: [f64; 8],
    /// The number of a corner's node, the same in all cells that share it; numbers grow along each axis.
    pub node: N,
    /// Where a corner is.
    pub position: P,
    /// Least distance of a crossing from the ends of its edge, as a share of it.
    pub margin: f64,
}

impl<N: Fn(u8) -> u64, P: Fn(u8) -> DVec3> Cell<N, P> {
    /// Appends the triangles in the cell, counter-clockwise from outside.
    pub fn append(&self, triangles: &mut Vec<[Crossing; 3]>) {
        let inside = (0..8).fold(0_u8, |m, bits| {
            m | u8::from(self.values[bits] < 0.0) << bits
        });
        if inside == 0 || inside == u8::MAX {
            return;
        }
        let crossing = |a: u8, b: u8| self.crossing(a, b);
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

    fn crossing(&self, a: u8, b: u8) -> Crossing {
        // An edge's lower end has the fewer bits: all cells that share the edge name it alike.
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let (from, to) = (
            self.values[usize::from(low)],
            self.values[usize::from(high)],
        );
        let t = (from / (from - to)).clamp(self.margin, 1.0 - self.margin);
        Crossing {
            edge: (self.node)(low) * 8 + u64::from(high & !low),
            position: (self.position)(low).lerp((self.position)(high), t),
        }
    }
}

/// The triangles of all cells as a mesh: one vertex for each edge, in the order of their numbers. Where cells put the crossing of an edge
/// differently, the first one's counts.
#[must_use]
pub fn mesh(triangles: &[[Crossing; 3]]) -> TriangleMesh {
    let corner = |k: u32| &triangles[k as usize / 3][k as usize % 3];
    let mut order: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    order.sort_unstable_by_key(|&k| (corner(k).edge, k));
    let mut mesh = TriangleMesh {
        faces: vec![[0; 3]; triangles.len()],
        ..TriangleMesh::default()
    };
    let mut last = None;
    for k in order {
        let crossing = corner(k);
        if last != Some(crossing.edge) {
            mesh.positions.push(crossing.position);
            last = Some(crossing.edge);
        }
        mesh.faces[k as usize / 3][k as usize % 3] = mesh.positions.len() as u32 - 1;
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ClosedMesh;
    use proptest::prelude::*;

    const NODES: usize = 5;

    /// The surface of values at the nodes of a grid whose border is outside.
    fn surface(values: &[f64]) -> TriangleMesh {
        let value = |p: [usize; 3]| {
            let is_border = p.iter().any(|&c| c == 0 || c == NODES - 1);
            let inner = values[p[0] + NODES * (p[1] + NODES * p[2])];
            if is_border { 1.0 } else { inner }
        };
        let mut triangles = Vec::new();
        let cells = NODES - 1;
        for k in 0..cells.pow(3) {
            let first = [k % cells, k / cells % cells, k / (cells * cells)];
            let corner = |bits: u8| {
                let step = |axis: usize| usize::from(bits >> axis & 1);
                [0, 1, 2].map(|axis| first[axis] + step(axis))
            };
            let cell = Cell {
                values: std::array::from_fn(|bits| value(corner(bits as u8))),
                node: |bits| {
                    let [x, y, z] = corner(bits);
                    (x + NODES * (y + NODES * z)) as u64
                },
                position: |bits| DVec3::from(corner(bits).map(|c| c as f64)),
                margin: 0.05,
            };
            cell.append(&mut triangles);
        }
        mesh(&triangles)
    }

    proptest! {
        /// Whatever the signs, the surface is a closed manifold, oriented outward: its volume is that of what is inside, about.
        #[test]
        fn the_surface_is_closed(values in prop::collection::vec(-1.0..1.0_f64, NODES.pow(3))) {
            let found = surface(&values);
            prop_assume!(!found.faces.is_empty());
            let volume = found.volume();
            let closed = ClosedMesh::try_from(found);
            prop_assert!(closed.is_ok(), "{:?}", closed.err());
            prop_assert!(volume > 0.0, "{volume}");
        }
    }

    /// One node inside, half-way to its neighbours: the tetrahedra about a node make a rhombic dodecahedron's relative, known by its volume.
    #[test]
    fn one_node_inside_is_enclosed() {
        let mut values = vec![1.0; NODES.pow(3)];
        values[2 + NODES * (2 + NODES * 2)] = -1.0;
        let found = surface(&values);
        // 24 tetrahedra of a volume of 1/6 each, cut to half their size, meet in a node.
        assert!((found.volume() - 24.0 / 6.0 / 8.0).abs() < 1e-12);
        assert_eq!(found.bounds().center, DVec3::splat(2.0));
    }
}
