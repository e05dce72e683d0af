//! `silmap build` on captures: a generated one whose truth is known, and the real ones where they are.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;

use common::{SMALL_BUILD, check_fields, check_one_sentence, path, run, run_json, scratch};
use glam::{DVec2, DVec3};
use image::{GrayImage, Luma, RgbImage};
use serde_json::{Value, json};
use silmap_capture::{Pinhole, silhouette};

const SIZE: (u32, u32) = (160, 140);
const VIEWS: usize = 14;

fn cameras() -> Vec<Pinhole> {
    let camera = |k: usize| {
        let (turn, height) = (2.4 * k as f64, -0.8 + 1.6 * (k as f64 + 0.5) / VIEWS as f64);
        let ring = (1.0_f64 - height * height).sqrt();
        let eye = 6.0 * DVec3::new(ring * turn.cos(), ring * turn.sin(), height);
        let forward = -eye.normalize_or_zero();
        let right = forward.cross(DVec3::Z).normalize_or_zero();
        let axes = [right, forward.cross(right), forward];
        let lens = (DVec2::new(240.0, 236.0), DVec2::new(76.0, 73.5));
        Pinhole::from_pose(eye, axes, lens, SIZE).unwrap()
    };
    (0..VIEWS).map(camera).collect()
}

/// Writes a capture of a torus: masks as by its cameras, photographs of one colour, both camera files.
fn write_capture(folder: &Path) {
    let model = silmap_models::torus(1200);
    fs::create_dir_all(folder.join("masks")).unwrap();
    fs::create_dir_all(folder.join("photos")).unwrap();
    let (mut views, mut frames) = (Vec::new(), Vec::new());
    for (k, camera) in cameras().into_iter().enumerate() {
        let (axes, eye) = (camera.axes, camera.eye);
        let mask = silhouette(&model, &camera).unwrap();
        let value = |x: u32, y: u32| Luma([255 * u8::from(mask.get(x.into(), y.into()))]);
        GrayImage::from_fn(SIZE.0, SIZE.1, value)
            .save(folder.join(format!("masks/{k}.png")))
            .unwrap();
        RgbImage::from_pixel(SIZE.0, SIZE.1, image::Rgb([180, 90, 40]))
            .save(folder.join(format!("photos/{k}.png")))
            .unwrap();
        views.push(json!({"name": k.to_string(), "P": camera.to_matrix(),
            "mask": format!("masks/{k}.png"), "photo": format!("photos/{k}.png")}));
        let column = |a: DVec3, c: usize| a[c];
        let row = |c: usize| {
            json!([
                column(axes[0], c),
                -column(axes[1], c),
                -column(axes[2], c),
                column(eye, c)
            ])
        };
        frames.push(json!({"file_path": format!("photos/{k}"),
            "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]}));
    }
    let matrices = json!({"name": "ring", "width": SIZE.0, "height": SIZE.1, "pixel_centre": 0.5,
        "metric": true, "views": views});
    let poses = json!({"w": SIZE.0, "h": SIZE.1, "fl_x": 240.0, "fl_y": 236.0, "cx": 76.0, "cy": 73.5,
        "frames": frames});
    fs::write(folder.join("cameras.json"), matrices.to_string()).unwrap();
    fs::write(folder.join("transforms.json"), poses.to_string()).unwrap();
}

/// A change to the camera file.
fn changed(folder: &Path, name: &str, change: impl Fn(&mut Value)) -> String {
    let text = fs::read_to_string(folder.join("cameras.json")).unwrap();
    let mut value: Value = serde_json::from_str(&text).unwrap();
    change(&mut value);
    let file = folder.join(name);
    fs::write(&file, value.to_string()).unwrap();
    path(&file).to_owned()
}

/// What `build --check` says of a capture, carved with so many voxels.
fn checked(capture: &Path, voxels: &str) -> Value {
    let words = ["build", path(capture), "--check", "--json"];
    run_json(&[&words[..], &["--voxels", voxels]].concat())
}

#[test]
fn a_capture_is_checked_and_built() {
    let folder = scratch("capture-build");
    write_capture(&folder);
    let check = checked(&folder, "48");
    check_fields(
        &check,
        &[
            "format",
            "conventions",
            "overlap.smallest",
            "overlap.median",
            "hull.volume",
            "masks",
        ],
    );
    assert_eq!(
        (&check["views"], &check["photographs"]),
        (&json!(14), &json!(14))
    );
    assert_eq!(check["disagree"], json!([]));
    assert!(
        check["overlap"]["smallest"].as_f64().unwrap() > 0.95,
        "{check}"
    );
    // 2·π²·R·r² = 3.16, and the visual hull is a little more.
    let volume = check["hull"]["volume"].as_f64().unwrap();
    assert!((2.9..4.2).contains(&volume), "{volume}");
    let poses = folder.join("transforms.json");
    let by_poses = checked(&poses, "48");
    assert_eq!(by_poses["overlap"], check["overlap"]);

    let build = |out: &str, options: &[&str]| {
        let out = folder.join(out);
        let words = ["build", path(&folder), "-o", path(&out), "--json"];
        let words = [&words[..], &["--voxels", "48"], options].concat();
        (run_json(&words), fs::read(&out).unwrap())
    };
    let page = folder.join("page.html");
    let carved = folder.join("carved.ply");
    let beside = ["--page", path(&page), "--carved", path(&carved)];
    let options = [&["--threads", "1"], &beside[..]].concat();
    let (told, first) = build("one.glb", &[&options[..], SMALL_BUILD].concat());
    assert!(fs::read_to_string(page).unwrap().contains("What was found"));
    let like = folder.join("one.glb");
    let options = ["--threads", "3", "--params-from", path(&like)];
    let (_, second) = build("three.glb", &options);
    assert!(
        first == second,
        "threads or recorded params change the bytes"
    );
    check_fields(
        &told,
        &[
            "bytes",
            "hull_faces",
            "overlap.median",
            "views_closed",
            "masks",
        ],
    );
    assert_eq!(told["photographs"], json!(14));
    // Half of the views that are kept may be photographs that stay.
    let seen = told["views_seen"].as_u64().unwrap();
    assert!((6..=14).contains(&seen), "{seen}");
    let covered = told["covered"].as_f64().unwrap();
    assert!(covered > 0.1 && covered < 1.0, "{covered}");
    // What was carved is a mesh like others.
    let words = ["--model", path(&carved), "--viewpoints", "6", "--json"];
    let against = run_json(&[&["evaluate", path(&folder.join("one.glb"))], &words[..]].concat());
    let off = against["methods"]["tight"]["misclassified_mean"].as_f64();
    assert!(off.is_some_and(|off| off < 0.1), "{against}");
    // How much of an outline rests on photographs is said for each eye, and drawn.
    let asset = folder.join("one.glb");
    let inspected = run_json(&["inspect", path(&asset), "--full", "--json"]);
    assert_eq!(inspected["map"]["covered"], told["covered"]);
    let shares = inspected["views"].as_array().unwrap().iter();
    let photographed = shares.filter(|v| v["photographed"].as_f64().unwrap() > 0.0);
    assert_eq!(photographed.count() as u64, seen);
    let covered = |eye: DVec3| {
        let eye = format!("--eye={},{},{}", eye.x, eye.y, eye.z);
        let outline = run_json(&["contour", path(&asset), &eye, "--json"]);
        outline["covered"].as_f64().unwrap()
    };
    let (photographed, far) = (covered(cameras()[4].eye), covered(-6.0 * DVec3::Z));
    assert!(photographed > 0.99 && far < 0.5, "{photographed}, {far}");
    let drawing = folder.join("seen.svg");
    run_json(&[
        "inspect",
        path(&asset),
        "--coverage",
        path(&drawing),
        "--json",
    ]);
    let svg = fs::read_to_string(drawing).unwrap();
    assert_eq!(svg.matches("r=\"3.4\"").count() as u64, seen);
    assert!(told["painted"].as_f64().unwrap() > 0.7, "{told}");
    // Photographs of one colour agree.
    let gain = |key: &str| told["gains"][key].as_f64().unwrap();
    assert!(gain("smallest") > 0.99 && gain("largest") < 1.01, "{told}");
    // The texture views stand at the photographs' eyes and hold their colour alone.
    let asset = silmap_map::asset::read(&first).unwrap();
    let origin = asset.placement.in_scene;
    let eyes: Vec<DVec3> = cameras().into_iter().map(|camera| camera.eye).collect();
    let mut photographed = 0;
    for view in &asset.textures.views {
        let is_taken = |eye: &DVec3| eye.distance(view.camera.eye + origin) < 1e-3;
        if !eyes.iter().any(is_taken) {
            continue;
        }
        photographed += 1;
        let picture = image::load_from_memory(&view.image.bytes).unwrap();
        for pixel in picture.into_rgb8().pixels() {
            let off = (0..3).map(|c| pixel.0[c].abs_diff([180, 90, 40][c]));
            assert!(off.max().unwrap() < 8, "{pixel:?}");
        }
    }
    assert!(photographed > 0, "{} views", asset.textures.views.len());
}

#[test]
fn an_exposure_unlike_the_rest_is_named_and_evened_out() {
    let folder = scratch("capture-exposed");
    write_capture(&folder);
    // Half of the light.
    RgbImage::from_pixel(SIZE.0, SIZE.1, image::Rgb([131, 64, 28]))
        .save(folder.join("photos/6.png"))
        .unwrap();
    let out = folder.join("exposed.glb");
    let mut words = vec!["build", path(&folder), "-o", path(&out), "--json"];
    words.extend(["--voxels", "48"]);
    words.extend(SMALL_BUILD);
    let told = run_json(&words);
    let gain = |view: usize| told["masks"][view]["gain"][1].as_f64().unwrap();
    assert!((gain(6) / gain(5) - 2.0).abs() < 0.1, "{told}");
    let warned = told["warnings"].to_string();
    assert!(
        warned.contains("view 6 is exposed unlike the rest"),
        "{warned}"
    );
    words.push("--no-photographs");
    let told = run_json(&words);
    assert_eq!(
        (&told["gains"], &told["photographs"]),
        (&Value::Null, &json!(0))
    );
}

#[test]
fn a_spoiled_mask_is_named() {
    let folder = scratch("capture-spoiled");
    write_capture(&folder);
    let mask = folder.join("masks/5.png");
    let mut picture = image::open(&mask).unwrap().into_luma8();
    for (_, y, pixel) in picture.enumerate_pixels_mut() {
        if y > 84 {
            pixel.0 = [0];
        }
    }
    picture.save(&mask).unwrap();
    let check = checked(&folder, "48");
    assert_eq!(check["disagree"], json!(["5"]));
    assert_eq!(check["outvoted"], json!(0));
    let told = run(&["build", path(&folder), "--check"]);
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(
        told.out.contains("1 disagree with the rest: 5"),
        "{}",
        told.out
    );
    assert!(told.err.contains("view 5 is left out"), "{}", told.err);
}

#[test]
fn options_that_are_not_for_captures_are_usage_errors() {
    let folder = scratch("capture-options");
    write_capture(&folder);
    // Options of captures mean nothing for a mesh.
    let mesh = folder.join("torus.ply");
    let made = run(&["generate", "torus", "--faces", "500", "-o", path(&mesh)]);
    assert_eq!(made.code, 0, "{}", made.err);
    assert_eq!(run(&["build", path(&mesh), "--check"]).code, 2);
    // And those that mend a mesh nothing for a capture.
    let out = folder.join("out.glb");
    for (option, said) in [
        ("--close-holes", "mend a mesh"),
        ("--repair", "mend a mesh"),
        ("--weld=0.1", "mend a mesh"),
        ("--alpha=mask", "mend a mesh"),
        ("--radius=4R", "are for meshes"),
        ("--coverage=any", "are for meshes"),
        ("--uniform-curve", "are for meshes"),
        (&format!("--page={}", path(&out)), "two results"),
        (&format!("--carved={}", path(&out)), "two results"),
    ] {
        let ended = run(&["build", path(&folder), "-o", path(&out), option]);
        assert_eq!(ended.code, 2, "{option}: {}", ended.err);
        assert!(ended.err.contains(said), "{}", ended.err);
        assert!(!out.exists(), "{option}");
    }
}

#[test]
fn real_captures_overlap_their_masks() {
    for (name, smallest, usual) in [
        ("squirrel", 0.96, 0.975),
        ("plaster-dinosaur/ring", 0.97, 0.98),
    ] {
        let Some(folder) = common::outside::shared(&format!("captures/{name}")) else {
            continue;
        };
        let check = checked(&folder, "128");
        let overlap = |key: &str| check["overlap"][key].as_f64().unwrap();
        assert!(
            overlap("smallest") > smallest,
            "{name}: {}",
            check["overlap"]
        );
        assert!(overlap("median") > usual, "{name}: {}", check["overlap"]);
        assert_eq!(check["disagree"], json!([]), "{name}");
    }
    // Matrices in XML, whose names are no photograph's.
    if let Some(file) = common::outside::shared("captures/squirrel/viff.xml") {
        let check = checked(&file, "96");
        assert_eq!(check["format"], json!("3×4 matrices"));
        assert!(check["overlap"]["smallest"].as_f64().unwrap() > 0.95);
    }
    // Projective cameras of a turntable.
    if let Some(folder) = common::outside::shared("captures/toy-dinosaur") {
        let check = checked(&folder, "96");
        let warning = check["warnings"][0].as_str().unwrap();
        assert!(warning.contains("are made metric"), "{warning}");
        assert!(
            check["overlap"]["smallest"].as_f64().unwrap() > 0.97,
            "{}",
            check["overlap"]
        );
    }
}

/// The same cameras as a COLMAP model of text, below the capture's folder.
#[test]
fn a_colmap_model_is_checked_as_the_same_cameras_are() {
    let folder = scratch("capture-colmap");
    write_capture(&folder);
    let expected = checked(&folder, "48");
    let (sparse, images) = (folder.join("sparse/0"), folder.join("images"));
    fs::create_dir_all(&sparse).unwrap();
    fs::rename(folder.join("photos"), images).unwrap();
    let text = fs::read_to_string(folder.join("transforms.json")).unwrap();
    let poses: Value = serde_json::from_str(&text).unwrap();
    let mut lines = String::new();
    for (k, frame) in poses["frames"].as_array().unwrap().iter().enumerate() {
        let row = |r: usize| -> [f64; 4] {
            std::array::from_fn(|c| frame["transform_matrix"][r][c].as_f64().unwrap())
        };
        let column = |c: usize| DVec3::new(row(0)[c], row(1)[c], row(2)[c]);
        // Rows of R are right, down, forward.
        let r = glam::DMat3::from_cols(column(0), -column(1), -column(2)).transpose();
        let (q, t) = (glam::DQuat::from_mat3(&r), -(r * column(3)));
        let [x, y, z, w] = q.to_array();
        let numbers = [w, x, y, z, t.x, t.y, t.z]
            .map(|v| format!("{v:?}"))
            .join(" ");
        lines += &format!("{} {numbers} 1 {k}.png\n\n", k + 1);
    }
    let camera = format!("1 PINHOLE {} {} 240 236 76 73.5\n", SIZE.0, SIZE.1);
    fs::write(sparse.join("cameras.txt"), camera).unwrap();
    fs::write(sparse.join("images.txt"), &lines).unwrap();
    for file in ["cameras.json", "transforms.json"] {
        fs::remove_file(folder.join(file)).unwrap();
    }
    let check = checked(&folder, "48");
    assert_eq!(
        (&check["format"], &check["photographs"]),
        (&json!("COLMAP model"), &json!(14))
    );
    for key in ["smallest", "median"] {
        let of = |check: &Value| check["overlap"][key].as_f64().unwrap();
        assert!((of(&check) - of(&expected)).abs() < 1e-3, "{check}");
    }
    fs::write(sparse.join("images.txt"), lines.replacen("\n\n", "\n", 1)).unwrap();
    let ended = run(&["build", path(&folder), "--check"]);
    check_one_sentence(&ended, "images.txt");
    assert!(ended.err.contains("line 2"), "{}", ended.err);
}

/// Each view predicted from the rest: by what the map says better than by the nearest view.
#[test]
fn views_are_left_out_in_turn() {
    let folder = scratch("capture-left-out");
    write_capture(&folder);
    let file = changed(&folder, "odd.json", |v| {
        v["views"][2]["photo"] = "missing.png".into();
    });
    let words = ["evaluate", &file, "--leave-one-out", "--every", "5"];
    let ended = run(&[&words[..], &["--json"]].concat());
    assert!(
        ended.err.contains("missing.png is not there"),
        "{}",
        ended.err
    );
    let told: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(told["left_out"], json!(3));
    let error = |method: &str| {
        let mean = &told["methods"][method]["misclassified_mean"];
        mean.as_f64().unwrap()
    };
    let (tight, nearest) = (error("tight"), error("nearest-view"));
    assert!(tight < 0.6 * nearest, "{told}");
    assert!(error("visual-hull") < nearest && error("hull") < nearest);
    for view in told["per_view"].as_array().unwrap() {
        let is_interpolated =
            ["paper", "hull", "tight"].contains(&view["method"].as_str().unwrap());
        assert_eq!(view["covered"].is_number(), is_interpolated);
    }
}
