//! Building the cone forest: greedy agglomeration from one node per edge.
//!
//! Two roots may be joined by a new parent, by one adopting the other, or by merging. A root's predicted cost is the
//! test of its cones and, with the probability that a viewpoint lies in neither of them, that of its edges and children.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5, "Tree Construction".
//! Deviations: viewpoints are assumed on a sphere about the mesh, [`VIEW_DISTANCE`] times as large as its bounding
//! sphere, instead of in a large ball. Roots are candidates when edges of theirs share a mesh vertex; the paper found
//! that similarity of normals adds little. At the end a node whose test does not pay is taken out.

use rayon::prelude::*;
use silmap_geometry::lp::HalfSpace;
use silmap_geometry::{CostQueue, Interrupted};

use super::cone::{ConePair, Plane, normal, planes_of};
use crate::edge_mesh::EdgeMesh;
use crate::watch::Counter;

/// Cost of testing a node over that of testing an edge: the paper's k_a/k_e.
const NODE_COST: f64 = 4.0 / 3.0;
/// The same when nodes that do not pay are taken out: a little more, as joins were judged by cones that grew since.
const KEEPING_COST: f64 = 1.47;
/// Distance of the viewpoints that the forest is built for, in bounding-sphere radii.
const VIEW_DISTANCE: f64 = 3.0;
/// Joins of roots with more faces are judged by so many of them at most, so that judging a large root's joins does not take the time of
/// looking at all of its faces for each. Cones always hold all.
const MOST_JUDGED: usize = 192;
/// At vertices of more edges not every pair of them is a candidate.
const MOST_LINKED: usize = 32;
/// So many links of a root are kept, spread evenly: those beside a large one know it by their own, so that it need not look at all of them
/// each time it grows.
const MOST_KEPT: usize = 64;

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
    /// Those of them that joins are judged by, when not all are.
    sketch: Option<Vec<u32>>,
}

impl Node {
    /// What it costs when it is not culled, without the insides of its children.
    fn own_cost(&self) -> f64 {
        self.edges.len() as f64 + NODE_COST * self.children.len() as f64
    }

    /// The faces that joins are judged by.
    fn judged_faces(&self) -> &[u32] {
        self.sketch.as_ref().unwrap_or(&self.faces)
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

/// A join of two roots that may be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    a: u32,
    b: u32,
    join: Join,
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

/// Edges whose joins are looked at by all cores before the watcher is called.
const EDGES_AT_ONCE: usize = 1 << 11;

/// Builds the forest of a mesh. Edges advance the counter twice, when they are looked at and when they are joined; its steps are faces
/// whose planes are looked at.
pub(super) fn build_forest(
    mesh: &EdgeMesh,
    counter: &mut Counter<'_>,
) -> Result<BuiltForest, Interrupted> {
    let mut builder = Builder::new(mesh, counter)?;
    let first = builder.first_candidates(counter)?;
    let mut queue: CostQueue<Candidate> = first.into_iter().collect();
    let mut scratch = Scratch::default();
    while let Some((_, candidate)) = queue.pop() {
        let (Some(a), Some(b)) = (builder.node(candidate.a), builder.node(candidate.b)) else {
            counter.step(1)?;
            continue;
        };
        let joined = builder.apply(candidate, (a, b), &mut scratch);
        counter.advance(1);
        let links = std::mem::take(&mut builder.links[joined as usize]);
        for &other in &links {
            queue.extend(builder.evaluate(joined, other, &mut scratch));
            counter.step(1 + scratch.planes.len() as u64)?;
        }
        builder.links[joined as usize] = links;
    }
    Ok(builder.finish(mesh))
}

impl Builder {
    fn new(mesh: &EdgeMesh, counter: &mut Counter<'_>) -> Result<Self, Interrupted> {
        let planes = planes_of(mesh);
        let edge_count = mesh.edges().len();
        let node_of = |scratch: &mut Scratch, edge: usize| {
            let mut faces = mesh.edge_faces()[edge].to_vec();
            faces.sort_unstable();
            let (cones, share) = cones_of(&planes, &faces, scratch);
            Node {
                edges: vec![edge as u32],
                children: Vec::new(),
                cones,
                share,
                faces,
                sketch: None,
            }
        };
        let mut nodes: Vec<Node> = Vec::with_capacity(edge_count);
        for first in (0..edge_count).step_by(EDGES_AT_ONCE) {
            counter.tell()?;
            let some = first..edge_count.min(first + EDGES_AT_ONCE);
            nodes.par_extend(some.into_par_iter().map_init(Scratch::default, node_of));
        }
        let is_known = |face: &u32| planes[*face as usize].is_some();
        let node_of_root = nodes
            .iter()
            .enumerate()
            .map(|(edge, node)| node.faces.iter().all(is_known).then_some(edge as u32))
            .collect();
        Ok(Self {
            nodes,
            node_of_root,
            successor: (0..edge_count as u32).collect(),
            links: links_at_vertices(mesh),
            planes,
        })
    }

    fn node(&self, root: u32) -> Option<u32> {
        self.node_of_root[root as usize]
    }

    fn first_candidates(
        &self,
        counter: &mut Counter<'_>,
    ) -> Result<Vec<(f64, Candidate)>, Interrupted> {
        let mut candidates = Vec::new();
        let edge_count = self.links.len();
        for first in (0..edge_count).step_by(EDGES_AT_ONCE) {
            counter.tell()?;
            let some = first as u32..edge_count.min(first + EDGES_AT_ONCE) as u32;
            counter.advance(some.len() as u64);
            let links = self.links[first..].iter().take(EDGES_AT_ONCE);
            counter.step(links.map(|links| links.len() as u64).sum())?;
            let found = some
                .into_par_iter()
                .map_init(Scratch::default, |scratch, a| {
                    let later = self.links[a as usize].iter().filter(|&&b| b > a);
                    later
                        .filter_map(|&b| self.evaluate(a, b, scratch))
                        .collect::<Vec<_>>()
                });
            candidates.par_extend(found.flatten_iter());
        }
        Ok(candidates)
    }

    /// The best join of two roots and its cost, less than nothing, if it saves anything.
    fn evaluate(&self, a: u32, b: u32, scratch: &mut Scratch) -> Option<(f64, Candidate)> {
        let first = &self.nodes[self.node(a)? as usize];
        let second = &self.nodes[self.node(b)? as usize];
        scratch.planes.clear();
        let share = if first.cones.is_none() || second.cones.is_none() {
            // More faces have no cones either.
            1.0
        } else {
            let mut faces = std::mem::take(&mut scratch.faces);
            merge_sorted(first.judged_faces(), second.judged_faces(), &mut faces);
            let (_, share) = cones_of(&self.planes, &faces, scratch);
            scratch.faces = faces;
            share
        };
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
        // What rounding decides is a tie: else a large root in a flat region might take in one edge after the other, and look at all of
        // its faces each time. Of equal joins that of the older roots comes first.
        let saving = f64::from((NODE_COST - cost) as f32);
        (saving > 0.0).then_some((-saving, Candidate { a, b, join }))
    }

    /// Makes a join; returns the new root.
    fn apply(&mut self, join: Candidate, (a, b): (u32, u32), scratch: &mut Scratch) -> u32 {
        let root = self.node_of_root.len() as u32;
        let (first, second) = (
            std::mem::take(&mut self.nodes[a as usize].faces),
            std::mem::take(&mut self.nodes[b as usize].faces),
        );
        for id in [a, b] {
            self.nodes[id as usize].sketch = None;
        }
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
                    sketch: None,
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
        let sketch = cones
            .filter(|_| faces.len() > MOST_JUDGED)
            .map(|cones| sketch_of(&faces, &self.planes, &cones));
        let grown = &mut self.nodes[node as usize];
        (grown.cones, grown.share, grown.faces) = (cones, share, faces);
        grown.sketch = sketch;
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
        if links.len() > MOST_KEPT {
            let count = links.len();
            links = (0..MOST_KEPT)
                .map(|k| links[k * count / MOST_KEPT])
                .collect();
        }
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

/// Faces that mostly determine where the cones of a root and others will be: those that look farthest from the axis, those that keep the
/// apexes where they are, and some from everywhere.
fn sketch_of(faces: &[u32], planes: &[Option<Plane>], cones: &ConePair) -> Vec<u32> {
    const SHARE: usize = MOST_JUDGED / 4;
    let mut sketch: Vec<u32> = (faces.iter().step_by(faces.len().div_ceil(SHARE)))
        .copied()
        .collect();
    let slacks: [&dyn Fn(&Plane) -> f64; 3] = [
        &|p| normal(p).dot(cones.axis),
        &|p| normal(p).dot(cones.front_apex) + p[3],
        &|p| -normal(p).dot(cones.back_apex) - p[3],
    ];
    for slack in slacks {
        let mut order: Vec<(f64, u32)> = (faces.iter())
            .filter_map(|&face| planes[face as usize].map(|plane| (slack(&plane), face)))
            .collect();
        let compare = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if order.len() > SHARE {
            order.select_nth_unstable_by(SHARE, compare);
            order.truncate(SHARE);
        }
        sketch.extend(order.iter().map(|(_, face)| face));
    }
    sketch.sort_unstable();
    sketch.dedup();
    sketch
}

/// For each edge, those that it may be joined with first: at a vertex of at most [`MOST_LINKED`] edges all others, at one of more
/// those of the same faces. All pairs there would be the square of their number, and joins of neighbours lead to the rest.
fn links_at_vertices(mesh: &EdgeMesh) -> Vec<Vec<u32>> {
    let mut at_vertex: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions().len()];
    for (edge, ends) in (0..).zip(mesh.edges()) {
        at_vertex[ends.from as usize].push(edge);
        at_vertex[ends.to as usize].push(edge);
    }
    (0..)
        .zip(mesh.edges().iter().zip(mesh.edge_faces()))
        .map(|(edge, (ends, faces))| {
            let around = [ends.from, ends.to].map(|v| &at_vertex[v as usize]);
            let few = around.into_iter().filter(|all| all.len() <= MOST_LINKED);
            let beside = faces.map(|face| mesh.face_edges()[face as usize]);
            let mut links: Vec<u32> = few
                .flatten()
                .chain(beside.as_flattened())
                .copied()
                .collect();
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
fn merge_sorted(a: &[u32], b: &[u32], out: &mut Vec<u32>) {
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

#[cfg(test)]
#[path = "build_tests.rs"]
mod tests;
