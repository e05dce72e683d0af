//! Sequences come back from their files as they were, and nothing else passes for one.

use super::*;
use crate::{HullParams, Tightening, build};
use silmap_geometry::Watch;
use silmap_models as models;

fn sequence(inner: bool) -> ProgressiveHull {
    let mesh = ClosedMesh::try_from(models::trefoil_knot(1200)).unwrap();
    let params = HullParams {
        target_faces: 100,
        inner,
        ..HullParams::default()
    };
    build(&mesh, &params, &Watch::silent()).unwrap()
}

/// With a checksum that fits.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = crc32fast::hash(&bytes[16..]);
    bytes[12..16].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn a_sequence_comes_back_whole() {
    for inner in [false, true] {
        let before = sequence(inner);
        let bytes = before.to_bytes();
        let after = ProgressiveHull::from_bytes(&bytes).unwrap();
        assert_eq!(after.to_bytes(), bytes);
        assert!(before.summaries().eq(after.summaries()));
        for faces in [100, 333, 700, usize::MAX] {
            assert_eq!(before.level(faces), after.level(faces), "{faces} faces");
        }
        let tight =
            |hull: &ProgressiveHull| hull.tightened_level(100, Tightening::Fast, &Watch::silent());
        assert_eq!(tight(&before), tight(&after));
        let mesh = ClosedMesh::try_from(models::trefoil_knot(1200)).unwrap();
        assert_eq!(after.model(), before.model());
        assert_eq!(after.model().faces, mesh.mesh().faces);
        assert_eq!(after.model().positions, mesh.mesh().positions);
    }
}

#[test]
fn levels_are_found_by_volume_and_distance() {
    let hull = sequence(false);
    let summaries: Vec<_> = hull.summaries().collect();
    let some = summaries[summaries.len() / 2];
    assert_eq!(hull.faces_within(Some(some.volume_ratio), None), some.faces);
    assert_eq!(
        hull.faces_within(None, Some(f64::INFINITY)),
        hull.least_faces()
    );
    let by_distance = hull.faces_within(None, Some(some.distance));
    assert!(hull.level(by_distance).distance <= some.distance);
    assert!(by_distance <= some.faces);
    assert_eq!(hull.faces_within(Some(1.0), None) % 2, 0);
}

#[test]
fn other_files_are_named() {
    let bytes = sequence(false).to_bytes();
    let read = |bytes: &[u8]| ProgressiveHull::from_bytes(bytes).map(|_| ());
    assert_eq!(read(b"solid cube"), Err(SequenceError::NotASequence));
    let mut newer = bytes.clone();
    newer[8] = 9;
    assert_eq!(
        read(&newer),
        Err(SequenceError::UnknownVersion { found: 9 })
    );
    for cut in [8, 12, 20, 60, bytes.len() / 2, bytes.len() - 1] {
        let short = bytes[..cut].to_vec();
        assert!(matches!(read(&short), Err(SequenceError::Damaged { .. })));
        if cut > 16 {
            assert!(read(&sealed(short)).is_err(), "cut at {cut}");
        }
    }
}

#[test]
fn changed_bytes_never_pass_nor_panic() {
    let bytes = sequence(false).to_bytes();
    // The checksum finds every change; with a checksum that fits, whatever names faces and vertices must still be right.
    let mut refused = 0;
    for at in (16..bytes.len()).step_by(997) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x55;
        assert!(ProgressiveHull::from_bytes(&changed).is_err(), "byte {at}");
        if let Ok(hull) = ProgressiveHull::from_bytes(&sealed(changed)) {
            let _ = hull.tightened_level(100, Tightening::Fast, &Watch::silent());
        } else {
            refused += 1;
        }
    }
    assert!(refused > 10, "{refused}");
}

/// Offsets of what follows the header: the vertices of the base mesh, and the first split.
fn places(bytes: &[u8]) -> [usize; 2] {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (vertices, base_faces) = (number(40), number(44));
    let first_vertex = 52 + base_faces * 16;
    [first_vertex, first_vertex + vertices * 48]
}

#[test]
fn numbers_that_are_none_are_named_with_their_element() {
    for inner in [false, true] {
        let bytes = sequence(inner).to_bytes();
        let [vertices, splits] = places(&bytes);
        let written = |at: usize, value: f64| {
            let mut changed = bytes.clone();
            changed[at..at + 8].copy_from_slice(&value.to_le_bytes());
            ProgressiveHull::from_bytes(&sealed(changed)).map(|_| ())
        };
        let of_vertices = (0..6).map(|k| (vertices + 48 * 7 + 8 * k, "vertex 7"));
        let of_split = (0..14).map(|k| (splits + 40 + 8 * k, "split 0"));
        for (at, name) in of_vertices.chain(of_split) {
            for value in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e200, f64::MAX] {
                let Err(SequenceError::Damaged { what }) = written(at, value) else {
                    panic!("{value} at byte {at} passes");
                };
                assert!(what.contains(name), "{value} at byte {at}: {what}");
            }
        }
        // Volumes and distances that are numbers, but not those of the hulls.
        assert!(written(splits + 40 + 96, -1.0).is_err());
        assert!(written(splits + 40 + 96, 1e3).is_err());
        assert!(written(splits + 40 + 104, -1.0).is_err());
        for unit in [0.0, 3.0, -2.0, f64::NAN, f64::INFINITY, 5e-324] {
            assert!(written(24, unit).is_err(), "unit {unit}");
        }
        for limit in [f64::NAN, -1.0] {
            assert!(written(32, limit).is_err(), "limit {limit}");
        }
    }
}

#[test]
fn counts_are_held_against_the_bytes_and_indices_against_counts() {
    let bytes = sequence(false).to_bytes();
    let [_, splits] = places(&bytes);
    let written = |at: usize, value: u32| {
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
        match ProgressiveHull::from_bytes(&sealed(changed)) {
            Err(SequenceError::Damaged { what }) => what,
            other => panic!("{value} at byte {at}: {:?}", other.map(|_| ())),
        }
    };
    for at in [20, 40, 44, 48] {
        for value in [0, u32::MAX, u32::MAX / 2] {
            written(at, value);
        }
    }
    assert!(written(52 + 16, u32::MAX).contains("face 1 of its base mesh"));
    assert!(written(52 + 16 + 4, 1 << 30).contains("face 1 of its base mesh names vertex"));
    assert!(written(splits, 1 << 30).contains("split 0 names vertex"));
    assert!(written(splits + 8, 1 << 30).contains("split 0 names face"));
    // More corners than there are bytes.
    written(splits + 152, u32::MAX);
}
