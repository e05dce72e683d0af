//! Eyes and cameras of a whole turn around what is looked at.

use std::f64::consts::TAU;

use anyhow::Context;
use glam::DVec3;
use silmap_geometry::Camera;
use silmap_geometry::camera::default_up;

use crate::args::CameraArgs;
use crate::camera::PictureCamera;
use crate::scene::Scene;

/// A whole turn.
#[derive(Clone, Debug)]
pub(crate) struct Turn {
    /// What is turned about, and what is up in every frame.
    pub(crate) up: DVec3,
    /// Where each frame is seen from, in the coordinates of what is typed.
    pub(crate) eyes: Vec<DVec3>,
    /// The cameras of those.
    pub(crate) cameras: Vec<Camera>,
}

impl Turn {
    /// The turn that begins at `--eye`. Each frame is that of the same options with its own eye, and with what is up at the first.
    ///
    /// # Errors
    /// One sentence about the first eye that sees nothing, with its frame.
    pub(crate) fn new(
        args: &CameraArgs,
        eye: DVec3,
        scene: &Scene,
        frames: u32,
    ) -> anyhow::Result<Self> {
        let target = args.target.unwrap_or(scene.sphere.0 + scene.origin);
        let up = args.up.unwrap_or_else(|| default_up(target - eye));
        let eyes = eyes(eye, target, up, frames);
        let camera = |eye: DVec3| {
            let args = CameraArgs {
                eye: Some(eye),
                up: Some(up),
                ..args.clone()
            };
            PictureCamera::from_args(&args, scene).map(|seen| seen.camera)
        };
        let of_frame = |(frame, &eye): (usize, &DVec3)| match frame {
            0 => camera(eye),
            _ => camera(eye).with_context(|| format!("frame {frame} of the turn")),
        };
        let cameras = eyes
            .iter()
            .enumerate()
            .map(of_frame)
            .collect::<Result<_, _>>()?;
        Ok(Self { up, eyes, cameras })
    }
}

/// The eye, turned about an axis through a point by one of so many equal parts after the other: counter-clockwise, seen from the end
/// of the axis. Half as many are every second one of these.
fn eyes(eye: DVec3, target: DVec3, up: DVec3, frames: u32) -> Vec<DVec3> {
    let axis = up.normalize_or_zero();
    let offset = eye - target;
    let along = axis * axis.dot(offset);
    let (out, across) = (offset - along, axis.cross(offset));
    (0..frames)
        .map(|frame| {
            // As it is typed.
            if frame == 0 {
                return eye;
            }
            let (sin, cos) = (f64::from(frame) / f64::from(frames) * TAU).sin_cos();
            target + along + out * cos + across * sin
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_closes_and_keeps_distance_and_height() {
        let (eye, target) = (DVec3::new(3.0, -1.0, 2.0), DVec3::new(0.5, 0.25, -0.5));
        let up = DVec3::new(0.3, 2.0, -0.4);
        let axis = up.normalize_or_zero();
        let turned = eyes(eye, target, up, 7);
        assert_eq!(turned[0], eye);
        let step = |k: usize| turned[(k + 1) % 7].distance(turned[k]);
        for k in 0..7 {
            let offset = turned[k] - target;
            assert!((offset.length() - eye.distance(target)).abs() < 1e-12);
            assert!((axis.dot(offset) - axis.dot(eye - target)).abs() < 1e-12);
            // The last one is as far from the first as from the one before.
            assert!((step(k) - step(0)).abs() < 1e-12, "{k}");
            let next = turned[(k + 1) % 7] - target;
            assert!(axis.dot(offset.cross(next)) > 0.0, "counter-clockwise");
        }
        assert!(step(0) > 1.0);
        let finer = eyes(eye, target, up, 14);
        assert!((0..7).all(|k| finer[2 * k] == turned[k]));
    }

    #[test]
    fn near_a_pole_it_turns_about_what_is_up_there() {
        let args = CameraArgs {
            eye: None,
            target: None,
            up: None,
            fov: None,
            size: None,
            captured: crate::args::CapturedCameraArgs {
                camera: None,
                view: None,
            },
            distorted: false,
        };
        let scene = Scene {
            origin: DVec3::ZERO,
            origin_in_model: DVec3::ZERO,
            sphere: (DVec3::ZERO, 1.0),
        };
        let eye = DVec3::new(0.1, 5.0, 0.2);
        let turn = Turn::new(&args, eye, &scene, 4).unwrap();
        assert_eq!((turn.up, turn.eyes.len()), (DVec3::Z, 4));
        let plain = CameraArgs {
            eye: Some(eye),
            ..args.clone()
        };
        let plain = PictureCamera::from_args(&plain, &scene).unwrap().camera;
        assert_eq!(turn.cameras[0], plain);
        // On the axis itself there is nothing to go around.
        let on_axis = CameraArgs {
            up: Some(DVec3::Y),
            ..args.clone()
        };
        let refused = Turn::new(&on_axis, DVec3::Y * 5.0, &scene, 4).unwrap_err();
        assert!(format!("{refused:#}").starts_with("--eye 0,5,0"));
        let aside = CameraArgs {
            target: Some(DVec3::X * 2.0),
            ..args
        };
        let refused = Turn::new(&aside, DVec3::X * 3.5, &scene, 4).unwrap_err();
        assert!(format!("{refused:#}").starts_with("frame 2 of the turn: --eye 0.5"));
    }
}
