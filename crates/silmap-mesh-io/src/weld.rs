//! Merging vertices at exactly the same place.
//!
//! Formats without shared vertices (STL), and files whose vertices are split along texture seams, are closed only after
//! this. Equal means equal in every bit, after −0 became 0: a tolerance would close cracks, and tear fine relief.

use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_geometry::defects::repeated_corner;

use super::raw::RawMesh;

/// A mesh without two vertices at one place.
#[derive(Debug)]
pub(super) struct Welded {
    /// The mesh; vertices are in the order of the file.
    pub(super) mesh: TriangleMesh,
    /// The file's vertex each one was, the first of those merged.
    pub(super) vertex_of: Vec<u32>,
    /// The file's face each triangle was.
    pub(super) face_of: Vec<u32>,
    /// Triangles dropped because two of their corners were merged.
    pub(super) dropped: usize,
}

/// Merges vertices at equal positions, and drops the triangles that thereby lose a corner.
pub(super) fn weld(raw: &RawMesh) -> Welded {
    let positions: Vec<DVec3> = raw
        .mesh
        .positions
        .iter()
        // Adding 0 turns −0 into 0.
        .map(|&p| p + DVec3::ZERO)
        .collect();
    let first_equal = first_at_equal_place(&positions);
    let mut new_of_old = vec![0; positions.len()];
    let mut vertex_of = Vec::new();
    let mut mesh = TriangleMesh {
        positions: Vec::new(),
        ..raw.mesh.clone()
    };
    for (v, &first) in first_equal.iter().enumerate() {
        if first as usize == v {
            new_of_old[v] = vertex_of.len() as u32;
            vertex_of.push(v as u32);
            mesh.positions.push(positions[v]);
        } else {
            new_of_old[v] = new_of_old[first as usize];
        }
    }
    for v in mesh.faces.iter_mut().flatten() {
        *v = new_of_old[*v as usize];
    }
    // Faces that repeat a corner in the file itself stay: they are a defect to be reported.
    let keeps: Vec<bool> = mesh
        .faces
        .iter()
        .zip(&raw.mesh.faces)
        .map(|(now, before)| repeated_corner(now).is_none() || repeated_corner(before).is_some())
        .collect();
    let dropped = keeps.iter().filter(|&&keep| !keep).count();
    if dropped > 0 {
        mesh.retain_faces(|f| keeps[f]);
    }
    let face_of = raw
        .face_of
        .iter()
        .zip(&keeps)
        .filter_map(|(&f, &keep)| keep.then_some(f))
        .collect();
    Welded {
        mesh,
        vertex_of,
        face_of,
        dropped,
    }
}

/// For every position, the first index with the same bits.
fn first_at_equal_place(positions: &[DVec3]) -> Vec<u32> {
    let key = |v: u32| positions[v as usize].to_array().map(f64::to_bits);
    let mut order: Vec<([u64; 3], u32)> =
        (0..positions.len() as u32).map(|v| (key(v), v)).collect();
    order.sort_unstable();
    let mut first_equal: Vec<u32> = (0..positions.len() as u32).collect();
    for group in order.chunk_by(|a, b| a.0 == b.0) {
        for &(_, v) in group {
            first_equal[v as usize] = group[0].1;
        }
    }
    first_equal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::PolygonLook;

    #[test]
    fn equal_places_are_merged_and_lost_faces_dropped() {
        let mut raw = RawMesh::counting_from(0);
        raw.mesh.positions = vec![
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::new(1.0, -0.0, 0.0),
            DVec3::new(1.0, 1e-300, 0.0),
        ];
        for face in [[0, 1, 3], [1, 4, 3], [2, 4, 5], [3, 3, 1]] {
            raw.push_polygon(&face, PolygonLook::default());
        }
        let welded = weld(&raw.finish());
        assert_eq!(welded.vertex_of, [0, 1, 3, 5]);
        assert_eq!(welded.mesh.faces, [[0, 1, 2], [0, 1, 3], [2, 2, 1]]);
        assert_eq!(welded.face_of, [0, 2, 3]);
        assert_eq!(welded.dropped, 1);
    }
}
