//! `silmap simplify` and `silmap align` as processes.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::{check_fields, check_one_sentence, path, run, run_json, scratch};
use serde_json::Value;

#[test]
fn a_simplified_model_keeps_the_silhouettes_that_are_asked_for() {
    let folder = scratch("simplify");
    let [model, eyes, out] = ["knot.obj", "eyes.txt", "simple.ply"].map(|n| folder.join(n));
    let ended = run(&[
        "generate",
        "trefoil-knot",
        "--faces",
        "20000",
        "-o",
        path(&model),
    ]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    fs::write(&eyes, "# a path\n\n0,0,5\n 0.5, 0, 5\n").unwrap();
    let to = ["--faces", "1500", "-o", path(&out), "--json"];
    let from = ["--eye", "-0.5,0,5", "--eyes", path(&eyes)];
    let simple = run_json(&[&["simplify", path(&model)][..], &from, &to].concat());
    check_fields(
        &simple,
        &["out", "vertices", "original_faces", "seconds", "error"],
    );
    assert_eq!(simple["viewpoints"], 3);
    assert!(simple["faces"].as_u64().unwrap() <= 1500);
    let mean = |name: &str| simple[name]["misclassified_mean"].as_f64().unwrap();
    assert!(mean("error") < 0.7 * mean("unguided_error"), "{simple}");
    // What was written is a closed model again.
    let hull = folder.join("hull.obj");
    run_json(&[
        "hull",
        path(&out),
        "--faces",
        "900",
        "-o",
        path(&hull),
        "--json",
    ]);

    fs::write(&eyes, "0,0,5\n1,2\n").unwrap();
    let ended = run(&[&["simplify", path(&model)][..], &from, &to].concat());
    check_one_sentence(&ended, path(&eyes));
    assert!(ended.err.contains("line 2"), "{}", ended.err);
    let ended = run(&[&["simplify", path(&model)][..], &to].concat());
    assert_eq!(ended.code, 2, "a viewpoint is needed: {}", ended.err);
    let inside = ["--eye", "0,0,0.1"];
    let ended = run(&[&["simplify", path(&model)][..], &inside, &to].concat());
    check_one_sentence(&ended, "viewpoint 0,0,0.1");
    for band in ["0", "91", "nan"] {
        let call = ["simplify", path(&model), "--eye", "0,0,5", "--band", band];
        let ended = run(&[&call[..], &to].concat());
        assert_eq!(ended.code, 2, "{band}: {}", ended.err);
        assert!(ended.err.contains("degrees"), "{}", ended.err);
    }
}

#[test]
fn a_pose_is_found_again_from_a_picture_of_the_outline() {
    let folder = scratch("align");
    let names = [
        "organic.obj",
        "organic.glb",
        "mask.png",
        "start.json",
        "pose.json",
    ];
    let [model, asset, mask, start, refined] = names.map(|n| folder.join(n));
    let ended = run(&["generate", "organic", "--faces", "6000", "-o", path(&model)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let build = ["build", path(&model), "-o", path(&asset)];
    let finer = [
        "--views",
        "64",
        "--keep",
        "20",
        "--resolution",
        "400",
        "--faces",
        "120",
    ];
    let plain = ["--texture-views", "4", "--texture-size", "32"];
    let ended = run(&[&build[..], &finer, &plain].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    // At a captured viewpoint the outline is the model's own.
    let inspected = run_json(&["inspect", path(&asset), "--full", "--json"]);
    let eye: Vec<f64> = serde_json::from_value(inspected["views"][3]["eye"].clone()).unwrap();
    let eye_text = eye.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let eye_option = format!("--eye={eye_text}");
    let view = ["contour", path(&asset), &eye_option, "--size", "400x400"];
    let png = ["--format", "png", "-o", path(&mask)];
    let ended = run(&[&view[..], &png].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    let truth = &run_json(&[&view[..], &["--json"]].concat())["camera"];
    // The same camera, moved and turned a little.
    let mut wrong = truth.clone();
    for (k, by) in [0.12, -0.1, 0.08].into_iter().enumerate() {
        wrong["eye"][k] = Value::from(truth["eye"][k].as_f64().unwrap() + by);
        wrong["target"][k] = Value::from(truth["target"][k].as_f64().unwrap() - 0.3 * by);
    }
    fs::write(&start, wrong.to_string()).unwrap();
    let from = ["--mask", path(&mask), "--start", path(&start)];
    let aligned = run_json(&[&["align", path(&model)][..], &from, &["--json"]].concat());
    check_fields(&aligned, &["camera", "rounds", "turned_degrees", "moved"]);
    assert!(aligned["distance_px"].as_f64().unwrap() < 0.5, "{aligned}");
    let off = |camera: &Value| {
        let squares = (0..3).map(|k| {
            let at = |c: &Value| c["eye"][k].as_f64().unwrap();
            (at(camera) - at(truth)).powi(2)
        });
        squares.sum::<f64>().sqrt()
    };
    assert!(
        off(&wrong) > 0.15 && off(&aligned["camera"]) < 0.05,
        "{aligned}"
    );
    // What was written is a pose to start from.
    let to = ["-o", path(&refined)];
    let ended = run(&[&["align", path(&model)][..], &from, &to].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    let again = ["--mask", path(&mask), "--start", path(&refined), "--json"];
    let again = run_json(&[&["align", path(&model)][..], &again].concat());
    assert!(again["turned_degrees"].as_f64().unwrap() < 0.2, "{again}");

    // The same mask as other tools write it.
    let plain = image::open(&mask).unwrap().into_luma8();
    let (width, height) = plain.dimensions();
    let inside = |x: u32, y: u32| plain.get_pixel(x, y).0[0] > 127;
    let variant = folder.join("variant.png");
    let zero_and_one =
        image::GrayImage::from_fn(width, height, |x, y| image::Luma([u8::from(inside(x, y))]));
    let inverted = image::GrayImage::from_fn(width, height, |x, y| {
        image::Luma([if inside(x, y) { 0 } else { 255 }])
    });
    let cut_out = image::RgbaImage::from_fn(width, height, |x, y| {
        image::Rgba(if inside(x, y) {
            [9, 9, 9, 255]
        } else {
            [255, 255, 255, 0]
        })
    });
    for (picture, is_warned) in [
        (image::DynamicImage::from(zero_and_one), false),
        (inverted.into(), true),
        (cut_out.into(), false),
    ] {
        picture.save(&variant).unwrap();
        let of_variant = ["--mask", path(&variant), "--start", path(&start), "--json"];
        let ended = run(&[&["align", path(&model)][..], &of_variant].concat());
        assert_eq!(ended.code, 0, "{}", ended.err);
        assert_eq!(ended.err.contains("warning"), is_warned, "{}", ended.err);
        let found: Value = serde_json::from_str(&ended.out).unwrap();
        assert_eq!(found["camera"], aligned["camera"]);
        assert_eq!(found["converged"], true);
    }
    // Another outline, which this model never has.
    let comb = image::GrayImage::from_fn(width, height, |x, y| {
        let is_tooth = (60..340).contains(&x) && (100..300).contains(&y) && (x / 30) % 2 == 0;
        image::Luma([
            if is_tooth || (60..340).contains(&x) && (280..300).contains(&y) {
                255
            } else {
                0
            },
        ])
    });
    comb.save(&variant).unwrap();
    let never = folder.join("never.json");
    let of_comb = [
        "--mask",
        path(&variant),
        "--start",
        path(&start),
        "-o",
        path(&never),
        "--json",
    ];
    let ended = run(&[&["align", path(&model)][..], &of_comb].concat());
    check_one_sentence(&ended, path(&variant));
    let told: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(told["converged"], false, "{told}");
    let (apart, bound) = (&told["distance_px"], &told["fits_within_px"]);
    assert!(apart.as_f64().unwrap() > bound.as_f64().unwrap(), "{told}");
    assert!(!never.exists());
    let ended = run(&[
        &["align", path(&model)][..],
        &of_comb,
        &["--within", "1000"],
    ]
    .concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(never.exists());

    for (pose, word) in [
        ("{\"eye\": [1, 2]}", "camera"),
        ("{\"eye\": [NaN, 0, 3]}", "JSON"),
        ("{\"eye\": [1e400, 0, 3]}", "JSON"),
        ("{\"eye\": [null, 0, 3]}", "camera"),
        ("{\"eye\": [0, 0, 9], \"fov_y_degrees\": 1e9}", "degrees"),
        ("{\"eye\": [0, 0, 9], \"target\": [0, 0, 9]}", "same point"),
        (
            "{\"eye\": [0, 0, 9], \"target\": [0, 0, 0], \"up\": [0, 0, 1]}",
            "parallel",
        ),
        ("", "JSON"),
    ] {
        fs::write(&start, pose).unwrap();
        let ended = run(&[&["align", path(&model)][..], &from].concat());
        check_one_sentence(&ended, path(&start));
        assert!(ended.err.contains(word), "{pose}: {}", ended.err);
    }
    let as_mask = ["--mask", path(&model), "--start", path(&start)];
    let ended = run(&[&["align", path(&model)][..], &as_mask].concat());
    check_one_sentence(&ended, path(&model));
    assert!(ended.err.contains("mesh"), "{}", ended.err);
    fs::write(&mask, "no picture").unwrap();
    let ended = run(&[&["align", path(&model)][..], &from].concat());
    check_one_sentence(&ended, path(&mask));
}
