//! Removing faces that enclose nothing.

use super::RepairError;
use super::outward::is_wound_around;
use crate::defects::{DisjointSets, MeshDefects, repeated_corner};
use crate::mesh::TriangleMesh;
use crate::topology::Topology;

/// Refuses meshes whose indices or coordinates mean nothing.
pub(super) fn check_meaning(mesh: &TriangleMesh) -> Result<(), RepairError> {
    let is_meaningless = mesh.faces.iter().flatten().any(|&v| {
        mesh.positions
            .get(v as usize)
            .is_none_or(|p| !p.is_finite())
    });
    match MeshDefects::of(mesh).filter(|_| is_meaningless) {
        Some(defects) => Err(RepairError::Meaningless(defects)),
        None => Ok(()),
    }
}

/// Keeps some faces, and the numbers they had.
fn retain(mesh: &mut TriangleMesh, face_of: &mut Vec<u32>, keeps: &[bool]) -> usize {
    let before = mesh.faces.len();
    if keeps.contains(&false) {
        mesh.retain_faces(|f| keeps[f]);
        let mut keep = keeps.iter();
        face_of.retain(|_| keep.next().copied().unwrap_or(false));
    }
    before - mesh.faces.len()
}

pub(super) fn remove_repeated_corners(mesh: &mut TriangleMesh, face_of: &mut Vec<u32>) -> usize {
    let keeps: Vec<bool> = mesh
        .faces
        .iter()
        .map(|f| repeated_corner(f).is_none())
        .collect();
    retain(mesh, face_of, &keeps)
}

/// Of faces on the same three vertices, keeps one where the surface needs it, and none where it does not: two bodies that
/// share a wall lose the wall, a face given twice stays once. Faces that run around their vertices the same way are one
/// face; of it, and of a pair that face each other, needed means that without, more of their edges would be left
/// with an odd number of faces than with an even one. A closed surface of nothing but such pairs is a body given twice, once
/// inside out, and stays once.
pub(super) fn remove_duplicates(mesh: &mut TriangleMesh, face_of: &mut Vec<u32>) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut uses: Vec<usize> = (0..topology.edges().len())
        .map(|e| topology.edge_uses(e).len())
        .collect();
    let by_corners = by_corners(&mesh.faces);
    let mut keeps: Vec<bool> = find_copies(&mesh.faces).iter().map(|copy| !copy).collect();
    let removed = |keeps: &[bool], face: u32| !keeps[face as usize];
    for &(.., face) in by_corners.iter().filter(|f| removed(&keeps, f.2)) {
        for e in topology.face_edges(face as usize) {
            uses[e as usize] -= 1;
        }
    }
    let is_body = pairs_of_bodies(mesh, &topology, &by_corners, &keeps);
    for group in by_corners
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|group| group.len() > 1)
    {
        let left: Vec<u32> = group
            .iter()
            .map(|f| f.2)
            .filter(|&f| keeps[f as usize])
            .collect();
        let edges = topology.face_edges(left[0] as usize);
        let odd_without = edges
            .iter()
            .filter(|&&e| (uses[e as usize] - left.len()) % 2 == 1)
            .count();
        let kept = match left[..] {
            [first, _] if is_body[first as usize] => Some(first),
            _ if odd_without < 2 => None,
            [first, second] => Some(best_oriented(mesh, &topology, [first, second])),
            _ => Some(left[0]),
        };
        for &face in left.iter().filter(|&&f| Some(f) != kept) {
            keeps[face as usize] = false;
            for e in edges {
                uses[e as usize] -= 1;
            }
        }
    }
    retain(mesh, face_of, &keeps)
}

/// The faces by their sorted vertices, then by the way they run around them, then by number.
fn by_corners(faces: &[[u32; 3]]) -> Vec<([u32; 3], bool, u32)> {
    let mut all: Vec<([u32; 3], bool, u32)> = faces
        .iter()
        .zip(0..)
        .map(|(face, f)| {
            let mut sorted = *face;
            sorted.sort_unstable();
            (sorted, !is_cyclic(face, &sorted), f)
        })
        .collect();
    all.sort_unstable();
    all
}

/// Which faces repeat an earlier one: the same three vertices, run around the same way, from whichever corner.
#[must_use]
pub fn find_copies(faces: &[[u32; 3]]) -> Vec<bool> {
    let mut is_copy = vec![false; faces.len()];
    for group in by_corners(faces).chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for &(.., copy) in &group[1..] {
            is_copy[copy as usize] = true;
        }
    }
    is_copy
}

/// Whether two faces on the same vertices run around them the same way.
fn is_cyclic(face: &[u32; 3], other: &[u32; 3]) -> bool {
    (0..3).any(|turn| (0..3).all(|k| face[(k + turn) % 3] == other[k]))
}

/// Per face, whether it belongs to a body given twice, once inside out: pairs of faces on the same vertices that hang
/// together and leave no edge open. Where other faces enclose them, they are a wall between two bodies, one in the other.
fn pairs_of_bodies(
    mesh: &TriangleMesh,
    topology: &Topology,
    by_corners: &[([u32; 3], bool, u32)],
    keeps: &[bool],
) -> Vec<bool> {
    let mut is_in_pair = vec![false; mesh.faces.len()];
    let kept: Vec<&([u32; 3], bool, u32)> =
        by_corners.iter().filter(|f| keeps[f.2 as usize]).collect();
    for pair in kept.chunk_by(|a, b| a.0 == b.0) {
        for &&(.., face) in pair {
            is_in_pair[face as usize] = pair.len() == 2;
        }
    }
    if !is_in_pair.contains(&true) {
        return is_in_pair;
    }
    let paired_at = |edge: usize| {
        topology
            .edge_uses(edge)
            .iter()
            .map(|u| u.face)
            .filter(|&f| is_in_pair[f as usize])
    };
    let mut bodies = DisjointSets::new(mesh.faces.len());
    for edge in 0..topology.edges().len() {
        if let Some(first) = paired_at(edge).next() {
            paired_at(edge).for_each(|f| bodies.unite(first, f));
        }
    }
    let mut is_body = is_in_pair.clone();
    for edge in 0..topology.edges().len() {
        // An edge of a body has two of its faces, or four where it touches itself, and each of them twice.
        if let Some(first) = paired_at(edge).next() {
            is_body[bodies.find(first) as usize] &= paired_at(edge).count() % 4 == 0;
        }
    }
    let singles: Vec<u32> = kept
        .iter()
        .map(|&&(.., face)| face)
        .filter(|&f| !is_in_pair[f as usize])
        .collect();
    for (face, is_body) in is_body.iter_mut().enumerate() {
        let is_root = bodies.find(face as u32) == face as u32;
        if is_root && *is_body && !singles.is_empty() {
            let [a, b, c] = mesh.corners(face);
            *is_body = !is_wound_around(mesh, &singles, (a + b + c) / 3.0);
        }
    }
    (0..mesh.faces.len() as u32)
        .map(|f| is_in_pair[f as usize] && is_body[bodies.find(f) as usize])
        .collect()
}

/// Of two faces that face each other, the one that runs against most of its neighbours, as it should; the first on a tie.
fn best_oriented(mesh: &TriangleMesh, topology: &Topology, pair: [u32; 2]) -> u32 {
    let agreement = |face: u32| -> i64 {
        let edges = topology.face_edges(face as usize);
        let own = |e: u32| {
            topology
                .edge_uses(e as usize)
                .iter()
                .find(|u| u.face == face)
        };
        edges
            .iter()
            .flat_map(|&e| {
                let own_direction = own(e).map(|u| u.is_forward);
                topology
                    .edge_uses(e as usize)
                    .iter()
                    .filter(|u| !pair.contains(&u.face))
                    .map(move |u| {
                        if Some(u.is_forward) == own_direction {
                            -1
                        } else {
                            1
                        }
                    })
            })
            .sum()
    };
    debug_assert!(pair.iter().all(|&f| (f as usize) < mesh.faces.len()));
    let [first, second] = pair;
    if agreement(second) > agreement(first) {
        second
    } else {
        first
    }
}

/// Removes faces with a free edge that stand on an edge with an odd number of faces, and faces with nothing but free
/// edges, until there are none.
pub(super) fn remove_fins(mesh: &mut TriangleMesh, face_of: &mut Vec<u32>) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut uses: Vec<usize> = (0..topology.edges().len())
        .map(|e| topology.edge_uses(e).len())
        .collect();
    let mut keeps = vec![true; mesh.faces.len()];
    let mut open: Vec<u32> = (0..mesh.faces.len() as u32).rev().collect();
    while let Some(face) = open.pop() {
        let edges = topology.face_edges(face as usize);
        let uses_of = edges.map(|e| uses[e as usize]);
        let is_stray = uses_of == [1; 3];
        let is_fin = uses_of.contains(&1) && uses_of.iter().any(|&n| n > 2 && n % 2 == 1);
        if !keeps[face as usize] || !(is_fin || is_stray) {
            continue;
        }
        keeps[face as usize] = false;
        for e in edges {
            uses[e as usize] -= 1;
            open.extend(
                topology
                    .edge_uses(e as usize)
                    .iter()
                    .map(|u| u.face)
                    .filter(|&f| keeps[f as usize]),
            );
        }
    }
    retain(mesh, face_of, &keeps)
}
