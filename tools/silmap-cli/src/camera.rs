//! The camera that `--eye`, `--target`, `--up`, `--fov` and `--size` describe, or `--camera` and `--view` name.

use anyhow::Context;
use clap::error::ErrorKind;
use glam::{DVec2, DVec3};
use serde::Serialize;
use silmap_geometry::{Camera, CameraError, ColourImage, Loop};

use crate::args::{CameraArgs, usage_error};
use crate::captured_camera::{self, Captured};
use crate::scene::Scene;
use crate::values::{Size, point_text};

/// The picture's size where nothing says another.
const USUAL_SIZE: Size = Size {
    width: 512,
    height: 512,
};

/// A camera in numbers that `align` reads again.
#[derive(Serialize)]
pub(crate) struct CameraJson {
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    fov_y_degrees: f64,
    width: u32,
    height: u32,
    #[serde(flatten)]
    captured: Option<IntrinsicsJson>,
}

/// What a camera of a capture has besides.
#[derive(Serialize)]
struct IntrinsicsJson {
    /// The view's name.
    view: String,
    /// Focal lengths along columns and rows, pixels; negative where the picture is mirrored.
    focal: [f64; 2],
    /// Principal point, pixels from the top-left corner.
    principal: [f64; 2],
    /// Pixels along a row for a unit of depth along a column.
    #[serde(skip_serializing_if = "is_zero")]
    skew: f64,
    /// Whether the picture is bent as by the lens.
    #[serde(skip_serializing_if = "is_false")]
    distorted: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_false(value: &bool) -> bool {
    !*value
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
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
            captured: None,
        }
    }

    /// The same of a captured camera, whose pose may be that of `camera`: with its intrinsics.
    pub(crate) fn of_captured(self, captured: &Captured) -> Self {
        let (focal, skew, principal) = captured.drawing.intrinsics();
        let (width, height) = captured.drawing.size();
        Self {
            fov_y_degrees: 2.0 * (0.5 * f64::from(height) / focal.y).atan().to_degrees(),
            width,
            height,
            captured: Some(IntrinsicsJson {
                view: captured.view.name.clone(),
                focal: focal.to_array(),
                principal: principal.to_array(),
                skew,
                distorted: captured.drawing.is_distorted(),
            }),
            ..self
        }
    }
}

/// What a picture is seen through.
#[derive(Debug)]
pub(crate) struct PictureCamera {
    /// What is drawn through, in coordinates about the model's origin.
    pub(crate) camera: Camera,
    /// The camera of a capture, if it is one.
    pub(crate) captured: Option<Captured>,
}

impl From<Captured> for PictureCamera {
    fn from(captured: Captured) -> Self {
        Self {
            camera: captured.drawing.camera,
            captured: Some(captured),
        }
    }
}

impl PictureCamera {
    /// The camera that is typed or named.
    ///
    /// Without a field of view the sphere just fits, as in capture; without a target the eye looks at the center.
    ///
    /// # Errors
    /// One sentence about the eye when it lies in the sphere or another value makes no camera; or about the capture's file or view.
    pub(crate) fn from_args(args: &CameraArgs, scene: &Scene) -> anyhow::Result<Self> {
        if let Some(captured) = captured_camera::of_args(args, scene)? {
            return Ok(captured.into());
        }
        let Some(eye) = args.eye else {
            usage_error(
                ErrorKind::MissingRequiredArgument,
                "a viewpoint is needed: --eye X,Y,Z, or --camera FILE --view NAME",
            );
        };
        let camera =
            make(args, eye, scene).with_context(|| format!("--eye {}", point_text(eye)))?;
        Ok(Self {
            camera,
            captured: None,
        })
    }

    /// Columns and rows of the picture.
    pub(crate) fn size(&self) -> (u32, u32) {
        let drawn = (self.camera.width_px, self.camera.height_px);
        (self.captured.as_ref()).map_or(drawn, |captured| captured.drawing.size())
    }

    /// What was drawn through the camera, as the picture shows it, on a background.
    pub(crate) fn picture(&self, drawn: ColourImage, background: [u8; 4]) -> ColourImage {
        match &self.captured {
            Some(captured) => captured.drawing.picture(drawn, background),
            None => drawn,
        }
    }

    /// Where a point of the image that is drawn lies in the picture.
    pub(crate) fn image(&self, drawn: DVec2) -> DVec2 {
        match &self.captured {
            Some(captured) => captured.drawing.image_from_drawn(drawn),
            None => drawn,
        }
    }

    /// Loops of the image that is drawn, in the picture.
    pub(crate) fn loops(&self, drawn: &[Loop]) -> Vec<Loop> {
        match &self.captured {
            Some(captured) => captured.drawing.loops_from_drawn(drawn),
            None => drawn.to_vec(),
        }
    }

    /// For people and `align`.
    pub(crate) fn json(&self, scene: &Scene) -> CameraJson {
        let distance = self.camera.eye.distance(scene.sphere.0);
        let json = CameraJson::new(&self.camera, distance, scene.origin);
        match &self.captured {
            Some(captured) => json.of_captured(captured),
            None => json,
        }
    }
}

impl CameraArgs {
    /// Columns and rows of the picture, where no camera of a capture says others.
    pub(crate) fn size_px(&self) -> (u32, u32) {
        let Size { width, height } = self.size.unwrap_or(USUAL_SIZE);
        (width, height)
    }
}

fn make(args: &CameraArgs, eye: DVec3, scene: &Scene) -> Result<Camera, CameraError> {
    let size = args.size_px();
    let eye = eye - scene.origin;
    let (center, radius) = scene.sphere;
    let target = args.target.map(|target| target - scene.origin);
    // Also refuses an eye in the sphere, from which no outline can be seen whole.
    let up_at_center = args.up.filter(|_| target.is_none());
    let fitted = Camera::fit_sphere(eye, center, radius, up_at_center, size)?;
    let target = target.unwrap_or(center);
    match args.fov {
        Some(degrees) => Camera::look_at(eye, target, args.up, degrees.to_radians(), size),
        None => Camera::with_half_tangent(eye, target, args.up, fitted.half_tangent.y, size),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::CapturedCameraArgs;

    fn args(eye: DVec3) -> CameraArgs {
        CameraArgs {
            eye: Some(eye),
            target: None,
            up: None,
            fov: None,
            size: Some(Size {
                width: 64,
                height: 48,
            }),
            captured: CapturedCameraArgs {
                camera: None,
                view: None,
            },
            distorted: false,
        }
    }

    fn about(origin: DVec3) -> Scene {
        Scene {
            origin,
            origin_in_model: origin,
            sphere: (DVec3::ZERO, 1.0),
        }
    }

    fn camera_from_args(args: &CameraArgs, scene: &Scene) -> anyhow::Result<Camera> {
        PictureCamera::from_args(args, scene).map(|seen| seen.camera)
    }

    #[test]
    fn without_options_it_is_the_fitted_camera() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let made = camera_from_args(&args(eye), &about(DVec3::ZERO)).unwrap();
        let fitted = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 48)).unwrap();
        assert_eq!(made, fitted);
    }

    #[test]
    fn options_are_heard() {
        let mut given = args(DVec3::new(0.0, 0.0, 4.0));
        given.fov = Some(40.0);
        given.target = Some(DVec3::X);
        given.up = Some(DVec3::X + DVec3::Y);
        let made = camera_from_args(&given, &about(DVec3::ZERO)).unwrap();
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
        let made = camera_from_args(&given, &about(DVec3::ZERO)).unwrap();
        given.eye = given.eye.map(|eye| eye + origin);
        given.target = given.target.map(|target| target + origin);
        let far = camera_from_args(&given, &about(origin)).unwrap();
        assert_eq!(made, far);
        assert_eq!(
            Some(DVec3::from(CameraJson::new(&far, 1.0, origin).eye)),
            given.eye
        );
    }

    #[test]
    fn an_eye_in_the_model_or_not_a_number_is_refused() {
        for eye in [DVec3::ZERO, DVec3::X * 0.5, DVec3::new(f64::NAN, 0.0, 3.0)] {
            for fov in [None, Some(40.0)] {
                let mut given = args(eye);
                given.fov = fov;
                let error = camera_from_args(&given, &about(DVec3::ZERO)).unwrap_err();
                assert!(format!("{error:#}").starts_with("--eye "), "{error:#}");
            }
        }
    }
}
