//! A bounding-volume hierarchy over triangles: ray, closest-point, winding-number and box queries.
//!
//! Everything is f64 and relative to the query point, so that neither the model's scale nor its place in the world
//! matters. Rays are watertight: a ray through an edge or a vertex that faces share hits at least one of them.
//!
//! Source: I. Wald. On fast Construction of SAH-based Bounding Volume Hierarchies. IEEE Symposium on Interactive Ray
//! Tracing, 2007 (binned surface-area heuristic).
//! Deviation: written here because the crates for this are single precision, and queries against a hull need to distinguish
//! touching from crossing.

mod closest;
mod oriented;
mod ray;
mod winding;

use glam::DVec3;

use crate::TriangleMesh;

pub use closest::closest_weights;
use oriented::Oriented;
pub use ray::Hit;

/// Most triangles in a leaf; a few are cheaper to test than another pair of boxes.
const LEAF_FACES: usize = 4;
/// Bins a split is chosen from: more hardly improve the tree.
const BINS: usize = 16;
/// Below this depth ranges are halved by count, so that no input makes a tree deeper than [`STACK`].
const HALVING_DEPTH: usize = 56;
/// Largest number of nodes that wait during a descent: `HALVING_DEPTH`, then one per halving of 2³² faces.
const STACK: usize = 96;
/// Boxes are widened by this share of their largest coordinate, so that rounding in a query never loses a face.
const BOX_SLACK_REL: f64 = 4.0 * f64::EPSILON;

/// Stands for "no further bounds".
const NOT_ORIENTED: u32 = u32::MAX;

/// A box tree over the triangles of a mesh.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Further bounds of nodes whose boxes are mostly empty.
    oriented: Vec<Oriented>,
    /// Corners of the faces in leaf order.
    triangles: Vec<[DVec3; 3]>,
    /// Face of the mesh, in leaf order.
    face_ids: Vec<u32>,
    /// A power of two that brings the mesh's extent to about one, so that products of three lengths stay in range.
    scale: f64,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// First triangle of a leaf, or the left child; the right child follows it.
    first: u32,
    /// Triangles of a leaf; zero for an inner node.
    count: u32,
    /// Place of its further bounds, or [`NOT_ORIENTED`].
    oriented: u32,
}

/// A face on its way into the tree.
struct Item {
    face: u32,
    corners: [DVec3; 3],
    min: DVec3,
    max: DVec3,
    middle: DVec3,
}

impl Bvh {
    /// Builds the tree. Faces with a corner that is not finite are left out.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut items: Vec<Item> = (0..mesh.faces.len())
            .filter_map(|f| {
                let corners = mesh.corners(f);
                corners.iter().all(|p| p.is_finite()).then(|| {
                    let min = corners[0].min(corners[1]).min(corners[2]);
                    let max = corners[0].max(corners[1]).max(corners[2]);
                    Item {
                        face: f as u32,
                        corners,
                        min,
                        max,
                        middle: min + (max - min) * 0.5,
                    }
                })
            })
            .collect();
        let extent = {
            let (min, max) = boxes_of(&items);
            (max - min).max_element()
        };
        let mut bvh = Self {
            nodes: Vec::with_capacity(items.len() / 2 + 1),
            oriented: Vec::new(),
            triangles: Vec::new(),
            face_ids: Vec::new(),
            scale: power_of_two_inverse(extent),
        };
        if items.is_empty() {
            return bvh;
        }
        bvh.nodes.push(Node {
            min: DVec3::ZERO,
            max: DVec3::ZERO,
            first: 0,
            count: 0,
            oriented: NOT_ORIENTED,
        });
        let mut waiting = vec![(0_usize, 0_usize, items.len(), 0_usize)];
        while let Some((node, first, end, depth)) = waiting.pop() {
            let (min, max) = boxes_of(&items[first..end]);
            let slack = DVec3::splat(min.abs().max(max.abs()).max_element() * BOX_SLACK_REL);
            bvh.nodes[node].min = min - slack;
            bvh.nodes[node].max = max + slack;
            if end - first <= LEAF_FACES {
                bvh.nodes[node].first = first as u32;
                bvh.nodes[node].count = (end - first) as u32;
                continue;
            }
            let middle = first + split(&mut items[first..end], depth);
            let left = bvh.nodes.len();
            bvh.nodes[node].first = left as u32;
            let child = bvh.nodes[node];
            bvh.nodes.extend([child, child]);
            for child in &mut bvh.nodes[left..] {
                child.count = 0;
            }
            waiting.push((left + 1, middle, end, depth + 1));
            waiting.push((left, first, middle, depth + 1));
        }
        bvh.triangles = items.iter().map(|item| item.corners).collect();
        bvh.face_ids = items.iter().map(|item| item.face).collect();
        bvh.orient();
        bvh
    }

    /// Whether no face is in the tree.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Calls `visit` with every face whose own box meets the closed box from `min` to `max`, in an order that depends on
    /// the mesh only.
    pub fn overlapping_faces(&self, min: DVec3, max: DVec3, visit: impl FnMut(u32)) {
        self.visit_overlapping((min, max), |_| true, visit);
    }

    /// As [`Bvh::overlapping_faces`], in the same order, but without faces that are known not to meet the convex hull of `points`.
    /// Some that do not meet it come along.
    pub fn faces_near_hull(
        &self,
        (min, max): (DVec3, DVec3),
        points: &[DVec3],
        visit: impl FnMut(u32),
    ) {
        self.visit_overlapping((min, max), |node| self.may_hold(node, points), visit);
    }

    fn visit_overlapping(
        &self,
        (min, max): (DVec3, DVec3),
        may_hold: impl Fn(&Node) -> bool,
        mut visit: impl FnMut(u32),
    ) {
        if self.is_empty() {
            return;
        }
        let mut stack = Stack::new();
        stack.push(0);
        while let Some(node) = stack.pop() {
            let node = &self.nodes[node as usize];
            if !boxes_meet(node.min, node.max, min, max) || !may_hold(node) {
                continue;
            }
            if node.count == 0 {
                stack.push(node.first + 1);
                stack.push(node.first);
                continue;
            }
            look_at(node.count);
            for i in node.leaf() {
                let [a, b, c] = self.triangles[i];
                if boxes_meet(a.min(b).min(c), a.max(b).max(c), min, max) {
                    visit(self.face_ids[i]);
                }
            }
        }
    }
}

#[cfg(test)]
thread_local! {
    /// How many faces this thread's queries have looked at.
    static LOOKED_AT: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Tests count the faces that queries look at.
#[inline(always)]
fn look_at(faces: u32) {
    #[cfg(test)]
    LOOKED_AT.with(|sum| sum.set(sum.get() + faces as usize));
    #[cfg(not(test))]
    let _ = faces;
}

impl Node {
    fn leaf(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// Nodes that wait to be visited.
struct Stack<T> {
    entries: [T; STACK],
    len: usize,
}

impl<T: Copy + Default> Stack<T> {
    fn new() -> Self {
        Self {
            entries: [T::default(); STACK],
            len: 0,
        }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.len] = entry;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }
}

fn boxes_meet(min_a: DVec3, max_a: DVec3, min_b: DVec3, max_b: DVec3) -> bool {
    min_a.cmple(max_b).all() && min_b.cmple(max_a).all()
}

fn boxes_of(items: &[Item]) -> (DVec3, DVec3) {
    items.iter().fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), item| (min.min(item.min), max.max(item.max)),
    )
}

/// One over the power of two just below `length`; one when there is no length.
fn power_of_two_inverse(length: f64) -> f64 {
    if length > 0.0 && length.is_finite() {
        // Exponents outside this range belong to lengths whose inverse is not a normal number.
        (-length.log2().floor().clamp(-1000.0, 1000.0)).exp2()
    } else {
        1.0
    }
}

/// Sorts a range of faces into two halves, neither empty, and says how many are in the first.
fn split(items: &mut [Item], depth: usize) -> usize {
    let (low, high) = items.iter().fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(low, high), item| (low.min(item.middle), high.max(item.middle)),
    );
    let extent = high - low;
    let halve = items.len() / 2;
    if depth >= HALVING_DEPTH || extent.max_element() <= 0.0 {
        let axis = extent.max_position();
        items.select_nth_unstable_by(halve, |a, b| {
            a.middle[axis]
                .total_cmp(&b.middle[axis])
                .then(a.face.cmp(&b.face))
        });
        return halve;
    }
    let bin_of = |item: &Item, axis: usize| {
        let position = (item.middle[axis] - low[axis]) / extent[axis] * BINS as f64;
        (position as usize).min(BINS - 1)
    };
    let mut best = (f64::INFINITY, 0, 0);
    for axis in 0..3 {
        if extent[axis] <= 0.0 {
            continue;
        }
        let mut bins = [(DVec3::INFINITY, DVec3::NEG_INFINITY, 0_usize); BINS];
        for item in items.iter() {
            let bin = &mut bins[bin_of(item, axis)];
            *bin = (bin.0.min(item.min), bin.1.max(item.max), bin.2 + 1);
        }
        let mut right_costs = [0.0; BINS];
        let mut gathered = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0_usize);
        for b in (1..BINS).rev() {
            gathered = gather(gathered, bins[b]);
            right_costs[b] = cost(gathered);
        }
        gathered = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0);
        for b in 1..BINS {
            gathered = gather(gathered, bins[b - 1]);
            if gathered.2 == 0 || gathered.2 == items.len() {
                continue;
            }
            let total = cost(gathered) + right_costs[b];
            if total < best.0 {
                best = (total, axis, b);
            }
        }
    }
    let (_, axis, bin) = best;
    partition(items, |item| bin_of(item, axis) < bin)
}

type Gathered = (DVec3, DVec3, usize);

fn gather(a: Gathered, b: Gathered) -> Gathered {
    (a.0.min(b.0), a.1.max(b.1), a.2 + b.2)
}

/// Half the box's surface times its faces.
fn cost((min, max, count): Gathered) -> f64 {
    if count == 0 {
        return 0.0;
    }
    let d = max - min;
    (d.x * d.y + d.y * d.z + d.z * d.x) * count as f64
}

/// Moves the items that satisfy `is_left` to the front; says how many there are.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let mut left = 0;
    for i in 0..items.len() {
        if is_left(&items[i]) {
            items.swap(left, i);
            left += 1;
        }
    }
    left
}

#[cfg(test)]
mod tests;
