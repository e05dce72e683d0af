//! Turning closed parts outward.
//!
//! Source (winding number as a sum of solid angles): A. van Oosterom, J. Strackee. The Solid Angle of a Plane Triangle.
//! IEEE Transactions on Biomedical Engineering 30, 1983.

use glam::DVec3;

use crate::mesh::{Bounds, TriangleMesh};
use crate::topology::Topology;

/// A point counts as inside when surfaces wind around it more than this; the exact values are whole numbers.
const INSIDE_WINDING: f64 = 0.5;

struct Part {
    faces: Vec<u32>,
    bounds: Bounds,
    volume: f64,
}

/// Turns parts outward: everything if the whole has a negative volume, then each part that faces inward without lying
/// inside others (one that does is a cavity). Only closed and consistent parts are looked at. Returns the number of
/// faces turned.
pub fn turn_outward(mesh: &mut TriangleMesh) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut parts = closed_parts(mesh, &topology);
    let mut is_flipped = vec![false; mesh.faces.len()];
    if parts.iter().map(|p| p.volume).sum::<f64>() < 0.0 {
        for part in &mut parts {
            flip_part(mesh, part, &mut is_flipped);
        }
    }
    for i in 0..parts.len() {
        if parts[i].volume < 0.0 && !lies_inside_others(mesh, &parts, i) {
            flip_part(mesh, &mut parts[i], &mut is_flipped);
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

fn closed_parts(mesh: &TriangleMesh, topology: &Topology) -> Vec<Part> {
    let (part_of_face, count) = topology.parts();
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
        .filter(|(_, is_closed)| *is_closed)
        .map(|(faces, _)| {
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
                volume: six / 6.0,
                faces,
                bounds,
            }
        })
        .collect()
}

/// Whether the other parts wind around a point of this one.
fn lies_inside_others(mesh: &TriangleMesh, parts: &[Part], this: usize) -> bool {
    let [a, b, c] = mesh.corners(parts[this].faces[0] as usize);
    let point = (a + b + c) / 3.0;
    let winding: f64 = parts
        .iter()
        .enumerate()
        .filter(|(other, part)| {
            *other != this
                && point.cmpge(part.bounds.min).all()
                && point.cmple(part.bounds.max).all()
        })
        .flat_map(|(_, part)| &part.faces)
        .map(|&face| winding_of(mesh.corners(face as usize).map(|p| p - point)))
        .sum();
    winding > INSIDE_WINDING
}

/// Whether some faces wind around a point, as an outward surface does around its inside.
pub(super) fn is_wound_around(mesh: &TriangleMesh, faces: &[u32], point: DVec3) -> bool {
    let winding: f64 = faces
        .iter()
        .map(|&face| winding_of(mesh.corners(face as usize).map(|p| p - point)))
        .sum();
    winding.abs() > INSIDE_WINDING
}

/// How much of a full turn a triangle winds around the origin.
fn winding_of([a, b, c]: [DVec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    a.dot(b.cross(c)).atan2(below) / std::f64::consts::TAU
}
