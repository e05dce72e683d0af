//! Planes of four faces side by side, so that one instruction works on all of them.

use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;

/// Faces in a block.
pub(crate) const LANES: usize = 4;
/// Planes of faces, coordinate by coordinate.
pub(crate) type PlaneBlock = [[f32; LANES]; 4];

/// The planes of at least one and at most [`LANES`] faces, and the faces; the first fills what is left.
pub(crate) fn block_of(mesh: &EdgeMesh, faces: &[u32]) -> (PlaneBlock, [u32; LANES]) {
    let ids: [u32; LANES] =
        std::array::from_fn(|lane| faces.get(lane).copied().unwrap_or(faces[0]));
    let mut block = PlaneBlock::default();
    for (lane, &face) in ids.iter().enumerate() {
        for (row, coordinate) in block.iter_mut().zip(mesh.planes()[face as usize]) {
            row[lane] = coordinate;
        }
    }
    (block, ids)
}

impl Query {
    /// What each of four planes says of the viewpoint, as [`Query::value`] does.
    #[inline(always)]
    pub(crate) fn values(&self, [x, y, z, w]: &PlaneBlock) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        for lane in 0..LANES {
            values[lane] = self.value(&[x[lane], y[lane], z[lane], w[lane]]);
        }
        values
    }
}
