//! `transforms.json` of NeRF, instant-ngp and nerfstudio: a pose from camera to world for each frame, intrinsics for all or each.
//!
//! Poses are taken as they stand: `applied_transform` and `applied_scale`, which nerfstudio has already applied to the poses of another
//! program, are not undone, so that the asset lies in the frame of this file. Lenses follow OpenCV; nerfstudio's `k4` without `k5` and
//! `k6` is the factor of r⁸, as in its own code, and with them that of the denominator.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use serde_json::Value;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::find_mask::size_by_pictures;
use crate::json::Fields;
use crate::lens::{Distortion, Projection};
use crate::mask_file::size_of;
use crate::pictures::EXTENSIONS;
use crate::pinhole::Pinhole;
use crate::view_names::view_names;

/// Camera models whose lens is a polynomial about a perspective camera.
const PERSPECTIVE: [&str; 8] = [
    "",
    "PERSPECTIVE",
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "FULL_OPENCV",
];

/// Those about an equidistant one.
const FISHEYE: [&str; 2] = ["OPENCV_FISHEYE", "FISHEYE"];

/// Fields by which instant-ngp says that a camera is none of them.
const OTHER_MODELS: [&str; 4] = ["ftheta_p0", "lonlat", "latlong", "ortho"];

/// Reads the file's object; paths are relative to `folder`.
pub(crate) fn read(object: &Fields<'_>, folder: &Path) -> Result<Declared, CaptureFault> {
    let listed = object.get("frames").and_then(Value::as_array);
    let listed = listed.ok_or_else(|| object.fault("frames", "a list"))?;
    if listed.is_empty() {
        return Err(CaptureFault::NoViews);
    }
    let frames = listed.iter().enumerate().map(|(number, value)| {
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
        Ok((file, map))
    });
    let frames = frames.collect::<Result<Vec<_>, CaptureFault>>()?;
    let names = view_names(frames.iter().map(|(file, _)| *file));
    let views = frames.iter().zip(names).map(|(&(file, map), name)| {
        let fields = Fields {
            place: format!("view {name}: "),
            map,
        };
        let photo = with_extension(&folder.join(file));
        let mask = match fields.text("mask_path")? {
            Some(path) => MaskPlace::Named(with_extension(&folder.join(path))),
            None => MaskPlace::ByConvention,
        };
        let of_pictures = || match &mask {
            MaskPlace::Named(path) => size_of(&photo).or_else(|| size_of(path)),
            _ => size_by_pictures(&photo, folder),
        };
        let frame = Frame {
            name: &name,
            fields,
            file: object,
        };
        Ok(DeclaredView {
            camera: frame.camera(&of_pictures)?,
            distortion: frame.distortion()?,
            mask,
            photo: Some(photo),
            name,
        })
    });
    let views = views.collect::<Result<_, CaptureFault>>()?;
    Ok(Declared::of(views, 0.5, Vec::new()))
}

/// The path itself when it is there, or with the first extension that is.
fn with_extension(path: &Path) -> PathBuf {
    if path.is_file() {
        return path.to_owned();
    }
    // NeRF's own sets mean pictures with an alpha channel.
    let mut tried = ["png"].iter().chain(&EXTENSIONS).map(|extension| {
        let mut name = path.as_os_str().to_owned();
        name.push(".");
        name.push(extension);
        PathBuf::from(name)
    });
    tried
        .find(|p| p.is_file())
        .unwrap_or_else(|| path.to_owned())
}

/// A frame, which has its own fields or those of the file.
struct Frame<'a> {
    name: &'a str,
    fields: Fields<'a>,
    file: &'a Fields<'a>,
}

impl Frame<'_> {
    fn number(&self, field: &'static str) -> Result<Option<f64>, CaptureFault> {
        match self.fields.number(field)? {
            Some(found) => Ok(Some(found)),
            None => self.file.number(field),
        }
    }

    fn pixels(&self, field: &'static str) -> Result<Option<u32>, CaptureFault> {
        match self.fields.pixels(field)? {
            Some(found) => Ok(Some(found)),
            None => self.file.pixels(field),
        }
    }

    fn distortion(&self) -> Result<Distortion, CaptureFault> {
        let (frame, file) = (&self.fields, self.file);
        let number = |field| self.number(field);
        let model = match frame.text("camera_model")? {
            Some(model) => model,
            None => file.text("camera_model")?.unwrap_or_default(),
        };
        let unknown = |what: &str| CaptureFault::LensModel {
            view: self.name.to_owned(),
            what: what.to_owned(),
        };
        let flag = |field: &str| {
            let value = frame.get(field).or_else(|| file.get(field));
            value.is_some_and(|v| v.as_bool() != Some(false))
        };
        if let Some(field) = OTHER_MODELS.iter().find(|field| flag(field)) {
            return Err(unknown(field));
        }
        let is_fisheye = FISHEYE.contains(&model) || flag("is_fisheye");
        if !(is_fisheye || PERSPECTIVE.contains(&model)) {
            return Err(unknown(model));
        }
        let [k1, k2, k3, k4] = ["k1", "k2", "k3", "k4"].map(number);
        let (k1, k2, k3, k4) = (k1?, k2?, k3?, k4?);
        let (k5, k6) = (number("k5")?, number("k6")?);
        let [p1, p2] = ["p1", "p2"].map(number);
        let or_none = |value: Option<f64>| value.unwrap_or(0.0);
        let is_rational = !is_fisheye && (k5.is_some() || k6.is_some() || model == "FULL_OPENCV");
        let (last, denominator) = match is_rational {
            true => (0.0, [k4, k5, k6].map(or_none)),
            false => (or_none(k4), [0.0; 3]),
        };
        Ok(Distortion {
            projection: match is_fisheye {
                true => Projection::Equidistant,
                false => Projection::Perspective,
            },
            numerator: [or_none(k1), or_none(k2), or_none(k3), last],
            denominator,
            // The fisheye model of OpenCV has none; programs that write one for all models leave zeros there.
            tangential: match is_fisheye {
                true => [0.0; 2],
                false => [or_none(p1?), or_none(p2?)],
            },
            prism: [0.0; 2],
        })
    }

    /// The camera; `of_pictures` finds the size of its image where no field has it.
    fn camera(
        &self,
        of_pictures: &dyn Fn() -> Option<(u32, u32)>,
    ) -> Result<Pinhole, CaptureFault> {
        let frame = &self.fields;
        let number = |field| self.number(field);
        let view = self.name.to_owned();
        let size = match (self.pixels("w")?, self.pixels("h")?) {
            (Some(width), Some(height)) => (width, height),
            _ => of_pictures().ok_or(CaptureFault::NoSize { view })?,
        };
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let of_angle =
            |angle: Option<f64>, side: f64| angle.map(|a| side / (2.0 * (a / 2.0).tan()));
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
                view: self.name.to_owned(),
                fault,
            }
        })
    }
}
