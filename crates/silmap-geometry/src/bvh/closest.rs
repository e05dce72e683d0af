//! The point of the mesh closest to a point.
//!
//! Source: C. Ericson. Real-Time Collision Detection. Morgan Kaufmann, 2005, section 5.1.5 (closest point on a triangle
//! by Voronoi regions).

use glam::DVec3;

use super::{Bvh, Stack, look_at};

impl Bvh {
    /// The point of the mesh closest to `p`, its face, and the weights of that face's corners; of several faces at the
    /// same distance the lowest id, but of the faces around a vertex of very many, when that is closest, any one.
    ///
    /// # Panics
    /// If the tree is empty.
    #[must_use]
    pub fn closest_point(&self, p: DVec3) -> (DVec3, u32, [f64; 3]) {
        self.closest_point_within(p, f64::INFINITY)
            .expect("the tree holds a face and the point is finite")
    }

    /// As [`Bvh::closest_point`], but `None` when nothing is nearer than `distance` (or as near).
    #[must_use]
    pub fn closest_point_within(&self, p: DVec3, distance: f64) -> Option<(DVec3, u32, [f64; 3])> {
        let root = self.nodes.first()?;
        let mut limit = (distance * self.scale).powi(2);
        let mut best: Option<(usize, [f64; 3])> = None;
        let distance_to = |min: DVec3, max: DVec3| {
            ((min - p).max(p - max).max(DVec3::ZERO) * self.scale).length_squared()
        };
        let mut stack = Stack::<(u32, f64)>::new();
        stack.push((0, distance_to(root.min, root.max)));
        while let Some((node, near)) = stack.pop() {
            if near > limit {
                continue;
            }
            let node = &self.nodes[node as usize];
            let found = best.is_some().then_some(limit);
            if self.refine_distance(node, p, near, found) > limit {
                continue;
            }
            if node.count > 0 {
                look_at(node.count);
                for i in node.leaf() {
                    let corners = self.triangles[i].map(|corner| (corner - p) * self.scale);
                    let weights = closest_weights_to_zero(corners);
                    let squared = weighted(corners, weights).length_squared();
                    let is_nearer = squared < limit
                        || (squared == limit
                            && best.is_none_or(|(b, _)| self.face_ids[i] < self.face_ids[b]));
                    if is_nearer {
                        limit = squared;
                        best = Some((i, weights));
                    }
                }
                continue;
            }
            let mut children = [node.first, node.first + 1].map(|id| {
                let child = &self.nodes[id as usize];
                let near = distance_to(child.min, child.max);
                let found = best.is_some().then_some(limit);
                (id, self.refine_distance(child, p, near, found))
            });
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            for child in children {
                if child.1 <= limit {
                    stack.push(child);
                }
            }
        }
        best.map(|(i, weights)| {
            (
                weighted(self.triangles[i], weights),
                self.face_ids[i],
                weights,
            )
        })
    }
}

/// The point with the given weights, computed from the first corner so that far-away coordinates keep their digits.
fn weighted([a, b, c]: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    a + (b - a) * weights[1] + (c - a) * weights[2]
}

/// Weights of the corners at the triangle's point closest to `p`.
#[must_use]
pub fn closest_weights(p: DVec3, corners: [DVec3; 3]) -> [f64; 3] {
    closest_weights_to_zero(corners.map(|corner| corner - p))
}

fn closest_weights_to_zero([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let w = ratio(d1, d1 - d3);
        return [1.0 - w, w, 0.0];
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = ratio(d2, d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = ratio(d4 - d3, (d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    let (v, w) = (ratio(vb, sum), ratio(vc, sum));
    [1.0 - v - w, v, w]
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        (part / whole).clamp(0.0, 1.0)
    } else {
        0.0
    }
}
