//! A forest of edges in clusters, laid out for searching: nodes are passed over from where all their faces look one way.
//!
//! Nodes lie in depth-first order, each with the place of the next node that is not below it, so that a search runs
//! through memory in one direction. A node's edges, and the faces that they lie between, follow those of the node before;
//! faces are in blocks of four, so that each is tested once for the node and four at a time. What bounds a node's faces is
//! up to the method.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5, "Runtime Algorithm".
//! Deviation: the flat layout; the paper's nodes hold pointers.

use crate::edge_mesh::EdgeMesh;
use crate::plane_block::{LANES, PlaneBlock, block_of};
use crate::viewpoint::Query;
use crate::{DirectedEdge, Viewpoint, Work};

/// A node holds no more edges than this: the places of their faces are of 16 bits.
pub(crate) const MOST_EDGES: usize = 8192;

/// Something that knows viewpoints from which a set of faces all show their fronts, or none does.
pub(crate) trait FacingBound {
    /// Whether the viewpoint is surely such a one.
    fn is_culled(&self, query: &Query) -> bool;
}

/// A node as the search reads it.
#[derive(Clone, Copy, Debug)]
struct Node<B> {
    bound: B,
    /// The next node that is not below this one.
    skip: u32,
    /// Its first edge and its first block of faces; they end where the next node's begin.
    first_edge: u32,
    first_block: u32,
}

/// The forest, ready to be searched.
#[derive(Clone, Debug)]
pub(crate) struct ClusterForest<B> {
    /// In depth-first order.
    nodes: Vec<Node<B>>,
    blocks: Vec<PlaneBlock>,
    /// The faces in the blocks; places beyond a node's last face repeat its first.
    block_faces: Vec<[u32; LANES]>,
    /// For each edge, its left and right faces' places among those of its node.
    edge_sides: Vec<[u16; 2]>,
    edge_ends: Vec<DirectedEdge>,
    /// Edges that are always tested.
    unbounded: Vec<u32>,
    /// Buffer: of one node's faces the values of their planes, positive in front.
    values: Vec<[f32; LANES]>,
    /// Buffer: edges found, twice their place in the order of the nodes, and one more when their left faces are in front.
    found: Vec<u32>,
}

impl<B: FacingBound> ClusterForest<B> {
    /// A forest without nodes, of edges that are always tested.
    pub(crate) fn new(unbounded: Vec<u32>) -> Self {
        Self {
            nodes: Vec::new(),
            blocks: Vec::new(),
            block_faces: Vec::new(),
            edge_sides: Vec::new(),
            edge_ends: Vec::new(),
            unbounded,
            values: Vec::new(),
            found: Vec::new(),
        }
    }

    /// Adds a node with its own edges, at most [`MOST_EDGES`], as the next in depth-first order; returns its place.
    pub(crate) fn push_node(&mut self, mesh: &EdgeMesh, bound: B, edges: &[u32]) -> usize {
        self.nodes.push(Node {
            bound,
            skip: self.nodes.len() as u32 + 1,
            first_edge: self.edge_ends.len() as u32,
            first_block: self.blocks.len() as u32,
        });
        let sides = edges.iter().map(|&e| mesh.edge_faces()[e as usize]);
        let mut faces: Vec<u32> = sides.clone().flatten().collect();
        faces.sort_unstable();
        faces.dedup();
        for some in faces.chunks(LANES) {
            let (block, ids) = block_of(mesh, some);
            self.blocks.push(block);
            self.block_faces.push(ids);
        }
        let place = |face: u32| faces.partition_point(|&f| f < face) as u16;
        self.edge_sides.extend(sides.map(|pair| pair.map(place)));
        self.edge_ends
            .extend(edges.iter().map(|&e| mesh.edges()[e as usize]));
        let block_count = faces.len().div_ceil(LANES);
        self.values
            .resize(self.values.len().max(block_count), [0.0; LANES]);
        self.found.resize(self.edge_ends.len(), 0);
        self.nodes.len() - 1
    }

    /// Says that all below the node at `place` has been added.
    pub(crate) fn close_node(&mut self, place: usize) {
        self.nodes[place].skip = self.nodes.len() as u32;
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.block_faces)
            + size_of_val(&*self.edge_sides)
            + size_of_val(&*self.edge_ends)
            + size_of_val(&*self.unbounded)
    }

    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        let mut work = Work::of_edges(self.unbounded.len());
        for &edge in &self.unbounded {
            let sides = mesh.edge_faces()[edge as usize];
            let [left, right] = sides.map(|face| mesh.is_front(face, viewpoint, &query));
            if left != right {
                out.push(mesh.directed(edge, left));
            }
        }
        let (mut count, mut at) = (0, 0);
        while let Some(node) = self.nodes.get(at) {
            work.visited_nodes += 1;
            if node.bound.is_culled(&query) {
                at = node.skip as usize;
                continue;
            }
            at += 1;
            let (last_edge, last_block) = match self.nodes.get(at) {
                Some(next) => (next.first_edge, next.first_block),
                None => (self.edge_ends.len() as u32, self.blocks.len() as u32),
            };
            let blocks = node.first_block as usize..last_block as usize;
            let values = &mut self.values[..blocks.len()];
            let mut nearest = [f32::INFINITY; LANES];
            for (values, block) in values.iter_mut().zip(&self.blocks[blocks.clone()]) {
                *values = query.values(block);
                keep_nearest(values, &mut nearest);
            }
            if nearest.iter().any(|&v| v <= query.value_error) {
                for (values, faces) in values.iter_mut().zip(&self.block_faces[blocks]) {
                    *values = faces.map(|face| {
                        let is_front = mesh.is_front(face, viewpoint, &query);
                        if is_front { 1.0 } else { -1.0 }
                    });
                }
            }
            let values = values.as_flattened();
            let edges = node.first_edge as usize..last_edge as usize;
            work.tested_edges += edges.len();
            let found = &mut self.found[count..];
            let mut hits = 0;
            for (place, sides) in (node.first_edge..).zip(&self.edge_sides[edges]) {
                let [left, right] = sides.map(|side| values[side as usize] > 0.0);
                found[hits] = 2 * place + u32::from(left);
                hits += usize::from(left != right);
            }
            count += hits;
        }
        out.extend(self.found[..count].iter().map(|&code| {
            let e = self.edge_ends[(code / 2) as usize];
            if code % 2 == 1 { e } else { e.reversed() }
        }));
        work
    }
}

/// Keeps the least distance from zero in each lane.
#[inline(always)]
fn keep_nearest(values: &[f32; LANES], nearest: &mut [f32; LANES]) {
    for (nearest, value) in nearest.iter_mut().zip(values) {
        let size = value.abs();
        // As one instruction has it: the second when either is not a number.
        *nearest = if size < *nearest { size } else { *nearest };
    }
}
