//! The facing test: whether a face shows its front to a viewpoint.

use glam::DVec3;
use silmap_geometry::predicates::side_of_plane;

/// Whether the face with these corners (counter-clockwise seen from outside) is front-facing for `eye`:
/// (eye − a)·n > 0.
///
/// The sign is exact for any finite input whose products neither overflow nor underflow: an eye in the face's plane,
/// and a face without area, are never front-facing.
#[must_use]
pub fn is_front_facing([a, b, c]: [DVec3; 3], eye: DVec3) -> bool {
    side_of_plane(a, b, c, eye) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_is_where_corners_run_counter_clockwise() {
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!(is_front_facing(face, DVec3::new(5.0, 5.0, 1e-300)));
        assert!(!is_front_facing(face, DVec3::new(5.0, 5.0, -1e-300)));
        assert!(!is_front_facing(face, DVec3::new(5.0, 5.0, 0.0)));
        assert!(!is_front_facing([DVec3::X; 3], DVec3::Z));
    }

    #[test]
    fn sign_is_exact_where_rounding_is_not() {
        // The sum of the doubles 0.1 and 0.2 lies below its rounded value, so the eye is above the plane z = x + y by less
        // than half a unit in the last place: plain products find it in the plane.
        let face = [
            DVec3::ZERO,
            DVec3::new(1.0, 0.0, 1.0),
            DVec3::new(0.0, 1.0, 1.0),
        ];
        let eye = DVec3::new(0.1, 0.2, 0.1 + 0.2);
        let normal = (face[1] - face[0]).cross(face[2] - face[0]);
        assert_eq!(eye.dot(normal), 0.0);
        assert!(is_front_facing(face, eye));
        assert!(!is_front_facing(face, DVec3::new(0.1, 0.2, 0.3)));
        assert!(!is_front_facing(face, DVec3::new(0.25, 0.5, 0.75)));
    }
}
