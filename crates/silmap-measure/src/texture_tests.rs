//! Small models whose pictures are known, and what is measured of them.

use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::{Bvh, ClosedMesh, TriangleMesh};
use silmap_map::{CoarseHull, TextureSet};
use silmap_preprocess::texture::{Parametrisation, TextureParams, bake};

use super::*;

/// The cube [−1, 1]³.
fn cube() -> (ClosedMesh, Bvh) {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let sides = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mesh = TriangleMesh {
        positions: (0..8)
            .map(|i| DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)))
            .collect(),
        faces: (sides.iter())
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        ..TriangleMesh::default()
    };
    let mesh = ClosedMesh::try_from(mesh).unwrap();
    let bvh = Bvh::new(mesh.mesh());
    (mesh, bvh)
}

/// The cube a tenth larger; P(v) are the corners of the cube itself.
fn cube_hull() -> CoarseHull {
    let (mesh, _) = cube();
    let mesh = mesh.mesh();
    let single = |scale: f64| -> Vec<[f32; 3]> {
        let scaled = mesh.positions.iter().map(|p| *p * scale);
        scaled.map(|p| p.as_vec3().to_array()).collect()
    };
    CoarseHull {
        positions: single(1.1),
        surface_points: single(1.0),
        faces: mesh.faces.clone(),
        volume_ratio: 1.331,
    }
}

fn small_params() -> TextureParams {
    TextureParams {
        views: 6,
        size_px: 96,
        atlas_px: 96,
        candidates: 60,
        ..TextureParams::default()
    }
}

fn bake_cube(params: &TextureParams) -> TextureSet {
    let (mesh, bvh) = cube();
    bake(&mesh, &bvh, &cube_hull(), params, &Watch::silent()).unwrap()
}

#[test]
fn more_views_see_more_of_a_cube() {
    let hull = cube_hull();
    let with = |views| {
        let params = TextureParams {
            views,
            ..small_params()
        };
        painting(&hull, &bake_cube(&params), 1.0)
    };
    let (none, one, six) = (with(0), with(1), with(6));
    assert_eq!((none.views, none.merit, none.atlas_share), (0, 0.0, 1.0));
    assert_eq!(one.views, 1);
    // A corner view sees three of six sides, each at 1/√3.
    assert!(one.atlas_share > 0.45 && one.atlas_share < 0.9, "{one:?}");
    assert!(one.merit > 0.15 && one.merit < 0.4, "{one:?}");
    assert_eq!(six.views, 6);
    assert!(six.atlas_share == 0.0 && six.merit > 0.75, "{six:?}");
    assert!(six.views_per_face >= 1.0);
}

/// A block with a groove of a V along its top.
fn grooved_block() -> ClosedMesh {
    let profile = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.5, 1.0],
        [0.0, 0.3],
        [-0.5, 1.0],
        [-1.0, 1.0],
    ];
    let n = profile.len() as u32;
    let layer = |z: f64| profile.map(|[x, y]| DVec3::new(x, y, z));
    let caps = [[4, 5, 6], [4, 6, 0], [4, 0, 1], [4, 1, 2], [4, 2, 3]];
    let mut faces: Vec<[u32; 3]> = caps
        .into_iter()
        .flat_map(|[a, b, c]| [[a, c, b], [a + n, b + n, c + n]])
        .collect();
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    let mesh = TriangleMesh {
        positions: [layer(-1.0), layer(1.0)].concat(),
        faces,
        ..TriangleMesh::default()
    };
    ClosedMesh::try_from(mesh).unwrap()
}

#[test]
fn over_a_hollow_the_closest_point_jumps_and_the_normal_does_not() {
    let block = grooved_block();
    let bvh = Bvh::new(block.mesh());
    // A patch over the groove alone: what lies beside the block has other places to jump at.
    let mut hull = cube_hull();
    for p in &mut hull.positions {
        *p = [0.8 * p[0], p[1], 0.8 * p[2]];
    }
    hull.faces = hull.faces[6..8].to_vec();
    let textures = bake(&block, &bvh, &hull, &small_params(), &Watch::silent()).unwrap();
    let atlas = textures.atlas.unwrap();
    let count = |how| discontinuities((block.mesh(), &bvh), &hull, &atlas, how);
    let (normal, closest) = (
        count(Parametrisation::NormalShooting),
        count(Parametrisation::ClosestPoint),
    );
    assert_eq!(normal.texels, closest.texels);
    assert!(closest.jumps > 10, "{closest:?}");
    assert_eq!(normal.jumps, 0, "{normal:?}, {closest:?}");
    // Over a cube neither has where to jump.
    let (cube, bvh) = cube();
    for how in Parametrisation::ALL {
        let found = discontinuities((cube.mesh(), &bvh), &hull, &atlas, how);
        assert_eq!(found.jumps, 0, "{how:?}: {found:?}");
    }
}
