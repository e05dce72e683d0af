//! Silhouette interpolation between two views, and a viewpoint on the line between them (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, `linSillInterp`: rectify the pair, sweep both silhouettes, interpolate the spans,
//! connect them. Deviation: what does not depend on the viewpoint is prepared, see `rows` and `within`. For cliques, where either view
//! has one interval, its sides are followed from vertex to vertex until a chain ends; where there are several, spans are visited
//! slab by slab.

mod paper;
pub(crate) mod tangent_arc;
pub(crate) mod visual_hull;

use glam::DVec4;

use crate::loops::DeepLoops;
use crate::pair_cache::RectifiedPair;
use crate::rule::paper::cliques::{GapMatching, GapTracks};
use crate::rule::paper::spans::{Cuts, SpanScratch};
use crate::rule::tangent_arc::prepare::{CrossingScratch, RowsScratch};
use crate::rule::visual_hull::PairScratch;
use crate::sweep::coverage::Cover;
use crate::sweep::follow::{do_cross, follow_pair};
use crate::sweep::interval::{Interval, Touch};
use crate::sweep::loop_builder::{Connector, Slack};
use crate::sweep::monotone_chain::{Chains, Walker, first_range, next_range};

/// Rectified coordinates are tangents: this is a seventh of a pixel of a 512² capture, less than contours are simplified by.
/// It keeps the vertices of both views from adding up along straight stretches.
const SLACK_TANGENT: f64 = 2e-4;

/// Hairs and slits of the tight rule are cut where they are narrower than this, about two pixels of a 512² capture.
const HAIR_TANGENT: f64 = 3e-3;

/// Disparities do not move anything by more than themselves, and mostly by a small part.
const SLACK_DISPARITY: f64 = 10.0 * SLACK_TANGENT;

/// How the ends of two spans are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pairing {
    /// Every interval with every other, as far as their rays meet within the sphere of this radius about the center:
    /// conservative for a model in that sphere.
    Within {
        /// Radius of the model's bounding sphere; with `None` the two-view visual hull.
        radius: Option<f64>,
    },
    /// Only within cliques: the paper's heuristic, tighter, and able to miss geometry.
    Cliques,
    /// Intervals linked by their depths, ends joined by the tight rule.
    Tight,
}

/// Buffers of one interpolation between two views.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinearScratch {
    walkers: [Walker; 2],
    spans: [Vec<Interval>; 2],
    gaps: [GapTracks; 2],
    matching: GapMatching,
    cuts: Cuts,
    rows: RowsScratch,
    crossing: CrossingScratch,
    side_ends: Vec<usize>,
    span: SpanScratch,
    pairs: PairScratch,
    cover: Cover,
    connector: Connector,
    /// Whether vertices stay that lie almost on the line between their neighbours.
    keeps_all_vertices: bool,
}

/// What a sweep over a pair needs to know beside the silhouettes.
#[derive(Clone, Copy, Debug)]
struct Sweep<'a> {
    chains: &'a [Chains; 2],
    alpha: f64,
    /// Whether gaps of both views were tracked and matched.
    is_matched: bool,
}

impl LinearScratch {
    /// Writes the silhouette seen from (1 − α)·p₁ + α·p₂ to `output`, in coordinates of the pair's frame.
    pub(crate) fn interpolate(
        &mut self,
        pair: &mut RectifiedPair,
        alpha: f64,
        pairing: Pairing,
        output: &mut DeepLoops,
    ) {
        self.connector.clear();
        match pairing {
            Pairing::Cliques => {
                let is_matched = self.match_gaps(&pair.chains);
                self.sweep(&Sweep {
                    chains: &pair.chains,
                    alpha,
                    is_matched,
                });
            }
            Pairing::Tight => {
                let rows = pair.rows(&mut self.rows);
                rows.interpolate(alpha, &mut self.crossing, &mut self.connector);
            }
            Pairing::Within { radius } => {
                let rows = pair.pair_rows(radius, &mut self.pairs);
                rows.interpolate(alpha, &mut self.cover, &mut self.connector);
            }
        }
        let slack = if self.keeps_all_vertices { 0.0 } else { 1.0 };
        self.connector.finish(
            Slack {
                line: slack * SLACK_TANGENT,
                depth: slack * SLACK_DISPARITY,
                hair: if pairing == Pairing::Tight {
                    slack * HAIR_TANGENT
                } else {
                    0.0
                },
            },
            output,
        );
        let inverse_depth = 1.0 / pair.depths.baseline;
        output.transform(|p| {
            // Depth is baseline over disparity.
            let slide = if p.w == 0.0 { 0.0 } else { -p.w / (p.z * p.z) };
            DVec4::new(p.x, p.y, p.z * inverse_depth, slide)
        });
    }

    /// Tracks and matches the gaps of both views; false when one has none, so that there is nothing to cut.
    fn match_gaps(&mut self, chains: &[Chains; 2]) -> bool {
        let views = chains.iter().zip(&mut self.walkers);
        for (gaps, (chains, walker)) in self.gaps.iter_mut().zip(views) {
            gaps.track(chains, walker);
        }
        let [one, two] = &self.gaps;
        if one.is_empty() || two.is_empty() {
            return false;
        }
        self.matching.assign(one, two);
        true
    }

    /// Goes down both silhouettes from one height where a chain ends or begins to the next.
    fn sweep(&mut self, sweep: &Sweep<'_>) {
        self.cuts.clear();
        let mut range = first_range(&mut self.walkers, sweep.chains);
        while let Some(heights) = range {
            if !self.follow(heights, sweep) {
                self.visit_slabs(heights, sweep);
            }
            range = next_range(&mut self.walkers, sweep.chains, heights.1);
        }
    }

    /// Follows both sides where each view has one interval; false, with nothing done, where one has several, or where the sides
    /// meet.
    fn follow(&mut self, heights: (f64, f64), sweep: &Sweep<'_>) -> bool {
        if self.walkers.iter().any(|w| w.n_intervals() != 1) {
            return false;
        }
        let (chains, alpha) = (sweep.chains, sweep.alpha);
        let rule = |a: Touch, b: Touch| a.lerp(b, alpha);
        let (one, two) = (self.walkers[0].strands(), self.walkers[1].strands());
        self.connector.begin_slab(heights.0);
        self.side_ends.clear();
        let points = self.connector.points();
        let start = points.len();
        for (one, two) in one.iter().zip(two) {
            let views = (&chains[0], &chains[1]);
            follow_pair(views, [*one, *two], heights, rule, points);
            let middle = self.side_ends.last().copied();
            let do_meet = |middle: usize| do_cross(&points[start..middle], &points[middle..]);
            if middle.is_some_and(do_meet) {
                points.truncate(start);
                return false;
            }
            self.side_ends.push(points.len());
        }
        self.connector
            .end_followed(start, &self.side_ends, heights.1);
        for (walker, chains) in self.walkers.iter_mut().zip(chains) {
            walker.advance(chains, heights.1);
        }
        true
    }

    /// Interpolates spans slab by slab, between vertices of either view.
    fn visit_slabs(&mut self, (mut y, end): (f64, f64), sweep: &Sweep<'_>) {
        while y < end {
            let bottom = (self.walkers[0].next_vertex())
                .min(self.walkers[1].next_vertex())
                .min(end);
            for ((walker, chains), span) in
                (self.walkers.iter_mut().zip(sweep.chains)).zip(&mut self.spans)
            {
                walker.intervals((y, bottom), span);
                walker.advance(chains, bottom);
            }
            self.visit_slab((y, bottom), sweep);
            y = bottom;
        }
    }

    fn visit_slab(&mut self, heights: (f64, f64), sweep: &Sweep<'_>) {
        let [one, two] = &self.spans;
        let alpha = sweep.alpha;
        if sweep.is_matched {
            let [gaps_one, gaps_two] = &self.gaps;
            let middle = 0.5 * (heights.0 + heights.1);
            self.matching
                .cuts(gaps_one, gaps_two, middle, &mut self.cuts);
        }
        self.span
            .interpolate(heights, (one, two), &self.cuts, alpha, &mut self.connector);
    }
}

#[cfg(test)]
mod tests;
