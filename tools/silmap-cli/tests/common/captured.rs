//! A capture of a torus, whose cameras are of every kind.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use image::{GrayImage, Luma, RgbImage};
use serde_json::{Value, json};
use silmap_capture::{Pinhole, silhouette};

use super::{path, scratch};

pub(crate) const SIZE: (u32, u32) = (220, 160);

/// A view for each kind of camera. Its principal point is far from the image's middle, its pixels are not square.
pub(crate) const VIEWS: [&str; 6] = [
    "front",
    "side",
    "skewed",
    "mirrored",
    "cut-off",
    "from above",
];

pub(crate) fn cameras(shift: DVec3) -> Vec<Pinhole> {
    let camera = |k: usize| {
        let turn = 0.4 + 1.1 * k as f64;
        let height: f64 = if k == 5 { 0.9 } else { 0.3 };
        let ring = (1.0 - height * height).sqrt();
        let eye = 5.5 * DVec3::new(ring * turn.cos(), height, ring * turn.sin());
        let forward = -eye.normalize_or_zero();
        let right = forward.cross(DVec3::Y).normalize_or_zero();
        let axes = [right, forward.cross(right), forward];
        let principal = match k {
            4 => DVec2::new(214.0, 70.0),
            _ => DVec2::new(96.0, 88.5),
        };
        let lens = (DVec2::new(230.0, 226.0), principal);
        let camera = Pinhole::from_pose(eye + shift, axes, lens, SIZE).unwrap();
        match VIEWS[k] {
            "skewed" => Pinhole {
                skew: 14.0,
                ..camera
            },
            "mirrored" => Pinhole {
                focal: DVec2::new(-230.0, 226.0),
                principal: DVec2::new(130.0, 88.5),
                ..camera
            },
            _ => camera,
        }
    };
    (0..VIEWS.len()).map(camera).collect()
}

/// Writes a mask and a photograph.
pub(crate) fn write_pictures(folder: &Path, name: &str, is_inside: impl Fn(u32, u32) -> bool) {
    fs::create_dir_all(folder.join("masks")).unwrap();
    fs::create_dir_all(folder.join("photos")).unwrap();
    let value = |x, y| Luma([255 * u8::from(is_inside(x, y))]);
    let mask = folder.join(format!("masks/{name}.png"));
    GrayImage::from_fn(SIZE.0, SIZE.1, value)
        .save(mask)
        .unwrap();
    let colour = |x, y| match is_inside(x, y) {
        true => image::Rgb([200, 120, 40]),
        false => image::Rgb([20; 3]),
    };
    let photo = folder.join(format!("photos/{name}.png"));
    RgbImage::from_fn(SIZE.0, SIZE.1, colour)
        .save(photo)
        .unwrap();
}

/// Writes the camera file of a torus that is shifted, and where wanted masks and photographs.
pub(crate) fn write_cameras(folder: &Path, shift: DVec3, with_pictures: bool) {
    let mut model = silmap_models::torus(1200);
    model.positions.iter_mut().for_each(|p| *p += shift);
    let mut views = Vec::new();
    for (name, camera) in VIEWS.iter().zip(cameras(shift)) {
        if with_pictures {
            let mask = silhouette(&model, &camera).unwrap();
            assert!(mask.count() > 3000, "{name} sees the torus");
            write_pictures(folder, name, |x, y| mask.get(x.into(), y.into()));
        }
        views.push(
            json!({"name": name, "P": camera.to_matrix(), "photo": format!("photos/{name}.png")}),
        );
    }
    let file = json!({"width": SIZE.0, "height": SIZE.1, "pixel_centre": 0.5, "views": views});
    fs::write(folder.join("cameras.json"), file.to_string()).unwrap();
}

/// The capture of this test file's torus.
pub(crate) fn capture() -> &'static Path {
    static MADE: OnceLock<std::path::PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = scratch(concat!(env!("CARGO_CRATE_NAME"), "-capture"));
        write_cameras(&folder, DVec3::ZERO, true);
        folder
    })
}

pub(crate) fn inside(file: &Path) -> GrayImage {
    image::open(file).unwrap().into_luma8()
}

/// Intersection over union of two masks of one size.
pub(crate) fn overlap(one: &GrayImage, other: &GrayImage) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let pairs = || {
        one.pixels()
            .zip(other.pixels())
            .map(|(a, b)| (a.0[0] > 127, b.0[0] > 127))
    };
    let both = pairs().filter(|&(a, b)| a && b).count();
    let either = pairs().filter(|&(a, b)| a || b).count();
    both as f64 / either as f64
}

pub(crate) fn number(value: &Value, pointer: &str) -> f64 {
    let found = value.pointer(pointer).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{pointer} of {value}"))
}

/// A command's words with a camera of a capture.
pub(crate) fn through<'a>(words: &[&'a str], folder: &'a Path, view: &'a str) -> Vec<&'a str> {
    let camera = ["--camera", path(folder), "--view", view];
    [words, &camera].concat()
}
