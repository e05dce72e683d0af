//! Skins: vertices moved by joints.
//!
//! A vertex goes to Σ wₖ · (world from joint k) · (inverse bind matrix k) · v; the transform of the node that has the mesh does
//! not count (glTF 2.0, section 3.7.3).

use glam::DMat4;

use super::super::error::{GltfFault, MeshFault};
use super::attribute::Attribute;

/// What each joint of a skin does to a vertex as it is stored.
pub(super) struct Skin {
    pub(super) index: usize,
    pub(super) world_from_bind: Vec<DMat4>,
}

/// The joints of a primitive's vertices, four at a time, with their weights.
pub(super) struct Influences<'a> {
    pub(super) sets: Vec<(Attribute<'a>, Attribute<'a>)>,
}

impl Skin {
    /// The transform of one vertex.
    pub(super) fn matrix(
        &self,
        influences: &Influences<'_>,
        vertex: usize,
    ) -> Result<DMat4, MeshFault> {
        let (mut sum, mut total) = (DMat4::ZERO, 0.0);
        let mut first = None;
        for (joints, weights) in &influences.sets {
            let joints: [f64; 4] = joints.get(vertex);
            let weights: [f64; 4] = weights.get(vertex);
            for (joint, weight) in joints.into_iter().zip(weights) {
                first = first.or(Some(joint));
                if weight == 0.0 || !weight.is_finite() {
                    continue;
                }
                sum += self.joint(joint)? * weight;
                total += weight;
            }
        }
        // Stored weights add up to one but for rounding. Without any, the first joint has the vertex.
        if total.abs() > f64::EPSILON {
            return Ok(sum * (1.0 / total));
        }
        self.joint(first.unwrap_or(0.0))
    }

    fn joint(&self, number: f64) -> Result<DMat4, MeshFault> {
        let found = self.world_from_bind.get(number as usize);
        found.copied().ok_or(MeshFault::Gltf(GltfFault::Joint {
            skin: self.index,
            joint: number as u64,
            count: self.world_from_bind.len(),
        }))
    }
}
