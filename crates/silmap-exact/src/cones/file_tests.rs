//! Forests survive a round trip through their bytes; changed bytes are refused.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::test_meshes::{bumpy_torus, cube, shaken_torus, torus};
use crate::{DirectedEdge, ExtractionMethod, Extractor, Viewpoint};

fn found(extractor: &mut Extractor<'_>, eye: DVec3) -> Vec<DirectedEdge> {
    let mut edges = Vec::new();
    extractor.extract(&Viewpoint::Eye(eye), &mut edges);
    edges.sort_unstable();
    edges
}

/// Puts the checksum right, as a forger would.
fn seal(bytes: &mut [u8]) {
    if let Some((_, body)) = bytes.split_at_checked(16) {
        let crc32 = crc32fast::hash(body).to_le_bytes();
        bytes[12..16].copy_from_slice(&crc32);
    }
}

#[test]
fn a_forest_comes_back_and_does_the_same() {
    let mesh = EdgeMesh::new(&torus(40, 24)).unwrap();
    let forest = ConeForest::new(&mesh);
    let bytes = forest.to_bytes(&mesh);
    let read = ConeForest::from_bytes(&mesh, &bytes).unwrap();
    assert_eq!(read.to_bytes(&mesh), bytes);
    let mut extractors = [forest, read].map(|f| Extractor::with_forest(&mesh, &f));
    let (mut edges, mut again) = (Vec::new(), Vec::new());
    for k in 0..20 {
        let viewpoint = Viewpoint::Eye(DVec3::new(3.0, 1.0, f64::from(k) * 0.1));
        // Also the same nodes, so the same cones.
        let work = extractors[0].extract(&viewpoint, &mut edges);
        assert_eq!(extractors[1].extract(&viewpoint, &mut again), work);
        assert_eq!(edges, again);
        assert!(edges.len() > 20 && work.tested_edges < mesh.edges().len() / 2);
    }
}

#[test]
fn what_is_no_forest_of_this_mesh_is_refused_by_name() {
    let mesh = EdgeMesh::new(&torus(12, 8)).unwrap();
    let bytes = ConeForest::new(&mesh).to_bytes(&mesh);
    let read = |bytes: &[u8]| ConeForest::from_bytes(&mesh, bytes).map(|_| ());
    assert_eq!(read(&bytes), Ok(()));
    assert_eq!(read(b"solid"), Err(ForestError::NotAForest));
    let mut later = bytes.clone();
    later[8] = 7;
    assert_eq!(read(&later), Err(ForestError::UnknownVersion { found: 7 }));
    let mut moved = torus(12, 8);
    moved.positions[5].x += 1e-9;
    let other = EdgeMesh::new(&moved).unwrap();
    assert!(matches!(
        ConeForest::from_bytes(&other, &bytes),
        Err(ForestError::OtherMesh { .. })
    ));
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length}");
    }
    let mut longer = bytes.clone();
    longer.extend([0; 4]);
    seal(&mut longer);
    let refused = |bytes: &[u8], part: &str| match read(bytes) {
        Err(ForestError::Damaged { what }) => assert!(what.contains(part), "{what}"),
        other => panic!("{other:?}"),
    };
    refused(&longer, "do not fit its length");
    // The first edge twice instead of the second.
    let mut doubled = bytes.clone();
    let first_edge = bytes.len() - 4 * mesh.edges().len();
    doubled.copy_within(first_edge..first_edge + 4, first_edge + 4);
    seal(&mut doubled);
    refused(&doubled, "twice");
    doubled[first_edge..first_edge + 4].fill(0xff);
    seal(&mut doubled);
    refused(&doubled, "names edge 4294967295 of");
    let mut childish = bytes.clone();
    childish[36..40].copy_from_slice(&u32::MAX.to_le_bytes());
    seal(&mut childish);
    refused(&childish, "node 0 has 4294967295 children");
}

proptest! {
    #[test]
    fn whatever_a_file_holds_what_is_found_is_right(
        mesh in prop_oneof![bumpy_torus(), shaken_torus(), Just(cube())],
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8), 1..4),
        is_sealed in any::<bool>(),
        eye in prop::array::uniform3(-4.0..4.0),
    ) {
        let edge_mesh = EdgeMesh::new(&mesh).unwrap();
        let mut bytes = ConeForest::new(&edge_mesh).to_bytes(&edge_mesh);
        let before = bytes.clone();
        // Behind the mesh's checksum, so that it is not all refused there.
        for (place, bit) in &flips {
            let place = 24 + place.index(bytes.len() - 24);
            bytes[place] ^= 1_u8 << bit;
        }
        if is_sealed {
            seal(&mut bytes);
        }
        match ConeForest::from_bytes(&edge_mesh, &bytes) {
            Err(_) => {}
            Ok(forest) => {
                prop_assert!(is_sealed || bytes == before);
                let eye = DVec3::from(eye);
                let mut brute = Extractor::new(&edge_mesh, ExtractionMethod::Brute);
                let mut extractor = Extractor::with_forest(&edge_mesh, &forest);
                prop_assert_eq!(found(&mut extractor, eye), found(&mut brute, eye));
            }
        }
    }
}
