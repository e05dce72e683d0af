//! Linear silhouette interpolation: two views, and a viewpoint between them (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, `linSillInterp`: rectify the pair, sweep both silhouettes, interpolate the spans,
//! connect them.

use glam::{DMat3, DVec2, DVec3};

use crate::clique::{GapMatching, GapTracks};
use crate::connect::{Connector, Slack};
use crate::epipolar::{EpipolarFrame, project};
use crate::loops::FlatLoops;
use crate::span::{Cuts, SpanScratch};
use crate::sweep::{Interval, Sweep, merge_heights};

/// Rectified coordinates are tangents: this is about a thousandth of a pixel of a 512² capture.
const SLACK_TANGENT: Slack = Slack(1e-6);

/// How the pairs of intervals that may hold geometry are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pairing {
    /// Every interval with every other: the exact two-view visual hull, always conservative.
    All,
    /// Only within cliques: the paper's heuristic, tighter, and able to miss geometry.
    Cliques,
}

/// A silhouette seen from somewhere, with the map from its coordinates to rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    /// Viewpoint, object space.
    pub eye: DVec3,
    /// The silhouette's loops, even-odd.
    pub loops: &'a FlatLoops,
    /// From coordinates of the loops (with a 1 appended) to rays from `eye`.
    pub object_from_loops: DMat3,
}

/// Buffers of one linear interpolation.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinearScratch {
    rectified: [FlatLoops; 2],
    sweeps: [Sweep; 2],
    spans: [Vec<Interval>; 2],
    heights: Vec<f64>,
    gaps: [GapTracks; 2],
    matching: GapMatching,
    cuts: Cuts,
    span: SpanScratch,
    connector: Connector,
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
        output: &mut FlatLoops,
    ) -> Option<EpipolarFrame> {
        let frame = EpipolarFrame::new(one.eye, two.eye, center)?;
        for (seen, (rectified, sweep)) in [one, two]
            .iter()
            .zip(self.rectified.iter_mut().zip(&mut self.sweeps))
        {
            rectify(seen, &frame, rectified)?;
            sweep.restart(rectified);
        }
        let matched = pairing == Pairing::Cliques && self.match_gaps();
        let [one, two] = &mut self.sweeps;
        merge_heights(&[one.heights(), two.heights()], &mut self.heights);
        self.connector.clear();
        self.cuts.clear();
        let [spans_one, spans_two] = &mut self.spans;
        for pair in self.heights.windows(2) {
            let (y_top, y_bottom) = (pair[0], pair[1]);
            one.step(y_top, y_bottom, spans_one);
            two.step(y_top, y_bottom, spans_two);
            if matched {
                let [gaps_one, gaps_two] = &self.gaps;
                self.matching
                    .cuts(gaps_one, gaps_two, 0.5 * (y_top + y_bottom), &mut self.cuts);
            }
            self.span.interpolate(
                (y_top, y_bottom),
                (spans_one, spans_two),
                &self.cuts,
                alpha,
                &mut self.connector,
            );
        }
        self.connector.finish(SLACK_TANGENT, output);
        Some(frame)
    }

    /// Tracks and matches the gaps of both views; false when one has none, so that there is nothing to cut.
    fn match_gaps(&mut self) -> bool {
        for (gaps, sweep) in self.gaps.iter_mut().zip(&mut self.sweeps) {
            gaps.track(sweep);
        }
        let [one, two] = &self.gaps;
        if one.is_empty() || two.is_empty() {
            return false;
        }
        self.matching.assign(one, two);
        true
    }
}

fn rectify(seen: &Seen<'_>, frame: &EpipolarFrame, output: &mut FlatLoops) -> Option<()> {
    let matrix = frame.epipolar_from_object() * seen.object_from_loops;
    output.clear();
    for points in seen.loops.iter() {
        for &p in points {
            output.push(project(&matrix, p)?);
        }
        output.close();
    }
    Some(())
}

/// The matrix from rectified coordinates of `frame` (with a 1 appended) to rays.
#[must_use]
pub(crate) fn object_from_epipolar(frame: &EpipolarFrame) -> DMat3 {
    DMat3::from_cols(frame.b, frame.u, frame.f)
}

/// Projects loops by a homogeneous map to image coordinates, cutting off what lies behind the camera.
pub(crate) fn project_loops(loops: &FlatLoops, matrix: &DMat3, output: &mut FlatLoops) {
    output.clear();
    for points in loops.iter() {
        let mut previous = *matrix * points[points.len() - 1].extend(1.0);
        let near = NEAR_SHARE
            * points
                .iter()
                .map(|p| (*matrix * p.extend(1.0)).z.abs())
                .fold(0.0, f64::max);
        for &p in points {
            let q = *matrix * p.extend(1.0);
            if (q.z > near) != (previous.z > near) {
                let cut = previous.lerp(q, (near - previous.z) / (q.z - previous.z));
                output.push(DVec2::new(cut.x, cut.y) / near);
            }
            if q.z > near {
                output.push(DVec2::new(q.x, q.y) / q.z);
            }
            previous = q;
        }
        output.close();
    }
}

/// Points nearer to the camera's plane than this share of the loop's farthest are cut off.
const NEAR_SHARE: f64 = 1e-4;
