//! A smooth path of viewpoints, for methods that follow a moving eye.

use glam::{DQuat, DVec3};
use silmap_geometry::camera::default_up;

use crate::Viewpoint;

/// Angle between one viewpoint of a walk and the next, as in the comparison's tables.
pub const WALK_STEP_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Viewpoints on the great circle about `center` that starts in `start` and leads off sideways, [`WALK_STEP_RAD`] apart.
///
/// All viewpoints are `start` when it lies in `center`.
pub fn walk_around(
    start: Viewpoint,
    center: DVec3,
    count: usize,
) -> impl Iterator<Item = Viewpoint> {
    let from_center = match start {
        Viewpoint::Eye(eye) => eye - center,
        Viewpoint::Direction(towards) => towards,
    };
    let up = default_up(-from_center);
    let axis =
        (up - from_center * (up.dot(from_center) / from_center.length_squared())).try_normalize();
    (0..count).map(move |k| {
        let Some(axis) = axis.filter(|_| k > 0) else {
            return start;
        };
        let turned = DQuat::from_axis_angle(axis, WALK_STEP_RAD * k as f64) * from_center;
        match start {
            Viewpoint::Eye(_) => Viewpoint::Eye(center + turned),
            Viewpoint::Direction(_) => Viewpoint::Direction(turned),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_half_a_degree_at_one_distance() {
        let (start, center) = (DVec3::new(1.0, 5.0, 2.0), DVec3::new(1.0, 2.0, -2.0));
        let eyes: Vec<DVec3> = walk_around(Viewpoint::Eye(start), center, 721)
            .map(|v| match v {
                Viewpoint::Eye(eye) => eye - center,
                Viewpoint::Direction(_) => panic!("the walk is of eyes"),
            })
            .collect();
        for pair in eyes.windows(2) {
            let angle = pair[0].angle_between(pair[1]);
            assert!((angle - WALK_STEP_RAD).abs() < 1e-9);
            assert!((pair[1].length() - 5.0).abs() < 1e-9);
        }
        assert!(eyes[720].distance(eyes[0]) < 1e-9, "once around");
    }
}
