//! Two rectified silhouettes, with what a method prepares of them once.

use super::method::Method;
use super::span_pairs::{Room, Source, SpanPairs, SpanPairsScratch};
use super::tangent_arc::prepare::{PrepareArcsScratch, PreparedArcs};
use super::visual_hull::SphereParallax;
use crate::sweep::monotone_chain::MonotoneChains;

/// Two silhouettes in their shared frame.
#[derive(Clone, Debug, Default)]
pub struct PreparedPair {
    chains: [MonotoneChains; 2],
    /// How many pieces each shows.
    pieces: [usize; 2],
    parallax: SphereParallax,
    arcs: PreparedArcs,
    pairs: SpanPairs,
    /// The method that has prepared these silhouettes: `arcs` for `tight`, `pairs` for the others.
    prepared: Option<Method>,
}

/// Buffers for preparing pairs.
#[derive(Clone, Debug, Default)]
pub(super) struct PrepareScratch {
    arcs: PrepareArcsScratch,
    pairs: SpanPairsScratch,
}

/// What a method has prepared of a pair.
pub(super) enum Prepared<'a> {
    Arcs(&'a PreparedArcs),
    Pairs(&'a SpanPairs),
}

impl PreparedPair {
    /// Where the chains of both silhouettes are written to; nothing is prepared of them.
    pub(crate) fn chains_mut(&mut self) -> &mut [MonotoneChains; 2] {
        self.prepared = None;
        &mut self.chains
    }

    /// Whether both views show something.
    pub(super) fn is_in_both(&self) -> bool {
        self.chains.iter().all(|c| c.first_y().is_finite())
    }

    /// Empties both silhouettes, and sets the parallax that points of the model can have.
    pub(crate) fn restart(&mut self, parallax: SphereParallax) {
        self.chains_mut().iter_mut().for_each(MonotoneChains::clear);
        self.pieces = [0; 2];
        self.parallax = parallax;
    }

    /// Says that a silhouette shows another piece.
    pub(crate) fn count_piece(&mut self, silhouette: usize) {
        self.pieces[silhouette] += 1;
    }

    /// The most pieces that either view shows.
    pub(super) fn most_pieces(&self) -> usize {
        self.pieces[0].max(self.pieces[1])
    }

    /// Distance between the viewpoints.
    pub(super) fn baseline(&self) -> f64 {
        self.parallax.baseline
    }

    /// What `method` needs, found when it is asked for first.
    pub(super) fn prepare(&mut self, method: Method, scratch: &mut PrepareScratch) -> Prepared<'_> {
        let is_prepared = self.prepared.replace(method) == Some(method);
        if method == Method::Tight {
            if !is_prepared {
                self.arcs.assign(&self.chains, &mut scratch.arcs);
            }
            return Prepared::Arcs(&self.arcs);
        }
        if !is_prepared {
            let source = Source {
                chains: &self.chains,
                parallax: self.parallax,
                method,
            };
            self.pairs.assign(&source, &mut scratch.pairs);
        }
        Prepared::Pairs(&self.pairs)
    }

    /// The capacity without another allocation.
    pub(crate) fn room(&self) -> Room {
        self.pairs.room()
    }

    /// Clears everything, and reserves capacity for contours of so many vertices each, and for their pairs.
    pub(crate) fn make_room(&mut self, n_vertices: usize, room: Room) {
        for chains in self.chains_mut() {
            chains.clear();
            chains.reserve(n_vertices);
        }
        self.arcs.reserve(2 * n_vertices);
        self.pairs.make_room(room);
    }
}
