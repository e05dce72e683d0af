//! Building the forest: from one node for each edge, the join that saves most, again and again.
//!
//! Two roots may be joined by a new parent, by one adopting the other, or by merging. A root's predicted cost is the
//! test of its cones and, with the probability that a viewpoint lies in neither of them, that of its edges and children.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5, "Tree Construction".
//! Deviations: viewpoints are assumed on a sphere about the mesh, [`VIEW_DISTANCE`] times as large as its bounding
//! sphere, instead of in a large ball. Roots are candidates when edges of theirs share a mesh vertex; the paper found
//! that similarity of normals adds little. At the end a node whose test does not pay is taken out.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;
use silmap_geometry::lp::HalfSpace;

use super::cone::{ConePair, Plane, planes_of};
use crate::edge_mesh::EdgeMesh;

/// Cost of testing a node over that of testing an edge: the paper's k_a/k_e.
const NODE_COST: f64 = 4.0 / 3.0;
/// The same when nodes that do not pay are taken out: a little more, as joins were judged by cones that grew since.
const KEEPING_COST: f64 = 1.47;
/// Distance of the viewpoints that the forest is built for, in bounding-sphere radii.
const VIEW_DISTANCE: f64 = 3.0;

/// A node while the forest is built.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) edges: Vec<u32>,
    pub(super) children: Vec<u32>,
    pub(super) cones: Option<ConePair>,
    /// Probability that a viewpoint is in neither cone.
    pub(super) share: f64,
    /// Faces of the edges of the node and its descendants, sorted; empty once it is no root.
    faces: Vec<u32>,
}

impl Node {
    /// What it costs when it is not culled, without the insides of its children.
    fn own_cost(&self) -> f64 {
        self.edges.len() as f64 + NODE_COST * self.children.len() as f64
    }
}

/// The forest: nodes, the roots among them, and edges that no cone can bound.
#[derive(Clone, Debug)]
pub(super) struct BuiltForest {
    pub(super) nodes: Vec<Node>,
    pub(super) roots: Vec<u32>,
    /// Edges with a face whose plane is not known well enough, or that are better tested always.
    pub(super) unbounded: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Join {
    Parent,
    Adopt,
    AdoptReversed,
    Merge,
}

/// A join of two roots that may be made. Larger is better.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    saving: f64,
    join: Join,
    a: u32,
    b: u32,
}

impl Candidate {
    fn key(&self) -> impl Ord {
        (self.a, self.b, self.join)
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.saving
            .total_cmp(&other.saving)
            .then_with(|| other.key().cmp(&self.key()))
    }
}

/// Buffers of one evaluation after the other.
#[derive(Clone, Debug, Default)]
struct Scratch {
    faces: Vec<u32>,
    planes: Vec<Plane>,
    half_spaces: Vec<HalfSpace>,
}

struct Builder {
    planes: Vec<Option<Plane>>,
    nodes: Vec<Node>,
    /// Of each root that ever was: its node while it is one.
    node_of_root: Vec<Option<u32>>,
    /// Of each root that ever was: the one that it went into, or itself.
    successor: Vec<u32>,
    /// Of each root: others that it may be joined with, some of them joined already.
    links: Vec<Vec<u32>>,
}

/// Builds the forest of a mesh.
pub(super) fn build_forest(mesh: &EdgeMesh) -> BuiltForest {
    let mut builder = Builder::new(mesh);
    let mut heap = BinaryHeap::from(builder.first_candidates());
    let mut scratch = Scratch::default();
    while let Some(candidate) = heap.pop() {
        let (Some(a), Some(b)) = (builder.node(candidate.a), builder.node(candidate.b)) else {
            continue;
        };
        let joined = builder.apply(candidate, (a, b), &mut scratch);
        for other in builder.links[joined as usize].clone() {
            heap.extend(builder.evaluate(joined, other, &mut scratch));
        }
    }
    builder.finish(mesh)
}

impl Builder {
    fn new(mesh: &EdgeMesh) -> Self {
        let planes = planes_of(mesh);
        let edge_count = mesh.edges().len();
        let nodes: Vec<Node> = (0..edge_count)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, edge| {
                let mut faces = mesh.edge_faces()[edge].to_vec();
                faces.sort_unstable();
                let (cones, share) = cones_of(&planes, &faces, scratch);
                Node {
                    edges: vec![edge as u32],
                    children: Vec::new(),
                    cones,
                    share,
                    faces,
                }
            })
            .collect();
        let is_known = |face: &u32| planes[*face as usize].is_some();
        let node_of_root = nodes
            .iter()
            .enumerate()
            .map(|(edge, node)| node.faces.iter().all(is_known).then_some(edge as u32))
            .collect();
        Self {
            nodes,
            node_of_root,
            successor: (0..edge_count as u32).collect(),
            links: links_at_vertices(mesh),
            planes,
        }
    }

    fn node(&self, root: u32) -> Option<u32> {
        self.node_of_root[root as usize]
    }

    fn first_candidates(&self) -> Vec<Candidate> {
        (0..self.links.len() as u32)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, a| {
                let later = self.links[a as usize].iter().filter(|&&b| b > a);
                later
                    .filter_map(|&b| self.evaluate(a, b, scratch))
                    .collect::<Vec<_>>()
            })
            .flatten_iter()
            .collect()
    }

    /// The best join of two roots, if one saves anything.
    fn evaluate(&self, a: u32, b: u32, scratch: &mut Scratch) -> Option<Candidate> {
        let first = &self.nodes[self.node(a)? as usize];
        let second = &self.nodes[self.node(b)? as usize];
        merge_sorted(&first.faces, &second.faces, &mut scratch.faces);
        let faces = std::mem::take(&mut scratch.faces);
        let (_, share) = cones_of(&self.planes, &faces, scratch);
        scratch.faces = faces;
        // What happens more often to what a root holds when the root grows.
        let growth = |node: &Node| (share - node.share) * node.own_cost();
        let (grown_a, grown_b) = (growth(first), growth(second));
        // Every join does away with one root's test.
        let options = [
            (Join::Merge, grown_a + grown_b),
            (Join::Adopt, share * NODE_COST + grown_a),
            (Join::AdoptReversed, share * NODE_COST + grown_b),
            (Join::Parent, 2.0 * share * NODE_COST),
        ];
        let (join, cost) = options
            .into_iter()
            .min_by(|x, y| x.1.total_cmp(&y.1))
            .expect("there are four options");
        let saving = NODE_COST - cost;
        (saving > 0.0).then_some(Candidate { saving, join, a, b })
    }

    /// Makes a join; returns the new root.
    fn apply(&mut self, join: Candidate, (a, b): (u32, u32), scratch: &mut Scratch) -> u32 {
        let root = self.node_of_root.len() as u32;
        let (first, second) = (
            std::mem::take(&mut self.nodes[a as usize].faces),
            std::mem::take(&mut self.nodes[b as usize].faces),
        );
        let mut faces = Vec::with_capacity(first.len() + second.len());
        merge_sorted(&first, &second, &mut faces);
        let (cones, share) = cones_of(&self.planes, &faces, scratch);
        let node = match join.join {
            Join::Parent => {
                self.nodes.push(Node {
                    edges: Vec::new(),
                    children: vec![a, b],
                    cones: None,
                    share: 1.0,
                    faces: Vec::new(),
                });
                self.nodes.len() as u32 - 1
            }
            Join::Adopt => {
                self.nodes[a as usize].children.push(b);
                a
            }
            Join::AdoptReversed => {
                self.nodes[b as usize].children.push(a);
                b
            }
            Join::Merge => {
                let taken = &mut self.nodes[b as usize];
                let edges = std::mem::take(&mut taken.edges);
                let children = std::mem::take(&mut taken.children);
                let keeper = &mut self.nodes[a as usize];
                keeper.edges.extend(edges);
                keeper.children.extend(children);
                a
            }
        };
        let grown = &mut self.nodes[node as usize];
        (grown.cones, grown.share, grown.faces) = (cones, share, faces);
        self.node_of_root[join.a as usize] = None;
        self.node_of_root[join.b as usize] = None;
        self.node_of_root.push(Some(node));
        self.successor[join.a as usize] = root;
        self.successor[join.b as usize] = root;
        self.successor.push(root);
        let mut links = std::mem::take(&mut self.links[join.a as usize]);
        links.append(&mut self.links[join.b as usize]);
        for link in &mut links {
            *link = current(&mut self.successor, *link);
        }
        links.sort_unstable();
        links.dedup();
        links.retain(|&link| link != root && self.node_of_root[link as usize].is_some());
        self.links.push(links);
        root
    }

    fn finish(mut self, mesh: &EdgeMesh) -> BuiltForest {
        let mut forest = BuiltForest {
            roots: self.node_of_root.iter().flatten().copied().collect(),
            nodes: std::mem::take(&mut self.nodes),
            unbounded: Vec::new(),
        };
        let is_known = |face: u32| self.planes[face as usize].is_some();
        forest.unbounded = (0..)
            .zip(mesh.edge_faces())
            .filter(|(_, faces)| !faces.iter().all(|&f| is_known(f)))
            .map(|(edge, _)| edge)
            .collect();
        forest.take_out_useless();
        forest
    }
}

impl BuiltForest {
    /// Takes out nodes whose test costs more than it saves: what they hold goes to their parents.
    fn take_out_useless(&mut self) {
        for root in std::mem::take(&mut self.roots) {
            for node in self.descendants(root).into_iter().rev() {
                self.take_out_children(node);
            }
            let top = &self.nodes[root as usize];
            if KEEPING_COST + top.share * top.own_cost() < top.own_cost() {
                self.roots.push(root);
            } else {
                self.unbounded.extend(&self.nodes[root as usize].edges);
                self.roots.extend(&self.nodes[root as usize].children);
            }
        }
    }

    /// A node and all below it, each before its children.
    pub(super) fn descendants(&self, root: u32) -> Vec<u32> {
        let mut order = vec![root];
        let mut next = 0;
        while next < order.len() {
            order.extend(&self.nodes[order[next] as usize].children);
            next += 1;
        }
        order
    }

    fn take_out_children(&mut self, parent: u32) {
        let share = self.nodes[parent as usize].share;
        for child in std::mem::take(&mut self.nodes[parent as usize].children) {
            let node = &self.nodes[child as usize];
            let with_test = share * KEEPING_COST + node.share.min(share) * node.own_cost();
            if with_test < share * node.own_cost() {
                self.nodes[parent as usize].children.push(child);
            } else {
                let taken = &mut self.nodes[child as usize];
                let edges = std::mem::take(&mut taken.edges);
                let children = std::mem::take(&mut taken.children);
                let keeper = &mut self.nodes[parent as usize];
                keeper.edges.extend(edges);
                keeper.children.extend(children);
            }
        }
    }
}

fn cones_of(
    planes: &[Option<Plane>],
    faces: &[u32],
    scratch: &mut Scratch,
) -> (Option<ConePair>, f64) {
    scratch.planes.clear();
    scratch
        .planes
        .extend(faces.iter().filter_map(|&f| planes[f as usize]));
    if scratch.planes.len() < faces.len() {
        return (None, 1.0);
    }
    let cones = ConePair::of(&scratch.planes, &mut scratch.half_spaces);
    (
        cones,
        cones.map_or(1.0, |c| c.unculled_share(VIEW_DISTANCE)),
    )
}

/// For each edge, those that share a vertex with it.
fn links_at_vertices(mesh: &EdgeMesh) -> Vec<Vec<u32>> {
    let mut at_vertex: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions().len()];
    for (edge, ends) in (0..).zip(mesh.edges()) {
        at_vertex[ends.from as usize].push(edge);
        at_vertex[ends.to as usize].push(edge);
    }
    (0..)
        .zip(mesh.edges())
        .map(|(edge, ends)| {
            let around = [ends.from, ends.to].map(|v| &at_vertex[v as usize]);
            let mut links: Vec<u32> = around.into_iter().flatten().copied().collect();
            links.sort_unstable();
            links.dedup();
            links.retain(|&other| other != edge);
            links
        })
        .collect()
}

/// The root that `root` has become part of; shortens the way for the next time.
fn current(successor: &mut [u32], root: u32) -> u32 {
    let mut at = root;
    while successor[at as usize] != at {
        let next = successor[at as usize];
        successor[at as usize] = successor[next as usize];
        at = next;
    }
    at
}

/// The union of two sorted lists.
pub(super) fn merge_sorted(a: &[u32], b: &[u32], out: &mut Vec<u32>) {
    out.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let (x, y) = (a[i], b[j]);
        out.push(x.min(y));
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    out.extend_from_slice(&a[i..]);
    out.extend_from_slice(&b[j..]);
}
