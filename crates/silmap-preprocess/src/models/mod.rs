//! Models that need no file: closed, oriented, outward manifolds of any face count.
//!
//! The same kind and count always give the same mesh. Counts are approached, not promised: each function says how near.

mod tube;

use silmap_geometry::TriangleMesh;

/// Most faces a model is made of; larger requests get this many.
pub const MAX_FACES: usize = 8_000_000;

/// A torus with radii 1 and 0.4 about the z axis.
///
/// A grid of quadrilaterals cut in two: the count is the nearest `2 · rings · sides` with near-square cells, at least 18.
#[must_use]
pub fn torus(faces: usize) -> TriangleMesh {
    tube::torus(faces.min(MAX_FACES))
}

/// A tube about a (2, 3) torus knot: genus 1, knotted, radius about 1.5.
///
/// The count is the nearest `2 · rings · sides` with near-square cells, at least 144.
#[must_use]
pub fn trefoil_knot(faces: usize) -> TriangleMesh {
    tube::trefoil_knot(faces.min(MAX_FACES))
}
