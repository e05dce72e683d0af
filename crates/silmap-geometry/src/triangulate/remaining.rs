//! A spatial index of a polygon's remaining corners: whether one of them lies in a triangle.
//!
//! A tree over all corners, halved by count along the longer side of their box. Cutting a corner off lowers the counts and shrinks the
//! boxes above it, so that parts of the polygon that are gone are passed over.

use glam::DVec2;

use super::Ear;

/// Corners of a leaf.
const LEAF_CORNERS: usize = 8;

/// The corners that are left of a polygon.
pub(super) struct Remaining<'a> {
    points: &'a [DVec2],
    is_left: Vec<bool>,
    /// Corners in leaf order.
    order: Vec<u32>,
    nodes: Vec<Node>,
    leaf_of: Vec<u32>,
    /// Nodes that wait to be looked at.
    stack: Vec<u32>,
    /// How many nodes and corners were looked at.
    #[cfg(test)]
    pub(super) looked_at: usize,
}

#[derive(Clone, Copy)]
struct Node {
    min: DVec2,
    max: DVec2,
    /// Of a leaf its range in `order`.
    first: u32,
    end: u32,
    /// Its left child, which the right one follows; zero in a leaf.
    left: u32,
    parent: u32,
    left_count: u32,
}

impl<'a> Remaining<'a> {
    pub(super) fn new(points: &'a [DVec2]) -> Self {
        let mut remaining = Self {
            points,
            is_left: vec![true; points.len()],
            order: (0..points.len() as u32).collect(),
            nodes: Vec::with_capacity(points.len() / 2 + 1),
            leaf_of: vec![0; points.len()],
            stack: Vec::new(),
            #[cfg(test)]
            looked_at: 0,
        };
        remaining.push_node(0, points.len(), 0);
        let mut next = 0;
        while next < remaining.nodes.len() {
            remaining.divide(next);
            next += 1;
        }
        remaining
    }

    fn push_node(&mut self, first: usize, end: usize, parent: usize) {
        let corners = self.order[first..end].iter();
        let (min, max) = box_of(corners.map(|&i| self.points[i as usize]));
        self.nodes.push(Node {
            min,
            max,
            first: first as u32,
            end: end as u32,
            left: 0,
            parent: parent as u32,
            left_count: (end - first) as u32,
        });
    }

    fn divide(&mut self, id: usize) {
        let node = self.nodes[id];
        let (first, end) = (node.first as usize, node.end as usize);
        // Corners at one place stay together, so that all of them are passed over at once.
        if end - first <= LEAF_CORNERS || node.min == node.max {
            for &corner in &self.order[first..end] {
                self.leaf_of[corner as usize] = id as u32;
            }
            return;
        }
        let axis = (node.max - node.min).max_position();
        let middle = first + (end - first) / 2;
        self.order[first..end].select_nth_unstable_by((end - first) / 2, |&a, &b| {
            let place = |i: u32| self.points[i as usize];
            place(a)[axis]
                .total_cmp(&place(b)[axis])
                .then(place(a)[1 - axis].total_cmp(&place(b)[1 - axis]))
                .then(a.cmp(&b))
        });
        self.nodes[id].left = self.nodes.len() as u32;
        self.push_node(first, middle, id);
        self.push_node(middle, end, id);
    }

    pub(super) fn has(&self, corner: usize) -> bool {
        self.is_left[corner]
    }

    /// Cuts a corner off.
    pub(super) fn remove(&mut self, corner: usize) {
        self.is_left[corner] = false;
        let leaf = self.leaf_of[corner] as usize;
        self.nodes[leaf].left_count -= 1;
        self.shrink_leaf(leaf);
        let mut id = leaf;
        while id > 0 {
            id = self.nodes[id].parent as usize;
            self.nodes[id].left_count -= 1;
            self.shrink(id);
        }
    }

    /// Fits the box of a leaf to what is left in it.
    fn shrink_leaf(&mut self, id: usize) {
        let node = self.nodes[id];
        if node.left_count == 0 || node.min == node.max {
            return;
        }
        let corners = self.order[node.first as usize..node.end as usize].iter();
        let left = corners.filter(|&&i| self.is_left[i as usize]);
        let (min, max) = box_of(left.map(|&i| self.points[i as usize]));
        (self.nodes[id].min, self.nodes[id].max) = (min, max);
    }

    /// Fits the box of an inner node to those below it.
    fn shrink(&mut self, id: usize) {
        let left = self.nodes[id].left as usize;
        let below = self.nodes[left..left + 2].iter();
        let below = below.filter(|child| child.left_count > 0);
        let (min, max) = box_of(below.flat_map(|child| [child.min, child.max]));
        (self.nodes[id].min, self.nodes[id].max) = (min, max);
    }

    /// Whether a corner that is left, at another place than the ear's three, lies in the ear or on its rim.
    pub(super) fn any_in(&mut self, ear: &Ear) -> bool {
        self.stack.clear();
        self.stack.push(0);
        while let Some(id) = self.stack.pop() {
            #[cfg(test)]
            {
                self.looked_at += 1;
            }
            let node = self.nodes[id as usize];
            let is_of_ear = node.min == node.max && ear.has_corner_at(node.min);
            if node.left_count == 0 || is_of_ear || !ear.may_meet(node.min, node.max) {
                continue;
            }
            if node.left != 0 {
                self.stack.extend([node.left + 1, node.left]);
                continue;
            }
            for &corner in &self.order[node.first as usize..node.end as usize] {
                #[cfg(test)]
                {
                    self.looked_at += 1;
                }
                let p = self.points[corner as usize];
                if self.is_left[corner as usize] && !ear.has_corner_at(p) && ear.contains(p) {
                    return true;
                }
            }
        }
        false
    }
}

fn box_of(points: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(min, max), p| {
        (min.min(p), max.max(p))
    })
}
