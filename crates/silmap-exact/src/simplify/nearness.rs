//! The angular distance of vertices from the silhouettes to be kept.

use glam::DVec3;
use silmap_geometry::{Interrupted, TriangleMesh};

use crate::is_front_facing;
use crate::watch::Counter;

/// Per vertex, how near it is to a silhouette from any of `eyes`: one on a silhouette edge, falling to zero where all its faces are
/// seen at more than `band_rad` from edge-on.
#[must_use]
pub fn silhouette_nearness(mesh: &TriangleMesh, eyes: &[DVec3], band_rad: f64) -> Vec<f64> {
    let mut field = Nearness::new(mesh);
    for &eye in eyes {
        field.look_from(eye, band_rad);
    }
    field.nearness
}

pub(super) fn watched_nearness(
    mesh: &TriangleMesh,
    eyes: &[DVec3],
    band_rad: f64,
    counter: &mut Counter<'_>,
) -> Result<Vec<f64>, Interrupted> {
    let mut field = Nearness::new(mesh);
    for (k, &eye) in eyes.iter().enumerate() {
        counter.tell_done((k * mesh.faces.len()) as u64)?;
        field.look_from(eye, band_rad);
    }
    Ok(field.nearness)
}

/// How near vertices are to silhouettes, from one eye after the other.
struct Nearness<'m> {
    mesh: &'m TriangleMesh,
    nearness: Vec<f64>,
    /// Per vertex: whether it has a front-facing face and whether it has another.
    sides: Vec<[bool; 2]>,
}

impl<'m> Nearness<'m> {
    fn new(mesh: &'m TriangleMesh) -> Self {
        Self {
            mesh,
            nearness: vec![0.0; mesh.positions.len()],
            sides: vec![[false; 2]; mesh.positions.len()],
        }
    }

    fn look_from(&mut self, eye: DVec3, band_rad: f64) {
        let (mesh, nearness, sides) = (self.mesh, &mut self.nearness, &mut self.sides);
        sides.fill([false; 2]);
        for (f, face) in mesh.faces.iter().enumerate() {
            let corners = mesh.corners(f);
            let is_front = is_front_facing(corners, eye);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let ray = (eye - middle).normalize_or_zero();
            let sine = mesh.face_cross(f).normalize_or_zero().dot(ray);
            let near = 1.0 - sine.clamp(-1.0, 1.0).asin().abs() / band_rad;
            for &v in face {
                sides[v as usize][usize::from(is_front)] = true;
                nearness[v as usize] = nearness[v as usize].max(near);
            }
        }
        // Between a front and a back face of one vertex there is a silhouette edge at it.
        for (near, sides) in nearness.iter_mut().zip(&*sides) {
            if *sides == [true; 2] {
                *near = 1.0;
            }
        }
    }
}
