//! The camera that `--eye`, `--target`, `--up`, `--fov` and `--size` describe.

use anyhow::Context;
use glam::DVec3;
use serde::Serialize;
use silmap_geometry::{Camera, CameraError};

use crate::args::CameraArgs;
use crate::values::point_text;

/// A camera in numbers that `align` reads again.
#[derive(Serialize)]
pub(crate) struct CameraJson {
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    fov_y_degrees: f64,
    width: u32,
    height: u32,
}

impl CameraJson {
    /// The camera as eye, a point in the middle of its view, and its own up vector, for people: its coordinates are about
    /// `origin`.
    pub(crate) fn new(camera: &Camera, distance: f64, origin: DVec3) -> Self {
        let camera = camera.moved(origin);
        Self {
            eye: camera.eye.to_array(),
            target: (camera.eye + camera.forward * distance).to_array(),
            up: camera.up.to_array(),
            fov_y_degrees: camera.fov_y_rad().to_degrees(),
            width: camera.width_px,
            height: camera.height_px,
        }
    }
}

/// The camera for a model with this bounding sphere, in coordinates about `origin`; what was typed is about zero.
///
/// Without a field of view the sphere just fits, as in capture; without a target the eye looks at the center.
///
/// # Errors
/// One sentence about the eye when it lies in the sphere or another value makes no camera.
pub(crate) fn camera_from_args(
    args: &CameraArgs,
    origin: DVec3,
    center: DVec3,
    radius: f64,
) -> anyhow::Result<Camera> {
    let local = CameraArgs {
        eye: args.eye - origin,
        target: args.target.map(|target| target - origin),
        ..*args
    };
    make(&local, center, radius).with_context(|| format!("--eye {}", point_text(args.eye)))
}

fn make(args: &CameraArgs, center: DVec3, radius: f64) -> Result<Camera, CameraError> {
    let size = (args.size.width, args.size.height);
    // Also refuses an eye in the sphere, from which no outline can be seen whole.
    let up_at_center = args.up.filter(|_| args.target.is_none());
    let fitted = Camera::fit_sphere(args.eye, center, radius, up_at_center, size)?;
    let target = args.target.unwrap_or(center);
    match args.fov {
        Some(degrees) => Camera::look_at(args.eye, target, args.up, degrees.to_radians(), size),
        None => Camera::with_half_tangent(args.eye, target, args.up, fitted.half_tangent.y, size),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::Size;

    fn args(eye: DVec3) -> CameraArgs {
        CameraArgs {
            eye,
            target: None,
            up: None,
            fov: None,
            size: Size {
                width: 64,
                height: 48,
            },
        }
    }

    #[test]
    fn without_options_it_is_the_fitted_camera() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let made = camera_from_args(&args(eye), DVec3::ZERO, DVec3::ZERO, 1.0).unwrap();
        let fitted = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 48)).unwrap();
        assert_eq!(made, fitted);
    }

    #[test]
    fn options_are_heard() {
        let mut given = args(DVec3::new(0.0, 0.0, 4.0));
        given.fov = Some(40.0);
        given.target = Some(DVec3::X);
        given.up = Some(DVec3::X + DVec3::Y);
        let made = camera_from_args(&given, DVec3::ZERO, DVec3::ZERO, 1.0).unwrap();
        assert!((made.fov_y_rad().to_degrees() - 40.0).abs() < 1e-9);
        let target = made.image_from_object(DVec3::X);
        assert!((target - glam::DVec2::new(32.0, 24.0)).length() < 1e-9);
        assert!(made.up.x > 0.5);
    }

    #[test]
    fn far_away_it_is_the_same_camera() {
        let origin = DVec3::new(5e5, 5.4e6, 200.0);
        let mut given = args(DVec3::new(1.0, 2.0, 3.0));
        given.target = Some(DVec3::new(0.25, 0.0, 0.0));
        let made = camera_from_args(&given, DVec3::ZERO, DVec3::ZERO, 1.0).unwrap();
        given.eye += origin;
        given.target = given.target.map(|target| target + origin);
        let far = camera_from_args(&given, origin, DVec3::ZERO, 1.0).unwrap();
        assert_eq!(made, far);
        assert_eq!(
            DVec3::from(CameraJson::new(&far, 1.0, origin).eye),
            given.eye
        );
    }

    #[test]
    fn an_eye_in_the_model_or_not_a_number_is_refused() {
        for eye in [DVec3::ZERO, DVec3::X * 0.5, DVec3::new(f64::NAN, 0.0, 3.0)] {
            for fov in [None, Some(40.0)] {
                let mut given = args(eye);
                given.fov = fov;
                let error = camera_from_args(&given, DVec3::ZERO, DVec3::ZERO, 1.0).unwrap_err();
                assert!(format!("{error:#}").starts_with("--eye "), "{error:#}");
            }
        }
    }
}
