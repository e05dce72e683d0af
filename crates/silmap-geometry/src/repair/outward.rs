//! Turning closed parts outward.

use glam::DVec3;

use crate::bvh::Bvh;
use crate::mesh::{Bounds, TriangleMesh};
use crate::topology::Topology;

struct Part {
    /// Its number among all parts, the open ones included.
    number: u32,
    faces: Vec<u32>,
    volume: f64,
}

/// Turns parts outward: everything if the whole has a negative volume, then each part that faces inward without lying
/// inside others (one that does is a cavity). Only closed and consistent parts are looked at. Returns the number of
/// faces turned.
pub fn turn_outward(mesh: &mut TriangleMesh) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let (part_of_face, count) = topology.parts();
    let mut parts = closed_parts(mesh, &topology, (&part_of_face, count));
    let mut is_flipped = vec![false; mesh.faces.len()];
    if parts.iter().map(|p| p.volume).sum::<f64>() < 0.0 {
        for part in &mut parts {
            flip_part(mesh, part, &mut is_flipped);
        }
    }
    if parts.iter().any(|part| part.volume < 0.0) {
        let tree = Bvh::new(mesh);
        // How the surface of each part counts: 0 when it is open, −1 when it was turned since the tree was made.
        let mut signs = vec![0; count];
        parts.iter().for_each(|p| signs[p.number as usize] = 1);
        for part in &mut parts {
            if part.volume < 0.0 && !lies_inside_others(mesh, &tree, (&part_of_face, &signs), part)
            {
                flip_part(mesh, part, &mut is_flipped);
                signs[part.number as usize] = -1;
            }
        }
    }
    is_flipped.iter().filter(|&&flipped| flipped).count()
}

fn flip_part(mesh: &mut TriangleMesh, part: &mut Part, is_flipped: &mut [bool]) {
    part.volume = -part.volume;
    for &face in &part.faces {
        mesh.flip_face(face as usize);
        is_flipped[face as usize] ^= true;
    }
}

fn closed_parts(
    mesh: &TriangleMesh,
    topology: &Topology,
    (part_of_face, count): (&[u32], usize),
) -> Vec<Part> {
    let mut is_closed = vec![true; count];
    let mut faces = vec![Vec::new(); count];
    for (face, &part) in part_of_face.iter().enumerate() {
        faces[part as usize].push(face as u32);
        for edge in topology.face_edges(face) {
            is_closed[part as usize] &= topology.edge_faces(edge as usize).is_some();
        }
    }
    faces
        .into_iter()
        .zip(is_closed)
        .enumerate()
        .filter(|(_, (_, is_closed))| *is_closed)
        .map(|(number, (faces, _))| {
            let corners = || faces.iter().flat_map(|&f| mesh.corners(f as usize));
            let bounds = Bounds::of_points(corners().collect::<Vec<_>>().into_iter());
            let six: f64 = faces
                .iter()
                .map(|&f| {
                    let [a, b, c] = mesh.corners(f as usize).map(|p| p - bounds.center);
                    a.dot(b.cross(c))
                })
                .sum();
            Part {
                number: number as u32,
                volume: six / 6.0,
                faces,
            }
        })
        .collect()
}

/// Whether the other parts wind around a point of this one.
fn lies_inside_others(
    mesh: &TriangleMesh,
    tree: &Bvh,
    (part_of_face, signs): (&[u32], &[i32]),
    this: &Part,
) -> bool {
    let [a, b, c] = mesh.corners(this.faces[0] as usize);
    let point = (a + b + c) / 3.0;
    let windings = tree.windings_by_group(point, part_of_face);
    let others = windings.iter().filter(|(part, _)| *part != this.number);
    others
        .map(|&(part, n)| signs[part as usize] * n)
        .sum::<i32>()
        > 0
}

/// Whether some faces wind around a point, as an outward surface does around its inside.
pub(super) fn is_wound_around(mesh: &TriangleMesh, faces: &[u32], point: DVec3) -> bool {
    let winding: f64 = faces
        .iter()
        .map(|&face| winding_of(mesh.corners(face as usize).map(|p| p - point)))
        .sum();
    winding.abs() > 0.5
}

/// How much of a full turn a triangle winds around the origin.
fn winding_of([a, b, c]: [DVec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    a.dot(b.cross(c)).atan2(below) / std::f64::consts::TAU
}
