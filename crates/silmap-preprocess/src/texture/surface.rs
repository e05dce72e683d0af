//! Colour and normal of the original at any surface point.

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

    /// The unit normal at a point of a face, given by the weights of its corners.
    pub(super) fn normal(&self, face: usize, weights: [f64; 3]) -> DVec3 {
        let corners = self.mesh.faces[face];
        let normal: DVec3 = (0..3)
            .map(|k| self.normals[corners[k] as usize] * weights[k])
            .sum();
        normal
            .try_normalize()
            .or_else(|| self.mesh.face_cross(face).try_normalize())
            .unwrap_or_default()
    }

    /// Linear RGB of the surface there under the studio light.
    pub(super) fn lit_colour(&self, face: usize, weights: [f64; 3], normal: DVec3) -> [f32; 3] {
        let light = lighting::irradiance(normal.as_vec3().to_array());
        let albedo = self.mesh.appearance.albedo(face, weights.map(|w| w as f32));
        albedo.map(|c| c * light)
    }
}
