//! Colour and normal of the original at any surface point.

use glam::DVec3;
use silmap_geometry::{TriangleMesh, lighting};

use super::parametrisation::blend;
use super::photographed::Looks;

/// A mesh with its smooth normals, and the photographs that were taken of it.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    pub(super) mesh: &'a TriangleMesh,
    normals: Vec<DVec3>,
    looks: Option<Looks<'a>>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(mesh: &'a TriangleMesh) -> Self {
        Self {
            mesh,
            normals: mesh.vertex_normals(),
            looks: None,
        }
    }

    /// The same with photographs.
    pub(super) fn photographed(self, looks: Looks<'a>) -> Self {
        Self {
            looks: Some(looks),
            ..self
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

    /// Linear RGB of the surface there under the studio light, or as photographs show it, which have their own.
    pub(super) fn lit_colour(&self, face: usize, weights: [f64; 3], normal: DVec3) -> [f32; 3] {
        let light = lighting::irradiance(normal.as_vec3().to_array());
        let albedo = self.mesh.appearance.albedo(face, weights.map(|w| w as f32));
        let lit = albedo.map(|c| c * light);
        match &self.looks {
            None => lit,
            Some(looks) => looks.colour(blend(&self.mesh.corners(face), weights), normal, lit),
        }
    }
}
