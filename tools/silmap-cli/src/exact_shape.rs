//! The exact silhouette of a model as a clip region of a frame.

use serde::Serialize;
use silmap_exact::{DirectedEdge, FanReport, Outliner, chain_loops, decompose_loops, image_loops};
use silmap_geometry::{Camera, Loop, TriangleMesh};
use silmap_runtime::{ClipShape, FanApex, FillRule};

/// The exact silhouette in an image.
#[derive(Clone, Debug)]
pub(crate) struct ExactShape {
    layers: [Vec<Loop>; 1],
    outline: Vec<Loop>,
    fans: FanReport,
}

/// What the stencil was filled with.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct FansJson {
    loops: usize,
    loops_decomposed: usize,
    /// Pixels that fan triangles pass over, before and after long loops were cut.
    fan_area: f64,
    fan_area_decomposed: f64,
}

impl ExactShape {
    /// The region that the edges of the whole silhouette bound. The outline, for soft edges alone, is made when
    /// `with_outline`.
    ///
    /// # Errors
    /// When the edges are no silhouette, or a vertex does not lie in front of the eye.
    pub(crate) fn new(
        mesh: &TriangleMesh,
        edges: &[DirectedEdge],
        camera: &Camera,
        with_outline: bool,
    ) -> anyhow::Result<Self> {
        let loops = image_loops(&chain_loops(edges)?, &mesh.positions, camera)?;
        let (layer, fans) = decompose_loops(&loops);
        let outline = if with_outline {
            Outliner::new(&mesh.positions).outline(edges, camera)?
        } else {
            Vec::new()
        };
        Ok(Self {
            layers: [layer],
            outline,
            fans,
        })
    }

    /// As the renderer takes it.
    pub(crate) fn clip_shape(&self) -> ClipShape<'_> {
        ClipShape {
            rule: FillRule::NonZero,
            apex: FanApex::Centroid,
            layers: &self.layers,
            outline: &self.outline,
        }
    }

    pub(crate) fn fans(&self) -> FansJson {
        FansJson {
            loops: self.fans.loops_before,
            loops_decomposed: self.fans.loops_after,
            fan_area: self.fans.area_before_px,
            fan_area_decomposed: self.fans.area_after_px,
        }
    }
}
