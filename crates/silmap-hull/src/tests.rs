//! Nesting of every level, and the guarantees around it.

use glam::DVec3;
use proptest::prelude::*;
use silmap_geometry::{Bvh, ClosedMesh, TriangleMesh};

use super::*;
use silmap_models as models;

/// Two levels may touch within rounding; in radii.
const TOUCHING: VerifyParams = VerifyParams {
    tolerance_rel: 1e-12,
    samples: 100,
};

fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::try_from(mesh).unwrap()
}

fn params(target_faces: u32) -> HullParams {
    HullParams {
        target_faces,
        ..HullParams::default()
    }
}

fn hull_of(mesh: &ClosedMesh, params: &HullParams) -> ProgressiveHull {
    build(mesh, params, &Watch::silent()).unwrap()
}

/// The surface of the cells of a 3-D grid for which `is_full` holds, two triangles a square.
fn cells(n: i32, is_full: impl Fn([i32; 3]) -> bool) -> TriangleMesh {
    let inside = |c: [i32; 3]| c.iter().all(|&i| (0..n).contains(&i)) && is_full(c);
    let mut mesh = TriangleMesh::default();
    let mut ids = std::collections::BTreeMap::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                let cell = [x, y, z];
                for (axis, step) in (0..3).flat_map(|a| [(a, 0), (a, 1)]) {
                    let mut beside = cell;
                    beside[axis] += 2 * step - 1;
                    if !inside(cell) || inside(beside) {
                        continue;
                    }
                    let quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                        let mut at = cell;
                        at[axis] += step;
                        at[(axis + 1) % 3] += u;
                        at[(axis + 2) % 3] += v;
                        let new = mesh.positions.len() as u32;
                        *ids.entry(at).or_insert_with(|| {
                            mesh.positions.push(DVec3::from_array(at.map(f64::from)));
                            new
                        })
                    });
                    let [a, b, c, d] = quad;
                    mesh.faces.extend(if step == 1 {
                        [[a, b, c], [a, c, d]]
                    } else {
                        [[a, c, b], [a, d, c]]
                    });
                }
            }
        }
    }
    mesh
}

fn tetrahedron() -> TriangleMesh {
    TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        ..TriangleMesh::default()
    }
}

fn joined(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for part in parts {
        let shift = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.faces
            .extend(part.faces.iter().map(|f| f.map(|v| v + shift)));
    }
    all
}

/// Every level encloses the next finer one, by winding numbers at vertices, crossings and random points.
fn assert_nested(hull: &ProgressiveHull, finest: &TriangleMesh) {
    let mut finer = finest.clone();
    for summary in hull.summaries().skip(1) {
        let level = hull.level(summary.faces);
        assert_eq!(level.mesh.faces.len(), summary.faces);
        assert!((level.volume_ratio - summary.volume_ratio).abs() < 1e-9);
        let (inside, outside) = if level.is_inner {
            (&level.mesh, &finer)
        } else {
            (&finer, &level.mesh)
        };
        let report = verify(inside, outside, &TOUCHING);
        assert!(report.encloses, "at {} faces: {report:?}", summary.faces);
        finer = level.mesh;
    }
}

#[test]
fn every_collapse_on_a_torus_nests() {
    let mesh = closed(models::torus(240));
    for inner in [false, true] {
        let hull = hull_of(
            &mesh,
            &HullParams {
                inner,
                ..params(60)
            },
        );
        assert_eq!(hull.least_faces(), 60);
        assert_nested(&hull, mesh.mesh());
    }
}

#[test]
fn every_collapse_on_a_grid_of_cubes_nests() {
    // Flat sides, and inner edges of all kinds: an L of cubes, and a block with a pit.
    let shapes = [
        cells(3, |[x, y, _]| x == 0 || y == 0),
        cells(4, |[x, y, z]| !(x == 1 && y == 2 && z >= 1)),
    ];
    for shape in shapes {
        let mesh = closed(shape);
        let hull = hull_of(&mesh, &params(20));
        assert!(
            hull.least_faces() <= 40,
            "stalled at {}",
            hull.least_faces()
        );
        assert_nested(&hull, mesh.mesh());
    }
}

#[test]
fn flat_sides_cost_no_volume() {
    let mesh = closed(cells(6, |_| true));
    let hull = hull_of(&mesh, &params(16));
    let level = hull.level(16);
    assert_eq!(level.mesh.faces.len(), 16);
    assert!(level.volume_ratio < 1.0 + 1e-6, "{}", level.volume_ratio);
}

#[test]
fn a_tetrahedron_stays_as_it_is() {
    let mesh = closed(tetrahedron());
    let hull = hull_of(&mesh, &params(4));
    assert_eq!(hull.least_faces(), 4);
    assert_eq!(hull.level(4).mesh, *mesh.mesh());
    assert_eq!(hull.level(4).surface_points, mesh.mesh().positions);
}

#[test]
fn parts_and_cavities_keep_their_winding() {
    let mut cavity = cells(2, |_| true);
    for p in &mut cavity.positions {
        *p = *p * 0.9 + DVec3::splat(1.1);
    }
    for f in &mut cavity.faces {
        f.swap(1, 2);
    }
    let mut beside = cells(3, |[x, y, _]| x != 1 || y != 1);
    for p in &mut beside.positions {
        p.x += 7.0;
    }
    let mesh = closed(joined(&[cells(4, |_| true), cavity, beside]));
    let hull = hull_of(&mesh, &params(40));
    assert_nested(&hull, mesh.mesh());
    let tree = Bvh::new(&hull.level(40).mesh);
    assert_eq!(tree.winding_number(DVec3::splat(0.5)), 1);
}

#[test]
fn inner_and_outer_hulls_bound_the_model_from_both_sides() {
    let mesh = closed(models::trefoil_knot(3000));
    let outer = hull_of(&mesh, &params(300)).level(300);
    let inner = hull_of(
        &mesh,
        &HullParams {
            inner: true,
            ..params(300)
        },
    )
    .level(300);
    assert!(inner.volume_ratio < 1.0 && outer.volume_ratio > 1.0);
    assert!(verify(&inner.mesh, mesh.mesh(), &VerifyParams::default()).encloses);
    assert!(verify(mesh.mesh(), &outer.mesh, &VerifyParams::default()).encloses);
    // And the other way about neither does.
    assert!(!verify(mesh.mesh(), &inner.mesh, &VerifyParams::default()).encloses);
    assert!(!verify(&outer.mesh, mesh.mesh(), &VerifyParams::default()).encloses);
}

#[test]
fn verify_sees_a_vertex_pushed_inward_and_a_shrunken_hull() {
    let mesh = closed(models::torus(4000));
    let level = hull_of(&mesh, &params(200)).level(200);
    assert!(verify(mesh.mesh(), &level.mesh, &VerifyParams::default()).encloses);

    let normals = level.mesh.vertex_normals();
    let push = mesh.bounds().radius * 0.05;
    for v in [0, 50] {
        let mut dented = level.mesh.clone();
        dented.positions[v] -= normals[v] * push;
        let report = verify(mesh.mesh(), &dented, &VerifyParams::default());
        assert!(!report.encloses && report.leaking_pairs > 0, "{report:?}");
        assert!(report.escaped_distance <= push * 1.01);
    }

    let mut small = level.mesh.clone();
    let center = mesh.bounds().center;
    for p in &mut small.positions {
        *p = center + (*p - center) * 0.99;
    }
    let report = verify(mesh.mesh(), &small, &VerifyParams::default());
    assert!(!report.encloses && report.escaped_rel > 1e-4, "{report:?}");
    assert!(
        !verify(
            mesh.mesh(),
            &TriangleMesh::default(),
            &VerifyParams::default()
        )
        .encloses
    );
}

#[test]
fn verify_allows_touching_and_hulls_that_pass_through_themselves() {
    let block = cells(3, |_| true);
    let report = verify(&block, &block, &VerifyParams::default());
    assert!(report.encloses && report.escaped_rel < 1e-12, "{report:?}");
    // Two boxes far larger than the parts they enclose, each crossing the other's part.
    let moved = |mesh: &TriangleMesh, by: DVec3, scale: f64| {
        let mut mesh = mesh.clone();
        for p in &mut mesh.positions {
            *p = *p * scale + by;
        }
        mesh
    };
    let parts = joined(&[block.clone(), moved(&block, DVec3::X * 4.0, 1.0)]);
    let around = joined(&[
        moved(&block, DVec3::splat(-2.0), 2.5),
        moved(&block, DVec3::new(2.0, -2.0, -2.0), 2.5),
    ]);
    let report = verify(&parts, &around, &VerifyParams::default());
    assert!(report.encloses && report.crossing_pairs > 0, "{report:?}");
}

#[test]
fn verify_counts_inside_out_parts_by_their_own_winding() {
    let inside_out = |scale: f64| {
        let mut block = cells(2, |_| true);
        for p in &mut block.positions {
            *p = (*p - DVec3::ONE) * scale;
        }
        for f in &mut block.faces {
            f.swap(1, 2);
        }
        block
    };
    // Twice inside out in the middle, the hull in a smaller part of it: its number is nowhere below the mesh's.
    let mesh = joined(&[inside_out(1.0), inside_out(0.6)]);
    let hull = joined(&[inside_out(1.0), inside_out(0.5)]);
    let report = verify(&mesh, &hull, &TOUCHING);
    assert!(report.encloses, "{report:?}");
    let report = verify(&hull, &mesh, &TOUCHING);
    assert!(
        !report.encloses && report.vertices_outside == 26,
        "{report:?}"
    );
}

#[test]
fn the_sequence_does_not_depend_on_scale() {
    let mesh = models::trefoil_knot(1500);
    let reference = hull_of(&closed(mesh.clone()), &params(150)).level(150);
    for exponent in [-40, -3, 5, 60] {
        let factor = f64::from(exponent).exp2();
        let mut scaled = mesh.clone();
        for p in &mut scaled.positions {
            *p *= factor;
        }
        let level = hull_of(&closed(scaled), &params(150)).level(150);
        assert_eq!(level.mesh.faces, reference.mesh.faces, "2^{exponent}");
        for (a, b) in level.mesh.positions.iter().zip(&reference.mesh.positions) {
            assert_eq!(*a, *b * factor);
        }
    }
}

#[test]
fn far_from_the_origin_it_still_encloses() {
    let mesh = models::trefoil_knot(1500);
    let reference = hull_of(&closed(mesh.clone()), &params(150)).level(150);
    for offset in [3.0, 1e3, 1e6] {
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            *p += DVec3::new(offset, -offset, 0.5 * offset);
        }
        let mesh = closed(moved);
        let level = hull_of(&mesh, &params(150)).level(150);
        assert_eq!(level.mesh.faces.len(), 150);
        assert!((level.volume_ratio / reference.volume_ratio - 1.0).abs() < 0.05);
        assert!(verify(mesh.mesh(), &level.mesh, &VerifyParams::default()).encloses);
    }
}

#[test]
fn rounding_to_single_precision_keeps_enclosing() {
    let mut mesh = models::torus(4000);
    for p in &mut mesh.positions {
        *p += DVec3::new(0.1, 0.7, -0.3);
    }
    let mesh = closed(mesh);
    let hull = hull_of(&mesh, &params(200));
    let rounded = hull.level(200).round();
    let single = rounded.mesh();
    let report = verify(mesh.mesh(), &single, &VerifyParams::default());
    assert!(
        report.encloses && report.escaped_distance <= rounded.leak * 1.001,
        "{report:?}"
    );
    assert!(rounded.leak <= 1e-7 * mesh.bounds().radius);
    assert!((single.volume() / mesh.mesh().volume() - rounded.volume_ratio).abs() < 1e-9);
}

#[test]
fn surface_points_lie_on_the_surface() {
    let mesh = closed(models::torus(3000));
    let level = hull_of(&mesh, &params(200)).level(200);
    let tree = Bvh::new(mesh.mesh());
    assert_eq!(level.surface_points.len(), level.mesh.positions.len());
    for (p, v) in level.surface_points.iter().zip(&level.mesh.positions) {
        assert!(tree.closest_point(*p).0.distance(*p) < 1e-9);
        assert!(p.distance(*v) <= level.distance + 1e-9);
    }
}

#[test]
fn limits_on_volume_and_distance_are_kept() {
    let mesh = closed(models::torus(3000));
    let hull = hull_of(
        &mesh,
        &HullParams {
            volume_ratio: Some(1.01),
            ..params(20)
        },
    );
    let level = hull.level(hull.least_faces());
    assert!(level.volume_ratio <= 1.01 && hull.least_faces() < 1500);
    let limit = 0.02 * mesh.bounds().radius;
    let hull = hull_of(
        &mesh,
        &HullParams {
            max_distance: Some(limit),
            ..params(20)
        },
    );
    let level = hull.level(hull.least_faces());
    let tree = Bvh::new(mesh.mesh());
    assert!(hull.least_faces() > 20);
    for p in &level.mesh.positions {
        assert!(tree.closest_point(*p).0.distance(*p) <= limit * (1.0 + 1e-9));
    }
}

#[test]
fn the_caller_can_stop_it() {
    let stop = std::sync::atomic::AtomicBool::new(true);
    let watch = Watch::new(&|_| {}, &stop);
    let mesh = closed(models::torus(1000));
    assert!(matches!(
        build(&mesh, &params(100), &watch),
        Err(HullError::Interrupted(_))
    ));
}

#[test]
fn bad_parameters_are_named() {
    let mesh = closed(tetrahedron());
    for bad in [
        params(3),
        HullParams {
            volume_ratio: Some(0.9),
            ..params(4)
        },
        HullParams {
            volume_ratio: Some(1.1),
            inner: true,
            ..params(4)
        },
        HullParams {
            max_distance: Some(f64::NAN),
            ..params(4)
        },
        HullParams {
            compactness_weight: -1.0,
            ..params(4)
        },
    ] {
        let error = build(&mesh, &bad, &Watch::silent());
        assert!(
            matches!(error, Err(HullError::BadParameter { .. })),
            "{bad:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn random_heaps_of_cubes_nest(full in prop::collection::vec(prop::bool::weighted(0.7), 27), inner: bool) {
        let shape = cells(3, |[x, y, z]| full[(x + 3 * y + 9 * z) as usize]);
        // Cubes that meet in an edge or corner only are not manifold.
        let Ok(mesh) = ClosedMesh::try_from(shape) else { return Ok(()) };
        let hull = hull_of(&mesh, &HullParams { inner, ..params(8) });
        assert_nested(&hull, mesh.mesh());
    }
}

#[test]
fn edges_of_a_vertex_of_many_are_not_gone_through_again_and_again() {
    let gone_through = |sides: u32| {
        super::collapse::BESIDE.set(0);
        let hull = hull_of(&closed(models::bicone(sides)), &params(200));
        assert!(hull.least_faces() <= 200);
        super::collapse::BESIDE.get()
    };
    let (few, many) = (gone_through(400), gone_through(1_600));
    // Four times as many collapses, and some more; the square would be sixteen times as much.
    assert!(many < 6 * few, "{few} and {many}");
}
