//! Finite and infinite viewpoints, and their single-precision form with an error bound.

use glam::{DVec3, Vec3};
use silmap_geometry::predicates::{direction_side_of_plane, side_of_plane};

/// From where a mesh is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewpoint {
    /// An eye at this point: perspective.
    Eye(DVec3),
    /// An eye infinitely far away in this direction, of any length but zero: parallel projection.
    Direction(DVec3),
}

impl Viewpoint {
    /// Whether the face with these corners (counter-clockwise seen from outside) shows its front.
    ///
    /// The sign is exact for any finite input whose products neither overflow nor underflow: an eye in the face's
    /// plane, and a face without area, are never front-facing.
    #[must_use]
    pub fn sees_front_of(&self, [a, b, c]: [DVec3; 3]) -> bool {
        match *self {
            Self::Eye(eye) => side_of_plane(a, b, c, eye) > 0.0,
            Self::Direction(towards) => direction_side_of_plane(a, b, c, towards) > 0.0,
        }
    }
}

/// The ball around a mesh that is the unit ball of single-precision planes and points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Its center, object space.
    pub(crate) center: DVec3,
    /// Its radius, object space.
    pub(crate) radius: f64,
}

/// A viewpoint in homogeneous coordinates of the unit ball: `point / weight`, at infinity when the weight is zero.
///
/// The larger of the weight and of the point's length is about 1, so that one bound serves for all distances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub(crate) point: Vec3,
    pub(crate) weight: f32,
    /// The value of a plane of unit normal that passes through the unit ball is known up to this; infinity when the
    /// viewpoint is none, such as a direction of no length.
    pub(crate) value_error: f32,
}

/// Error of a plane's value in single precision, for each unit of (|point| + weight): four factors of a normal and a
/// query rounded before, a product and up to three sums after, each by 2⁻²⁴; twice that to cover the rounding of planes
/// and queries in double precision and the second-order terms.
const VALUE_ERROR: f32 = 12.0 * f32::EPSILON * 0.5;

impl Query {
    pub(crate) fn new(viewpoint: &Viewpoint, frame: &Frame) -> Self {
        let (point, weight) = match *viewpoint {
            Viewpoint::Eye(eye) => ((eye - frame.center) / frame.radius, 1.0),
            Viewpoint::Direction(towards) => (towards, 0.0),
        };
        let largest = point.abs().max_element();
        // In two steps, as the square of the length may overflow.
        let scaled = point / largest.max(weight);
        let scaled_weight = weight / largest.max(weight);
        let length = scaled.length().max(scaled_weight);
        let (point, weight) = ((scaled / length).as_vec3(), (scaled_weight / length) as f32);
        let value_error = VALUE_ERROR * (point.length() + weight);
        Self {
            point,
            weight,
            value_error: if value_error.is_finite() {
                value_error
            } else {
                f32::INFINITY
            },
        }
    }

    /// What a plane `[normal, offset]` says of the viewpoint: its sign is right when it is farther from zero than the
    /// error bound.
    #[inline(always)]
    pub(crate) fn value(&self, plane: &[f32; 4]) -> f32 {
        plane[0] * self.point.x
            + plane[1] * self.point.y
            + plane[2] * self.point.z
            + plane[3] * self.weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_eyes_become_directions() {
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!(Viewpoint::Direction(DVec3::new(5.0, 5.0, 1e-300)).sees_front_of(face));
        assert!(!Viewpoint::Direction(DVec3::new(5.0, 5.0, 0.0)).sees_front_of(face));
        let frame = Frame {
            center: DVec3::ONE,
            radius: 2.0,
        };
        let towards = DVec3::new(1.0, 2.0, -2.0);
        let far = Query::new(&Viewpoint::Eye(towards * 1e200), &frame);
        let infinite = Query::new(&Viewpoint::Direction(towards * 1e-200), &frame);
        assert!(far.point.distance(infinite.point) < 1e-6);
        assert_eq!(far.weight, 0.0);
        let none = Query::new(&Viewpoint::Direction(DVec3::ZERO), &frame);
        assert_eq!(none.value_error, f32::INFINITY);
        let near = Query::new(&Viewpoint::Eye(DVec3::ONE), &frame);
        assert_eq!((near.point, near.weight), (Vec3::ZERO, 1.0));
    }
}
