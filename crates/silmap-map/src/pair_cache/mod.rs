//! Pairs of silhouettes in the frame they share, and those of polytope edges kept for the next frame.
//!
//! Source: Silhouette Mapping, section 5.2, "Epipolar decomposition". Deviation: what a polytope edge allows is prepared once, not
//! per frame: the two captured silhouettes rectified, cut into chains and sorted. Only the edges used last are kept.

use std::cmp::Reverse;

use glam::{DMat3, DVec3};

use crate::epipolar::{EpipolarFrame, MIN_FORWARD_COSINE, object_from_image, project};
use crate::loops::DeepLoops;
use crate::rule::tangent_arc::prepare::{Rows, RowsScratch};
use crate::rule::visual_hull::{PairRows, PairScratch, PairSource, Room};
use crate::sweep::monotone_chain::Chains;
use crate::{BoundingSphere, CapturedView, SilhouetteMap};

/// Turns of a contour by less height than this are levelled: a third of a pixel of a 512² capture, less than contours are
/// simplified. It keeps stretches along the scanlines from falling apart into chains.
pub(crate) const TURN_TANGENT: f64 = 5e-4;

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

/// A pair of silhouettes in a shared frame, ready to be swept.
#[derive(Clone, Debug, Default)]
pub(crate) struct RectifiedPair {
    frame: Option<EpipolarFrame>,
    pub(crate) chains: [Chains; 2],
    pub(crate) depths: SphereDepths,
    rows: Rows,
    has_rows: bool,
    pair_rows: PairRows,
    has_pair_rows: bool,
}

impl RectifiedPair {
    /// Rectifies two silhouettes; returns `None` when they cannot be: viewpoints and center in line.
    ///
    /// Turns by less than `slack`, in tangents, are levelled.
    pub(crate) fn assign(
        &mut self,
        (one, two): (Seen<'_>, Seen<'_>),
        center: DVec3,
        slack: f64,
    ) -> Option<EpipolarFrame> {
        self.frame = None;
        self.has_rows = false;
        self.has_pair_rows = false;
        let frame = EpipolarFrame::new(one.eye, two.eye, center)?;
        let baseline = one.eye.distance(two.eye);
        for (seen, chains) in [one, two].iter().zip(&mut self.chains) {
            rectify(seen, &frame, baseline, slack, chains)?;
        }
        self.depths = SphereDepths {
            baseline,
            center_depth: (center - (one.eye + two.eye) * 0.5).dot(frame.f),
        };
        self.frame = Some(frame);
        self.frame
    }

    /// What the tight rule needs of the pair, found when it is asked for first.
    pub(crate) fn rows(&mut self, scratch: &mut RowsScratch) -> &Rows {
        if !self.has_rows {
            self.rows.assign(&self.chains, scratch);
            self.has_rows = true;
        }
        &self.rows
    }

    /// All pairs of intervals that can meet within a sphere of this radius about the center, found when they are asked for first:
    /// each pair of silhouettes is asked for one radius only.
    pub(crate) fn pair_rows(
        &mut self,
        radius: Option<f64>,
        scratch: &mut PairScratch,
    ) -> &PairRows {
        if !self.has_pair_rows {
            let source = PairSource {
                chains: &self.chains,
                depths: self.depths,
                radius,
            };
            self.pair_rows.assign(&source, scratch);
            self.has_pair_rows = true;
        }
        &self.pair_rows
    }

    /// The shared frame, where the pair could be rectified.
    pub(crate) fn frame(&self) -> Option<&EpipolarFrame> {
        self.frame.as_ref()
    }
}

/// How far a sphere about the center reaches, seen from a pair of viewpoints.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SphereDepths {
    /// Distance between the viewpoints.
    pub(crate) baseline: f64,
    /// Depth of the center along the frame's forward axis.
    center_depth: f64,
}

impl SphereDepths {
    /// A range of parallax that is allowed on all scanlines between two heights: the farther from the middle, the narrower.
    pub(crate) fn narrowest(&self, radius: f64, (y_top, y_bottom): (f64, f64)) -> (f64, f64) {
        self.parallax_at(radius, y_top.abs().max(y_bottom.abs()))
    }

    /// A range that holds all parallax that is allowed on some scanline between two heights.
    pub(crate) fn widest(&self, radius: f64, (y_top, y_bottom): (f64, f64)) -> (f64, f64) {
        self.parallax_at(radius, 0.0_f64.clamp(y_top, y_bottom))
    }

    /// The least and the greatest parallax on the scanline at height y.
    ///
    /// A point at depth z has parallax b/z. The epipolar plane cuts the sphere in a disc whose middle has depth c/(1 + y²).
    /// Contours are stored to a fraction of a pixel, so that touching rays may miss: hence the slack, which also covers that
    /// the range is taken as linear within a slab.
    pub(crate) fn parallax_at(&self, radius: f64, y: f64) -> (f64, f64) {
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
            let q = project(in_front(ray))?;
            output.push(DVec3::new(q.x, q.y, baseline * p.z / ray.z));
        }
        output.close(slack);
    }
    output.seal();
    Some(())
}

/// A ray of the frame, turned in front of it where it lies beside it: what an interpolated silhouette has there is not of the model,
/// and the rest of the outline need not be lost with it.
fn in_front(ray: DVec3) -> DVec3 {
    let least = 1.01 * MIN_FORWARD_COSINE * ray.x.hypot(ray.y);
    ray.with_z(ray.z.max(least))
}

/// The matrix from rectified coordinates of `frame` (with a 1 appended) to rays.
#[must_use]
pub(crate) fn object_from_epipolar(frame: &EpipolarFrame) -> DMat3 {
    DMat3::from_cols(frame.b, frame.u, frame.f)
}

/// How many polytope edges are kept rectified: those around a moving eye, and room for its next triangles.
const EDGES_KEPT: usize = 32;
/// Bytes that the pairs of all kept edges may take. Many parts beside each other make so many pairs that 32 edges would take
/// a gigabyte; fewer are kept then.
const MOST_PAIR_BYTES: usize = 32 << 20;
/// The edges of one triangle are kept at any price.
const LEAST_EDGES_KEPT: usize = 3;

/// The polytope edges used last, rectified.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgeCache {
    edges: Vec<CachedEdge>,
    captured: [DeepLoops; 2],
    clock: u64,
}

#[derive(Clone, Debug)]
struct CachedEdge {
    views: [u32; 2],
    level: u8,
    last_used: u64,
    pair: RectifiedPair,
}

impl EdgeCache {
    /// The silhouettes of two views of `map` at a level of detail, that with the smaller number first; `None` when they cannot be
    /// rectified.
    pub(crate) fn pair(
        &mut self,
        map: &SilhouetteMap,
        views: [u32; 2],
        level: u8,
    ) -> Option<&mut RectifiedPair> {
        self.clock += 1;
        let mut edges = self.edges.iter();
        let at = match edges.position(|e| e.views == views && e.level == level) {
            Some(at) => at,
            None => self.prepare(map, views, level),
        };
        let edge = &mut self.edges[at];
        edge.last_used = self.clock;
        edge.pair.frame().is_some().then_some(&mut edge.pair)
    }

    /// Rectifies a pair in the place of the one that was used longest ago; returns that place.
    fn prepare(&mut self, map: &SilhouetteMap, views: [u32; 2], level: u8) -> usize {
        // Places take turns: what one of them needed once another will need.
        let rooms = self.edges.iter().map(|edge| edge.pair.pair_rows.room());
        let room = rooms.fold(Room::default(), Room::max);
        let kept = kept_of(room);
        if self.edges.len() > kept {
            self.edges.sort_by_key(|edge| Reverse(edge.last_used));
            self.edges.truncate(kept);
        }
        if self.edges.len() < kept {
            self.edges.push(CachedEdge {
                views,
                level,
                last_used: 0,
                pair: RectifiedPair::default(),
            });
        }
        let oldest = (self.edges.iter().enumerate()).min_by_key(|(_, e)| e.last_used);
        let at = oldest.map_or(0, |(at, _)| at);
        let sphere = map.bounding_sphere();
        let [one, two] = views.map(|v| &map.views[v as usize]);
        for (loops, view) in self.captured.iter_mut().zip([one, two]) {
            assign_contours(loops, view, sphere, level);
        }
        let seen = |view: &CapturedView, loops| Seen {
            eye: view.camera.eye,
            loops,
            object_from_loops: object_from_image(&view.camera),
        };
        let [loops_one, loops_two] = &self.captured;
        let edge = &mut self.edges[at];
        (edge.views, edge.level) = (views, level);
        // Room for the largest contours at once, so that places need not grow as other edges come.
        let most = map.contour_vertex_counts().max().unwrap_or(0);
        for chains in &mut edge.pair.chains {
            chains.clear();
            chains.reserve(most);
        }
        edge.pair.rows.reserve(2 * most);
        edge.pair.pair_rows.make_room(room);
        // A pair that cannot be rectified is kept without a frame.
        let seen = (seen(one, loops_one), seen(two, loops_two));
        let _ = edge.pair.assign(seen, sphere.center, TURN_TANGENT);
        at
    }
}

/// How many polytope edges are kept when one of them needs so much room.
fn kept_of(room: Room) -> usize {
    let affordable = MOST_PAIR_BYTES / room.bytes().max(1);
    affordable.clamp(LEAST_EDGES_KEPT, EDGES_KEPT)
}

/// Copies a view's contours at a level of detail with inverse depths, zero where it has none.
///
/// Every point of the model lies in its bounding sphere: a depth outside, as a file may hold, is the nearest in it.
pub(crate) fn assign_contours(
    loops: &mut DeepLoops,
    view: &CapturedView,
    sphere: BoundingSphere,
    level: u8,
) {
    let distance = view.camera.eye.distance(sphere.center);
    let (nearest, farthest) = (distance - sphere.radius, distance + sphere.radius);
    loops.clear();
    for contour in &view.contours {
        let has_depth = contour.depths.len() == contour.points.len();
        for k in contour.vertices_at(level) {
            let inverse = if has_depth {
                1.0 / contour.depths[k].max(nearest).min(farthest)
            } else {
                0.0
            };
            loops.push(contour.points[k].extend(inverse).extend(0.0));
        }
        loops.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_edges_are_kept_when_they_need_much_room() {
        assert_eq!(kept_of(Room::default()), EDGES_KEPT);
        let mut kept = Vec::new();
        for millions in 0..9 {
            let room = Room::of_corners(millions << 20);
            kept.push(kept_of(room));
            let is_within = kept_of(room) * room.bytes() <= MOST_PAIR_BYTES;
            assert!(is_within || kept_of(room) == LEAST_EDGES_KEPT);
        }
        assert!(kept.is_sorted_by(|a, b| a >= b), "{kept:?}");
        assert_eq!(kept.last(), Some(&LEAST_EDGES_KEPT));
    }
}
