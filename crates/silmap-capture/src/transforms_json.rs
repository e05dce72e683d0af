//! `transforms.json` of NeRF, instant-ngp and nerfstudio: a pose from camera to world for each frame, intrinsics for all or each.
//!
//! Poses are taken as they stand: `applied_transform`, by which nerfstudio turned the poses of another program, is not undone, so that
//! the asset lies in the frame of this file.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use serde_json::Value;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::json::Fields;
use crate::mask_file;
use crate::pinhole::Pinhole;

/// Coefficients of lens models in such files.
const DISTORTION: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];

/// Extensions that may be left out of `file_path`.
const EXTENSIONS: [&str; 6] = ["png", "jpg", "jpeg", "webp", "PNG", "JPG"];

/// Reads the file's object; paths are relative to `folder`.
pub(crate) fn read(object: &Fields<'_>, folder: &Path) -> Result<Declared, CaptureFault> {
    let listed = object.get("frames").and_then(Value::as_array);
    let listed = listed.ok_or_else(|| object.fault("frames", "a list"))?;
    if listed.is_empty() {
        return Err(CaptureFault::NoViews);
    }
    let views = listed.iter().enumerate().map(|(number, value)| {
        let place = format!("frame number {}: ", number + 1);
        let map = value.as_object().ok_or_else(|| CaptureFault::Field {
            place: place.clone(),
            field: "it",
            shape: "an object",
            found: None,
        })?;
        let frame = Fields { place, map };
        let file = frame.text("file_path")?;
        let file = file.ok_or_else(|| frame.fault("file_path", "the photograph's path"))?;
        let name = view_name(file);
        let frame = Fields {
            place: format!("view {name}: "),
            map,
        };
        let photo = with_extension(&folder.join(file));
        let mask = match frame.text("mask_path")? {
            Some(path) => MaskPlace::Named(folder.join(path)),
            None => MaskPlace::ByConvention,
        };
        let camera = camera(object, &frame, &name, (&photo, &mask))?;
        Ok(DeclaredView {
            name,
            camera,
            mask,
            photo: Some(photo),
        })
    });
    Ok(Declared {
        views: views.collect::<Result<_, _>>()?,
        name: None,
        pixel_centre: 0.5,
        object_bounds: None,
        is_metric: true,
    })
}

/// The photograph's name without folder and extension.
fn view_name(file: &str) -> String {
    let path = Path::new(file);
    let is_picture = path
        .extension()
        .is_some_and(|e| EXTENSIONS.iter().any(|k| e.eq_ignore_ascii_case(k)));
    let name = if is_picture {
        path.file_stem()
    } else {
        path.file_name()
    };
    name.map_or_else(|| file.to_owned(), |n| n.to_string_lossy().into_owned())
}

/// The path itself when it is there, or with the first extension that is.
fn with_extension(path: &Path) -> PathBuf {
    if path.is_file() {
        return path.to_owned();
    }
    let mut tried = EXTENSIONS.iter().map(|extension| {
        let mut name = path.as_os_str().to_owned();
        name.push(".");
        name.push(extension);
        PathBuf::from(name)
    });
    tried
        .find(|p| p.is_file())
        .unwrap_or_else(|| path.to_owned())
}

fn camera(
    file: &Fields<'_>,
    frame: &Fields<'_>,
    name: &str,
    (photo, mask): (&Path, &MaskPlace),
) -> Result<Pinhole, CaptureFault> {
    let number = |field: &'static str| match frame.number(field)? {
        Some(found) => Ok(Some(found)),
        None => file.number(field),
    };
    for field in DISTORTION {
        if let Some(value) = number(field)?.filter(|&v| v != 0.0) {
            return Err(CaptureFault::Distortion {
                view: name.to_owned(),
                what: format!("{field} = {value}"),
            });
        }
    }
    let model = match frame.text("camera_model")? {
        Some(model) => Some(model),
        None => file.text("camera_model")?,
    };
    if let Some(model) = model.filter(|m| m.contains("FISHEYE") || m.contains("EQUIRECT")) {
        return Err(CaptureFault::Distortion {
            view: name.to_owned(),
            what: model.to_owned(),
        });
    }
    let pixels = |field: &'static str| match frame.pixels(field)? {
        Some(found) => Ok(Some(found)),
        None => file.pixels(field),
    };
    let size = match (pixels("w")?, pixels("h")?) {
        (Some(width), Some(height)) => (width, height),
        _ => {
            let of_mask = || match mask {
                MaskPlace::Named(path) => mask_file::size_of(path),
                _ => None,
            };
            let found = mask_file::size_of(photo).or_else(of_mask);
            found.ok_or_else(|| CaptureFault::NoSize {
                view: name.to_owned(),
            })?
        }
    };
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let of_angle = |angle: Option<f64>, side: f64| angle.map(|a| side / (2.0 * (a / 2.0).tan()));
    let (fl_x, fl_y) = (number("fl_x")?, number("fl_y")?);
    let fx = fl_x.or(of_angle(number("camera_angle_x")?, width));
    let fy = fl_y.or(of_angle(number("camera_angle_y")?, height));
    let (Some(fx), Some(fy)) = (fx.or(fy), fy.or(fx)) else {
        return Err(frame.fault("fl_x", "given, or camera_angle_x"));
    };
    let middle = DVec2::new(
        number("cx")?.unwrap_or(width / 2.0),
        number("cy")?.unwrap_or(height / 2.0),
    );
    let pose = match frame.matrix::<4, 4>("transform_matrix", "4×4") {
        Ok(found) => found.map(|m| [m[0], m[1], m[2]]),
        Err(fault) => match frame.matrix::<3, 4>("transform_matrix", "3×4") {
            Ok(found) => found,
            Err(_) => return Err(fault),
        },
    };
    let pose = pose.ok_or_else(|| frame.fault("transform_matrix", "4×4"))?;
    let column = |c: usize| DVec3::new(pose[0][c], pose[1][c], pose[2][c]);
    // Right, up, backward.
    let axes = [column(0), -column(1), -column(2)];
    Pinhole::from_pose(column(3), axes, (DVec2::new(fx, fy), middle), size).map_err(|fault| {
        CaptureFault::Camera {
            view: name.to_owned(),
            fault,
        }
    })
}
