//! Pair interpolation: the silhouette from a viewpoint on the line between two views (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, `linSillInterp`: sweep both rectified silhouettes, interpolate the spans, connect them.
//! Deviation: what does not depend on the viewpoint is prepared once, see [`span_pairs`] and [`tangent_arc::prepare`].

pub(crate) mod method;
mod paper_cliques;
pub(crate) mod prepared_pair;
pub(crate) mod span_pairs;
pub(crate) mod tangent_arc;
pub(crate) mod visual_hull;

use glam::DVec4;

use crate::loops::DeepLoops;
use crate::sweep::coverage::CoverageSweep;
use crate::sweep::loop_builder::LoopBuilder;
use crate::sweep::sleeve::Slack;
use crate::tidy::CrumbScratch;
use method::Method;
use prepared_pair::{PrepareScratch, Prepared, PreparedPair};
use tangent_arc::prepare::CrossingScratch;

/// Rectified coordinates are tangents: this is a seventh of a pixel of a 512² capture, less than contours are simplified by.
/// It keeps the vertices of both views from adding up along straight stretches.
const SLACK_TANGENT: f64 = 2e-4;

/// Hairs and slits of the tight rule are cut where they are narrower than this, about two pixels of a 512² capture.
const HAIR_TANGENT: f64 = 3e-3;

/// Disparities do not move anything by more than themselves, and mostly by a small part.
const SLACK_DISPARITY: f64 = 10.0 * SLACK_TANGENT;

/// Buffers of one interpolation between two views.
#[derive(Clone, Debug, Default)]
pub struct PairInterpolator {
    scratch: PrepareScratch,
    crossing: CrossingScratch,
    coverage: CoverageSweep,
    builder: LoopBuilder,
    crumbs: CrumbScratch,
    /// Whether vertices stay that lie almost on the line between their neighbours.
    keeps_all_vertices: bool,
}

impl PairInterpolator {
    /// Writes the silhouettes of all `parts`, in order, seen from (1 − α)·p₁ + α·p₂ to `output`, in coordinates of the pair's frame. A part that only one
    /// view shows is left out.
    pub fn interpolate(
        &mut self,
        parts: &mut [PreparedPair],
        alpha: f64,
        method: Method,
        output: &mut DeepLoops,
    ) {
        output.clear();
        let Some(first) = parts.first() else { return };
        let inverse_depth = 1.0 / first.baseline();
        for (part, silhouettes) in (0_u16..).zip(parts) {
            if !silhouettes.is_in_both() {
                continue;
            }
            output.set_part(part);
            self.interpolate_part(silhouettes, alpha, method, output);
        }
        output.transform(|p| {
            // Depth is baseline over disparity.
            let slide = if p.w == 0.0 { 0.0 } else { -p.w / (p.z * p.z) };
            DVec4::new(p.x, p.y, p.z * inverse_depth, slide)
        });
    }

    /// Appends the silhouette of one part, with disparities.
    fn interpolate_part(
        &mut self,
        pair: &mut PreparedPair,
        alpha: f64,
        method: Method,
        output: &mut DeepLoops,
    ) {
        self.builder.clear();
        match pair.prepare(method, &mut self.scratch) {
            Prepared::Arcs(arcs) => {
                arcs.interpolate(alpha, &mut self.crossing, &mut self.builder);
            }
            Prepared::Pairs(pairs) => {
                pairs.interpolate(alpha, &mut self.coverage, &mut self.builder);
            }
        }
        let slack = if self.keeps_all_vertices { 0.0 } else { 1.0 };
        let hair = if method.is_tidied() {
            HAIR_TANGENT
        } else {
            0.0
        };
        let n_before = output.n_loops();
        self.builder.finish(
            Slack {
                line: slack * SLACK_TANGENT,
                depth: slack * SLACK_DISPARITY,
                hair: slack * hair,
            },
            output,
        );
        if method.is_tidied() {
            (self.crumbs).leave_out_pieces(pair.most_pieces(), n_before, output);
        }
    }
}

#[cfg(test)]
mod tests;
