//! Which points of a surface a photograph shows, and how well.

use glam::{DVec2, DVec3};
use silmap_geometry::photograph::Seen;
use silmap_geometry::{Bvh, ClosedMesh, Photograph};

/// Weights are the cosine to the view to this power: about the nearest view, and no seam.
const SHARPNESS: i32 = 6;

/// Views more oblique than this cosine are not asked.
const LEAST_COSINE: f64 = 0.1;

/// Farther from the border than this a view has all of its weight, pixels; at the border it has none.
const FADE_PX: f64 = 4.5;

/// How far the surface may lie in front of a corner and not hide it, in shares of its bounding radius.
const SLACK_REL: f64 = 0.01;

/// A photograph that is asked for a surface's colours.
pub(crate) struct Looker<'a> {
    photograph: &'a Photograph,
    tree: &'a Bvh,
    slack: f64,
}

/// What a photograph shows of a point.
pub(crate) struct Look {
    pub(crate) image: DVec2,
    pub(crate) seen: Seen,
    pub(crate) weight: f64,
}

impl<'a> Looker<'a> {
    pub(crate) fn new(photograph: &'a Photograph, tree: &'a Bvh, surface: &ClosedMesh) -> Self {
        Self {
            photograph,
            tree,
            slack: SLACK_REL * surface.bounds().radius,
        }
    }

    /// What the photograph shows of a point; `None` where it does not show it.
    pub(crate) fn look(&self, point: DVec3, normal: DVec3) -> Option<Look> {
        let to_eye = self.photograph.eye - point;
        let cosine = to_eye.normalize_or_zero().dot(normal);
        if cosine < LEAST_COSINE {
            return None;
        }
        let image = self.photograph.project(point)?;
        let seen = self.photograph.look(image)?;
        let trust = (seen.inside_px / FADE_PX).clamp(0.0, 1.0);
        if trust <= 0.0 {
            return None;
        }
        let from = self.slack / to_eye.length();
        let is_hidden = self.tree.first_hit(point, to_eye, from, 1.0).is_some();
        (!is_hidden).then(|| Look {
            image,
            seen,
            weight: trust * (cosine - LEAST_COSINE).powi(2) * cosine.powi(SHARPNESS),
        })
    }
}
