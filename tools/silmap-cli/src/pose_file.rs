//! A camera as a file: a JSON object with the eye, and where wanted target, up and the field of view; or an object that holds one as
//! `camera`, as `align` and `contour` print it. One of a capture has focal lengths and a principal point for an image of its own size.

use anyhow::bail;
use glam::{DVec2, DVec3};
use serde::Deserialize;
use silmap_geometry::Camera;

#[derive(Deserialize)]
#[serde(untagged)]
enum PoseFile {
    Whole { camera: PoseJson },
    Bare(PoseJson),
}

#[derive(Deserialize)]
struct PoseJson {
    eye: [f64; 3],
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov_y_degrees: Option<f64>,
    #[serde(flatten)]
    captured: Option<IntrinsicsJson>,
}

#[derive(Clone, Copy, Deserialize)]
struct IntrinsicsJson {
    width: u32,
    height: u32,
    focal: [f64; 2],
    principal: [f64; 2],
    #[serde(default)]
    skew: f64,
    #[serde(default)]
    distorted: bool,
}

impl IntrinsicsJson {
    /// The pose of `camera` with these intrinsics, for an image of its size.
    fn of(self, camera: Camera) -> anyhow::Result<Camera> {
        let is_skewed = self.skew.abs() > LEAST_SKEW;
        if self.focal[0] <= 0.0 || self.focal[1] <= 0.0 || is_skewed || self.distorted {
            bail!(
                "its picture is mirrored, skewed or bent by a lens: give --camera and --view besides"
            );
        }
        let size = DVec2::new(self.width.into(), self.height.into());
        let principal = 2.0 * DVec2::from(self.principal) / size - 1.0;
        let with = Camera {
            half_tangent: size / (2.0 * DVec2::from(self.focal)),
            center_offset: DVec2::new(principal.x, -principal.y),
            ..camera
        };
        let rows = camera.size().x * size.y / size.x;
        let is_fit = with.half_tangent.is_finite() && principal.is_finite();
        if !(is_fit && (rows - camera.size().y).abs() <= 1.0) {
            bail!(
                "its intrinsics are for {} × {} pixels, and {} × {} have another shape",
                self.width,
                self.height,
                camera.width_px,
                camera.height_px
            );
        }
        Ok(with)
    }
}

/// Skew that is left out, pixels at a unit of depth along a column.
const LEAST_SKEW: f64 = 1e-2;

/// The camera that `text` describes, for an image of `size` pixels, in coordinates about `origin`; those of the text are about zero. The
/// model's bounding sphere, center and radius about `origin`, is looked at where there is no target, and fits where there is no
/// field of view. Intrinsics that are given are those of the camera, whatever the text has.
///
/// # Errors
/// One sentence when it is no camera, or one that cannot be.
pub(crate) fn parse(
    text: &str,
    (size, intrinsics): ((u32, u32), Option<Camera>),
    origin: DVec3,
    (center, radius): (DVec3, f64),
) -> anyhow::Result<Camera> {
    let file: PoseFile = match serde_json::from_str(text) {
        Ok(file) => file,
        // Where the text is no JSON at all, the place is worth more than what is wanted.
        Err(error) if !error.is_data() => bail!("it is no JSON: {error}"),
        Err(_) => bail!(
            "this is no camera: a JSON object with eye, and where wanted target, up and fov_y_degrees, is needed, in finite numbers"
        ),
    };
    let (PoseFile::Whole { camera: pose } | PoseFile::Bare(pose)) = file;
    let eye = DVec3::from(pose.eye) - origin;
    let target = (pose.target).map_or(center, |target| DVec3::from(target) - origin);
    let up = pose.up.map(DVec3::from);
    let camera = match pose.fov_y_degrees {
        Some(degrees) => Camera::look_at(eye, target, up, degrees.to_radians(), size),
        None => Camera::fit_sphere(eye, center, radius, None, size)
            .and_then(|fit| Camera::with_half_tangent(eye, target, up, fit.half_tangent.y, size)),
    };
    let camera = camera?;
    match (intrinsics, pose.captured) {
        (Some(given), _) => Ok(Camera {
            half_tangent: given.half_tangent,
            center_offset: given.center_offset,
            width_px: given.width_px,
            height_px: given.height_px,
            ..camera
        }),
        (None, Some(own)) => own.of(camera),
        (None, None) => Ok(camera),
    }
}
