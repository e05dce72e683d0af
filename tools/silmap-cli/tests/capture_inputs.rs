//! Captures that are unusual, and captures that are broken: the first work, the others end in one sentence that names file and view.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{check_one_sentence, path, run, run_json, scratch};
use glam::{DVec2, DVec3};
use image::{DynamicImage, GrayImage, ImageFormat, Luma, RgbImage};
use serde_json::{Value, json};
use silmap_capture::{Pinhole, silhouette};
use silmap_geometry::{Mask, TriangleMesh};

const SIZE: (u32, u32) = (120, 100);

fn camera(turn: f64, height: f64) -> Pinhole {
    let ring = (1.0_f64 - height * height).sqrt();
    let eye = 6.0 * DVec3::new(ring * turn.cos(), ring * turn.sin(), height);
    let forward = -eye.normalize_or_zero();
    let right = forward.cross(DVec3::Z).normalize_or_zero();
    let axes = [right, forward.cross(right), forward];
    let lens = (DVec2::new(170.0, 168.0), DVec2::new(57.0, 52.5));
    Pinhole::from_pose(eye, axes, lens, SIZE).unwrap()
}

/// Cameras around and above.
fn cameras() -> Vec<Pinhole> {
    (0..12)
        .map(|k| camera(2.4 * f64::from(k), -0.7 + 1.4 * (f64::from(k) + 0.5) / 12.0))
        .collect()
}

fn picture(mask: &Mask) -> GrayImage {
    let value = |x: u32, y: u32| Luma([255 * u8::from(mask.get(x.into(), y.into()))]);
    GrayImage::from_fn(mask.width(), mask.height(), value)
}

/// Writes masks of a model and `cameras.json`; views are named a, b, c …
fn write(folder: &Path, model: &TriangleMesh, cameras: &[Pinhole]) -> Value {
    fs::create_dir_all(folder.join("masks")).unwrap();
    let views: Vec<Value> = (cameras.iter().zip(b'a'..))
        .map(|(camera, letter)| {
            let name = char::from(letter).to_string();
            let mask = silhouette(model, camera).unwrap();
            let file = format!("masks/{name}.png");
            picture(&mask).save(folder.join(&file)).unwrap();
            json!({"name": name, "P": camera.to_matrix(), "mask": file})
        })
        .collect();
    let file = json!({"width": SIZE.0, "height": SIZE.1, "views": views});
    save(folder, &file);
    file
}

fn save(folder: &Path, file: &Value) {
    fs::write(folder.join("cameras.json"), file.to_string()).unwrap();
}

fn written(name: &str) -> (PathBuf, Value) {
    let folder = scratch(name);
    let file = write(&folder, &silmap_models::torus(800), &cameras());
    (folder, file)
}

fn checked(folder: &Path, more: &[&str]) -> Value {
    let words = ["build", path(folder), "--check", "--json", "--voxels", "40"];
    run_json(&[&words[..], more].concat())
}

fn smallest_overlap(check: &Value) -> f64 {
    check["overlap"]["smallest"].as_f64().unwrap()
}

/// A torus has holes in most masks; two of them beside each other are two components; near the border objects are cut off.
#[test]
fn holes_components_and_cut_off_objects_are_carved() {
    let (folder, _) = written("inputs-fine");
    let whole = checked(&folder, &[]);
    assert!(smallest_overlap(&whole) > 0.93, "{}", whole["overlap"]);

    let torus = silmap_models::torus(800);
    let mut two = TriangleMesh::default();
    for shift in [DVec3::new(0.9, 0.0, 0.0), DVec3::new(-0.9, 0.0, 0.0)] {
        let first = two.positions.len() as u32;
        let at = |p: &DVec3| *p * 0.45 + shift;
        two.positions.extend(torus.positions.iter().map(at));
        two.faces
            .extend(torus.faces.iter().map(|f| f.map(|v| v + first)));
    }
    let folder = scratch("inputs-two");
    write(&folder, &two, &cameras());
    let check = checked(&folder, &[]);
    assert!(smallest_overlap(&check) > 0.9, "{}", check["overlap"]);
    assert_eq!(check["disagree"], json!([]));

    // Three of twelve look past the object, which leaves their images.
    let folder = scratch("inputs-border");
    let mut cut = cameras();
    for camera in cut.iter_mut().step_by(4) {
        camera.principal.x -= 60.0;
    }
    write(&folder, &torus, &cut);
    let check = checked(&folder, &[]);
    assert!(smallest_overlap(&check) > 0.9, "{}", check["overlap"]);
    let ratio =
        check["hull"]["volume"].as_f64().unwrap() / whole["hull"]["volume"].as_f64().unwrap();
    assert!((0.95..1.15).contains(&ratio), "{ratio}");
}

#[test]
fn two_coinciding_cameras_do_no_harm() {
    let folder = scratch("inputs-coinciding");
    let mut all = cameras();
    all.push(all[3]);
    write(&folder, &silmap_models::torus(800), &all);
    let check = checked(&folder, &[]);
    assert_eq!(check["views"], json!(13));
    assert!(smallest_overlap(&check) > 0.93, "{}", check["overlap"]);
}

/// The same masks as they are seldom written: every one carves the same hull, or nearly.
#[test]
fn masks_are_read_however_they_are_written() {
    let (folder, file) = written("inputs-masks");
    let plain = checked(&folder, &[]);
    let volume = |check: &Value| check["hull"]["volume"].as_f64().unwrap();
    let masks = || {
        let views = file["views"].as_array().unwrap();
        views
            .iter()
            .map(|v| folder.join(v["mask"].as_str().unwrap()))
            .collect::<Vec<_>>()
    };
    let originals: Vec<GrayImage> = masks()
        .iter()
        .map(|m| image::open(m).unwrap().into_luma8())
        .collect();
    let rewrite = |change: &dyn Fn(&GrayImage) -> DynamicImage, format: ImageFormat| {
        for (path, original) in masks().iter().zip(&originals) {
            change(original).save_with_format(path, format).unwrap();
        }
    };
    let scaled = |k: u32| {
        move |m: &GrayImage| {
            let filter = image::imageops::FilterType::Nearest;
            image::imageops::resize(m, SIZE.0 * k, SIZE.1 * k, filter).into()
        }
    };
    // A name says nothing about the format.
    rewrite(&|m| m.clone().into(), ImageFormat::WebP);
    assert_eq!(volume(&checked(&folder, &[])), volume(&plain));
    rewrite(&scaled(3), ImageFormat::Png);
    assert_eq!(volume(&checked(&folder, &[])), volume(&plain));

    let inverted = |m: &GrayImage| {
        GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| Luma([255 - m.get_pixel(x, y).0[0]])).into()
    };
    rewrite(&inverted, ImageFormat::Png);
    assert_eq!(
        volume(&checked(&folder, &["--mask-inverted"])),
        volume(&plain)
    );
    // As they stand they are said to be wrong, whatever is left.
    let ended = run(&["build", path(&folder), "--check"]);
    assert!(
        ended.code == 1 || ended.err.contains("overlaps the masks by"),
        "{ended:?}"
    );

    let halved = |m: &GrayImage| {
        let filter = image::imageops::FilterType::Triangle;
        image::imageops::resize(m, SIZE.0 / 2, SIZE.1 / 2, filter).into()
    };
    rewrite(&halved, ImageFormat::Png);
    let coarse = checked(&folder, &[]);
    assert!((volume(&coarse) / volume(&plain) - 1.0).abs() < 0.05);
    assert!(
        coarse["warnings"].to_string().contains("as coarse"),
        "{}",
        coarse["warnings"]
    );
}

/// A photograph's mask by a rule, and what EXIF does to both.
#[test]
fn plain_backgrounds_become_masks() {
    let (folder, mut file) = written("inputs-rule");
    let plain = checked(&folder, &[]);
    fs::create_dir_all(folder.join("photos")).unwrap();
    for view in file["views"].as_array_mut().unwrap() {
        let mask = image::open(folder.join(view["mask"].as_str().unwrap()))
            .unwrap()
            .into_luma8();
        let colour = |x: u32, y: u32| match mask.get_pixel(x, y).0[0] {
            0 => image::Rgb([20, 60, 170]),
            _ => image::Rgb([190, 120, 40 + (x % 7) as u8]),
        };
        let photo = format!("photos/{}.png", view["name"].as_str().unwrap());
        RgbImage::from_fn(SIZE.0, SIZE.1, colour)
            .save(folder.join(&photo))
            .unwrap();
        view["photo"] = photo.into();
        view["mask"] = Value::Null;
    }
    save(&folder, &file);
    let none = run(&["build", path(&folder), "--check"]);
    check_one_sentence(&none, "no masks");
    assert!(
        none.err.contains("0 of 12 views have a mask"),
        "{}",
        none.err
    );
    for rule in ["auto", "lighter:180", "unlike:20,60,170:60"] {
        let check = checked(&folder, &["--mask-rule", rule]);
        let ratio =
            check["hull"]["volume"].as_f64().unwrap() / plain["hull"]["volume"].as_f64().unwrap();
        // A threshold well below one half of the difference makes masks larger by a part of a pixel.
        assert!((ratio - 1.0).abs() < 0.08, "{rule}: {ratio}");
    }
    assert_eq!(
        run(&["build", path(&folder), "--check", "--mask-rule", "bright"]).code,
        2
    );
}

#[test]
fn a_page_shows_every_view() {
    let (folder, _) = written("inputs-page");
    let page = folder.join("page.html");
    checked(&folder, &["--page", path(&page)]);
    let text = fs::read_to_string(&page).unwrap();
    for name in 'a'..='l' {
        assert!(text.contains(&format!("<b>{name}</b>")), "{name}");
    }
    assert!(
        text.matches("data:image/png;base64,").count() == 12 && text.matches("<svg").count() == 3
    );
    // Again, whatever the number of threads.
    checked(&folder, &["--page", path(&page), "--threads", "1"]);
    assert_eq!(fs::read_to_string(&page).unwrap(), text);
}

type Change = Box<dyn Fn(&mut Value)>;

#[test]
fn broken_captures_are_named() {
    let (folder, good) = written("inputs-broken");
    let p = |k: usize| good["views"][k]["P"].clone();
    let set = |key: &'static str, value: Value| -> Change {
        Box::new(move |v| v["views"][2][key] = value.clone())
    };
    let all_p = |matrix: Value| -> Change {
        Box::new(move |v| {
            for view in v["views"].as_array_mut().unwrap() {
                view["P"] = matrix.clone();
            }
        })
    };
    // Beside files there are things that are none.
    fs::create_dir(folder.join("masks/folder.png")).unwrap();
    fs::write(folder.join("masks/text.png"), "no picture").unwrap();
    GrayImage::new(SIZE.0, SIZE.1)
        .save(folder.join("masks/black.png"))
        .unwrap();
    GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([255]))
        .save(folder.join("masks/white.png"))
        .unwrap();
    GrayImage::from_fn(SIZE.0 - 1, SIZE.1, |x, _| Luma([x as u8]))
        .save(folder.join("masks/narrow.png"))
        .unwrap();
    fs::write(folder.join("masks/huge.png"), claims(60_000)).unwrap();
    let mut rank_2 = p(2);
    rank_2[0] = rank_2[2].clone();
    // Inside of the tube, looking along it: everything around it is the object.
    let mut inside = camera(0.0, 0.0);
    inside.eye = DVec3::X;
    let mut looking_away = good.clone();
    for (view, camera) in looking_away["views"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .zip(cameras())
    {
        let [right, down, forward] = camera.axes;
        let away = Pinhole {
            axes: [-right, down, -forward],
            ..camera
        };
        view["P"] = json!(away.to_matrix());
    }
    let cases: Vec<(&str, Change, &[&str])> = vec![
        (
            "missing",
            set("mask", "masks/no.png".into()),
            &["view c", "no.png", "cannot be read"],
        ),
        (
            "folder",
            set("mask", "masks/folder.png".into()),
            &["view c", "folder.png", "cannot be read"],
        ),
        (
            "text",
            set("mask", "masks/text.png".into()),
            &["view c", "text.png", "a picture is needed"],
        ),
        (
            "narrow",
            set("mask", "masks/narrow.png".into()),
            &["view c", "narrow.png", "119 × 100 pixels, not 120 × 100"],
        ),
        (
            "huge",
            set("mask", "masks/huge.png".into()),
            &["view c", "huge.png", "60000 × 60000"],
        ),
        (
            "black",
            set("mask", "masks/black.png".into()),
            &["view c", "black.png", "(black)"],
        ),
        (
            "white",
            set("mask", "masks/white.png".into()),
            &["view c", "white.png", "(white)"],
        ),
        (
            "another size",
            Box::new(|v| v["height"] = 99.into()),
            &["view a", "masks/a.png", "120 × 100"],
        ),
        (
            "no 3×4",
            set("P", json!([[1, 2], [3, 4]])),
            &["view c", "3×4, and is 2×2"],
        ),
        ("rank", set("P", rank_2), &["view c", "rank 2"]),
        (
            "inside",
            set("P", json!(inside.to_matrix())),
            &["view c", "inside"],
        ),
        ("same", all_p(p(0)), &["same direction"]),
        (
            "away",
            Box::new(move |v| *v = looking_away.clone()),
            &["nothing is left"],
        ),
        (
            "one",
            Box::new(|v| v["views"].as_array_mut().unwrap().truncate(1)),
            &["1 of 1 views has a mask"],
        ),
        ("none", Box::new(|v| v["views"] = json!([])), &["no views"]),
    ];
    let (out, page) = (folder.join("out.glb"), folder.join("page.html"));
    for (name, change, words) in cases {
        let mut file = good.clone();
        change(&mut file);
        save(&folder, &file);
        let ended = run(&[
            "build",
            path(&folder),
            "-o",
            path(&out),
            "--page",
            path(&page),
            "--voxels",
            "40",
        ]);
        check_one_sentence(&ended, name);
        let error = ended.err.lines().last().unwrap();
        assert!(error.contains("cameras.json"), "{name}: {error}");
        for word in words {
            assert!(error.contains(word), "{name}: {word}: {error}");
        }
        assert!(!out.exists() && !page.exists(), "{name}");
    }
    let text = good.to_string().replacen("120", "NaN", 1);
    fs::write(folder.join("cameras.json"), text).unwrap();
    let ended = run(&["build", path(&folder), "-o", path(&out)]);
    check_one_sentence(&ended, "NaN");
    assert!(ended.err.contains("NaN or infinite"), "{}", ended.err);
    let empty = scratch("inputs-empty");
    let ended = run(&["build", path(&empty), "-o", path(&out)]);
    check_one_sentence(&ended, "empty folder");
    assert!(ended.err.contains("no camera file"), "{}", ended.err);
}

/// The first bytes of a PNG whose header claims that many columns and rows.
fn claims(side: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let small = DynamicImage::from(GrayImage::new(1, 1));
    small
        .write_to(&mut std::io::Cursor::new(&mut bytes), ImageFormat::Png)
        .unwrap();
    bytes[16..20].copy_from_slice(&side.to_be_bytes());
    bytes[20..24].copy_from_slice(&side.to_be_bytes());
    // The checksum of the header, bit by bit.
    let mut sum = u32::MAX;
    for &byte in &bytes[12..29] {
        sum ^= u32::from(byte);
        for _ in 0..8 {
            sum = (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg());
        }
    }
    bytes[29..33].copy_from_slice(&(!sum).to_be_bytes());
    bytes
}

/// Photographs that are no pictures, or of another size, are not used, and said.
#[test]
fn photographs_that_are_none_are_said() {
    let (folder, mut file) = written("inputs-photos");
    fs::write(folder.join("words.jpg"), "no picture").unwrap();
    RgbImage::new(SIZE.1, SIZE.0)
        .save(folder.join("aside.png"))
        .unwrap();
    file["views"][0]["photo"] = "words.jpg".into();
    file["views"][1]["photo"] = "aside.png".into();
    file["views"][2]["photo"] = "missing.png".into();
    save(&folder, &file);
    let check = checked(&folder, &[]);
    assert_eq!(check["photographs"], json!(0));
    let warnings = check["warnings"].to_string();
    for word in [
        "view a: its photograph is not used",
        "100 × 120 pixels, not 120 × 100",
        "missing.png is not there",
    ] {
        assert!(warnings.contains(word), "{word}: {warnings}");
    }
}

/// A slip in all cameras is named by the check and by a build.
#[test]
fn slips_in_all_cameras_are_named() {
    let (folder, mut file) = written("inputs-slips");
    for (view, camera) in file["views"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .zip(cameras())
    {
        let [right, down, forward] = camera.axes;
        view["P"] = json!(
            Pinhole {
                axes: [right, -down, -forward],
                ..camera
            }
            .to_matrix()
        );
    }
    save(&folder, &file);
    let out = folder.join("out.glb");
    for words in [&["--check"][..], &["-o", path(&out)]] {
        let ended = run(&[&["build", path(&folder)], words].concat());
        check_one_sentence(&ended, "y up");
        assert!(
            ended
                .err
                .contains("the likely cause is that the cameras have y up"),
            "{}",
            ended.err
        );
    }
    assert!(!out.exists());
}
