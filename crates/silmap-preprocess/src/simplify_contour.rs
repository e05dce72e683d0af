//! Contour simplification: greedy vertex removal within a tolerance.
//!
//! A traced outline is a staircase. Its corners lie on both sides of the true outline, the middles of its cracks mostly on
//! it, so first every corner is cut off half a step away (when the tolerance allows that). Then vertices go, the one whose
//! removal costs least first: the two edges that met there become one, laid through the cracks of both by least squares,
//! and the edge's ends move with it.
//!
//! Every point of the new outline stays within the tolerance of the traced one. (The other way round it is √2 times the
//! tolerance, at the corners of a staircase: with half a pixel, every straight line sampled at pixel centres may become one
//! edge.) Loops neither cross themselves nor each other, and none changes sides with another.
//!
//! In outward mode no corner is cut, and an outline changes in two ways only, both adding to the region: a
//! concave vertex goes, or the edge between two convex vertices gives way to the point where its neighbours meet.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. TR-1-99, Harvard University, 1999, section 4.
//! Deviations: the paper keeps some of the staircase's corners; here edges are fitted to the cracks, which makes the outline
//! unbiased and several times sparser at the same tolerance.

mod fit;
mod grid;
mod hidden;
mod levels;
mod moments;
mod outline;
mod outward;
#[cfg(test)]
mod tests;

use silmap_geometry::{CostQueue, CoverageRule, Loop};

pub(crate) use hidden::thin_hidden;
pub use levels::add_levels;
use outline::{Proposal, SimplifiedLoops};

/// How far to simplify.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyContourParams {
    /// Largest distance of a point of the simplified outline from the traced one, pixels. With 0 only vertices on
    /// straight lines go.
    pub tolerance_px: f64,
    /// Whether the simplified region must contain the traced one. A tolerance under 0.71 keeps most steps of a staircase
    /// then: the line along the outside of one is that far from its inner corners.
    pub outward_only: bool,
}

impl Default for SimplifyContourParams {
    fn default() -> Self {
        Self {
            tolerance_px: 0.5,
            outward_only: false,
        }
    }
}

impl SimplifyContourParams {
    /// What suits outlines of pixels captured by a rule: those of all touched pixels only grow, and not even the diagonal of a
    /// staircase is within half a pixel of its outside.
    #[must_use]
    pub fn for_coverage(coverage: CoverageRule) -> Self {
        match coverage {
            CoverageRule::Center => Self::default(),
            CoverageRule::Any => Self {
                tolerance_px: 0.75,
                outward_only: true,
            },
        }
    }
}

/// Moved vertices are rounded to this fraction of a pixel, which is also what a file keeps of them: writing loses nothing.
pub const VERTEX_STEPS_PER_PX: f64 = 16.0;

/// Simplifies the loops of one image together, in their order; each keeps its orientation and at least three vertices.
///
/// The loops must be simple and not cross, as [`silmap_geometry::trace::trace_contours`] returns them.
#[must_use]
pub fn simplify_contours(loops: &[Loop], params: &SimplifyContourParams) -> Vec<Loop> {
    let mut outline = SimplifiedLoops::new(loops, params);
    if params.outward_only {
        remove_vertices(
            &mut outline,
            SimplifiedLoops::cost_of_outward,
            SimplifiedLoops::propose_outward,
        );
    } else {
        remove_vertices(
            &mut outline,
            SimplifiedLoops::cost_of_fitted,
            SimplifiedLoops::propose_fitted,
        );
    }
    outline.into_loops()
}

/// Removes the vertex of least cost that has a valid proposal, again and again, until there is none.
fn remove_vertices(
    outline: &mut SimplifiedLoops,
    cost: impl Fn(&SimplifiedLoops, u32) -> Option<f64>,
    propose: impl Fn(&SimplifiedLoops, u32) -> Option<Proposal>,
) {
    // Of equal costs the lower vertex goes first.
    let mut queue: CostQueue<_> = (0..outline.vertex_count())
        .filter(|&v| !outline.is_gone(v))
        .filter_map(|v| Some((cost(outline, v)?, (v, outline.version(v)))))
        .collect();
    while let Some((_, (v, version))) = queue.pop() {
        if outline.version(v) != version {
            continue;
        }
        let Some(proposal) = propose(outline, v).filter(|p| outline.is_clear(v, p)) else {
            // It comes back when something near it changes.
            continue;
        };
        for near in outline.apply(v, &proposal) {
            if let Some(cost) = cost(outline, near) {
                queue.push(cost, (near, outline.version(near)));
            }
        }
    }
}
