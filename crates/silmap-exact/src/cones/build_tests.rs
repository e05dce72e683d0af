//! The cost of building the forest where many edges meet.

use super::*;
use crate::ConeForest;
use crate::test_meshes::torus;
use crate::watch::{SEARCH, heard};
use silmap_geometry::{StageEvent, Watch};
use silmap_models::{bicone, flat_drum};

/// Links between edges at the beginning, and faces that were looked at in the end.
fn work(mesh: &silmap_geometry::TriangleMesh) -> (usize, u64) {
    let mesh = EdgeMesh::new(mesh).expect("the test meshes are manifold");
    let watch = Watch::silent();
    let mut counter = Counter::start(&watch, SEARCH, 0, 1 << 14);
    let links = links_at_vertices(&mesh).iter().map(Vec::len).sum();
    build_forest(&mesh, &mut counter).expect("nobody stops it");
    (links, counter.steps())
}

#[test]
fn edges_at_a_vertex_of_many_are_not_linked_in_pairs() {
    for fan in [bicone, flat_drum] {
        let (few, many) = (work(&fan(250)), work(&fan(1_000)));
        assert!(many.0 <= 5 * few.0, "links: {} and {}", few.0, many.0);
        // Four times as many faces; n log n with some to spare, and the square would be sixteen times.
        assert!(many.1 <= 7 * few.1, "faces: {} and {}", few.1, many.1);
    }
    // At usual vertices every pair is a candidate.
    let mesh = EdgeMesh::new(&torus(9, 7)).expect("a torus is manifold");
    assert!(
        links_at_vertices(&mesh)
            .iter()
            .all(|links| links.len() == 10)
    );
}

/// A comb of many prongs between two planes: all edges of a flat lid are one root's neighbours.
fn comb(prongs: u32) -> silmap_geometry::TriangleMesh {
    let mut outline = vec![[-1.0, -0.2], [1.0, -0.2]];
    let step = 2.0 / f64::from(prongs);
    for k in (0..prongs).rev() {
        let x = -1.0 + f64::from(k) * step;
        outline.extend([[x + 0.7 * step, 0.0], [x + 0.5 * step, 1.0]]);
        outline.extend([[x + 0.2 * step, 1.0], [x, 0.0]]);
    }
    let n = outline.len() as u32;
    let mut lid = Vec::new();
    for a in (2..n).step_by(4) {
        // The spine as a fan, and the prong.
        lid.extend([[0, a - 1, a], [0, a, a + 3]]);
        lid.extend([[a, a + 1, a + 2], [a, a + 2, a + 3]]);
    }
    let mut mesh = silmap_geometry::TriangleMesh::default();
    for z in [-0.1, 0.1] {
        let points = outline.iter().map(|&[x, y]| glam::DVec3::new(x, y, z));
        mesh.positions.extend(points);
    }
    for [a, b, c] in lid {
        mesh.faces.extend([[a, c, b], [n + a, n + b, n + c]]);
    }
    for a in 0..n {
        let b = (a + 1) % n;
        mesh.faces.extend([[a, b, n + b], [a, n + b, n + a]]);
    }
    mesh
}

#[test]
fn what_is_beside_a_flat_lid_is_not_looked_at_whenever_the_lid_grows() {
    let (few, many) = (work(&comb(60)), work(&comb(240)));
    assert!(many.1 <= 7 * few.1, "faces: {} and {}", few.1, many.1);
}

#[test]
fn the_work_ends_when_its_watcher_says_so() {
    let mesh = EdgeMesh::new(&bicone(300)).expect("a bicone is manifold");
    let told = heard(usize::MAX, |watch| {
        ConeForest::watched(&mesh, watch).expect("nobody stops it");
    });
    let total = 2 * mesh.edges().len() as u64;
    let stage = SEARCH;
    assert_eq!(told[0], StageEvent::Started { stage, total });
    assert_eq!(told.last(), Some(&StageEvent::Finished { stage }));
    let done = told.iter().map(|event| match event {
        StageEvent::Advanced { count, .. } => *count,
        _ => 0,
    });
    let done: u64 = done.sum();
    assert!(
        told.len() > 4 && done > total / 2 && done <= total,
        "{told:?}"
    );
    for last in 1..told.len() {
        let heard = heard(last, |watch| {
            let stopped = ConeForest::watched(&mesh, watch);
            assert_eq!(stopped.err(), Some(Interrupted));
        });
        assert_eq!(heard, told[..last], "it is not told again");
    }
}
