//! Sequences come back from their files as they were, and nothing else passes for one.

use super::*;
use crate::hull::{HullParams, Tightening, build};
use crate::{Monitor, models};

fn sequence(inner: bool) -> ProgressiveHull {
    let mesh = ClosedMesh::try_from(models::trefoil_knot(1200)).unwrap();
    let params = HullParams {
        target_faces: 100,
        inner,
        ..HullParams::default()
    };
    build(&mesh, &params, &Monitor::silent()).unwrap()
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
        let tight = |hull: &ProgressiveHull| {
            hull.tightened_level(100, Tightening::Fast, &Monitor::silent())
        };
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
            let _ = hull.tightened_level(100, Tightening::Fast, &Monitor::silent());
        } else {
            refused += 1;
        }
    }
    assert!(refused > 10, "{refused}");
}
