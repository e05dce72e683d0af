//! The original as something that has a colour at every point.

use glam::DVec3;
use silmap_geometry::{TriangleMesh, lighting};

/// A mesh with its smooth normals.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    pub(super) mesh: &'a TriangleMesh,
    normals: Vec<DVec3>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(mesh: &'a TriangleMesh) -> Self {
        Self {
            mesh,
            normals: mesh.vertex_normals(),
        }
    }

    /// Linear RGB of the lit surface at a point of a face, given by the weights of its corners.
    pub(super) fn colour(&self, face: usize, weights: [f64; 3]) -> [f32; 3] {
        let corners = self.mesh.faces[face];
        let normal: DVec3 = (0..3)
            .map(|k| self.normals[corners[k] as usize] * weights[k])
            .sum();
        let normal = normal
            .try_normalize()
            .or_else(|| self.mesh.face_cross(face).try_normalize())
            .unwrap_or_default();
        let light = lighting::irradiance(normal.as_vec3().to_array());
        let weights = weights.map(|w| w as f32);
        self.mesh
            .appearance
            .albedo(face, weights)
            .map(|c| c * light)
    }
}
