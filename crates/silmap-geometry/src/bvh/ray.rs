//! Ray queries.
//!
//! Source: S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. Journal of Computer Graphics Techniques 2
//! (1), 2013.
//! Deviation: where an edge function is too small for its sign to be sure, an exact predicate decides, so that a ray
//! can neither slip between faces around a vertex nor through a shared edge.

use glam::{DVec2, DVec3};

use super::{Bvh, Node, Stack, look_at};
use crate::predicates::orient2d;

/// Relative error of a difference of two products, with some to spare.
const EDGE_ERROR_REL: f64 = 4.0 * f64::EPSILON;
/// Relative error of a ray's parameter at a box side, with some to spare.
const SLAB_ERROR_REL: f64 = 16.0 * f64::EPSILON;

/// Where a ray meets a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How far along the ray, in lengths of its direction.
    pub t: f64,
    /// Face of the mesh.
    pub face: u32,
    /// Weights of the face's corners, not negative, with sum one.
    pub barycentric: [f64; 3],
    /// Whether the ray runs against the face's normal (into a closed, outward mesh).
    pub enters: bool,
}

/// A ray prepared for many triangles: the axis it runs along most, and the shear that turns it into that axis.
pub(super) struct Ray {
    origin: DVec3,
    direction: DVec3,
    inverse: DVec3,
    axes: [usize; 3],
    shear: DVec2,
    /// One over the direction's largest component, in the tree's scale.
    per_depth: f64,
    scale: f64,
}

/// A hit, and whether it lies exactly on the face's rim.
pub(super) struct FaceHit {
    pub(super) t: f64,
    pub(super) barycentric: [f64; 3],
    pub(super) enters: bool,
    pub(super) on_rim: bool,
}

impl Ray {
    /// `None` when the direction has no length or something is not finite.
    pub(super) fn new(origin: DVec3, direction: DVec3, scale: f64) -> Option<Self> {
        let z = direction.abs().max_position();
        if !origin.is_finite() || !direction.is_finite() || direction[z] == 0.0 {
            return None;
        }
        // Mirroring keeps counter-clockwise faces counter-clockwise in the sheared plane.
        let (x, y) = if direction[z] > 0.0 {
            ((z + 1) % 3, (z + 2) % 3)
        } else {
            ((z + 2) % 3, (z + 1) % 3)
        };
        Some(Self {
            origin,
            direction,
            inverse: direction.recip(),
            axes: [x, y, z],
            shear: DVec2::new(direction[x], direction[y]) / direction[z],
            per_depth: (direction[z] * scale).recip(),
            scale,
        })
    }

    /// The box's stretch of the ray, clipped to `t_min..=t_max`; `None` when there is none.
    fn crosses_box(&self, min: DVec3, max: DVec3, t_min: f64, t_max: f64) -> Option<(f64, f64)> {
        // A zero direction component gives infinities of the right sign. NaN appears only for an origin on the side of a
        // widened box, which the mesh does not reach.
        let a = (min - self.origin) * self.inverse;
        let b = (max - self.origin) * self.inverse;
        let mut near = a.min(b).max_element();
        let mut far = a.max(b).min_element();
        near -= near.abs() * SLAB_ERROR_REL;
        far += far.abs() * SLAB_ERROR_REL;
        near = near.max(t_min);
        far = far.min(t_max);
        (near <= far).then_some((near, far))
    }

    /// Where the ray comes near a node's faces, at the earliest; `None` when it does not.
    fn enters(&self, (tree, node): (&Bvh, &Node), t_min: f64, t_max: f64) -> Option<f64> {
        let stretch = self.crosses_box(node.min, node.max, t_min, t_max)?;
        tree.may_meet(node, (self.origin, self.direction), stretch)
            .then_some(stretch.0)
    }

    pub(super) fn meets(&self, corners: &[DVec3; 3]) -> Option<FaceHit> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let v = (p - self.origin) * self.scale;
            (
                DVec2::new(v[x] - self.shear.x * v[z], v[y] - self.shear.y * v[z]),
                v[z],
            )
        });
        let u = edge_function(c.0, b.0);
        let v = edge_function(a.0, c.0);
        let w = edge_function(b.0, a.0);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            // Seen edge-on: the faces beside it are hit instead.
            return None;
        }
        let barycentric = [u / sum, v / sum, w / sum];
        let depth = barycentric[0] * a.1 + barycentric[1] * b.1 + barycentric[2] * c.1;
        Some(FaceHit {
            t: depth * self.per_depth,
            barycentric,
            enters: sum > 0.0,
            on_rim: u == 0.0 || v == 0.0 || w == 0.0,
        })
    }
}

/// `p × q`, with the exact sign; swapping the arguments negates it exactly.
fn edge_function(p: DVec2, q: DVec2) -> f64 {
    let (left, right) = (p.x * q.y, p.y * q.x);
    let value = left - right;
    if value.abs() > (left.abs() + right.abs()) * EDGE_ERROR_REL {
        value
    } else {
        orient2d(p, q, DVec2::ZERO)
    }
}

impl Bvh {
    /// The nearest face that the ray meets with `t_min <= t <= t_max`; of several at the same `t` the lowest id.
    ///
    /// `direction` need not be of unit length: `t` counts in its lengths. Both sides of a face are hit.
    #[must_use]
    pub fn first_hit(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<Hit> {
        let ray = Ray::new(origin, direction, self.scale)?;
        let root = self.nodes.first()?;
        let mut best: Option<Hit> = None;
        let mut limit = t_max;
        let mut stack = Stack::<(u32, f64)>::new();
        stack.push((0, ray.enters((self, root), t_min, t_max)?));
        while let Some((node, near)) = stack.pop() {
            if near > limit {
                continue;
            }
            let node = &self.nodes[node as usize];
            if node.count > 0 {
                look_at(node.count);
                for i in node.leaf() {
                    let Some(hit) = ray.meets(&self.triangles[i]) else {
                        continue;
                    };
                    let face = self.face_ids[i];
                    let is_nearer = hit.t >= t_min
                        && (hit.t < limit
                            || (hit.t == limit && best.as_ref().is_none_or(|b| face < b.face)));
                    if is_nearer {
                        limit = hit.t;
                        best = Some(hit.of_face(face));
                    }
                }
                continue;
            }
            let mut children = [node.first, node.first + 1].map(|id| {
                let child = &self.nodes[id as usize];
                (id, ray.enters((self, child), t_min, limit))
            });
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            for (id, near) in children {
                if let Some(near) = near {
                    stack.push((id, near));
                }
            }
        }
        best
    }

    /// Every face that the ray meets with `t >= 0`, sorted by `t`, then face.
    ///
    /// A ray exactly through a shared edge or vertex hits all faces around it.
    #[must_use]
    pub fn all_hits(&self, origin: DVec3, direction: DVec3) -> Vec<Hit> {
        let mut hits = Vec::new();
        if let Some(ray) = Ray::new(origin, direction, self.scale) {
            self.visit_hits(&ray, 0.0, |i, hit| {
                hits.push(hit.of_face(self.face_ids[i]));
                true
            });
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)));
        hits
    }

    /// Calls `visit` with the place in leaf order of each face met at `t >= t_min`, until it returns false.
    pub(super) fn visit_hits(
        &self,
        ray: &Ray,
        t_min: f64,
        mut visit: impl FnMut(usize, FaceHit) -> bool,
    ) {
        if self.is_empty() {
            return;
        }
        let mut stack = Stack::<u32>::new();
        stack.push(0);
        while let Some(node) = stack.pop() {
            let node = &self.nodes[node as usize];
            if ray.enters((self, node), t_min, f64::INFINITY).is_none() {
                continue;
            }
            if node.count == 0 {
                stack.push(node.first + 1);
                stack.push(node.first);
                continue;
            }
            look_at(node.count);
            for i in node.leaf() {
                if let Some(hit) = ray.meets(&self.triangles[i])
                    && hit.t >= t_min
                    && !visit(i, hit)
                {
                    return;
                }
            }
        }
    }
}

impl FaceHit {
    fn of_face(self, face: u32) -> Hit {
        Hit {
            t: self.t,
            face,
            barycentric: self.barycentric,
            enters: self.enters,
        }
    }
}
