//! Planes of eight faces side by side, so that one instruction works on several of them.

use glam::{BVec4A, Mat4, Vec4};

use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;

/// Faces in a block.
pub(crate) const LANES: usize = 8;

/// Planes of faces, coordinate by coordinate, four and four.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct PlaneBlock([[Vec4; 4]; 2]);

impl PlaneBlock {
    /// The planes of some faces.
    pub(crate) fn new(mesh: &EdgeMesh, faces: &[u32; LANES]) -> Self {
        Self(std::array::from_fn(|half| {
            transposed(std::array::from_fn(|lane| {
                Vec4::from_array(mesh.planes()[faces[4 * half + lane] as usize])
            }))
        }))
    }

    /// One bit for each face that shows its front, and for each of which that is not known for sure.
    #[inline(always)]
    pub(crate) fn fronts(&self, query: &Query) -> (u8, u8) {
        let [first, second] = self.0.map(|[x, y, z, w]| {
            x * query.point.x + y * query.point.y + z * query.point.z + w * query.weight
        });
        let error = Vec4::splat(query.value_error);
        (
            mask_of(first.cmpgt(Vec4::ZERO), second.cmpgt(Vec4::ZERO)),
            mask_of(first.abs().cmple(error), second.abs().cmple(error)),
        )
    }
}

/// One bit for each of eight.
#[inline(always)]
pub(crate) fn mask_of(first: BVec4A, second: BVec4A) -> u8 {
    (first.bitmask() | second.bitmask() << 4) as u8
}

/// Four vectors as their coordinates.
#[inline(always)]
pub(crate) fn transposed([a, b, c, d]: [Vec4; 4]) -> [Vec4; 4] {
    let t = Mat4::from_cols(a, b, c, d).transpose();
    [t.x_axis, t.y_axis, t.z_axis, t.w_axis]
}
