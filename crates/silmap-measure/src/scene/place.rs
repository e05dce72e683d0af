//! Where the instances of the scene are, and how the camera walks around them.

use glam::{DQuat, DVec3};
use silmap_geometry::{Camera, CameraError};
use silmap_map::BoundingSphere;
use silmap_runtime::{Transform, View};

/// Half the vertical field of view, as a tangent: 45° in all.
const HALF_TANGENT: f64 = 0.414_213_562_373_095;

/// Degrees from one frame to the next.
const STEP: f64 = 0.5;

/// Half the width of the crowd, as a share of the picture's: it stays in view from all around.
const CROWD: f64 = 0.62;

/// How many instances are drawn, how large, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneParams {
    /// Instances.
    pub instances: usize,
    /// Diameter of the sphere about the model on the screen, pixels.
    pub pixels: f64,
    /// Side of the picture, pixels.
    pub side_px: u32,
    /// Whether the camera stays where it is.
    pub is_still: bool,
    /// Frames that are timed.
    pub frames: usize,
}

impl SceneParams {
    /// Distance at which the sphere has its size.
    pub(super) fn distance(&self, sphere: &BoundingSphere) -> f64 {
        let focal_px = 0.5 * f64::from(self.side_px) / HALF_TANGENT;
        2.0 * focal_px * sphere.radius / self.pixels
    }

    /// Places in a ball about the origin, each turned its own way about the vertical.
    pub(super) fn transforms(&self, sphere: &BoundingSphere) -> Vec<Transform> {
        let reach = CROWD * HALF_TANGENT * self.distance(sphere);
        // The additive recurrence of three irrationals spreads points evenly (R3 of Roberts).
        let steps = DVec3::new(
            0.819_172_513_396_164,
            0.671_043_606_703_789,
            0.549_700_477_901_970,
        );
        let mut transforms = Vec::with_capacity(self.instances);
        let mut at = DVec3::splat(0.5);
        while transforms.len() < self.instances {
            let p = (at * 2.0 - 1.0) * reach;
            at = (at + steps).fract();
            // A round crowd, flattened so that its depth makes little difference to sizes.
            if p.length() > reach && self.instances > 1 {
                continue;
            }
            let turn = DQuat::from_rotation_y(2.399_963 * transforms.len() as f64);
            let middle = if self.instances > 1 { p } else { DVec3::ZERO };
            let place = middle - turn * sphere.center;
            if let Ok(transform) = Transform::new(1.0, turn, place) {
                transforms.push(transform);
            }
        }
        transforms
    }

    /// The camera of a frame.
    pub(super) fn camera(
        &self,
        sphere: &BoundingSphere,
        frame: usize,
    ) -> Result<Camera, CameraError> {
        let frame = if self.is_still { 0 } else { frame };
        let turn = (frame as f64 * STEP).to_radians();
        let direction = DVec3::new(turn.sin(), 0.3, turn.cos()).normalize_or_zero();
        let eye = direction * self.distance(sphere);
        let size = (self.side_px, self.side_px);
        Camera::look_at(eye, DVec3::ZERO, None, 2.0 * HALF_TANGENT.atan(), size)
    }

    /// The same as a view.
    pub(super) fn view(&self, camera: &Camera) -> View {
        let distance = camera.eye.length();
        View {
            clip_from_world: camera.clip_from_object(0.2 * distance, 2.0 * distance),
            size_px: (self.side_px, self.side_px),
        }
    }
}

/// The camera that sees an object as `camera` sees the instance of it.
pub(super) fn object_camera(camera: &Camera, transform: &Transform) -> Camera {
    let turned = |axis: DVec3| transform.object_direction(axis);
    Camera {
        eye: transform.object_point(camera.eye),
        right: turned(camera.right),
        up: turned(camera.up),
        forward: turned(camera.forward),
        ..*camera
    }
}
