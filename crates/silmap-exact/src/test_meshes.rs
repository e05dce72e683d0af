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

/// A torus of no special shape with every vertex moved a little at random, sometimes much.
pub(crate) fn bumpy_torus() -> impl Strategy<Value = TriangleMesh> {
    let noise = prop::collection::vec(prop::array::uniform3(-1.0..1.0), 14 * 9);
    (noise, prop_oneof![Just(0.01), Just(0.1), Just(0.6)]).prop_map(|(noise, size)| {
        let mut mesh = torus(14, 9);
        for (p, n) in mesh.positions.iter_mut().zip(noise) {
            *p += DVec3::from(n) * size;
        }
        mesh
    })
}

/// The surface of some unit cubes of a grid: whole faces lie in one plane, and eyes with whole coordinates in many.
/// Cubes that would make an edge with four faces are left out.
pub(crate) fn voxel_shape() -> impl Strategy<Value = TriangleMesh> {
    prop::collection::vec(prop::array::uniform3(0_i32..4), 1..24).prop_map(|wanted| {
        let mut cubes = Vec::new();
        for cube in wanted {
            if cubes.contains(&cube) {
                continue;
            }
            cubes.push(cube);
            if crate::EdgeMesh::new(&voxel_surface(&cubes)).is_err() {
                cubes.pop();
            }
        }
        voxel_surface(&cubes)
    })
}

fn voxel_surface(cubes: &[[i32; 3]]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut corners: Vec<[i32; 3]> = Vec::new();
    for &at in cubes {
        for axis in 0..3 {
            for step in [0, 1] {
                let mut beyond = at;
                beyond[axis] += 2 * step - 1;
                if cubes.contains(&beyond) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                // Counter-clockwise about the outward axis.
                let turn = [[0, 0], [1, 0], [1, 1], [0, 1]];
                let mut quad = turn.map(|[i, j]| {
                    let mut corner = at;
                    corner[axis] += step;
                    corner[u] += i;
                    corner[v] += j;
                    corner
                });
                if step == 0 {
                    quad.reverse();
                }
                let [a, b, c, d] = quad.map(|corner| {
                    let known = corners.iter().position(|&k| k == corner);
                    known.unwrap_or_else(|| {
                        corners.push(corner);
                        corners.len() - 1
                    }) as u32
                });
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh.positions = corners
        .iter()
        .map(|c| DVec3::from(c.map(f64::from)))
        .collect();
    mesh
}
