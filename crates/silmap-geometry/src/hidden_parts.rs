//! Parts of a closed mesh that no eye outside can see: cavities, and whatever lies within them or within a solid.
//!
//! A part is hidden when another one winds around it and their surfaces have no point in common: every ray from outside
//! to it passes through that other part. Which way either faces does not matter, so that the shells of an onion are hidden
//! but for the outermost one. One point decides for a whole part, as parts are connected; every sign is exact.
//! Parts that touch or cross what surrounds them stay, and so do those that only several others together enclose.
//! The wall of a cavity with an opening is one part with the outer surface, and is not hidden.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::bvh::Bvh;
use crate::closed_mesh::ClosedMesh;
use crate::mesh::TriangleMesh;
use crate::predicates::triangles_are_apart;
use crate::topology::Topology;

/// How many parts are hidden.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HiddenParts {
    /// Those that face inward: walls of cavities.
    pub cavities: usize,
    /// Those that face outward: bodies in cavities, or within other bodies.
    pub bodies: usize,
    /// Faces of both.
    pub faces: usize,
}

/// The mesh without its hidden parts, and how many those are; `None` when every part can be seen.
#[must_use]
pub fn without_hidden_parts(mesh: &ClosedMesh) -> Option<(ClosedMesh, HiddenParts)> {
    let origin = mesh.origin();
    let mesh = mesh.mesh();
    let (part_of_face, count) = Topology::new(&mesh.faces, mesh.positions.len()).parts();
    if count < 2 {
        return None;
    }
    let mut faces_of_part: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (face, &part) in part_of_face.iter().enumerate() {
        faces_of_part[part as usize].push(face as u32);
    }
    let tree = Bvh::new(mesh);
    let is_hidden: Vec<bool> = (faces_of_part.iter())
        .map(|faces| is_hidden(mesh, &tree, &part_of_face, faces))
        .collect();
    let mut hidden = HiddenParts::default();
    for faces in faces_of_part
        .iter()
        .zip(&is_hidden)
        .filter(|&(_, &is)| is)
        .map(|(f, _)| f)
    {
        hidden.faces += faces.len();
        if signed_volume(mesh, faces) < 0.0 {
            hidden.cavities += 1;
        } else {
            hidden.bodies += 1;
        }
    }
    if hidden.faces == 0 {
        return None;
    }
    let mut seen = mesh.clone();
    seen.retain_faces(|face| !is_hidden[part_of_face[face] as usize]);
    // What is left faces outward as a whole, but for surfaces so crossed that it is better to leave them alone.
    let seen = ClosedMesh::try_from(seen).ok()?;
    Some((seen.with_origin(origin), hidden))
}

/// Whether a part, given by its faces, lies within another one.
fn is_hidden(mesh: &TriangleMesh, tree: &Bvh, part_of_face: &[u32], faces: &[u32]) -> bool {
    let part = part_of_face[faces[0] as usize];
    let [a, b, c] = mesh.corners(faces[0] as usize);
    let point = a + ((b - a) + (c - a)) / 3.0;
    let mut around: BTreeSet<u32> = (tree.windings_by_group(point, part_of_face))
        .into_iter()
        .map(|(other, _)| other)
        .filter(|&other| other != part)
        .collect();
    for &face in faces {
        if around.is_empty() {
            return false;
        }
        let corners = mesh.corners(face as usize);
        let [a, b, c] = corners;
        tree.overlapping_faces(a.min(b).min(c), a.max(b).max(c), |other| {
            let other_part = part_of_face[other as usize];
            if around.contains(&other_part)
                && !triangles_are_apart(corners, mesh.corners(other as usize))
            {
                around.remove(&other_part);
            }
        });
    }
    !around.is_empty()
}

/// Six times the volume that some faces enclose.
fn signed_volume(mesh: &TriangleMesh, faces: &[u32]) -> f64 {
    let origin: DVec3 = mesh.corners(faces[0] as usize)[0];
    let of_face = |&face: &u32| {
        let [a, b, c] = mesh.corners(face as usize).map(|p| p - origin);
        a.dot(b.cross(c))
    };
    faces.iter().map(of_face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 8] = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [-1.0, 1.0, 1.0],
        [1.0, 1.0, 1.0],
    ];
    const SIDES: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];

    /// Cubes with center and half an edge; those with a negative one face inward.
    fn cubes(all: &[([f64; 3], f64)]) -> ClosedMesh {
        let mut mesh = TriangleMesh::default();
        for &(center, half) in all {
            let first = mesh.positions.len() as u32;
            let place = |corner: [f64; 3]| DVec3::from(center) + DVec3::from(corner) * half.abs();
            mesh.positions.extend(CORNERS.map(place));
            for [a, b, c, d] in SIDES.map(|side| side.map(|v| v + first)) {
                let turn = |[a, b, c]: [u32; 3]| if half > 0.0 { [a, b, c] } else { [a, c, b] };
                mesh.faces.extend([[a, b, c], [a, c, d]].map(turn));
            }
        }
        ClosedMesh::try_from(mesh).unwrap().with_origin(DVec3::X)
    }

    fn hidden(all: &[([f64; 3], f64)]) -> Option<(usize, HiddenParts)> {
        without_hidden_parts(&cubes(all)).map(|(seen, hidden)| {
            assert_eq!(seen.origin(), DVec3::X);
            (seen.mesh().faces.len(), hidden)
        })
    }

    const O: [f64; 3] = [0.0; 3];

    #[test]
    fn one_part_or_several_beside_each_other_are_seen() {
        assert_eq!(hidden(&[(O, 1.0)]), None);
        assert_eq!(hidden(&[(O, 1.0), ([3.0, 0.0, 0.0], 1.0)]), None);
        // In the box of a part that goes around it, but not within.
        assert_eq!(hidden(&[(O, 1.0), ([1.5, 0.9, 0.0], 0.25)]), None);
    }

    #[test]
    fn cavities_and_what_is_in_them_are_hidden() {
        let cavity = HiddenParts {
            cavities: 1,
            bodies: 0,
            faces: 12,
        };
        assert_eq!(hidden(&[(O, 1.0), (O, -0.5)]), Some((12, cavity)));
        assert_eq!(hidden(&[(O, -0.5), (O, 1.0)]), Some((12, cavity)));
        let island = HiddenParts {
            cavities: 2,
            bodies: 2,
            faces: 48,
        };
        let shells = [
            (O, 1.0),
            (O, -0.8),
            (O, 0.6),
            (O, -0.4),
            ([0.1, 0.0, 0.0], 0.2),
        ];
        assert_eq!(hidden(&shells), Some((12, island)));
    }

    #[test]
    fn bodies_within_bodies_are_hidden_unless_they_touch() {
        let body = HiddenParts {
            cavities: 0,
            bodies: 1,
            faces: 12,
        };
        assert_eq!(
            hidden(&[(O, 1.0), ([0.25, 0.0, 0.0], 0.5)]),
            Some((12, body))
        );
        // A face in the plane of the outer one's, a corner in it, and through it.
        for (center, half) in [
            ([0.5, 0.0, 0.0], 0.5),
            ([0.75, 0.0, 0.0], 0.5),
            ([0.5, 0.5, 0.5], 0.5),
            ([1.0, 1.0, 1.0], 0.5),
        ] {
            assert_eq!(hidden(&[(O, 1.0), (center, half)]), None, "{center:?}");
        }
    }

    #[test]
    fn a_body_between_two_that_overlap_stays() {
        // Crosses both, and only both together go around it.
        let all = [([-0.75, 0.0, 0.0], 1.0), ([0.75, 0.0, 0.0], 1.0), (O, 0.5)];
        assert_eq!(hidden(&all), None);
        // In one of them altogether, whatever else there is.
        let all = [all[0], all[1], ([-0.75, 0.0, 0.0], 0.25)];
        assert_eq!(hidden(&all).map(|(faces, _)| faces), Some(24));
    }

    #[test]
    fn thousands_of_cavities_go() {
        const SIDE: usize = 14;
        let mut all = vec![(O, 1.0)];
        for k in 0..SIDE * SIDE * SIDE {
            let at = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE];
            let center = at.map(|i| (i as f64 + 0.5) / SIDE as f64 * 1.8 - 0.9);
            all.push((center, if k % 2 == 0 { -0.05 } else { 0.05 }));
        }
        let (faces, found) = hidden(&all).unwrap();
        assert_eq!(faces, 12);
        assert_eq!(found.cavities + found.bodies, SIDE * SIDE * SIDE);
    }
}
