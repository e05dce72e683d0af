//! A capture's folder whose masks are good, and one of whose camera files is the fuzzer's.

use std::cell::RefCell;
use std::fs;
use std::path::Path;

use glam::DVec2;
use image::{GrayImage, Luma};
use tempfile::TempDir;

use crate::is_one_sentence;

/// The files that the first byte chooses from, `a` and on.
pub const FILES: [&str; 14] = [
    "cameras.json",
    "transforms.json",
    "x_par.txt",
    "cameras.xml",
    "cameras.bin",
    "images.bin",
    "rigs.bin",
    "frames.bin",
    "cameras.txt",
    "images.txt",
    "rigs.txt",
    "frames.txt",
    "matrices.txt",
    "txt/a.txt",
];

/// Columns and rows of the masks, which are called `a` and `b`.
pub const SIZE: (u32, u32) = (24, 20);

/// Files of a COLMAP model whose one image has its pose on the frame alone.
pub const COLMAP: [(&str, &str); 4] = [
    ("cameras.txt", "1 OPENCV 24 20 30 30 12 10 -0.1 0.01 0 0\n"),
    ("images.txt", "1 1 a.png\n\n2 1 0 0 0 0 0 3 1 b.png\n"),
    ("rigs.txt", "1 1 CAMERA 1\n"),
    ("frames.txt", "1 1 1 0 0 0 0 0 3 1 CAMERA 1 1\n"),
];

thread_local! {
    static FOLDER: RefCell<Option<TempDir>> = const { RefCell::new(None) };
}

/// Reads bytes as the file that the first of them chooses, in a folder with what belongs to it.
pub fn read(bytes: &[u8]) {
    let Some((&choice, bytes)) = bytes.split_first() else {
        return;
    };
    let Some(name) = choice
        .checked_sub(b'a')
        .and_then(|k| FILES.get(usize::from(k)))
    else {
        return;
    };
    FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(make_folder);
        read_in(folder.path(), name, bytes);
    });
}

fn make_folder() -> TempDir {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    fs::create_dir(folder.path().join("masks")).expect("it can be written");
    let is_inside = |x, y| (4..20).contains(&x) && (3..15).contains(&y);
    let mask = GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        Luma([255 * u8::from(is_inside(x, y))])
    });
    for name in ["a", "b"] {
        let path = folder.path().join(format!("masks/{name}.png"));
        mask.save(path).expect("it can be written");
    }
    folder
}

fn read_in(folder: &Path, name: &str, bytes: &[u8]) {
    let place = folder.join("camera-files");
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(place.join("txt")).expect("it can be written");
    // Masks are looked for beside camera files.
    fs::create_dir(place.join("masks")).expect("it can be written");
    for mask in ["a.png", "b.png"] {
        let (from, to) = (
            folder.join("masks").join(mask),
            place.join("masks").join(mask),
        );
        fs::hard_link(&from, &to).expect("it can be linked");
    }
    let stem = Path::new(name)
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or_default();
    let is_model = COLMAP
        .iter()
        .any(|(file, _)| file.starts_with(&format!("{stem}.")));
    if is_model && !name.ends_with(".json") && !name.ends_with(".xml") {
        let is_binary = name.ends_with(".bin");
        for (file, text) in COLMAP {
            match is_binary {
                true => {
                    let file = Path::new(file).with_extension("bin");
                    fs::write(place.join(&file), binary(&file)).expect("it can be written");
                }
                false => fs::write(place.join(file), text).expect("it can be written"),
            }
        }
    }
    let file = place.join(name);
    fs::write(&file, bytes).expect("it can be written");
    for path in [&file, &place] {
        match silmap_capture::read(path) {
            Ok(capture) => {
                for view in &capture.views {
                    assert!(view.mask.count() > 0);
                    assert!(view.outline.iter().flatten().all(|p| p.is_finite()));
                    let middle = DVec2::new(12.0, 10.0);
                    let photo = view.photo_from_image(middle);
                    assert!(photo.is_none_or(|p| !p.is_nan()));
                    let _ = view.photograph();
                }
            }
            Err(fault) => assert!(is_one_sentence(&fault.to_string()), "{fault}"),
        }
    }
}

/// The same model as binary files.
#[must_use]
pub fn binary(file: &Path) -> Vec<u8> {
    let mut bytes = 1_u64.to_le_bytes().to_vec();
    let floats = |list: &[f64]| {
        list.iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let ints = |list: &[u32]| {
        list.iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    match file.file_stem().and_then(|s| s.to_str()) {
        Some("cameras") => {
            bytes.extend(ints(&[1, 4, 24, 0, 20, 0]));
            bytes.extend(floats(&[30.0, 30.0, 12.0, 10.0, -0.1, 0.01, 0.0, 0.0]));
        }
        Some("images") => {
            bytes[0] = 2;
            for (id, name, w) in [(1, b"a.png\0", 0.0), (2, b"b.png\0", 1.0)] {
                bytes.extend(ints(&[id]));
                bytes.extend(floats(&[w, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0]));
                bytes.extend(ints(&[1]));
                bytes.extend(name);
                bytes.extend(0_u64.to_le_bytes());
            }
        }
        Some("rigs") => bytes.extend(ints(&[1, 1, 0, 1])),
        _ => {
            bytes.extend(ints(&[1, 1]));
            bytes.extend(floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0]));
            bytes.extend(ints(&[1, 0, 1, 1, 0]));
        }
    }
    bytes
}
