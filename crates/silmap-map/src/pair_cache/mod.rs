//! Pairs of views at polytope edges, rectified and prepared for their rule, kept for the next frame.
//!
//! Deviation from Silhouette Mapping, section 5.2: what a polytope edge allows is prepared once, not per frame: the two captured
//! silhouettes rectified, cut into chains and sorted. Only the edges used last are kept.

mod rectified;

use std::cmp::Reverse;

use crate::SilhouetteMap;
use crate::loops::DeepLoops;
use crate::rule::span_pairs::Room;

pub use rectified::RectifiedPair;
pub(crate) use rectified::{
    RectifyParams, TURN_TANGENT, ViewedSilhouette, assign_contours, object_from_epipolar,
};

/// How many polytope edges are kept rectified: those around a few hundred eyes, or around one and its sectors wherever it goes.
const EDGES_KEPT: usize = 256;
/// Bytes that the pairs of all kept edges may take. Many parts beside each other make so many pairs that 32 edges would take
/// a gigabyte; fewer are kept then.
const MOST_PAIR_BYTES: usize = 32 << 20;
/// The edges of one triangle are kept at any price.
const LEAST_EDGES_KEPT: usize = 3;

/// The polytope edges used last, rectified.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairCache {
    edges: Vec<CachedPair>,
    captured: [DeepLoops; 2],
    /// The most contour vertices that a view has of each part.
    most_vertices: Vec<usize>,
    clock: u64,
}

#[derive(Clone, Debug)]
struct CachedPair {
    views: [u32; 2],
    level: u8,
    last_used: u64,
    pair: RectifiedPair,
}

impl PairCache {
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
        if self.most_vertices.is_empty() {
            self.most_vertices = map.part_vertex_counts();
        }
        // Places take turns: what one of them needed once another will need.
        let rooms = self.edges.iter().map(|edge| edge.pair.room());
        let room = rooms.fold(Room::default(), Room::max);
        let kept = kept_of(room, self.most_vertices.len());
        if self.edges.len() > kept {
            self.edges.sort_by_key(|edge| Reverse(edge.last_used));
            self.edges.truncate(kept);
        }
        if self.edges.len() < kept {
            self.edges.push(CachedPair {
                views,
                level,
                last_used: 0,
                pair: RectifiedPair::default(),
            });
        }
        let oldest = (self.edges.iter().enumerate()).min_by_key(|(_, e)| e.last_used);
        let at = oldest.map_or(0, |(at, _)| at);
        let edge = &mut self.edges[at];
        (edge.views, edge.level) = (views, level);
        // Capacity for the largest contours at once, so that places need not grow as other edges come.
        edge.pair.make_room(&self.most_vertices, room);
        // A pair that cannot be rectified is kept without a frame.
        let _ = (edge.pair).assign_views(map, views, level, &mut self.captured);
        at
    }
}

/// How many polytope edges are kept when each of so many parts of one of them needs this capacity.
fn kept_of(room: Room, parts: usize) -> usize {
    let affordable = MOST_PAIR_BYTES / (parts.max(1) * room.bytes().max(1));
    affordable.clamp(LEAST_EDGES_KEPT, EDGES_KEPT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_edges_are_kept_when_they_need_much_room() {
        assert_eq!(kept_of(Room::default(), 1), EDGES_KEPT);
        let mut kept = Vec::new();
        for millions in 0..9 {
            let room = Room::of_corners(millions << 20);
            kept.push(kept_of(room, 1));
            let of_parts = kept_of(room, 12);
            let is_within = of_parts * 12 * room.bytes() <= MOST_PAIR_BYTES;
            assert!(is_within || of_parts == LEAST_EDGES_KEPT);
        }
        assert!(kept.is_sorted_by(|a, b| a >= b), "{kept:?}");
        assert_eq!(kept.last(), Some(&LEAST_EDGES_KEPT));
    }
}
