//! The progressive hull: nested coarse meshes that enclose the model.
//!
//! Edges are collapsed one after the other, always the one that adds the least volume (with a say for shape), and the
//! new vertex is placed so that no point of space loses winding number: the module `placement` says why. The sequence is
//! kept as a progressive mesh, so that every face count in between can be taken out of it.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. TR-1-99, 1999, section 7; the progressive mesh
//! is that of H. Hoppe. Progressive Meshes. SIGGRAPH 1996.
//!
#![doc = include_str!("../README.md")]

mod collapse;
mod colours;
mod inside;
mod placement;
mod progressive;
mod rounded;
mod self_crossing;
mod sequence;
mod surface;
mod tighten;
mod verify;

use serde::{Deserialize, Serialize};
use silmap_geometry::{Bvh, ClosedMesh, Interrupted, Stage, TriangleMesh, Watch};
use thiserror::Error;

use collapse::Limits;
use surface::Surface;

pub use progressive::{HullLevel, LevelSummary, ProgressiveHull};
pub use rounded::RoundedHull;
pub use self_crossing::count_self_crossings;
pub use sequence::{MAGIC as SEQUENCE_MAGIC, SequenceError};
pub use tighten::Tightening;
pub use verify::{VerifyParams, VerifyReport, verify, verify_inner};

/// Collapsing, whose units are faces.
pub const STAGE: Stage = Stage("growing the hull");

/// What hull to make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HullParams {
    /// Faces to stop at.
    pub target_faces: u32,
    /// Volume to stop at, over the model's: above one for an outer hull, below for an inner one.
    pub volume_ratio: Option<f64>,
    /// Distance from the model's surface, in the model's units, that no vertex of the hull may exceed.
    pub max_distance: Option<f64>,
    /// Enclosed by the model rather than enclosing it.
    pub inner: bool,
    /// No collapse may let the hull pass through itself. Where the model does, the hull may.
    pub no_self_intersections: bool,
    /// Weight of the new faces' shape against the volume they add.
    pub compactness_weight: f64,
}

impl Default for HullParams {
    fn default() -> Self {
        Self {
            target_faces: 500,
            volume_ratio: None,
            max_distance: None,
            inner: false,
            no_self_intersections: false,
            compactness_weight: 1e-5,
        }
    }
}

impl HullParams {
    fn validate(&self) -> Result<(), HullError> {
        let bad = |name, value: f64, wanted| {
            Err(HullError::BadParameter {
                name,
                value,
                wanted,
            })
        };
        if self.target_faces < 4 {
            let value = f64::from(self.target_faces);
            return bad("face count", value, "a closed mesh has at least 4");
        }
        if let Some(ratio) = self.volume_ratio {
            let is_right = if self.inner {
                ratio <= 1.0
            } else {
                ratio >= 1.0
            };
            if !(is_right && ratio > 0.0 && ratio.is_finite()) {
                let wanted = "an outer hull needs one or more, an inner one up to one";
                return bad("volume ratio", ratio, wanted);
            }
        }
        match self.max_distance {
            Some(d) if d.is_nan() || d < 0.0 => {
                bad("largest distance", d, "it must not be negative")
            }
            _ if self.compactness_weight < 0.0 || !self.compactness_weight.is_finite() => bad(
                "compactness weight",
                self.compactness_weight,
                "it must not be negative",
            ),
            _ => Ok(()),
        }
    }
}

/// Why there is no hull.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum HullError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A parameter makes no sense.
    #[error("the hull's {name} is {}: {wanted}", silmap_geometry::camera::in_short(*.value))]
    BadParameter {
        /// Which one.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
}

/// Collapses the mesh down to the faces asked for, or as far as it goes: compare [`ProgressiveHull::least_faces`].
///
/// # Errors
/// When a parameter makes no sense, or the caller asks to stop.
pub fn build(
    mesh: &ClosedMesh,
    params: &HullParams,
    watch: &Watch<'_>,
) -> Result<ProgressiveHull, HullError> {
    params.validate()?;
    let origin = mesh.origin();
    let mesh = mesh.mesh();
    let unit = mesh.bounds().radius.log2().ceil().exp2();
    let faces: Vec<[u32; 3]> = if params.inner {
        mesh.faces.iter().map(|&[a, b, c]| [a, c, b]).collect()
    } else {
        mesh.faces.clone()
    };
    let scaled = TriangleMesh {
        positions: mesh.positions.iter().map(|&p| p / unit).collect(),
        faces,
        ..TriangleMesh::default()
    };
    let original = Bvh::new(&scaled);
    let volume = scaled.volume();
    let limits = Limits {
        faces: params.target_faces as usize,
        volume: params.volume_ratio.map_or(f64::INFINITY, |r| r * volume),
        distance: params.max_distance.map_or(f64::INFINITY, |d| d / unit),
    };
    watch.start(STAGE, mesh.faces.len().saturating_sub(limits.faces) as u64);
    let surface = Surface::new(scaled.positions.clone(), &scaled.faces);
    let model = collapse::Model {
        mesh: &scaled,
        tree: &original,
        volume,
    };
    let collapsed = collapse::collapse(surface, &model, &limits, params, watch)?;
    watch.finish(STAGE);
    Ok(ProgressiveHull {
        collapsed,
        scaled,
        original,
        original_faces: mesh.faces.len(),
        original_volume: volume,
        unit,
        origin,
        is_inner: params.inner,
        may_cross_itself: !params.no_self_intersections,
        distance_limit: limits.distance,
    })
}

#[cfg(test)]
mod tests;
