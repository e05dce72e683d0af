//! `cameras.json`: a matrix, a mask and a photograph for each view.

use std::path::Path;

use glam::DVec3;
use serde_json::Value;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::json::Fields;
use crate::lens::Distortion;
use crate::pinhole::{Matrix33, Matrix34, Pinhole, of_rows, product};

/// How far P may be from K·[R t], as a share of the largest element.
const AGREEMENT: f64 = 1e-3;

const MATRIX_34: &str = "3×4";
const MATRIX_33: &str = "3×3";

/// Reads the file's object; paths are relative to `folder`.
pub(crate) fn read(object: &Fields<'_>, folder: &Path) -> Result<Declared, CaptureFault> {
    let listed = object.get("views").and_then(Value::as_array);
    let listed = listed.ok_or_else(|| object.fault("views", "a list"))?;
    if listed.is_empty() {
        return Err(CaptureFault::NoViews);
    }
    let size = |field| {
        let pixels = object.pixels(field)?;
        pixels.ok_or_else(|| object.fault(field, "a whole number of pixels"))
    };
    let size = (size("width")?, size("height")?);
    let pixel_centre = object.number("pixel_centre")?.unwrap_or(0.5);
    let bounds = object.matrix::<2, 3>("object_bounds", "two corners of three numbers")?;
    let metric = match object.get("metric") {
        None => true,
        Some(value) => value
            .as_bool()
            .ok_or_else(|| object.fault("metric", "true or false"))?,
    };
    let views = listed.iter().enumerate().map(|(number, value)| {
        let map = value.as_object().ok_or_else(|| CaptureFault::Field {
            place: format!("view number {}: ", number + 1),
            field: "it",
            shape: "an object",
            found: None,
        })?;
        let mut fields = Fields {
            place: format!("view number {}: ", number + 1),
            map,
        };
        let name = match fields.text("name")? {
            Some(name) => name.to_owned(),
            None => (number + 1).to_string(),
        };
        fields.place = format!("view {name}: ");
        let camera = camera(&fields, &name, (size, 0.5 - pixel_centre))?;
        let mask = match (fields.text("mask")?, map.contains_key("mask")) {
            (Some(path), _) => MaskPlace::Named(folder.join(path)),
            (None, true) => MaskPlace::None,
            (None, false) => MaskPlace::ByConvention,
        };
        let photo = fields.text("photo")?.map(|path| folder.join(path));
        Ok(DeclaredView {
            name,
            camera,
            distortion: Distortion::default(),
            mask,
            photo,
        })
    });
    Ok(Declared {
        views: views.collect::<Result<_, _>>()?,
        name: object.text("name")?.map(str::to_owned),
        pixel_centre,
        object_bounds: bounds.map(|corners| corners.map(DVec3::from)),
        is_metric: metric,
        warnings: Vec::new(),
    })
}

/// The camera of a view: P, or K, R and t, or both, which must agree.
fn camera(
    fields: &Fields<'_>,
    name: &str,
    (size, shift): ((u32, u32), f64),
) -> Result<Pinhole, CaptureFault> {
    let fault = |fault| CaptureFault::Camera {
        view: name.to_owned(),
        fault,
    };
    let p: Option<Matrix34> = fields.matrix("P", MATRIX_34)?;
    let k = fields.matrix::<3, 3>("K", MATRIX_33)?;
    let r = fields.matrix::<3, 3>("R", MATRIX_33)?;
    let t = fields.numbers::<3>("t", "three numbers")?;
    let (Some(k), Some(r), Some(t)) = (k, r, t) else {
        let p = p.ok_or_else(|| fields.fault("P", "3×4, or K, R and t be given"))?;
        return Pinhole::from_matrix(&p, shift, size).map_err(fault);
    };
    let t = DVec3::from(t);
    let of_parts = Pinhole::from_parts((&k, &r, t), shift, size).map_err(fault)?;
    let Some(p) = p else {
        return Ok(of_parts);
    };
    let camera = Pinhole::from_matrix(&p, shift, size).map_err(fault)?;
    let difference = scaled_difference(&p, &product((&k, &r, t)));
    if difference <= AGREEMENT {
        return Ok(camera);
    }
    let turned: Matrix33 = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
    let back = -(of_rows(&turned) * t);
    let hints = [
        (turned, t, ": with R transposed they agree"),
        (
            turned,
            back,
            ": R and t seem to be those from camera to world",
        ),
    ];
    let agrees = |(r, t, _): &(Matrix33, DVec3, &str)| {
        scaled_difference(&p, &product((&k, r, *t))) <= AGREEMENT
    };
    Err(CaptureFault::Disagreement {
        view: name.to_owned(),
        difference,
        hint: hints.iter().find(|h| agrees(h)).map_or("", |h| h.2),
    })
}

/// Largest difference of two matrices that are both scaled to a largest element of one.
fn scaled_difference(a: &Matrix34, b: &Matrix34) -> f64 {
    let norm = |m: &Matrix34| m.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
    let (of_a, of_b) = (norm(a), norm(b));
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.fold(0.0, |most: f64, (a, b)| {
        most.max((a / of_a - b / of_b).abs())
    })
}
