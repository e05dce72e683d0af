//! From loops with depths to the image of a camera.
//!
//! Source: Silhouette Mapping, section 5, maps an outline by the homography of a plane. Deviation: where depths are known, each
//! vertex is a point in space and is seen where it is; and where it is known how fast the touched point slides along its ray, the
//! object is taken as round there, so that an eye off the polytope touches it at another point.

use glam::{DMat3, DVec3, DVec4};

use crate::loops::{DeepLoops, SeenLoops};

/// A map from loops with inverse depths to an image: homogeneous image coordinates are `matrix`·(x, y, 1) + inverse depth · `shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// From coordinates of the loops, with a 1 appended.
    pub matrix: DMat3,
    /// Zero for a map by the plane of some homography.
    pub shift: DVec3,
    /// From the polytope to the eye, where outlines are to follow a round object.
    pub round: Option<Round>,
    /// Whether homogeneous image coordinates are as long as points are deep, so that depths are known in the image too.
    pub keeps_depth: bool,
}

/// What is known about a move of the eye off the polytope.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// The move, in the coordinates of the loops' frame.
    pub offset: DVec3,
    /// Radius of the model's bounding sphere.
    pub radius: f64,
}

impl Projection {
    /// The same for loops in other coordinates that are known as points only, given the matrix from these.
    pub(crate) fn after(&self, matrix: DMat3) -> Self {
        Self {
            matrix: self.matrix * matrix,
            round: None,
            ..*self
        }
    }

    /// The same for loops in an orthonormal frame, given the matrix from it.
    pub(crate) fn after_frame(&self, matrix: DMat3) -> Self {
        let round = self.round.map(|round| Round {
            offset: matrix.transpose() * round.offset,
            ..round
        });
        Self {
            matrix: self.matrix * matrix,
            round,
            ..*self
        }
    }

    fn project(&self, p: DVec4) -> DVec3 {
        self.matrix * DVec3::new(p.x, p.y, 1.0) + self.shift * p.z
    }
}

/// With a normal closer than this to right angles with the pair's baseline, the slide says little about the radius.
const LEAST_TILT: f64 = 0.15;

/// Radii of curvature are limited to this many radii of the bounding sphere.
const LARGEST_RADIUS_REL: f64 = 2.0;

impl Round {
    /// The vertex `p`, between `before` and `after` on its loop, moved to where the eye off the polytope touches the object.
    ///
    /// In the plane of ray and normal the object is a circle. Its radius is that with which the touched point slides as it does on
    /// the way between the views.
    fn touched(&self, before: DVec4, p: DVec4, after: DVec4) -> DVec4 {
        if p.w == 0.0 || p.z <= 0.0 {
            return p;
        }
        let (t_x, t_y) = (after.x - before.x, after.y - before.y);
        let ray = DVec3::new(p.x, p.y, 1.0);
        let normal = DVec3::new(t_y, -t_x, p.y * t_x - p.x * t_y).normalize_or_zero();
        let length = ray.length();
        let ray = ray / length;
        let distance = length / p.z;
        let per_normal = p.w * normal.x / (normal.x * normal.x + LEAST_TILT * LEAST_TILT);
        let curvature_radius =
            (distance * length * per_normal).min(LARGEST_RADIUS_REL * self.radius);
        if curvature_radius <= 0.0 {
            return p;
        }
        // From the circle's middle, along the ray and along the normal, the new eye is at (−reach, height).
        let reach = distance - self.offset.dot(ray);
        let height = curvature_radius + self.offset.dot(normal);
        let from_middle = reach * reach + height * height;
        let tangent = from_middle - curvature_radius * curvature_radius;
        if reach <= 0.0 || tangent <= 0.0 {
            return p;
        }
        let tangent = tangent.sqrt();
        let share = curvature_radius / from_middle;
        let sin = (tangent * height - curvature_radius * reach) * share;
        let cos = (curvature_radius * height + tangent * reach) * share;
        let point = ray * (distance + sin) - normal * (curvature_radius - cos);
        if point.z <= 0.0 {
            return p;
        }
        let inverse = 1.0 / point.z;
        DVec4::new(point.x * inverse, point.y * inverse, inverse, p.w)
    }
}

/// Projects loops to image coordinates, cutting off what lies behind the camera.
pub(crate) fn project_loops(loops: &DeepLoops, to: &Projection, output: &mut SeenLoops) {
    output.clear();
    let depth_share = if to.keeps_depth { 1.0 } else { 0.0 };
    for (part, points) in loops.of_parts() {
        output.set_part(part);
        let n = points.len();
        let image = |k: usize| {
            let p = points[k];
            let p = match &to.round {
                Some(round) => {
                    let (before, after) = ((k + n - 1) % n, (k + 1) % n);
                    round.touched(points[before], p, points[after])
                }
                None => p,
            };
            to.project(p).extend(p.z * depth_share)
        };
        let (least, most) = (0..n).fold((f64::INFINITY, 0.0_f64), |(low, high), k| {
            let z = to.project(points[k]).z;
            (low.min(z), high.max(z.abs()))
        });
        // Points that move with the touched ones stay ahead of the camera where these are well ahead.
        let near = NEAR_SHARE * most;
        let mut previous = image(n - 1);
        let is_ahead = least > FAR_FROM_NEAR * near;
        for k in 0..n {
            let q = image(k);
            if !is_ahead && (q.z > near) != (previous.z > near) {
                let cut = previous.lerp(q, (near - previous.z) / (q.z - previous.z));
                output.push(DVec3::new(cut.x, cut.y, cut.w) / near);
            }
            if q.z > near {
                output.push(DVec3::new(q.x, q.y, q.w) / q.z);
            }
            previous = q;
        }
        output.close();
    }
}

/// Points nearer to the camera's plane than this share of the loop's farthest are cut off.
const NEAR_SHARE: f64 = 1e-4;
/// Loops that keep this many times that distance are not looked at for cuts.
const FAR_FROM_NEAR: f64 = 1e3;

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    /// The left touching point of a disc, seen from `eye`, in the plane of baseline and depth.
    fn touch(eye: DVec2, middle: DVec2, radius: f64) -> DVec2 {
        let to_eye = eye - middle;
        let share = radius / to_eye.length();
        let along = to_eye.normalize_or_zero();
        middle + radius * (along * share - along.perp() * (1.0 - share * share).sqrt())
    }

    proptest! {
        /// An upright cylinder is touched where a nearer, farther or displaced eye does touch it.
        #[test]
        fn a_round_rim_is_touched_elsewhere(
            x in -0.5..0.5_f64, radius in 0.1..0.6_f64, nearer in -2.0..1.2_f64, aside in -0.3..0.3_f64,
        ) {
            let middle = DVec2::new(x, 3.0);
            let at = |baseline: f64| touch(DVec2::new(baseline, 0.0), middle, radius);
            let t = at(0.0);
            prop_assert!(t.x < middle.x, "not a left side");
            // Depth per unit of baseline.
            let slide = (at(1e-5).y - at(-1e-5).y) / 2e-5;
            let vertex = |y: f64| DVec4::new(t.x / t.y, y, 1.0 / t.y, slide);
            let round = Round { offset: DVec3::new(aside, 0.0, nearer), radius: 1.0 };
            // Left sides go up.
            let moved = round.touched(vertex(0.1), vertex(0.0), vertex(-0.1));
            let seen = |p: DVec2| {
                let ray = p - DVec2::new(aside, nearer);
                ray.x / ray.y
            };
            let truth = seen(touch(DVec2::new(aside, nearer), middle, radius));
            let after = seen(DVec2::new(moved.x, 1.0) / moved.z);
            let before = seen(t);
            prop_assert!((after - truth).abs() <= 0.15 * (before - truth).abs() + 1e-9, "{after} is not {truth}, was {before}");
        }
    }

    #[test]
    fn a_sharp_edge_stays_where_it_is() {
        let round = Round {
            offset: DVec3::new(0.1, 0.2, -1.0),
            radius: 1.0,
        };
        let vertex = |y: f64| DVec4::new(0.2, y, 0.3, 0.0);
        assert_eq!(
            round.touched(vertex(0.1), vertex(0.0), vertex(-0.1)),
            vertex(0.0)
        );
    }
}
