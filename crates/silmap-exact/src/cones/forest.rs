//! The forest of anchored cones in memory: nodes in depth-first order.

use std::ops::Range;

use silmap_geometry::lp::HalfSpace;
use silmap_geometry::{Interrupted, Watch};

use super::build::{BuiltForest, build_forest};
use super::cone::{ConePair, Plane, planes_of};
use crate::EdgeMesh;
use crate::watch::{Counter, SEARCH};

/// Faces whose planes are looked at between one call of the watcher and the next: some milliseconds.
const FACES_UNWATCHED: u64 = 1 << 14;

/// The forest that [`ExtractionMethod::Cones`](crate::ExtractionMethod::Cones) searches: clusters of edges, each with anchored cones from
/// which all its faces look one way.
///
/// Building takes seconds, so it can be saved ([`Self::to_bytes`]) and read again ([`Self::from_bytes`]).
#[derive(Clone, Debug)]
pub struct ConeForest {
    /// In depth-first order.
    pub(super) nodes: Vec<ForestNode>,
    /// The edges of the nodes, in their order.
    pub(super) edges: Vec<u32>,
    /// Edges with a face whose plane is not known well enough, or that are better tested always.
    pub(super) unbounded: Vec<u32>,
}

/// A node of the forest.
#[derive(Clone, Copy, Debug)]
pub(super) struct ForestNode {
    /// The end of its own edges in the list of all; they begin where those of the node before end.
    pub(super) edges_end: u32,
    /// How many nodes hang directly below it.
    pub(super) child_count: u32,
    /// `None` when no viewpoint is known from which its faces look one way.
    pub(super) cones: Option<ConePair>,
}

impl ConeForest {
    /// Builds the forest of a mesh: about 10 s for 70,000 faces.
    #[must_use]
    pub fn new(mesh: &EdgeMesh) -> Self {
        let built = Self::watched(mesh, &Watch::silent());
        built.unwrap_or_else(|Interrupted| unreachable!("nobody stops it"))
    }

    /// As [`Self::new`]; the stage [`SEARCH`] counts edges, looked at and then joined.
    ///
    /// # Errors
    /// When the caller asks to stop.
    pub fn watched(mesh: &EdgeMesh, watch: &Watch<'_>) -> Result<Self, Interrupted> {
        let total = 2 * mesh.edges().len() as u64;
        let mut counter = Counter::start(watch, SEARCH, total, FACES_UNWATCHED);
        let built = build_forest(mesh, &mut counter)?;
        counter.finish();
        Ok(Self::from(built))
    }

    /// Of a node its own edges.
    pub(super) fn edges_of(&self, node: usize) -> &[u32] {
        &self.edges[self.edge_range(node)]
    }

    fn edge_range(&self, node: usize) -> Range<usize> {
        let first = node.checked_sub(1).map_or(0, |k| self.nodes[k].edges_end);
        first as usize..self.nodes[node].edges_end as usize
    }

    /// Works out the cones of all nodes.
    pub(super) fn find_cones(&mut self, mesh: &EdgeMesh) {
        let planes = planes_of(mesh);
        let mut half_spaces: Vec<HalfSpace> = Vec::new();
        let mut known: Vec<Plane> = Vec::new();
        // The faces of nodes without a parent yet.
        let mut open: Vec<Vec<u32>> = Vec::new();
        for node in (0..self.nodes.len()).rev() {
            let sides = self.edges_of(node).iter();
            let mut faces: Vec<u32> = sides.flat_map(|&e| mesh.edge_faces()[e as usize]).collect();
            let kept = open.len() - self.nodes[node].child_count as usize;
            faces.extend(open.drain(kept..).flatten());
            faces.sort_unstable();
            faces.dedup();
            known.clear();
            known.extend(faces.iter().filter_map(|&f| planes[f as usize]));
            self.nodes[node].cones = if known.len() == faces.len() {
                ConePair::of(&known, &mut half_spaces)
            } else {
                None
            };
            open.push(faces);
        }
    }
}

impl From<BuiltForest> for ConeForest {
    fn from(built: BuiltForest) -> Self {
        let mut forest = Self {
            nodes: Vec::with_capacity(built.nodes.len()),
            edges: Vec::new(),
            unbounded: built.unbounded,
        };
        let mut next: Vec<u32> = built.roots.iter().rev().copied().collect();
        while let Some(id) = next.pop() {
            let node = &built.nodes[id as usize];
            forest.edges.extend(&node.edges);
            forest.nodes.push(ForestNode {
                edges_end: forest.edges.len() as u32,
                child_count: node.children.len() as u32,
                cones: node.cones,
            });
            next.extend(node.children.iter().rev());
        }
        forest
    }
}
