//! All methods give the same directed edges, whatever the mesh and wherever the eye.

use glam::DVec3;
use proptest::prelude::*;
use silmap_geometry::TriangleMesh;

use crate::test_meshes::{bumpy_torus, cube, shaken_torus, torus, voxel_shape};
use crate::{DirectedEdge, EdgeMesh, ExtractionMethod, Extractor, Viewpoint, silhouette_edges};
use silmap_models::{bicone, flat_drum};

/// The definition, edge by edge, with the exact predicate.
fn by_definition(mesh: &EdgeMesh, viewpoint: &Viewpoint) -> Vec<DirectedEdge> {
    let sees = |face: u32| {
        let corners = mesh.faces()[face as usize].map(|v| mesh.positions()[v as usize]);
        viewpoint.sees_front_of(corners)
    };
    let mut found = Vec::new();
    for (e, &[left, right]) in mesh.edges().iter().zip(mesh.edge_faces()) {
        match (sees(left), sees(right)) {
            (true, false) => found.push(*e),
            (false, true) => found.push(DirectedEdge {
                from: e.to,
                to: e.from,
            }),
            _ => {}
        }
    }
    found.sort_unstable();
    found
}

/// Asserts that every method finds what the definition says, for viewpoints one after the other.
fn check(mesh: &TriangleMesh, viewpoints: &[Viewpoint]) -> Result<usize, TestCaseError> {
    let edge_mesh = EdgeMesh::new(mesh).expect("the test meshes are manifold");
    let mut found = Vec::new();
    let mut most = 0;
    for &method in ExtractionMethod::ALL {
        let mut extractor = Extractor::new(&edge_mesh, method);
        for viewpoint in viewpoints {
            extractor.extract(viewpoint, &mut found);
            found.sort_unstable();
            let wanted = by_definition(&edge_mesh, viewpoint);
            prop_assert_eq!(&found, &wanted, "{} from {:?}", method, viewpoint);
            most = most.max(found.len());
        }
    }
    Ok(most)
}

/// Whole numbers: eyes in face planes, on vertices and within the mesh are common.
fn grid_viewpoints() -> impl Strategy<Value = Vec<Viewpoint>> {
    let viewpoint = (prop::array::uniform3(-8_i32..9), any::<bool>()).prop_map(|(p, is_eye)| {
        let p = DVec3::from(p.map(f64::from));
        if is_eye || p == DVec3::ZERO {
            Viewpoint::Eye(p)
        } else {
            Viewpoint::Direction(p)
        }
    });
    prop::collection::vec(viewpoint, 1..6)
}

/// What [`special_viewpoint`] makes a viewpoint of: a kind, a face, and three numbers.
type Seed = (u8, usize, [f64; 3]);

fn seeds() -> impl Strategy<Value = Vec<Seed>> {
    let seed = (0..5_u8, 0..10_000_usize, prop::array::uniform3(-4.0..4.0));
    prop::collection::vec(seed, 1..6)
}

/// A viewpoint anywhere, as nearly in a face's plane as rounding allows, far away, or along a face.
fn special_viewpoint(mesh: &TriangleMesh, (kind, face, p): Seed) -> Viewpoint {
    let [a, b, c] = mesh.corners(face % mesh.faces.len());
    let along = (b - a) * p[0] + (c - a) * p[1];
    match kind {
        0 => Viewpoint::Eye(DVec3::from(p)),
        1 => Viewpoint::Eye(a + along),
        2 => Viewpoint::Eye(a + along * 1e12),
        3 => Viewpoint::Direction(along),
        _ => Viewpoint::Direction(DVec3::from(p)),
    }
}

proptest! {
    #[test]
    fn methods_agree_on_voxel_shapes(mesh in voxel_shape(), viewpoints in grid_viewpoints()) {
        check(&mesh, &viewpoints)?;
    }

    #[test]
    fn methods_agree_on_degenerate_meshes(mesh in shaken_torus(), viewpoints in grid_viewpoints()) {
        check(&mesh, &viewpoints)?;
    }

    #[test]
    fn methods_agree_on_rough_meshes(mesh in bumpy_torus(), seeds in seeds()) {
        let viewpoints: Vec<_> = seeds.iter().map(|&s| special_viewpoint(&mesh, s)).collect();
        check(&mesh, &viewpoints)?;
    }

    #[test]
    fn methods_agree_far_from_the_origin(mesh in bumpy_torus(), seeds in seeds(), lift in -1e6..1e6) {
        let mut mesh = mesh;
        let shift = DVec3::new(lift, -0.7 * lift, 0.3 * lift);
        mesh.positions.iter_mut().for_each(|p| *p += shift);
        let viewpoints: Vec<_> = seeds.iter().map(|&s| special_viewpoint(&mesh, s)).collect();
        check(&mesh, &viewpoints)?;
    }
}

#[test]
fn methods_agree_where_many_faces_meet() {
    let viewpoints: Vec<Viewpoint> = [
        // From beside, from above within and without the cone that all faces of one side look to, in the plane of a cap, and
        // from a corner.
        Viewpoint::Eye(DVec3::new(3.0, 0.4, 0.2)),
        Viewpoint::Eye(DVec3::new(0.1, 0.0, 3.0)),
        Viewpoint::Eye(DVec3::new(2.5, 0.1, 1.0)),
        Viewpoint::Eye(DVec3::new(1.0, 0.0, 0.0)),
        Viewpoint::Eye(DVec3::new(0.0, 0.0, 1.0)),
        Viewpoint::Direction(DVec3::new(0.0, 1.0, 0.0)),
        Viewpoint::Direction(DVec3::new(0.3, -0.2, 1.0)),
    ]
    .into();
    for sides in [33, 64, 400] {
        for fan in [bicone, flat_drum] {
            let most = check(&fan(sides), &viewpoints).expect("all methods agree");
            assert!(most >= sides as usize, "{most}");
        }
    }
}

#[test]
fn methods_agree_on_a_smooth_model_and_find_something() {
    let mesh = torus(60, 30);
    let walk: Vec<Viewpoint> = (0..40)
        .map(|k| f64::from(k) * 0.5_f64.to_radians())
        .map(|angle| Viewpoint::Eye(DVec3::new(3.0 * angle.cos(), 1.0, 3.0 * angle.sin())))
        .collect();
    let most = check(&mesh, &walk).expect("all methods agree");
    assert!(most > 100, "{most}");
    // The same edges as for any mesh.
    let Viewpoint::Eye(eye) = walk[7] else {
        panic!("the walk is of eyes");
    };
    let mut reference = silhouette_edges(&mesh, eye);
    reference.sort_unstable();
    let edge_mesh = EdgeMesh::new(&mesh).expect("a torus is manifold");
    assert_eq!(reference, by_definition(&edge_mesh, &walk[7]));
}

#[test]
fn a_missing_or_turned_edge_is_noticed() {
    let mesh = EdgeMesh::new(&cube()).expect("a cube is manifold");
    let viewpoint = Viewpoint::Direction(DVec3::new(1.0, 2.0, 3.0));
    let wanted = by_definition(&mesh, &viewpoint);
    assert_eq!(wanted.len(), 6);
    assert_ne!(
        wanted,
        by_definition(&mesh, &Viewpoint::Direction(-DVec3::ONE))
    );
    assert_ne!(
        wanted,
        by_definition(&mesh, &Viewpoint::Direction(DVec3::new(1.0, 2.0, 0.0)))
    );
}
