//! Removing faces that enclose nothing.

use super::RepairError;
use crate::defects::{MeshDefects, repeated_corner};
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
/// share a wall lose the wall, a face given twice stays once. Needed means that without any of them, more of their edges
/// would be left with an odd number of faces than with an even one.
pub(super) fn remove_duplicates(mesh: &mut TriangleMesh, face_of: &mut Vec<u32>) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut uses: Vec<usize> = (0..topology.edges().len())
        .map(|e| topology.edge_uses(e).len())
        .collect();
    let mut by_corners: Vec<([u32; 3], u32)> = mesh
        .faces
        .iter()
        .zip(0..)
        .map(|(face, f)| {
            let mut sorted = *face;
            sorted.sort_unstable();
            (sorted, f)
        })
        .collect();
    by_corners.sort_unstable();
    let mut keeps = vec![true; mesh.faces.len()];
    for group in by_corners
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|g| g.len() > 1)
    {
        let edges = topology.face_edges(group[0].1 as usize);
        let odd_without = edges
            .iter()
            .filter(|&&e| (uses[e as usize] - group.len()) % 2 == 1)
            .count();
        let kept = (odd_without >= 2).then(|| best_oriented(mesh, &topology, group));
        for &(_, face) in group {
            if Some(face) != kept {
                keeps[face as usize] = false;
                for e in edges {
                    uses[e as usize] -= 1;
                }
            }
        }
    }
    retain(mesh, face_of, &keeps)
}

/// The face of a group of copies that runs against most of its neighbours, as it should; the first on a tie.
fn best_oriented(mesh: &TriangleMesh, topology: &Topology, group: &[([u32; 3], u32)]) -> u32 {
    let edges = topology.face_edges(group[0].1 as usize);
    let corners = group[0].0;
    let is_copy = |face: u32| {
        let mut sorted = mesh.faces[face as usize];
        sorted.sort_unstable();
        sorted == corners
    };
    // How many more of the others walk each edge from its lower to its higher vertex than back: counted once for all copies, of
    // which there may be many.
    let forward = edges.map(|e| {
        let uses = topology.edge_uses(e as usize).iter();
        let others = uses.filter(|u| !is_copy(u.face));
        others
            .map(|u| if u.is_forward { 1 } else { -1 })
            .sum::<i64>()
    });
    let agreement = |face: u32| -> i64 {
        let corners = mesh.faces[face as usize];
        let sides = (0..3).map(|k| (corners[k], corners[(k + 1) % 3]));
        sides
            .map(|(from, to)| {
                let edge = topology.find_edge(from, to);
                let place = edges.iter().position(|&e| Some(e as usize) == edge);
                let forward = place.map_or(0, |k| forward[k]);
                if from < to { -forward } else { forward }
            })
            .sum()
    };
    let mut best = (group[0].1, agreement(group[0].1));
    for &(_, face) in &group[1..] {
        let found = agreement(face);
        if found > best.1 {
            best = (face, found);
        }
    }
    best.0
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
