//! The exact silhouette of a model as a clip region of a frame.

use silmap_exact::{DirectedEdge, FanReport, Outliner, chain_loops, decompose_loops, image_loops};
use silmap_geometry::{Camera, Loop, TriangleMesh};
use silmap_study::ClipShape;

use crate::MeasureError;

/// The exact silhouette in an image.
#[derive(Clone, Debug)]
pub struct ExactShape {
    loops: Vec<Loop>,
    outline: Vec<Loop>,
    fans: FanReport,
}

impl ExactShape {
    /// The region that the edges of the whole silhouette bound. The outline, for soft edges alone, is made when
    /// `with_outline`.
    ///
    /// # Errors
    /// When the edges are no silhouette, or a vertex does not lie in front of the eye.
    pub fn new(
        mesh: &TriangleMesh,
        edges: &[DirectedEdge],
        camera: &Camera,
        with_outline: bool,
    ) -> Result<Self, MeasureError> {
        let loops = image_loops(&chain_loops(edges)?, &mesh.positions, camera)?;
        let (loops, fans) = decompose_loops(&loops);
        let outline = if with_outline {
            Outliner::new(&mesh.positions).outline(edges, camera)?
        } else {
            Vec::new()
        };
        Ok(Self {
            loops,
            outline,
            fans,
        })
    }

    /// As the renderer takes it.
    #[must_use]
    pub fn clip_shape(&self) -> ClipShape<'_> {
        ClipShape {
            loops: &self.loops,
            outline: &self.outline,
        }
    }

    /// What the stencil is filled with.
    #[must_use]
    pub fn fans(&self) -> &FanReport {
        &self.fans
    }
}
