//! Looking through the cameras of a capture: `render`, `contour`, `edges` and `align` with `--camera` and `--view`.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::captured::{
    SIZE, VIEWS, cameras, capture, inside, number, overlap, through, write_cameras,
};
use common::{SMALL_BUILD, check_one_sentence, fixture, path, run, run_json, scratch};
use glam::{DVec2, DVec3};
use image::{GrayImage, Luma};
use serde_json::{Value, json};
use silmap_capture::Pinhole;

#[test]
fn contours_lie_over_the_masks_of_their_cameras() {
    let (folder, asset) = (capture(), path(&fixture().asset));
    let mut holes = 0;
    for (name, camera) in VIEWS.iter().zip(cameras(DVec3::ZERO)) {
        let out = folder.join(format!("{name} contour.png"));
        let words = through(&["contour", asset], folder, name);
        let ended = run(&[&words[..], &["--format", "png", "-o", path(&out)]].concat());
        assert_eq!(ended.code, 0, "{}", ended.err);
        let mask = inside(&folder.join(format!("masks/{name}.png")));
        let found = overlap(&inside(&out), &mask);
        assert!(found > 0.95, "{name}: {found}");
        // Shifted by a few pixels it is much less.
        let moved = GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
            *mask.get_pixel((x + 8).min(SIZE.0 - 1), y)
        });
        assert!(overlap(&inside(&out), &moved) < found - 0.05, "{name}");
        let told = run_json(&[&words[..], &["--json"]].concat());
        assert_eq!(told["camera"]["view"], json!(name));
        let focal = number(&told, "/camera/focal/0");
        assert!((focal - camera.focal.x).abs() < 1e-6, "{name}: {focal}");
        // Outer loops have positive area in the picture, also in a mirrored one.
        let of = |v: &Value, k: usize| v[k].as_f64().unwrap();
        let area = |points: &Value| {
            let points = points.as_array().unwrap();
            let pairs = points.iter().zip(points.iter().cycle().skip(1));
            pairs
                .map(|(a, b)| of(a, 0) * of(b, 1) - of(b, 0) * of(a, 1))
                .sum::<f64>()
        };
        let loops = told["loops"].as_array().unwrap();
        assert!(
            loops.iter().map(area).fold(0.0, f64::max) > 3000.0,
            "{name}"
        );
        holes += usize::from(loops.iter().map(area).fold(0.0, f64::min) < -100.0);
    }
    assert!(holes > 0, "some view sees the hole");
    // Twice the size is twice the picture.
    let words = through(&["contour", asset, "--json"], folder, "front");
    let (once, twice) = (
        run_json(&words),
        run_json(&[&words[..], &["--size", "440x320"]].concat()),
    );
    // Parts are united in the picture, so that vertices differ by what is thinned out.
    let leftmost = |told: &Value| {
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(told["loops"].clone()).unwrap();
        let places = loops.iter().flatten().map(|p| p[0]);
        places.fold(f64::INFINITY, f64::min)
    };
    let (a, b) = (leftmost(&once), leftmost(&twice));
    assert!((2.0 * a - b).abs() < 0.2, "{a}, {b}");
    assert_eq!(twice["camera"]["width"], json!(440));
}

#[test]
fn exact_outlines_are_those_of_the_masks() {
    let (folder, model) = (capture(), path(&fixture().model));
    for name in VIEWS {
        let out = folder.join(format!("{name} exact.json"));
        let drawing = folder.join(format!("{name} edges.svg"));
        let files = ["--outline", path(&out), "--svg", path(&drawing)];
        let words = [&["edges", model], &files[..]].concat();
        let ended = run(&through(&words, folder, name));
        assert_eq!(ended.code, 0, "{}", ended.err);
        let told: Value = serde_json::from_str(&fs::read_to_string(&out).unwrap()).unwrap();
        let mask = inside(&folder.join(format!("masks/{name}.png")));
        // The model's file has single precision: a point beside the outline by less than this may be on either side.
        let loops: Vec<Vec<DVec2>> =
            serde_json::from_value::<Vec<Vec<[f64; 2]>>>(told["loops"].clone())
                .unwrap()
                .into_iter()
                .map(|points| points.into_iter().map(DVec2::from).collect())
                .collect();
        let mut exact = silmap_geometry::Mask::new(SIZE.0, SIZE.1);
        silmap_geometry::polygon::fill_non_zero(&loops, &mut exact);
        let differs = |(x, y, pixel): (u32, u32, &Luma<u8>)| {
            exact.get(x.into(), y.into()) != (pixel.0[0] > 127)
        };
        let different = mask.enumerate_pixels().filter(|&p| differs(p)).count();
        assert!(different <= 3, "{name}: {different}");
        let svg = fs::read_to_string(&drawing).unwrap();
        assert!(svg.contains("viewBox=\"0 0 220 160\""), "{name}");
    }
}

#[test]
fn far_from_the_origin_it_is_the_same_picture() {
    let folder = scratch("captured-cameras-far");
    let shift = DVec3::new(4.2e5, -3.1e6, 700.0);
    write_cameras(&folder, shift, false);
    let mut text = String::new();
    let model = silmap_models::torus(1200);
    for p in &model.positions {
        let p = *p + shift;
        text.push_str(&format!("v {} {} {}\n", p.x, p.y, p.z));
    }
    for [a, b, c] in &model.faces {
        text.push_str(&format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    }
    let (mesh, asset) = (folder.join("far.obj"), folder.join("far.glb"));
    fs::write(&mesh, text).unwrap();
    let mut words = vec!["build", path(&mesh), "-o", path(&asset)];
    words.extend(SMALL_BUILD);
    let ended = run(&words);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let out = folder.join("contour.png");
    let words = through(&["contour", path(&asset)], &folder, "side");
    let ended = run(&[&words[..], &["--format", "png", "-o", path(&out)]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    let mask = inside(&capture().join("masks/side.png"));
    let found = overlap(&inside(&out), &mask);
    assert!(found > 0.95, "{found}");
}

#[test]
fn a_model_is_aligned_with_a_mask_by_the_cameras_intrinsics() {
    let (folder, model) = (capture(), path(&fixture().model));
    for name in ["front", "skewed", "mirrored", "side"] {
        let mask = folder.join(format!("masks/{name}.png"));
        let words = ["align", model, "--mask", path(&mask), "--json"];
        let told = run_json(&through(&words, folder, name));
        assert_eq!(told["converged"], json!(true), "{name}: {told}");
        assert!(number(&told, "/distance_px") < 0.5, "{name}: {told}");
        assert!(
            number(&told, "/captured/distance_px") < 0.5,
            "{name}: {told}"
        );
        assert!(number(&told, "/captured/moved") < 0.05, "{name}: {told}");
        assert_eq!(told["camera"]["view"], json!(name));
    }
    // From a pose beside: the intrinsics hold, and what is printed can be started from without the capture.
    let eye = cameras(DVec3::ZERO)[0].eye;
    let beside = eye + DVec3::new(0.1, -0.2, 0.15);
    let (start, refined) = (folder.join("start.json"), folder.join("refined.json"));
    let pose = json!({"eye": beside.to_array(), "target": [0.02, 0.0, 0.0], "up": [0.0, 1.0, 0.0], "fov_y_degrees": 30.0});
    fs::write(&start, pose.to_string()).unwrap();
    let mask = folder.join("masks/front.png");
    let words = ["align", model, "--mask", path(&mask), "--json", "--start"];
    let from_start = [&words[..], &[path(&start)]].concat();
    let into = [&from_start[..], &["-o", path(&refined)]].concat();
    let told = run_json(&through(&into, folder, "front"));
    assert!(number(&told, "/moved") > 0.05, "{told}");
    assert!(number(&told, "/captured/moved") < 0.05, "{told}");
    assert!(number(&told, "/distance_px") < 0.5, "{told}");
    let again = run_json(&[&words[..], &[path(&refined)]].concat());
    assert!(number(&again, "/distance_px") < 0.5, "{again}");
    assert!(number(&again, "/moved") < 0.02, "{again}");
    // Without the intrinsics it is another pose.
    let alone = run_json(&from_start);
    assert!(number(&alone, "/moved") > 0.5, "{alone}");
}

#[test]
fn options_that_do_not_go_together_are_usage_errors() {
    let (folder, fixture) = (path(capture()), fixture());
    for (line, said) in [
        ("contour ASSET --camera CAPTURE", "--view"),
        ("contour ASSET --view front --eye 0,0,5", "--camera"),
        ("contour ASSET", "--eye"),
        ("edges MODEL --eye 0,0,5 THROUGH", "--camera"),
        ("edges MODEL --walk 5 THROUGH", "--walk"),
        ("contour ASSET --eye 0,0,5 THROUGH", "--camera"),
        ("contour ASSET --fov 30 THROUGH", "--fov"),
        ("contour ASSET --target 0,0,1 THROUGH", "--target"),
        ("contour ASSET --up 0,0,1 THROUGH", "--up"),
        ("contour ASSET --eye 0,0,5 --distorted", "--camera"),
        ("render ASSET -o no.png --up 0,0,1 THROUGH", "--up"),
        (
            "render ASSET -o no.png --eye 0,0,5 --photograph behind",
            "--camera",
        ),
        (
            "render ASSET -o no.png --mask-rule auto THROUGH",
            "--photograph",
        ),
        (
            "render ASSET -o no.png --mask-inverted THROUGH",
            "--photograph",
        ),
        ("evaluate ASSET", "--model"),
        ("evaluate ASSET --model MODEL --camera CAPTURE", "--camera"),
        ("evaluate ASSET --model MODEL --view front", "--camera"),
        ("evaluate ASSET --model MODEL --mask-inverted", "--camera"),
        ("evaluate ASSET --model MODEL --mask-rule auto", "--camera"),
        ("evaluate ASSET --model MODEL --every 5", "--leave-one-out"),
        (
            "evaluate ASSET --camera CAPTURE --every 3",
            "--leave-one-out",
        ),
        (
            "evaluate ASSET --camera CAPTURE --viewpoints 3",
            "--viewpoints",
        ),
        (
            "evaluate CAPTURE --leave-one-out --resolution 64",
            "--resolution",
        ),
        ("evaluate CAPTURE --leave-one-out --seed 2", "--seed"),
        ("evaluate CAPTURE --leave-one-out --weld 0.1", "--model"),
        ("align MODEL --mask no.png", "--start"),
    ] {
        let words = line.split(' ').flat_map(|word| match word {
            "ASSET" => vec![path(&fixture.asset)],
            "MODEL" => vec![path(&fixture.model)],
            "CAPTURE" => vec![folder],
            "THROUGH" => vec!["--camera", folder, "--view", "front"],
            other => vec![other],
        });
        let ended = run(&words.collect::<Vec<_>>());
        assert_eq!(ended.code, 2, "{line}: {}", ended.err);
        assert!(ended.err.contains(said), "{line}: {}", ended.err);
    }
}

#[test]
fn what_is_read_of_a_capture_is_not_replaced() {
    let folder = scratch("captured-cameras-kept");
    write_cameras(&folder, DVec3::ZERO, true);
    let (asset, model) = (path(&fixture().asset), path(&fixture().model));
    let [cameras, photo, mask] =
        ["cameras.json", "photos/front.png", "masks/front.png"].map(|name| folder.join(name));
    for file in [&cameras, &photo] {
        let (before, out) = (fs::read(file).unwrap(), path(file));
        let mut commands = Vec::new();
        for words in [
            &["contour", asset, "-o", out][..],
            &["edges", model, "--outline", out],
            &["edges", model, "--svg", out],
            &["align", model, "--mask", path(&mask), "-o", out],
            // No picture is called .json.
            &["render", asset, "-o", path(&photo)],
        ] {
            commands.push(through(words, &folder, "front"));
        }
        for words in commands {
            let ended = run(&words);
            assert_eq!(ended.code, 2, "{words:?}: {}", ended.err);
            assert!(ended.err.contains("would be replaced"), "{}", ended.err);
            assert!(fs::read(file).unwrap() == before, "{words:?}");
        }
    }
    // What is not called a page is none.
    for file in [&cameras, &photo, &mask] {
        let (before, out) = (fs::read(file).unwrap(), path(file));
        let ended = run(&["build", path(&folder), "--check", "--page", out]);
        check_one_sentence(&ended, out);
        assert!(ended.err.contains("ends in .html"), "{}", ended.err);
        assert!(fs::read(file).unwrap() == before, "{out}");
    }
}

#[test]
fn cameras_that_cannot_be_used_end_in_one_sentence() {
    let (folder, asset) = (scratch("captured-cameras-bad"), path(&fixture().asset));
    write_cameras(&folder, DVec3::ZERO, false);
    let good = fs::read_to_string(folder.join("cameras.json")).unwrap();
    let changed = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut value: Value = serde_json::from_str(&good).unwrap();
        change(&mut value);
        let file = folder.join(name);
        fs::write(&file, value.to_string()).unwrap();
        path(&file).to_owned()
    };
    let near = changed("near.json", &|v| {
        let mut camera = cameras(DVec3::ZERO)[0];
        camera.eye *= 0.1;
        v["views"][0]["P"] = json!(camera.to_matrix());
    });
    let projective = changed("projective.json", &|v| v["metric"] = false.into());
    let flat = changed("flat.json", &|v| {
        v["views"][0]["P"] = json!(vec![[0.0; 4]; 3])
    });
    let slanted = changed("slanted.json", &|v| {
        let camera = Pinhole {
            skew: 1e6,
            ..cameras(DVec3::ZERO)[0]
        };
        v["views"][0]["P"] = json!(camera.to_matrix());
    });
    let whole = path(&folder).to_owned();
    for (file, view, more, said) in [
        (&whole, "frnt", &[][..], "the names most like it are front"),
        (&whole, "", &[], "6 views may be meant by"),
        (
            &whole,
            "front",
            &["--size", "160x220"],
            "one of 160 × 116 has",
        ),
        (&near, "front", &[], "view front: the eye is"),
        (&projective, "front", &[], "projective"),
        (&flat, "front", &[], "rank 0"),
        (&slanted, "front", &[], "skew of"),
    ] {
        let words = ["contour", asset, "--camera", file, "--view", view];
        let ended = run(&[&words[..], more].concat());
        check_one_sentence(&ended, said);
        assert!(ended.err.contains(said), "{said}: {}", ended.err);
    }
}
