//! Small closed meshes for this crate's tests.

use glam::DVec3;
use proptest::prelude::*;
use silmap_geometry::TriangleMesh;

/// The unit cube, twelve faces.
pub(crate) fn cube() -> TriangleMesh {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    TriangleMesh {
        positions: (0..8).map(corner).collect(),
        faces: sides
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        ..TriangleMesh::default()
    }
}

/// A torus about the y axis with radii 1 and 0.4.
pub(crate) fn torus(rings: u32, sides: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..rings {
        let (sin_u, cos_u) = (std::f64::consts::TAU * f64::from(i) / f64::from(rings)).sin_cos();
        for j in 0..sides {
            let (sin_v, cos_v) =
                (std::f64::consts::TAU * f64::from(j) / f64::from(sides)).sin_cos();
            let r = 1.0 + 0.4 * cos_v;
            mesh.positions
                .push(DVec3::new(r * cos_u, 0.4 * sin_v, r * sin_u));
            let id = |i: u32, j: u32| i % rings * sides + j % sides;
            let [a, b, c, d] = [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The connectivity of a small torus with every vertex anywhere on a small grid: flat faces, repeated points and
/// self-intersections are common.
pub(crate) fn shaken_torus() -> impl Strategy<Value = TriangleMesh> {
    prop::collection::vec(prop::array::uniform3(-3_i32..=3), 12).prop_map(|points| TriangleMesh {
        positions: points
            .iter()
            .map(|p| DVec3::from(p.map(f64::from)))
            .collect(),
        ..torus(4, 3)
    })
}
