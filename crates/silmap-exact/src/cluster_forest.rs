//! A forest of edge clusters, laid out for search: a node is skipped where all its faces face the same way.
//!
//! The search goes down level by level. Children lie side by side, so that a level is a list of short ranges; every node of
//! it is tested, and its children and edges are noted whether it is passed over or not: only how far the lists grow depends
//! on it. So nothing waits for a guess of which way a test will go, and memory is asked for long before it is needed.
//! Then the edges follow, in groups of at most eight with at most eight faces: one byte says which faces show their
//! front, and one comparison finds the edges between two that differ. What bounds a node's faces is up to the method.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5, "Runtime Algorithm".
//! Deviation: the flat layout and the order of the search; the paper's nodes hold pointers, and it goes down depth first.

use std::hint::black_box;

use glam::DVec3;

use crate::edge_group::{GroupFaces, GroupPlanes, GroupSides, RoundedQuery, groups_of};
use crate::edge_mesh::EdgeMesh;
use crate::level_order::{SPARE, level_order, write_range};
use crate::plane_block::LANES;
use crate::viewpoint::Query;
use crate::{DirectedEdge, Viewpoint, Work};

/// Something that knows viewpoints from which a set of faces all show their fronts, or none does.
pub(crate) trait FacingBound {
    /// One bit for each of four that surely has the viewpoint among them.
    fn culled(bounds: [&Self; AT_ONCE], query: &Query) -> u8;
}

/// Nodes in depth-first order, as methods make them.
#[derive(Clone, Debug)]
pub(crate) struct Clusters<B> {
    /// Of each node what bounds it, how many nodes hang directly below it, and where its own edges end in the list.
    pub(crate) nodes: Vec<(B, u32, u32)>,
    /// Of each node a [`direction_key`] in which its faces look: such as look alike will lie side by side.
    pub(crate) directions: Vec<u32>,
    pub(crate) edges: Vec<u32>,
    /// Edges that are always tested.
    pub(crate) unbounded: Vec<u32>,
}

/// A node as the search reads it.
#[derive(Clone, Copy, Debug)]
struct Node<B> {
    bound: B,
    /// Its first child and how many there are; its own groups of edges likewise.
    first_child: u32,
    child_count: u32,
    first_group: u32,
    group_count: u32,
}

/// The forest, ready to be searched.
#[derive(Clone, Debug)]
pub(crate) struct ClusterForest<B> {
    /// Level by level; siblings lie side by side. Some more at the end are looked at, but count for nothing.
    nodes: Vec<Node<B>>,
    root_count: u32,
    /// In the order of their nodes, then those of no node.
    planes: Vec<GroupPlanes>,
    sides: Vec<GroupSides>,
    faces: Vec<GroupFaces>,
    edges: Vec<DirectedEdge>,
    first_unbounded: u32,
    /// Buffers: nodes to be visited, groups to be tested, what is found in them, and the edges found.
    visited: Vec<u32>,
    tested: Vec<u32>,
    fronts: Vec<(u8, u8)>,
    unsure: Vec<u32>,
    found: Vec<u32>,
}

/// So many nodes are tested at once.
pub(crate) const AT_ONCE: usize = 4;
/// Nodes that are tested before what is below them is noted.
const CHUNK: usize = 64;
impl<B: FacingBound + Copy> ClusterForest<B> {
    /// Lays out some clusters.
    pub(crate) fn new(mesh: &EdgeMesh, clusters: &Clusters<B>) -> Self {
        let count = clusters.nodes.len();
        let child_counts: Vec<u32> = clusters.nodes.iter().map(|node| node.1).collect();
        let order = level_order(&child_counts, |k| clusters.directions[k]);
        let mut forest = Self {
            nodes: Vec::with_capacity(count),
            root_count: order.root_count as u32,
            planes: Vec::new(),
            sides: Vec::new(),
            faces: Vec::new(),
            edges: Vec::new(),
            first_unbounded: 0,
            visited: vec![0; count + SPARE],
            tested: Vec::new(),
            fronts: Vec::new(),
            unsure: Vec::new(),
            found: Vec::new(),
        };
        for (&k, &first_child) in order.nodes.iter().zip(&order.first_children) {
            let (bound, child_count, edges_end) = clusters.nodes[k];
            let edges_start = k
                .checked_sub(1)
                .map_or(0, |before| clusters.nodes[before].2);
            let first_group = forest.planes.len() as u32;
            forest.push_groups(
                mesh,
                &clusters.edges[edges_start as usize..edges_end as usize],
            );
            forest.nodes.push(Node {
                bound,
                first_child,
                child_count,
                first_group,
                group_count: forest.planes.len() as u32 - first_group,
            });
        }
        if let Some(&last) = forest.nodes.last() {
            forest.nodes.extend([last; SPARE]);
        }
        forest.first_unbounded = forest.planes.len() as u32;
        forest.push_groups(mesh, &clusters.unbounded);
        forest.tested = vec![0; forest.planes.len() + SPARE];
        forest.fronts = vec![(0, 0); forest.planes.len()];
        forest.unsure = vec![0; forest.planes.len()];
        forest.found = vec![0; forest.edges.len() + LANES];
        forest
    }

    fn push_groups(&mut self, mesh: &EdgeMesh, edges: &[u32]) {
        for (planes, sides, faces, edges) in groups_of(mesh, edges, self.edges.len() as u32) {
            self.planes.push(planes);
            self.sides.push(sides);
            self.faces.push(faces);
            self.edges.extend(edges);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.planes)
            + size_of_val(&*self.sides)
            + size_of_val(&*self.faces)
            + size_of_val(&*self.edges)
    }

    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        let (tested, visited_nodes) = self.search(&query);
        let mut work = Work {
            tested_edges: 0,
            visited_nodes,
        };
        self.test_groups(tested, &RoundedQuery::new(&query));
        // The few that this does not decide are decided on their own, so that the others need not wait for them.
        let mut unsure_count = 0;
        for (place, &(_, unsure)) in (0..).zip(&self.fronts[..tested]) {
            self.unsure[unsure_count] = place;
            unsure_count += usize::from(unsure != 0);
        }
        for &place in &self.unsure[..unsure_count] {
            let fronts = &mut self.fronts[place as usize];
            let group = self.tested[place as usize] as usize;
            fronts.0 = self.faces[group].decide(*fronts, (mesh, viewpoint, &query));
        }
        let mut count = 0;
        for (&group, &(fronts, _)) in self.tested[..tested].iter().zip(&self.fronts) {
            let sides = &self.sides[group as usize];
            work.tested_edges += sides.edge_count();
            sides.find(fronts, &mut self.found, &mut count);
        }
        let ends = &self.edges;
        out.extend(self.found[..count].iter().map(|&code| {
            let edge = ends[(code / 2) as usize];
            if code & 1 == 1 { edge } else { edge.reversed() }
        }));
        work
    }

    /// Finds the faces of groups that show their fronts, and those of which that is not known.
    ///
    /// A function of its own so that the compiler does not know that a query's factors are equal in all lanes, which
    /// would keep it from the instruction for products of 16 bits.
    #[inline(never)]
    fn test_groups(&mut self, tested: usize, query: &RoundedQuery) {
        let chunks = self.tested[..tested].chunks(CHUNK);
        for (groups, fronts) in chunks.zip(self.fronts.chunks_mut(CHUNK)) {
            // So little work for each that all of them are on their way from memory at once.
            let mut touched = 0;
            for &group in groups {
                touched ^= self.planes[group as usize].first()
                    ^ self.sides[group as usize].edge_count() as i16;
            }
            black_box(touched);
            for (&group, fronts) in groups.iter().zip(fronts) {
                *fronts = self.planes[group as usize].fronts(query);
            }
        }
    }

    /// Notes which groups are to be tested; returns how many, and the number of nodes visited.
    fn search(&mut self, query: &Query) -> (usize, usize) {
        let (mut tested, mut visited) = (0, 0);
        let mut noted = 0;
        write_range(&mut self.visited, &mut noted, 0, self.root_count);
        while visited < noted {
            let count = (noted - visited).min(CHUNK);
            // As for groups.
            let mut touched = 0;
            for &id in &self.visited[visited..visited + count] {
                touched ^= self.nodes[id as usize].first_child;
            }
            black_box(touched);
            let mut kept = [0; CHUNK + AT_ONCE];
            let mut kept_count = 0;
            for first in (visited..visited + count).step_by(AT_ONCE) {
                // Behind the last there are numbers of some nodes or other.
                let ids: [u32; AT_ONCE] = std::array::from_fn(|k| self.visited[first + k]);
                let bounds = ids.map(|id| &self.nodes[id as usize].bound);
                let not_there = !0 << (visited + count - first).min(AT_ONCE);
                let culled = B::culled(bounds, query) | not_there;
                for (k, id) in ids.into_iter().enumerate() {
                    kept[kept_count] = id;
                    kept_count += usize::from(!culled >> k & 1);
                }
            }
            visited += count;
            for &id in &kept[..kept_count] {
                let node = &self.nodes[id as usize];
                write_range(
                    &mut self.visited,
                    &mut noted,
                    node.first_child,
                    node.child_count,
                );
                write_range(
                    &mut self.tested,
                    &mut tested,
                    node.first_group,
                    node.group_count,
                );
            }
        }
        let unbounded = self.planes.len() as u32 - self.first_unbounded;
        write_range(
            &mut self.tested,
            &mut tested,
            self.first_unbounded,
            unbounded,
        );
        (tested, visited)
    }
}

/// The place of a direction along a curve that fills the sphere, unfolded from an octahedron.
pub(crate) fn direction_key(direction: DVec3) -> u32 {
    const STEPS: f64 = 4096.0;
    let d = direction / (direction.abs().element_sum() + f64::MIN_POSITIVE);
    let (mut x, mut y) = (d.x, d.y);
    if d.z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    let [x, y] = [x, y].map(|c| ((c + 1.0) * 0.5 * STEPS).clamp(0.0, STEPS - 1.0) as u32);
    (0..12).fold(0, |key, bit| {
        key | (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)
    })
}
