//! Whether the new faces of an inner hull stay inside the model.
//!
//! By the rule of `placement` an inner hull winds nowhere more often than the model does. That alone does not keep it inside: where
//! faces fold over, it winds less than zero times, and may do so outside the model, as at the tips of thin fingers. So
//! each fan of new faces is held against the model itself: a fan that touches nothing of the model's surface, but where
//! its ring lies on it, is inside as a whole when its vertex is. Touching is decided by exact signs.
//!
//! Where the model passes through itself, a fan may go from one part into another, as long as both sides of
//! the place are inside; that is looked at in the middle of each crossing.

use glam::{DVec2, DVec3};
use silmap_geometry::predicates::{orient2d, side_of_plane};
use silmap_geometry::{Bvh, TriangleMesh};

/// Heights within this of a plane, in lengths of which the model takes about one, are left to exact signs: above their
/// rounding, but for what slivers make of it.
const UNSURE: f64 = 64.0 * f64::EPSILON;
/// How far beside a crossing the winding number is asked for, in the same lengths.
const BESIDE: f64 = 1e-9;

/// The model, as an inner hull is held against it: turned inside out, as the collapsed surface is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inside<'a> {
    pub(super) model: &'a TriangleMesh,
    pub(super) tree: &'a Bvh,
}

impl Inside<'_> {
    /// Whether the faces from the edges of a ring to `apex` are inside; the ring itself is taken to be.
    pub(super) fn holds(&self, ring: impl IntoIterator<Item = [DVec3; 2]>, apex: DVec3) -> bool {
        let mut near = Vec::new();
        let is_clear =
            (ring.into_iter()).all(|[from, to]| self.holds_face([from, to, apex], &mut near));
        is_clear && self.is_inside(apex)
    }

    fn is_inside(&self, point: DVec3) -> bool {
        self.tree.winding_number(point) < 0
    }

    /// Whether a face, but for its first edge, meets the model's surface only between parts of its inside.
    fn holds_face(&self, face: [DVec3; 3], near: &mut Vec<u32>) -> bool {
        let [a, b, v] = face;
        let cross = (b - a).cross(v - a);
        let normal = cross / cross.length();
        let unsure = UNSURE * (b - a).length() * (v - a).length() / cross.length();
        near.clear();
        self.tree
            .overlapping_faces(a.min(b).min(v), a.max(b).max(v), |f| {
                let heights = self.model.corners(f as usize).map(|p| normal.dot(p - v));
                let is_beside =
                    heights.iter().all(|&h| h > unsure) || heights.iter().all(|&h| h < -unsure);
                if !is_beside {
                    near.push(f);
                }
            });
        near.iter().all(|&f| {
            let other = self.model.corners(f as usize);
            !meets(face, other) || self.is_within(face, other)
        })
    }

    /// Whether both sides of the place where a face passes through a triangle of the model are inside.
    fn is_within(&self, face: [DVec3; 3], other: [DVec3; 3]) -> bool {
        let Some((middle, along)) = crossing(face, other) else {
            return false;
        };
        let [a, b, c] = face;
        let across = (b - a).cross(c - a).cross(along).normalize_or_zero() * BESIDE;
        self.is_inside(middle + across) && self.is_inside(middle - across)
    }
}

/// Whether a triangle without its first edge, whose ends belong to that, has a point in common with another one. The answer is
/// exact but where things lie in one plane or line that need not: there it may be yes instead of no.
fn meets(face: [DVec3; 3], other: [DVec3; 3]) -> bool {
    let [a, b, v] = face;
    let [p, q, r] = other;
    let [sa, sb, sv] = face.map(|x| side_of_plane(p, q, r, x));
    if (sv > 0.0 && sa >= 0.0 && sb >= 0.0) || (sv < 0.0 && sa <= 0.0 && sb <= 0.0) {
        return false;
    }
    let heights = other.map(|x| side_of_plane(a, b, v, x));
    if heights.iter().all(|&h| h > 0.0) || heights.iter().all(|&h| h < 0.0) {
        return false;
    }
    if heights == [0.0; 3] {
        return meets_in_plane(face, &other);
    }
    let meets_side = |from: DVec3, side: f64| {
        if side == 0.0 {
            // From its start on the plane it goes away from that, or along it.
            return sv == 0.0;
        }
        if side * sv > 0.0 {
            return false;
        }
        let turns = [(p, q), (q, r), (r, p)].map(|(s, t)| side_of_plane(from, v, s, t));
        turns.iter().all(|&s| s >= 0.0) || turns.iter().all(|&s| s <= 0.0)
    };
    if meets_side(a, sa) || meets_side(b, sb) {
        return true;
    }
    (0..3).any(|k| {
        let (s, t) = (other[k], other[(k + 1) % 3]);
        let (low, high) = (heights[k], heights[(k + 1) % 3]);
        if low == 0.0 && high == 0.0 {
            return meets_in_plane(face, &[s, t]);
        }
        if (low > 0.0 && high > 0.0) || (low < 0.0 && high < 0.0) {
            return false;
        }
        let [first, second, third] =
            [(a, b), (b, v), (v, a)].map(|(from, to)| side_of_plane(s, t, from, to));
        (first > 0.0 && second >= 0.0 && third >= 0.0)
            || (first < 0.0 && second <= 0.0 && third <= 0.0)
    })
}

/// The same for points of a convex polygon, or of a line, in the triangle's own plane; yes where no side of either keeps them apart.
fn meets_in_plane(face: [DVec3; 3], points: &[DVec3]) -> bool {
    let projections: [fn(DVec3) -> DVec2; 3] = [
        |p| DVec2::new(p.x, p.y),
        |p| DVec2::new(p.y, p.z),
        |p| DVec2::new(p.z, p.x),
    ];
    let turn =
        |p: [DVec3; 3], flat: fn(DVec3) -> DVec2| orient2d(flat(p[0]), flat(p[1]), flat(p[2]));
    let Some(flat) = (projections.into_iter()).find(|&flat| turn(face, flat) != 0.0) else {
        return true;
    };
    let [a, b, v] = face;
    let sign = turn(face, flat).signum();
    let inwards = |from, to, p| sign * turn([from, to, p], flat);
    let is_apart = points.iter().all(|&p| inwards(a, b, p) <= 0.0)
        || points.iter().all(|&p| inwards(b, v, p) < 0.0 || p == b)
        || points.iter().all(|&p| inwards(v, a, p) < 0.0 || p == a);
    if is_apart {
        return false;
    }
    !(0..points.len()).any(|k| {
        let (s, t) = (points[k], points[(k + 1) % points.len()]);
        let side = |p| turn([s, t, p], flat);
        let others = || points.iter().map(|&p| side(p));
        (side(v) > 0.0 && side(a) >= 0.0 && side(b) >= 0.0 && others().all(|s| s <= 0.0))
            || (side(v) < 0.0 && side(a) <= 0.0 && side(b) <= 0.0 && others().all(|s| s >= 0.0))
    })
}

/// Middle and direction of the segment that two triangles share; `None` where they only touch.
fn crossing(first: [DVec3; 3], second: [DVec3; 3]) -> Option<(DVec3, DVec3)> {
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let along = normal(first).cross(normal(second)).try_normalize()?;
    let piece = |triangle: [DVec3; 3], plane: [DVec3; 3]| {
        let [p, q, r] = plane;
        let heights = triangle.map(|x| side_of_plane(p, q, r, x));
        let mut ends: Vec<DVec3> = (0..3)
            .filter(|&k| heights[k] == 0.0)
            .map(|k| triangle[k])
            .collect();
        for k in 0..3 {
            let (s, t) = (heights[k], heights[(k + 1) % 3]);
            if s * t < 0.0 || (s != 0.0 && t != 0.0 && (s > 0.0) != (t > 0.0)) {
                ends.push(triangle[k].lerp(triangle[(k + 1) % 3], s / (s - t)));
            }
        }
        ends.sort_by(|p, q| along.dot(*p).total_cmp(&along.dot(*q)));
        Some([*ends.first()?, *ends.last()?])
    };
    let (one, two) = (piece(first, second)?, piece(second, first)?);
    let later = |p: DVec3, q: DVec3| if along.dot(p) < along.dot(q) { q } else { p };
    let earlier = |p: DVec3, q: DVec3| if along.dot(p) < along.dot(q) { p } else { q };
    let (start, end) = (later(one[0], two[0]), earlier(one[1], two[1]));
    (along.dot(start) < along.dot(end)).then(|| (start.midpoint(end), along))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use silmap_models as models;

    const FACE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    fn triangle(points: [[f64; 3]; 3]) -> [DVec3; 3] {
        points.map(DVec3::from)
    }

    #[test]
    fn only_the_first_edge_may_be_touched() {
        // From the first edge upwards and downwards, beyond an end of it, and through its corner on one side.
        for free in [
            [[0.2, 0.0, 0.0], [0.8, 0.0, 0.0], [0.5, 0.0, 1.0]],
            [[0.2, 0.0, 0.0], [0.8, 0.0, 0.0], [0.5, -1.0, 1.0]],
            [[0.5, 0.0, -1.0], [0.5, 0.0, 1.0], [0.5, -1.0, 0.0]],
            [[0.0, 0.0, 0.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0]],
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, -1.0, 0.0]],
            [[0.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
            [[1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 0.0]],
            [[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 1.0]],
        ] {
            assert!(!meets(FACE, triangle(free)), "{free:?}");
        }
        for met in [
            // Through it, at its apex, in a corner, from a side, in its plane.
            [[0.2, 0.2, -1.0], [0.3, 0.2, -1.0], [0.2, 0.2, 1.0]],
            [[0.0, 1.0, 0.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0]],
            [[0.2, 0.2, 0.0], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]],
            [[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [1.0, 1.0, 0.0]],
            [[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]],
            [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
            [[0.5, 0.0, -1.0], [0.5, 0.0, 1.0], [0.5, 1.0, 0.0]],
        ] {
            assert!(meets(FACE, triangle(met)), "{met:?}");
        }
    }

    proptest! {
        /// Against points of the triangles themselves, on a grid so coarse that every degenerate position comes up.
        #[test]
        fn a_common_point_is_never_missed(coordinates in prop::array::uniform18(-2_i32..3)) {
            let point = |i: usize| DVec3::new(
                f64::from(coordinates[i]), f64::from(coordinates[i + 1]), f64::from(coordinates[i + 2]));
            let face = [point(0), point(3), point(6)];
            let other = [point(9), point(12), point(15)];
            prop_assume!((face[1] - face[0]).cross(face[2] - face[0]) != DVec3::ZERO);
            prop_assume!((other[1] - other[0]).cross(other[2] - other[0]) != DVec3::ZERO);
            // The point of the other one at small weights, moved onto the face's plane and looked for in it.
            let n = 12;
            let mut is_common = false;
            let normal = (face[1] - face[0]).cross(face[2] - face[0]);
            for i in 0..=n {
                for j in 0..=(n - i) {
                    let w = [f64::from(i), f64::from(j), f64::from(n - i - j)];
                    let p = other[0] * w[0] + other[1] * w[1] + other[2] * w[2];
                    // Twelve times a point of the grid: whole numbers.
                    let f = face.map(|x| x * f64::from(n));
                    if normal.dot(p - f[0]) != 0.0 {
                        continue;
                    }
                    let inner = |s: DVec3, t: DVec3| normal.dot((t - s).cross(p - s));
                    is_common |= inner(f[0], f[1]) > 0.0 && inner(f[1], f[2]) >= 0.0 && inner(f[2], f[0]) >= 0.0;
                }
            }
            if is_common {
                prop_assert!(meets(face, other));
            }
            prop_assert_eq!(meets(face, other), meets(face, [other[2], other[0], other[1]]));
            prop_assert_eq!(meets(face, other), meets([face[1], face[0], face[2]], other));
        }
    }

    #[test]
    fn fans_are_told_inside_from_outside_also_across_overlapping_parts() {
        let mut model = models::torus(1200);
        for face in &mut model.faces {
            face.swap(1, 2);
        }
        // A second ring that overlaps the first one.
        let count = model.positions.len() as u32;
        let moved: Vec<DVec3> = model
            .positions
            .iter()
            .map(|&p| p + DVec3::X * 0.1)
            .collect();
        model.positions.extend(moved);
        let faces: Vec<[u32; 3]> = model.faces.iter().map(|f| f.map(|v| v + count)).collect();
        model.faces.extend(faces);
        let tree = Bvh::new(&model);
        let inside = Inside {
            model: &model,
            tree: &tree,
        };
        let bounds = model.bounds();
        // In both bodies, close beneath the wall of the first; not in line with any vertex.
        let middle = DVec3::new(bounds.max.x - 0.13, 0.013, 0.007);
        let ring = |size: f64| {
            let corners = [DVec3::Y, DVec3::Z, -DVec3::Y, -DVec3::Z].map(|d| middle + d * size);
            (0..4).map(move |k| [corners[k], corners[(k + 1) % 4]])
        };
        assert!(inside.is_inside(middle));
        assert!(inside.holds(ring(1e-3), middle - DVec3::X * 0.02));
        assert!(inside.holds(ring(1e-3), middle + DVec3::X * 0.06));
        assert!(!inside.holds(ring(1e-3), middle + DVec3::X * 0.3));
        assert!(!inside.holds(ring(1e-3), middle - DVec3::X * 3.0));
    }
}
