//! A camera as a file: a JSON object with the eye, and where wanted target, up and the field of view; or an object that holds one as
//! `camera`, as `align` and `contour` print it.

use anyhow::bail;
use glam::DVec3;
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
}

/// The camera that `text` describes, for an image of `size` pixels, in coordinates about `origin`; those of the text are about zero. The
/// model's bounding sphere, center and radius about `origin`, is looked at where there is no target, and fits where there is no
/// field of view.
///
/// # Errors
/// One sentence when it is no camera, or one that cannot be.
pub(crate) fn parse(
    text: &str,
    size: (u32, u32),
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
    camera.map_err(anyhow::Error::from)
}
