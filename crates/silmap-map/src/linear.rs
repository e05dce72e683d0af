//! Silhouette interpolation between two views, and a viewpoint on the line between them (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, `linSillInterp`: rectify the pair, sweep both silhouettes, interpolate the spans,
//! connect them. Deviation: where either view has one interval, its sides are followed from vertex to vertex until a chain
//! ends; only where there are several are spans visited slab by slab.

use glam::DVec4;

use crate::chains::{Chains, Walker};
use crate::clique::{GapMatching, GapTracks};
use crate::connect::{Connector, Slack};
use crate::follow::{FEWEST_FOLLOWED, do_cross, follow_one, follow_pair};
use crate::loops::DeepLoops;
use crate::rectified::{RectifiedPair, SphereDepths};
use crate::side::{Interval, Section, Touch};
use crate::span::{Cuts, PairRule, SpanScratch};
use crate::tight::{self, GapShifts, Homes, Linked, Origin, Rim};

/// Rectified coordinates are tangents: this is a seventh of a pixel of a 512² capture, less than contours are simplified by.
/// It keeps the vertices of both views from adding up along straight stretches.
const SLACK_TANGENT: f64 = 2e-4;

/// Hairs and slits of the tight rule are cut where they are narrower than this, about two pixels of a 512² capture.
const HAIR_TANGENT: f64 = 3e-3;

/// On parts of less height, about two pixels of a 512² capture, links are taken to be those half-way.
const LOW_TANGENT: f64 = 3e-3;

/// Disparities do not move anything by more than themselves, and mostly by a small part.
const SLACK_DISPARITY: f64 = 10.0 * SLACK_TANGENT;

/// How the ends of two spans are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pairing {
    #[cfg(test)]
    /// Every interval with every other: the two-view visual hull, always conservative.
    All,
    /// Every interval with every other, as far as their rays meet within the sphere of this radius about the center: still
    /// conservative for a model in that sphere, and tighter.
    Within {
        /// Radius of the model's bounding sphere.
        radius: f64,
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
    sections: [Vec<Section>; 2],
    gaps: [GapTracks; 2],
    matching: GapMatching,
    cuts: Cuts,
    homes: Vec<Homes>,
    links: Vec<Linked>,
    other_links: Vec<Linked>,
    side_ends: Vec<usize>,
    span: SpanScratch,
    connector: Connector,
    /// Whether vertices stay that lie almost on the line between their neighbours.
    keeps_all_vertices: bool,
}

/// What a sweep over a pair needs to know beside the silhouettes.
#[derive(Clone, Copy, Debug)]
struct Sweep<'a> {
    chains: &'a [Chains; 2],
    alpha: f64,
    pairing: Pairing,
    depths: SphereDepths,
    /// Whether gaps of both views were tracked and matched.
    is_matched: bool,
}

impl Sweep<'_> {
    /// Whether sides are followed where a view has several intervals, too.
    fn can_follow_several(&self) -> bool {
        self.pairing == Pairing::Tight
    }
}

impl LinearScratch {
    /// Writes the silhouette seen from (1 − α)·p₁ + α·p₂ to `output`, in coordinates of the pair's frame.
    pub(crate) fn interpolate(
        &mut self,
        pair: &RectifiedPair,
        alpha: f64,
        pairing: Pairing,
        output: &mut DeepLoops,
    ) {
        let is_matched = pairing == Pairing::Cliques && self.match_gaps(&pair.chains);
        self.sweep(&Sweep {
            chains: &pair.chains,
            alpha,
            pairing,
            depths: pair.depths,
            is_matched,
        });
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
        self.connector.clear();
        self.cuts.clear();
        for walker in &mut self.walkers {
            walker.restart();
        }
        let mut y = sweep.chains[0].first_y().min(sweep.chains[1].first_y());
        while y.is_finite() {
            for (walker, chains) in self.walkers.iter_mut().zip(sweep.chains) {
                walker.enter(chains, y);
            }
            let end =
                (self.walkers[0].end(&sweep.chains[0])).min(self.walkers[1].end(&sweep.chains[1]));
            if !end.is_finite() {
                return;
            }
            if self.walkers.iter().all(|w| w.n_intervals() > 0) {
                self.visit((y, end), sweep);
            }
            y = end;
        }
    }

    /// Interpolates between two heights where no chain ends: side by side as far as the same sides bound the silhouette, and
    /// slab by slab where they do not.
    fn visit(&mut self, (mut y, end): (f64, f64), sweep: &Sweep<'_>) {
        while y < end {
            let mut bottom = end;
            while !self.follow((y, bottom), sweep) {
                let middle = 0.5 * (y + bottom);
                let n_vertices = self.count_vertices(sweep.chains, bottom);
                if !sweep.can_follow_several() || n_vertices < FEWEST_FOLLOWED || middle <= y {
                    self.visit_slabs((y, bottom), sweep);
                    break;
                }
                bottom = middle;
            }
            y = bottom;
        }
    }

    /// Vertices of both views from where the walks are down to height `y`.
    fn count_vertices(&self, chains: &[Chains; 2], y: f64) -> u32 {
        let views = self.walkers.iter().zip(chains);
        views.map(|(w, c)| w.count_vertices(c, y)).sum()
    }

    /// Interpolates side by side; false, with nothing done, where the rule is not that simple.
    fn follow(&mut self, heights: (f64, f64), sweep: &Sweep<'_>) -> bool {
        let is_single = self.walkers.iter().all(|w| w.n_intervals() == 1);
        let alpha = sweep.alpha;
        match sweep.pairing {
            Pairing::Tight => {
                if is_single {
                    self.links.clear();
                    self.links.push(Linked::SINGLE);
                } else if !self.find_links(sweep.chains, heights) {
                    return false;
                }
                let left = |a: Touch, b: Touch| Some(tight::between(a, b, alpha, Rim::Left));
                let right = |a: Touch, b: Touch| Some(tight::between(a, b, alpha, Rim::Right));
                self.follow_links(sweep, heights, left, right)
            }
            _ if !is_single => false,
            pairing => {
                self.links.clear();
                self.links.push(Linked::SINGLE);
                if let Pairing::Within { radius } = pairing {
                    let (least, greatest) = sweep.depths.narrowest(radius, heights);
                    let within = |a: Touch, b: Touch| {
                        let parallax = a.x - b.x;
                        (least <= parallax && parallax <= greatest).then(|| a.lerp(b, alpha))
                    };
                    self.follow_links(sweep, heights, within, within)
                } else {
                    let linear = |a: Touch, b: Touch| Some(a.lerp(b, alpha));
                    self.follow_links(sweep, heights, linear, linear)
                }
            }
        }
    }

    /// Links the intervals of both views; false when the links are not the same all the way down.
    fn find_links(&mut self, chains: &[Chains; 2], (y_top, y_bottom): (f64, f64)) -> bool {
        let [one, two] = &mut self.sections;
        let mut links_at = |share: f64, links: &mut Vec<Linked>| {
            let y = y_top + (y_bottom - y_top) * share;
            self.walkers[0].sections(&chains[0], y, one);
            self.walkers[1].sections(&chains[1], y, two);
            tight::link(one, two, &mut self.homes, links);
        };
        if y_bottom - y_top < LOW_TANGENT {
            links_at(0.5, &mut self.links);
            return true;
        }
        links_at(0.1, &mut self.links);
        links_at(0.9, &mut self.other_links);
        self.links == self.other_links
    }

    /// Follows the sides that `self.links` name; false, with nothing done, where a rule gives nothing or sides meet.
    fn follow_links(
        &mut self,
        sweep: &Sweep<'_>,
        heights: (f64, f64),
        left: impl Fn(Touch, Touch) -> Option<Touch>,
        right: impl Fn(Touch, Touch) -> Option<Touch>,
    ) -> bool {
        let chains = (&sweep.chains[0], &sweep.chains[1]);
        let alpha = sweep.alpha;
        let (one, two) = (self.walkers[0].strands(), self.walkers[1].strands());
        self.connector.begin_slab(heights.0);
        self.side_ends.clear();
        let points = self.connector.points();
        let start = points.len();
        let (mut before, mut last) = (None, start);
        for link in &self.links {
            for (origin, at) in [(link.enter, 0), (link.exit, 1)] {
                let is_done = match origin {
                    Origin::Rim(i, j) => {
                        let pair = [one[2 * i + at], two[2 * j + at]];
                        if at == 0 {
                            follow_pair(chains, pair, heights, &left, points)
                        } else {
                            follow_pair(chains, pair, heights, &right, points)
                        }
                    }
                    Origin::First(i) => {
                        let shift = tight::first_shift(alpha);
                        follow_one(chains.0, one[2 * i + at], heights, shift, points)
                    }
                    Origin::Second(j) => {
                        let shift = tight::second_shift(alpha);
                        follow_one(chains.1, two[2 * j + at], heights, shift, points)
                    }
                    Origin::FirstGap(i, other) => {
                        let pair = [one[2 * i + at], one[2 * other + 1 - at]];
                        let shifts = GapShifts::of_first(alpha);
                        let beside = |a: Touch, b: Touch| {
                            Some(tight::beside_gap(a, b, shifts, Rim::of_end(at)))
                        };
                        follow_pair((chains.0, chains.0), pair, heights, beside, points)
                    }
                    Origin::SecondGap(j, other) => {
                        let pair = [two[2 * j + at], two[2 * other + 1 - at]];
                        let shifts = GapShifts::of_second(alpha);
                        let beside = |a: Touch, b: Touch| {
                            Some(tight::beside_gap(a, b, shifts, Rim::of_end(at)))
                        };
                        follow_pair((chains.1, chains.1), pair, heights, beside, points)
                    }
                    Origin::Linear(i, j) => {
                        let pair = [one[2 * i + at], two[2 * j + at]];
                        let linear = |a: Touch, b: Touch| Some(a.lerp(b, alpha));
                        follow_pair(chains, pair, heights, linear, points)
                    }
                };
                let end = points.len();
                let do_meet = |from: usize| do_cross(&points[from..last], &points[last..end]);
                if !is_done || before.is_some_and(do_meet) {
                    points.truncate(start);
                    return false;
                }
                self.side_ends.push(end);
                (before, last) = (Some(last), end);
            }
        }
        self.connector
            .end_followed(start, &self.side_ends, heights.1);
        for (walker, chains) in self.walkers.iter_mut().zip(sweep.chains) {
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
        if sweep.pairing == Pairing::Tight {
            for (sections, span) in self.sections.iter_mut().zip(&self.spans) {
                sections.clear();
                sections.extend(span.iter().map(|i| i.section(0.5)));
            }
            let [sections_one, sections_two] = &self.sections;
            tight::link(sections_one, sections_two, &mut self.homes, &mut self.links);
            let links = &self.links;
            self.span.unite(heights, &mut self.connector, |output| {
                tight::interpolate(one, two, links, alpha, output);
            });
            return;
        }
        if sweep.is_matched {
            let [gaps_one, gaps_two] = &self.gaps;
            let middle = 0.5 * (heights.0 + heights.1);
            self.matching
                .cuts(gaps_one, gaps_two, middle, &mut self.cuts);
        }
        let parallax = match sweep.pairing {
            Pairing::Within { radius } => Some(sweep.depths.parallax(radius, heights)),
            _ => None,
        };
        let rule = PairRule {
            cuts: &self.cuts,
            parallax,
        };
        self.span
            .interpolate(heights, (one, two), &rule, alpha, &mut self.connector);
    }
}

#[cfg(test)]
mod tests;
