//! Silhouette interpolation between two views, and a viewpoint on the line between them (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, `linSillInterp`: rectify the pair, sweep both silhouettes, interpolate the spans,
//! connect them. Deviation: where either view has one interval, its sides are followed from vertex to vertex until a chain
//! ends; only where there are several are spans visited slab by slab.

use glam::{DMat3, DVec3};

use crate::chains::{Chains, Walker};
use crate::clique::{GapMatching, GapTracks};
use crate::connect::{Connector, Slack};
use crate::epipolar::{EpipolarFrame, project};
use crate::follow::{FEWEST_FOLLOWED, do_cross, follow_one, follow_pair};
use crate::loops::DeepLoops;
use crate::side::{Interval, Touch};
use crate::span::{Cuts, Limit, PairRule, Parallax, SpanScratch};
use crate::tight::{self, GapShifts, Homes, Linked, Origin, Rim};

/// Rectified coordinates are tangents: this is a seventh of a pixel of a 512² capture, less than contours are simplified by.
/// It keeps the vertices of both views from adding up along straight stretches.
const SLACK_TANGENT: f64 = 2e-4;

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

/// A silhouette seen from somewhere, with the map from its coordinates to rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    /// Viewpoint, object space.
    pub eye: DVec3,
    /// The silhouette's loops, even-odd, with inverse depths: those of points at (ray / inverse depth) from the eye.
    pub loops: &'a DeepLoops,
    /// From coordinates of the loops (with a 1 appended) to rays from `eye`.
    pub object_from_loops: DMat3,
}

/// Buffers of one interpolation between two views.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinearScratch {
    chains: [Chains; 2],
    walkers: [Walker; 2],
    spans: [Vec<Interval>; 2],
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
struct Sweep {
    alpha: f64,
    pairing: Pairing,
    depths: SphereDepths,
    /// Whether gaps of both views were tracked and matched.
    is_matched: bool,
}

impl Sweep {
    /// Whether sides are followed where a view has several intervals, too.
    fn can_follow_several(&self) -> bool {
        self.pairing == Pairing::Tight
    }
}

impl LinearScratch {
    /// Writes the silhouette seen from (1 − α)·p₁ + α·p₂ to `output`, in coordinates of the returned frame.
    ///
    /// Returns `None` when the pair cannot be rectified: viewpoints and center in line, or a ray beside the frame.
    pub(crate) fn interpolate(
        &mut self,
        (one, two): (Seen<'_>, Seen<'_>),
        center: DVec3,
        alpha: f64,
        pairing: Pairing,
        output: &mut DeepLoops,
    ) -> Option<EpipolarFrame> {
        let frame = EpipolarFrame::new(one.eye, two.eye, center)?;
        let baseline = one.eye.distance(two.eye);
        let slack = if self.keeps_all_vertices { 0.0 } else { 1.0 };
        for (seen, chains) in [one, two].iter().zip(&mut self.chains) {
            rectify(seen, &frame, baseline, slack * SLACK_TANGENT, chains)?;
        }
        let is_matched = pairing == Pairing::Cliques && self.match_gaps();
        self.sweep(&Sweep {
            alpha,
            pairing,
            depths: SphereDepths {
                baseline,
                center_depth: (center - (one.eye + two.eye) * 0.5).dot(frame.f),
            },
            is_matched,
        });
        self.connector.finish(
            Slack {
                line: slack * SLACK_TANGENT,
                depth: slack * SLACK_DISPARITY,
            },
            output,
        );
        let inverse_depth = 1.0 / baseline;
        output.transform(|p| DVec3::new(p.x, p.y, p.z * inverse_depth));
        Some(frame)
    }

    /// Tracks and matches the gaps of both views; false when one has none, so that there is nothing to cut.
    fn match_gaps(&mut self) -> bool {
        let views = self.chains.iter().zip(&mut self.walkers);
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
    fn sweep(&mut self, sweep: &Sweep) {
        self.connector.clear();
        self.cuts.clear();
        for walker in &mut self.walkers {
            walker.restart();
        }
        let mut y = self.chains[0].first_y().min(self.chains[1].first_y());
        while y.is_finite() {
            for (walker, chains) in self.walkers.iter_mut().zip(&self.chains) {
                walker.enter(chains, y);
            }
            let end =
                (self.walkers[0].end(&self.chains[0])).min(self.walkers[1].end(&self.chains[1]));
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
    fn visit(&mut self, (mut y, end): (f64, f64), sweep: &Sweep) {
        while y < end {
            let mut bottom = end;
            while !self.follow((y, bottom), sweep) {
                let middle = 0.5 * (y + bottom);
                let n_vertices = self.count_vertices(bottom);
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
    fn count_vertices(&self, y: f64) -> u32 {
        let views = self.walkers.iter().zip(&self.chains);
        views.map(|(w, c)| w.count_vertices(c, y)).sum()
    }

    /// Interpolates side by side; false, with nothing done, where the rule is not that simple.
    fn follow(&mut self, heights: (f64, f64), sweep: &Sweep) -> bool {
        let is_single = self.walkers.iter().all(|w| w.n_intervals() == 1);
        let alpha = sweep.alpha;
        match sweep.pairing {
            Pairing::Tight => {
                if is_single {
                    self.links.clear();
                    self.links.push(Linked::SINGLE);
                } else if !self.find_links(heights) {
                    return false;
                }
                let left = |a: Touch, b: Touch| Some(tight::between(a, b, alpha, Rim::Left));
                let right = |a: Touch, b: Touch| Some(tight::between(a, b, alpha, Rim::Right));
                self.follow_links(heights, alpha, left, right)
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
                    self.follow_links(heights, alpha, within, within)
                } else {
                    let linear = |a: Touch, b: Touch| Some(a.lerp(b, alpha));
                    self.follow_links(heights, alpha, linear, linear)
                }
            }
        }
    }

    /// Links the intervals of both views; false when the links are not the same all the way down.
    fn find_links(&mut self, (y_top, y_bottom): (f64, f64)) -> bool {
        let [one, two] = &mut self.spans;
        let mut links_at = |share: f64, links: &mut Vec<Linked>| {
            let y = y_top + (y_bottom - y_top) * share;
            self.walkers[0].intervals_across(&self.chains[0], (y, y), one);
            self.walkers[1].intervals_across(&self.chains[1], (y, y), two);
            tight::link(one, two, &mut self.homes, links);
        };
        links_at(0.1, &mut self.links);
        links_at(0.9, &mut self.other_links);
        self.links == self.other_links
    }

    /// Follows the sides that `self.links` name; false, with nothing done, where a rule gives nothing or sides meet.
    fn follow_links(
        &mut self,
        heights: (f64, f64),
        alpha: f64,
        left: impl Fn(Touch, Touch) -> Option<Touch>,
        right: impl Fn(Touch, Touch) -> Option<Touch>,
    ) -> bool {
        let chains = (&self.chains[0], &self.chains[1]);
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
        for (walker, chains) in self.walkers.iter_mut().zip(&self.chains) {
            walker.advance(chains, heights.1);
        }
        true
    }

    /// Interpolates spans slab by slab, between vertices of either view.
    fn visit_slabs(&mut self, (mut y, end): (f64, f64), sweep: &Sweep) {
        while y < end {
            let bottom = (self.walkers[0].next_vertex())
                .min(self.walkers[1].next_vertex())
                .min(end);
            for ((walker, chains), span) in
                (self.walkers.iter_mut().zip(&self.chains)).zip(&mut self.spans)
            {
                walker.intervals((y, bottom), span);
                walker.advance(chains, bottom);
            }
            self.visit_slab((y, bottom), sweep);
            y = bottom;
        }
    }

    fn visit_slab(&mut self, heights: (f64, f64), sweep: &Sweep) {
        let [one, two] = &self.spans;
        let alpha = sweep.alpha;
        if sweep.pairing == Pairing::Tight {
            tight::link(one, two, &mut self.homes, &mut self.links);
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

/// How far a sphere about the center reaches, seen from a pair of viewpoints.
#[derive(Clone, Copy, Debug)]
struct SphereDepths {
    /// Distance between the viewpoints.
    baseline: f64,
    /// Depth of the center along the frame's forward axis.
    center_depth: f64,
}

impl SphereDepths {
    /// The parallax x₁ − x₂ that points of the sphere can have across a slab.
    fn parallax(&self, radius: f64, (y_top, y_bottom): (f64, f64)) -> Parallax {
        let (top, bottom) = (
            self.parallax_at(radius, y_top),
            self.parallax_at(radius, y_bottom),
        );
        Parallax {
            least: Limit {
                top: top.0,
                bottom: bottom.0,
            },
            greatest: Limit {
                top: top.1,
                bottom: bottom.1,
            },
        }
    }

    /// A range of parallax that is allowed on all scanlines between two heights: the farther from the middle, the narrower.
    fn narrowest(&self, radius: f64, (y_top, y_bottom): (f64, f64)) -> (f64, f64) {
        self.parallax_at(radius, y_top.abs().max(y_bottom.abs()))
    }

    /// The least and the greatest parallax on the scanline at height y.
    ///
    /// A point at depth z has parallax b/z. The epipolar plane cuts the sphere in a disc whose middle has depth c/(1 + y²).
    /// Contours are stored to a fraction of a pixel, so that touching rays may miss: hence the slack, which also covers that
    /// the range is taken as linear within a slab.
    fn parallax_at(&self, radius: f64, y: f64) -> (f64, f64) {
        let stretch = 1.0 + y * y;
        let off_plane = y * y * self.center_depth * self.center_depth / stretch;
        let reach = ((radius * radius - off_plane).max(0.0) / stretch).sqrt();
        let middle = self.center_depth / stretch;
        let nearest = (middle - reach).max(self.baseline / MAX_PARALLAX);
        let least = self.baseline / (middle + reach);
        (
            least - PARALLAX_SLACK,
            self.baseline / nearest + PARALLAX_SLACK,
        )
    }
}

/// Tangent units: more parallax than rays in front of both views can have.
const MAX_PARALLAX: f64 = 1e3;

/// Tangent units: about two pixels of a 512² capture.
const PARALLAX_SLACK: f64 = 3e-3;

fn rectify(
    seen: &Seen<'_>,
    frame: &EpipolarFrame,
    baseline: f64,
    slack: f64,
    output: &mut Chains,
) -> Option<()> {
    let matrix = frame.epipolar_from_object() * seen.object_from_loops;
    output.clear();
    for points in seen.loops.iter() {
        for &p in points {
            let ray = matrix * DVec3::new(p.x, p.y, 1.0);
            let q = project(ray)?;
            output.push(DVec3::new(q.x, q.y, baseline * p.z / ray.z));
        }
        output.close(slack);
    }
    output.seal();
    Some(())
}

/// The matrix from rectified coordinates of `frame` (with a 1 appended) to rays.
#[must_use]
pub(crate) fn object_from_epipolar(frame: &EpipolarFrame) -> DMat3 {
    DMat3::from_cols(frame.b, frame.u, frame.f)
}

#[cfg(test)]
mod tests;
