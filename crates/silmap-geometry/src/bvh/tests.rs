//! Tests of the tree against brute force, and of its edge cases.

use proptest::prelude::*;

use super::{ray::Ray, *};

/// A box from `min` to `max` with `n` × `n` squares a side.
fn grid_box(min: DVec3, max: DVec3, n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for axis in 0..3 {
        for side in 0..2_u32 {
            let first = mesh.positions.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    let mut at = DVec3::ZERO;
                    at[axis] = f64::from(side);
                    at[(axis + 1) % 3] = f64::from(i) / f64::from(n);
                    at[(axis + 2) % 3] = f64::from(j) / f64::from(n);
                    mesh.positions.push(min + (max - min) * at);
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let corner = |i: u32, j: u32| first + j * (n + 1) + i;
                    let quad = [
                        corner(i, j),
                        corner(i + 1, j),
                        corner(i + 1, j + 1),
                        corner(i, j + 1),
                    ];
                    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                        let face = [quad[a], quad[b], quad[c]];
                        mesh.faces.push(if side == 1 {
                            face
                        } else {
                            [face[0], face[2], face[1]]
                        });
                    }
                }
            }
        }
    }
    mesh
}

fn unit_box(n: u32) -> TriangleMesh {
    grid_box(DVec3::ZERO, DVec3::ONE, n)
}

#[test]
fn first_hit_is_the_near_side_in_lengths_of_the_direction() {
    let bvh = Bvh::new(&unit_box(7));
    let hit = bvh
        .first_hit(
            DVec3::new(0.31, 0.62, 5.0),
            DVec3::new(0.0, 0.0, -2.0),
            0.0,
            f64::INFINITY,
        )
        .expect("the ray runs into the box");
    assert!((hit.t - 2.0).abs() < 1e-12);
    assert!(hit.enters);
    assert!((hit.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let inside = bvh.all_hits(DVec3::new(0.31, 0.62, 5.0), DVec3::new(0.0, 0.0, -2.0));
    assert_eq!(inside.len(), 2);
    assert!(!inside[1].enters && (inside[1].t - 2.5).abs() < 1e-12);
    assert!(
        bvh.first_hit(DVec3::new(0.31, 0.62, 5.0), DVec3::Z, 0.0, f64::INFINITY)
            .is_none()
    );
    assert!(
        bvh.first_hit(DVec3::new(0.31, 0.62, 5.0), -DVec3::Z, 0.0, 3.9)
            .is_none()
    );
    assert!(
        bvh.first_hit(DVec3::new(0.31, 0.62, 5.0), DVec3::ZERO, 0.0, 9.0)
            .is_none()
    );
}

#[test]
fn no_ray_slips_through_edges_and_vertices() {
    let mesh = unit_box(8);
    let bvh = Bvh::new(&mesh);
    for eye in [DVec3::new(0.5, 0.5, 0.5), DVec3::new(0.3, 0.7, 0.1)] {
        let targets = mesh
            .positions
            .iter()
            .copied()
            .chain(mesh.faces.iter().flat_map(|f| {
                [0, 1, 2].map(|k| {
                    mesh.positions[f[k] as usize].midpoint(mesh.positions[f[(k + 1) % 3] as usize])
                })
            }));
        for target in targets {
            let hit = bvh.first_hit(eye, target - eye, 0.0, f64::INFINITY);
            assert!(
                hit.is_some_and(|h| (h.t - 1.0).abs() < 1e-9),
                "{eye} to {target}: {hit:?}"
            );
        }
    }
}

#[test]
fn rays_along_an_axis_in_the_plane_of_a_side_do_not_invent_hits_beyond_it() {
    let bvh = Bvh::new(&unit_box(4));
    let hits = bvh.all_hits(DVec3::new(-1.0, 0.5, 1.0 + 1e-9), DVec3::X);
    assert!(hits.is_empty());
    let hits = bvh.all_hits(DVec3::new(-1.0, 0.5, 1.0), DVec3::X);
    assert!(
        !hits.is_empty(),
        "a ray within a side meets the sides it ends at"
    );
}

#[test]
fn winding_counts_overlapping_and_reversed_parts() {
    let mut mesh = unit_box(3);
    let second = grid_box(DVec3::splat(0.5), DVec3::splat(1.5), 3);
    let shift = mesh.positions.len() as u32;
    mesh.positions.extend(&second.positions);
    mesh.faces
        .extend(second.faces.iter().map(|f| f.map(|v| v + shift)));
    let bvh = Bvh::new(&mesh);
    assert_eq!(bvh.winding_number(DVec3::splat(0.25)), 1);
    assert_eq!(bvh.winding_number(DVec3::splat(0.75)), 2);
    assert_eq!(bvh.winding_number(DVec3::splat(1.25)), 1);
    assert_eq!(bvh.winding_number(DVec3::splat(1.75)), 0);
    for face in &mut mesh.faces {
        face.swap(1, 2);
    }
    assert_eq!(Bvh::new(&mesh).winding_number(DVec3::splat(0.75)), -2);
    assert_eq!(bvh.solid_angle_number(DVec3::splat(0.75)), 2);
}

#[test]
fn an_empty_mesh_has_no_hits() {
    let bvh = Bvh::new(&TriangleMesh::default());
    assert!(bvh.is_empty());
    assert!(bvh.first_hit(DVec3::ZERO, DVec3::X, 0.0, 1.0).is_none());
    assert!(bvh.all_hits(DVec3::ZERO, DVec3::X).is_empty());
    assert_eq!(bvh.winding_number(DVec3::ZERO), 0);
    assert!(bvh.closest_point_within(DVec3::ZERO, 1.0).is_none());
}

#[test]
fn many_copies_of_one_face_still_make_a_tree() {
    let mut mesh = TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        ..TriangleMesh::default()
    };
    mesh.faces = vec![[0, 1, 2]; 1000];
    let bvh = Bvh::new(&mesh);
    let hits = bvh.all_hits(DVec3::new(0.2, 0.2, 1.0), -DVec3::Z);
    assert_eq!(hits.len(), 1000);
    assert!(hits.windows(2).all(|w| w[0].face < w[1].face));
}

/// A soup of triangles on a coarse grid, so that shared edges, degenerate faces and rays through vertices are common.
fn grid_soup() -> impl Strategy<Value = TriangleMesh> {
    (
        prop::collection::vec(prop::array::uniform9(-3_i32..4), 1..60),
        -40_i32..40,
        prop::sample::select(vec![0.0, 1e3, -1e6]),
    )
        .prop_map(|(triangles, exponent, offset)| {
            let scale = f64::from(exponent).exp2();
            let mut mesh = TriangleMesh::default();
            for t in triangles {
                let first = mesh.positions.len() as u32;
                for k in 0..3 {
                    let at = [0, 1, 2].map(|c| f64::from(t[3 * k + c]) + offset);
                    mesh.positions.push(DVec3::from_array(at) * scale);
                }
                mesh.faces.push([first, first + 1, first + 2]);
            }
            mesh
        })
}

proptest! {
    #[test]
    fn queries_agree_with_brute_force(
        mesh in grid_soup(),
        origin in prop::array::uniform3(-8_i32..9),
        toward in prop::array::uniform3(-8_i32..9),
    ) {
        let bvh = Bvh::new(&mesh);
        // The same grid as the mesh, so that rays graze on purpose.
        let unit = mesh.bounds();
        let step = 1.0 / bvh.scale;
        let at = |p: [i32; 3]| unit.center + DVec3::from_array(p.map(f64::from)) * (step * 0.25);
        let (origin, direction) = (at(origin), at(toward) - at(origin));
        let mut expected: Vec<Hit> = Vec::new();
        if let Some(ray) = Ray::new(origin, direction, bvh.scale) {
            for (i, corners) in bvh.triangles.iter().enumerate() {
                if let Some(hit) = ray.meets(corners) && hit.t >= 0.0 {
                    expected.push(Hit {
                        t: hit.t, face: bvh.face_ids[i], barycentric: hit.barycentric, enters: hit.enters,
                    });
                }
            }
        }
        expected.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)));
        let hits = bvh.all_hits(origin, direction);
        prop_assert_eq!(&hits, &expected);
        prop_assert_eq!(bvh.first_hit(origin, direction, 0.0, f64::INFINITY), expected.first().copied());

        let (point, face, weights) = bvh.closest_point(origin);
        let brute = (0..mesh.faces.len())
            .map(|f| {
                let c = mesh.corners(f);
                let w = closest::closest_weights(origin, c);
                (c[0] + (c[1] - c[0]) * w[1] + (c[2] - c[0]) * w[2]).distance(origin)
            })
            .fold(f64::INFINITY, f64::min);
        prop_assert!((point.distance(origin) - brute).abs() <= 1e-9 * step + 1e-15 * unit.center.length());
        prop_assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)));
        prop_assert!((face as usize) < mesh.faces.len());

        let (low, high) = (origin.min(origin + direction), origin.max(origin + direction));
        let mut found = Vec::new();
        bvh.overlapping_faces(low, high, |f| found.push(f));
        found.sort_unstable();
        let expected: Vec<u32> = (0..mesh.faces.len())
            .filter(|&f| {
                let [a, b, c] = mesh.corners(f);
                boxes_meet(a.min(b).min(c), a.max(b).max(c), low, high)
            })
            .map(|f| f as u32)
            .collect();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn winding_of_a_box_is_exact_next_to_its_sides(
        p in prop::array::uniform3(0_u32..9),
        nudge in prop::array::uniform3(-1_i8..2),
        offset in prop::sample::select(vec![0.0, 1024.0, -65536.0]),
    ) {
        let shift = DVec3::splat(offset);
        let bvh = Bvh::new(&grid_box(shift, shift + DVec3::ONE, 4));
        let mut at = DVec3::from_array(p.map(|c| f64::from(c) / 8.0)) + shift;
        for (coordinate, n) in at.as_mut().iter_mut().zip(nudge) {
            let step = coordinate.abs().max(1.0) * f64::EPSILON;
            *coordinate += f64::from(n) * step;
        }
        let local = at - shift;
        let is_on = local.min_element() == 0.0 || local.max_element() == 1.0;
        let is_inside = local.min_element() > 0.0 && local.max_element() < 1.0;
        let winding = bvh.winding_number(at);
        if is_on {
            prop_assert!(winding == 0 || winding == 1);
        } else {
            prop_assert_eq!(winding, i32::from(is_inside));
        }
    }
}
