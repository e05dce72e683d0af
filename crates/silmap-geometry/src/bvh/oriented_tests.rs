//! Queries against fans and needles: correct, and in sublinear time.

use std::hint::black_box;

use glam::{DMat3, DQuat};
use proptest::prelude::*;

use super::super::LOOKED_AT;
use super::*;
use crate::TriangleMesh;

/// Two cones base to base: `sides` faces meet in each apex. Turned, so that nothing lies along an axis.
fn bicone(sides: u32) -> TriangleMesh {
    let turn = DMat3::from_quat(DQuat::from_xyzw(0.3, -0.5, 0.1, 0.8).normalize());
    let mut mesh = TriangleMesh {
        positions: vec![turn * DVec3::Z, turn * -DVec3::Z],
        ..TriangleMesh::default()
    };
    for i in 0..sides {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
        mesh.positions.push(turn * DVec3::new(cos, sin, 0.0));
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        mesh.faces.extend([[0, a, b], [1, b, a]]);
    }
    mesh
}

/// A long cylinder of `sides` sides without lids, turned in the same way.
fn pipe(sides: u32) -> TriangleMesh {
    let mut mesh = bicone(sides);
    let axis = mesh.positions[0] * 3.0;
    let rim = mesh.positions.split_off(2);
    mesh.positions = rim.iter().flat_map(|&p| [p + axis, p - axis]).collect();
    mesh.faces.clear();
    for i in 0..sides {
        let (a, b) = (2 * i, 2 * ((i + 1) % sides));
        mesh.faces.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    mesh
}

/// Points about the model: all directions, near and far, above the apex and in the rim's plane.
fn places(mesh: &TriangleMesh) -> Vec<DVec3> {
    let apex = mesh.positions[0];
    let mut places = vec![apex * 1.3, apex * 1.001, apex * 1.1 + DVec3::splat(0.02)];
    for k in 0..60 {
        let (turn, lift) = (f64::from(k) * 2.399, f64::from(k % 11) / 5.5 - 1.0);
        let ring = (1.0 - lift * lift).max(0.0).sqrt();
        let direction = DVec3::new(ring * turn.cos(), ring * turn.sin(), lift);
        places.push(direction * (0.3 + 0.1 * f64::from(k % 13)));
    }
    places
}

/// Faces that the queries from all those places look at, on average.
fn looked_at(mesh: &TriangleMesh) -> [f64; 3] {
    let bvh = Bvh::new(mesh);
    let places = places(mesh);
    let mean = |query: &dyn Fn(DVec3)| {
        LOOKED_AT.set(0);
        places.iter().for_each(|&p| query(p));
        LOOKED_AT.get() as f64 / places.len() as f64
    };
    [
        mean(&|p| {
            black_box(bvh.closest_point(p));
        }),
        mean(&|p| {
            black_box(bvh.first_hit(p, DVec3::new(0.02, 0.01, 0.03) - p, 0.0, f64::INFINITY));
        }),
        mean(&|p| {
            black_box(bvh.winding_number(p));
        }),
    ]
}

#[test]
fn few_faces_of_a_fan_are_looked_at() {
    for model in [bicone, pipe] {
        let (few, many) = (looked_at(&model(500)), looked_at(&model(8_000)));
        for (few, many) in few.into_iter().zip(many) {
            // Sixteen times as many faces: those next to the apex alone grow faster than the tree's depth.
            assert!(many < 5.0 * few && many < 80.0, "{few} {many}");
        }
    }
}

#[test]
fn without_further_bounds_a_share_of_all_faces_is_looked_at() {
    let mesh = bicone(4_000);
    let mut bvh = Bvh::new(&mesh);
    for node in &mut bvh.nodes {
        node.oriented = NOT_ORIENTED;
    }
    LOOKED_AT.set(0);
    for p in places(&mesh) {
        black_box(bvh.closest_point(p));
    }
    assert!(LOOKED_AT.get() / places(&mesh).len() > 200);
}

#[test]
fn compact_faces_have_boxes_alone() {
    let cube = [0, 1, 2, 3, 4, 5, 6, 7]
        .map(|i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)));
    let mesh = TriangleMesh {
        positions: cube.to_vec(),
        faces: vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
        ],
        ..TriangleMesh::default()
    };
    assert!(Bvh::new(&mesh).oriented.is_empty());
}

proptest! {
    #[test]
    fn fans_are_found_as_by_brute_force(
        sides in 3_u32..90,
        kind in 0..2_u8,
        origin in prop::array::uniform3(-2.0..2.0_f64),
        toward in prop::array::uniform3(-1.0..1.0_f64),
        offset in prop::sample::select(vec![0.0, 1e5]),
    ) {
        let mut mesh = if kind == 0 { bicone(sides) } else { pipe(sides) };
        let shift = DVec3::new(offset, -offset, 0.3 * offset);
        mesh.positions.iter_mut().for_each(|p| *p += shift);
        let bvh = Bvh::new(&mesh);
        let (origin, toward) = (DVec3::from(origin) + shift, DVec3::from(toward) + shift);
        let (point, _, _) = bvh.closest_point(origin);
        let distances = (0..mesh.faces.len()).map(|f| {
            let c = mesh.corners(f);
            let w = super::super::closest_weights(origin, c);
            (c[0] + (c[1] - c[0]) * w[1] + (c[2] - c[0]) * w[2]).distance(origin)
        });
        let nearest = distances.fold(f64::INFINITY, f64::min);
        prop_assert!((point.distance(origin) - nearest).abs() <= 1e-11 + 1e-14 * offset);
        let mut plain = bvh.clone();
        for node in &mut plain.nodes {
            node.oriented = NOT_ORIENTED;
        }
        prop_assert_eq!(
            bvh.all_hits(origin, toward - origin),
            plain.all_hits(origin, toward - origin)
        );
        prop_assert_eq!(
            bvh.first_hit(origin, toward - origin, 0.0, f64::INFINITY),
            plain.first_hit(origin, toward - origin, 0.0, f64::INFINITY)
        );
    }

    #[test]
    fn no_face_that_meets_a_triangle_is_left_out(
        sides in 3_u32..90,
        kind in 0..2_u8,
        corners in prop::array::uniform9(-1.2..1.2_f64),
        size in prop::sample::select(vec![1.0, 0.1]),
    ) {
        let mesh = if kind == 0 { bicone(sides) } else { pipe(sides) };
        let bvh = Bvh::new(&mesh);
        let [x, y, z, rest @ ..] = corners;
        let from = DVec3::new(x, y, z);
        let triangle = [0, 1].map(|k| from + DVec3::new(rest[3 * k], rest[3 * k + 1], rest[3 * k + 2]) * size);
        let triangle = [from, triangle[0], triangle[1]];
        let [a, b, c] = triangle;
        let bounds = (a.min(b).min(c), a.max(b).max(c));
        let meets = |f: &u32| crate::predicates::triangles_cross(triangle, mesh.corners(*f as usize));
        let (mut all, mut near) = (Vec::new(), Vec::new());
        bvh.overlapping_faces(bounds.0, bounds.1, |f| all.push(f));
        bvh.faces_near_hull(bounds, &triangle, |f| near.push(f));
        // The same order, and the same faces that matter.
        let mut rest = all.iter();
        prop_assert!(near.iter().all(|f| rest.any(|g| f == g)));
        all.retain(meets);
        near.retain(meets);
        prop_assert_eq!(all, near);
    }
}
