//! The exact outlines of a mesh, camera by camera.

use std::sync::Arc;

use silmap_exact::{BoundaryEdges, OutlineError, Outliner};
use silmap_geometry::{Camera, Loop, TriangleMesh};

/// The exact outlines of a mesh. Copies share what does not depend on the camera.
#[derive(Clone, Debug)]
pub(crate) struct ExactOutlines<'m> {
    mesh: &'m TriangleMesh,
    edges: Arc<BoundaryEdges>,
    outliner: Outliner<'m>,
}

impl<'m> ExactOutlines<'m> {
    pub(crate) fn new(mesh: &'m TriangleMesh) -> Self {
        Self {
            mesh,
            edges: Arc::new(BoundaryEdges::new(mesh)),
            outliner: Outliner::new(&mesh.positions),
        }
    }

    /// Loops that neither cross nor overlap, pixels.
    pub(crate) fn seen_by(&mut self, camera: &Camera) -> Result<Vec<Loop>, OutlineError> {
        let edges = self.edges.silhouette_edges(self.mesh, camera.eye);
        self.outliner.outline(&edges, camera)
    }
}
