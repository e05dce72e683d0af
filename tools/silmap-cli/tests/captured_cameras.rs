//! Looking through the cameras of a capture: `render`, `contour`, `evaluate` and `align` with `--camera` and `--view`.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use common::{
    SMALL_BUILD, check_fields, check_one_sentence, fixture, is_gpu_skipped, path, run, run_json,
    scratch,
};
use glam::{DVec2, DVec3};
use image::{GrayImage, Luma, RgbImage};
use serde_json::{Value, json};
use silmap_capture::{Distortion, Lens, Pinhole, silhouette};

const SIZE: (u32, u32) = (220, 160);

/// A view for each kind of camera. Its principal point is far from the image's middle, its pixels are not square.
const VIEWS: [&str; 6] = [
    "front",
    "side",
    "skewed",
    "mirrored",
    "cut-off",
    "from above",
];

fn cameras(shift: DVec3) -> Vec<Pinhole> {
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

/// Writes the camera file of a torus that is shifted, and where wanted masks and photographs.
fn write_cameras(folder: &Path, shift: DVec3, with_pictures: bool) {
    let mut model = silmap_models::torus(1200);
    model.positions.iter_mut().for_each(|p| *p += shift);
    fs::create_dir_all(folder.join("masks")).unwrap();
    fs::create_dir_all(folder.join("photos")).unwrap();
    let mut views = Vec::new();
    for (name, camera) in VIEWS.iter().zip(cameras(shift)) {
        if with_pictures {
            let mask = silhouette(&model, &camera).unwrap();
            assert!(mask.count() > 3000, "{name} sees the torus");
            let is_inside = |x: u32, y: u32| mask.get(x.into(), y.into());
            GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
                Luma([255 * u8::from(is_inside(x, y))])
            })
            .save(folder.join(format!("masks/{name}.png")))
            .unwrap();
            let colour = |x, y| {
                image::Rgb(if is_inside(x, y) {
                    [200, 120, 40]
                } else {
                    [20; 3]
                })
            };
            RgbImage::from_fn(SIZE.0, SIZE.1, colour)
                .save(folder.join(format!("photos/{name}.png")))
                .unwrap();
        }
        views.push(
            json!({"name": name, "P": camera.to_matrix(), "photo": format!("photos/{name}.png")}),
        );
    }
    let file = json!({"width": SIZE.0, "height": SIZE.1, "pixel_centre": 0.5, "views": views});
    fs::write(folder.join("cameras.json"), file.to_string()).unwrap();
}

/// The capture of this test file's torus.
fn capture() -> &'static Path {
    static MADE: OnceLock<std::path::PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = scratch("captured-cameras");
        write_cameras(&folder, DVec3::ZERO, true);
        folder
    })
}

fn inside(file: &Path) -> GrayImage {
    image::open(file).unwrap().into_luma8()
}

/// Intersection over union of two masks of one size.
fn overlap(one: &GrayImage, other: &GrayImage) -> f64 {
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

fn number(value: &Value, pointer: &str) -> f64 {
    let found = value.pointer(pointer).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{pointer} of {value}"))
}

#[test]
fn contours_lie_over_the_masks_of_their_cameras() {
    let (folder, asset) = (capture(), path(&fixture().asset));
    let mut holes = 0;
    for (name, camera) in VIEWS.iter().zip(cameras(DVec3::ZERO)) {
        let out = folder.join(format!("{name} contour.png"));
        let words = ["contour", asset, "--camera", path(folder), "--view", name];
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
    let words = [
        "contour",
        asset,
        "--camera",
        path(folder),
        "--view",
        "front",
        "--json",
    ];
    let (once, twice) = (
        run_json(&words),
        run_json(&[&words[..], &["--size", "440x320"]].concat()),
    );
    let (a, b) = (
        number(&once, "/loops/0/0/0"),
        number(&twice, "/loops/0/0/0"),
    );
    assert!((2.0 * a - b).abs() < 1e-6, "{a}, {b}");
    assert_eq!(twice["camera"]["width"], json!(440));
}

#[test]
fn exact_outlines_are_those_of_the_masks() {
    let (folder, model) = (capture(), path(&fixture().model));
    for name in VIEWS {
        let out = folder.join(format!("{name} exact.json"));
        let drawing = folder.join(format!("{name} edges.svg"));
        let words = ["edges", model, "--camera", path(folder), "--view", name];
        let ended = run(&[
            &words[..],
            &["--outline", path(&out), "--svg", path(&drawing)],
        ]
        .concat());
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
fn masks_are_what_an_asset_is_measured_against() {
    let (folder, asset) = (capture(), path(&fixture().asset));
    let told = run_json(&["evaluate", asset, "--camera", path(folder), "--json"]);
    check_fields(
        &told,
        &[
            "viewpoints",
            "where",
            "camera",
            "methods.tight.misclassified_mean",
            "methods.hull.overlap_mean",
        ],
    );
    assert_eq!(
        (&told["viewpoints"], &told["where"]),
        (&json!(6), &json!("capture"))
    );
    let rows = told["per_viewpoint"].as_array().unwrap();
    assert_eq!(rows.len(), 6 * told["methods"].as_object().unwrap().len());
    for row in rows.iter().filter(|r| r["method"] == "tight") {
        let (wrong, overlap) = (number(row, "/misclassified"), number(row, "/overlap"));
        assert!(wrong < 0.05 && overlap > 0.95, "{row}");
        // Both are of the same pixels.
        let escaped = number(row, "/escaped");
        let from_shares = (1.0 - escaped) / (1.0 + wrong - escaped);
        assert!((overlap - from_shares).abs() < 1e-9, "{row}");
    }
    let some = [
        "evaluate",
        asset,
        "--camera",
        path(folder),
        "--view",
        "mirr",
        "--view",
        "side.png",
    ];
    let some = run_json(&[&some[..], &["--method", "tight", "--json"]].concat());
    let names: Vec<&Value> = some["per_viewpoint"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| &r["view"])
        .collect();
    assert_eq!(names, [&json!("mirrored"), &json!("side")]);
    let table = run(&[
        "evaluate",
        asset,
        "--camera",
        path(folder),
        "--method",
        "tight",
    ]);
    assert!(
        table.out.contains("6 views of the capture"),
        "{}",
        table.out
    );
    assert!(table.out.contains("cut-off  tight "), "{}", table.out);

    // Masks whose object is black, beside those that say so.
    let black = scratch("captured-cameras-black");
    write_cameras(&black, DVec3::ZERO, true);
    for name in VIEWS {
        let file = black.join(format!("masks/{name}.png"));
        let mut mask = inside(&file);
        mask.pixels_mut().for_each(|p| p.0[0] = 255 - p.0[0]);
        mask.save(&file).unwrap();
    }
    let words = [
        "evaluate",
        asset,
        "--camera",
        path(&black),
        "--mask-inverted",
        "--json",
    ];
    assert_eq!(run_json(&words)["methods"], told["methods"]);

    // Cameras that look 12 pixels aside are far off.
    let aside = scratch("captured-cameras-aside");
    write_cameras(&aside, DVec3::ZERO, true);
    let file = aside.join("cameras.json");
    let mut cameras: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    for view in cameras["views"].as_array_mut().unwrap() {
        for k in 0..4 {
            let moved = number(&view["P"], &format!("/0/{k}"))
                + 12.0 * number(&view["P"], &format!("/2/{k}"));
            view["P"][0][k] = moved.into();
        }
    }
    fs::write(&file, cameras.to_string()).unwrap();
    let off = run_json(&[
        "evaluate",
        asset,
        "--camera",
        path(&file),
        "--method",
        "tight",
        "--json",
    ]);
    let [right, wrong] = [&told, &off].map(|v| number(v, "/methods/tight/misclassified_mean"));
    assert!(wrong > 5.0 * right, "{right}, {wrong}");
}

#[test]
fn photographs_are_shown_behind_and_beside() {
    if is_gpu_skipped() {
        return;
    }
    let (folder, asset) = (capture(), path(&fixture().asset));
    for (place, width) in [("behind", SIZE.0), ("beside", 3 * SIZE.0 + 16)] {
        for name in ["front", "mirrored", "skewed", "cut-off"] {
            let out = folder.join(format!("{name}-{place}.png"));
            let words = ["render", asset, "--camera", path(folder), "--view", name];
            let told = run_json(
                &[
                    &words[..],
                    &["--photograph", place, "-o", path(&out), "--json"],
                ]
                .concat(),
            );
            assert!(number(&told, "/overlap") > 0.94, "{name} {told}");
            assert_eq!(
                (&told["width"], &told["view"]),
                (&json!(width), &json!(name))
            );
            let picture = image::open(&out).unwrap().into_rgb8();
            assert_eq!(picture.dimensions(), (width, SIZE.1));
            // A corner of the photograph, which is behind as it is beside.
            assert_eq!(picture.get_pixel(0, 159).0, [20; 3]);
        }
    }
    // Without a photograph there is nothing to show.
    let bare = scratch("captured-cameras-bare");
    write_cameras(&bare, DVec3::ZERO, false);
    let out = bare.join("no.png");
    let words = [
        "render",
        asset,
        "--camera",
        path(&bare),
        "--view",
        "front",
        "-o",
        path(&out),
    ];
    let ended = run(&[&words[..], &["--photograph", "beside"]].concat());
    check_one_sentence(&ended, "no photograph");
    assert!(
        ended.err.contains("front.png") && !out.exists(),
        "{}",
        ended.err
    );
    // But cameras need neither photographs nor masks.
    assert_eq!(run(&words).code, 0);
    assert_eq!(image::image_dimensions(&out).unwrap(), SIZE);
    let ended = run(&["evaluate", asset, "--camera", path(&bare)]);
    check_one_sentence(&ended, "no masks");
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
    let words = [
        "contour",
        path(&asset),
        "--camera",
        path(&folder),
        "--view",
        "side",
    ];
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
        let words = [
            "align",
            model,
            "--mask",
            path(&mask),
            "--camera",
            path(folder),
            "--view",
            name,
        ];
        let told = run_json(&[&words[..], &["--json"]].concat());
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
    let words = [
        "align",
        model,
        "--mask",
        path(&mask),
        "--start",
        path(&start),
        "--camera",
        path(folder),
        "--view",
        "front",
    ];
    let told = run_json(&[&words[..], &["-o", path(&refined), "--json"]].concat());
    assert!(number(&told, "/moved") > 0.05, "{told}");
    assert!(number(&told, "/captured/moved") < 0.05, "{told}");
    assert!(number(&told, "/distance_px") < 0.5, "{told}");
    let again = [
        "align",
        model,
        "--mask",
        path(&mask),
        "--start",
        path(&refined),
        "--json",
    ];
    let again = run_json(&again);
    assert!(number(&again, "/distance_px") < 0.5, "{again}");
    assert!(number(&again, "/moved") < 0.02, "{again}");
    // Without the intrinsics it is another pose.
    let alone = run_json(&[
        "align",
        model,
        "--mask",
        path(&mask),
        "--start",
        path(&start),
        "--json",
    ]);
    assert!(number(&alone, "/moved") > 0.5, "{alone}");
}

/// Writes a capture whose lens bends straight lines by several pixels.
fn write_bent(folder: &Path) {
    let model = silmap_models::torus(1200);
    fs::create_dir_all(folder.join("masks")).unwrap();
    fs::create_dir_all(folder.join("photos")).unwrap();
    const FINE: u32 = 4;
    let k1 = -0.35;
    let mut frames = Vec::new();
    for (k, camera) in cameras(DVec3::ZERO).iter().take(2).enumerate() {
        let distortion = Distortion {
            numerator: [k1, 0.0, 0.0, 0.0],
            ..Distortion::default()
        };
        let lens = Lens::new(distortion, (camera.focal, 0.0, camera.principal), SIZE).unwrap();
        // What a camera without the lens sees, in small pixels.
        let fine = Pinhole {
            focal: camera.focal * f64::from(FINE),
            principal: camera.principal * f64::from(FINE),
            width: camera.width * FINE,
            height: camera.height * FINE,
            ..*camera
        };
        let straight = silhouette(&model, &fine).unwrap();
        let is_inside = |x: u32, y: u32| {
            let photo = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let image = lens
                .tangent_from_photo(photo)
                .map(|tangent| fine.image(tangent));
            // The corners lie beyond the lens's domain.
            image.is_some_and(|p| straight.get(p.x as i64, p.y as i64))
        };
        GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
            Luma([255 * u8::from(is_inside(x, y))])
        })
        .save(folder.join(format!("masks/bent{k}.png")))
        .unwrap();
        let colour = |x, y| {
            image::Rgb(if is_inside(x, y) {
                [200, 120, 40]
            } else {
                [20; 3]
            })
        };
        RgbImage::from_fn(SIZE.0, SIZE.1, colour)
            .save(folder.join(format!("photos/bent{k}.png")))
            .unwrap();
        let [right, down, forward] = camera.axes;
        let row = |c: usize| json!([right[c], -down[c], -forward[c], camera.eye[c]]);
        frames.push(json!({"file_path": format!("photos/bent{k}.png"),
            "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]}));
    }
    let [front, ..] = &cameras(DVec3::ZERO)[..] else {
        unreachable!()
    };
    let file = json!({"w": SIZE.0, "h": SIZE.1, "fl_x": front.focal.x, "fl_y": front.focal.y,
        "cx": front.principal.x, "cy": front.principal.y, "camera_model": "OPENCV",
        "k1": k1, "k2": 0.0, "p1": 0.0, "p2": 0.0, "frames": frames});
    fs::write(folder.join("transforms.json"), file.to_string()).unwrap();
}

#[test]
fn a_lens_bends_pictures_where_it_is_asked_to() {
    let folder = scratch("captured-cameras-bent");
    write_bent(&folder);
    let asset = path(&fixture().asset);
    let mask = inside(&folder.join("masks/bent1.png"));
    let camera = ["--camera", path(&folder), "--view", "bent1"];
    let contour = |more: &[&str]| {
        let out = folder.join("contour.png");
        let words = ["contour", asset, "--format", "png", "-o", path(&out)];
        let ended = run(&[&words[..], &camera, more].concat());
        assert_eq!(ended.code, 0, "{}", ended.err);
        overlap(&inside(&out), &mask)
    };
    let (bent, straight) = (contour(&["--distorted"]), contour(&[]));
    assert!(bent > 0.95 && straight < bent - 0.02, "{bent}, {straight}");
    let told = run_json(&[
        "evaluate",
        asset,
        "--camera",
        path(&folder),
        "--method",
        "tight",
        "--json",
    ]);
    assert!(number(&told, "/methods/tight/overlap_min") > 0.95, "{told}");
    let mask = folder.join("masks/bent1.png");
    let words = [
        "align",
        path(&fixture().model),
        "--mask",
        path(&mask),
        "--json",
    ];
    let told = run_json(&[&words[..], &camera].concat());
    assert!(number(&told, "/captured/distance_px") < 0.6, "{told}");
    assert!(number(&told, "/captured/moved") < 0.06, "{told}");
    if is_gpu_skipped() {
        return;
    }
    for more in [&["--distorted"][..], &[]] {
        let out = folder.join("beside.png");
        let words = [
            "render",
            asset,
            "--photograph",
            "beside",
            "-o",
            path(&out),
            "--json",
        ];
        let told = run_json(&[&words[..], &camera, more].concat());
        assert!(number(&told, "/overlap") > 0.94, "{more:?}: {told}");
    }
}

#[test]
fn options_that_do_not_go_together_are_usage_errors() {
    let (folder, asset) = (path(capture()), path(&fixture().asset));
    let model = path(&fixture().model);
    let camera = ["--camera", folder, "--view", "front"];
    for (words, more) in [
        (vec!["contour", asset, "--camera", folder], "--view"),
        (
            vec!["contour", asset, "--view", "front", "--eye", "0,0,5"],
            "--camera",
        ),
        (vec!["contour", asset], "--eye"),
        (
            [&["edges", model, "--eye", "0,0,5"][..], &camera].concat(),
            "--camera",
        ),
        (
            [&["edges", model, "--walk", "5"][..], &camera].concat(),
            "--walk",
        ),
        (
            [&["contour", asset, "--eye", "0,0,5"][..], &camera].concat(),
            "--camera",
        ),
        (
            [&["contour", asset, "--fov", "30"][..], &camera].concat(),
            "--fov",
        ),
        (
            [&["contour", asset, "--target", "0,0,1"][..], &camera].concat(),
            "--target",
        ),
        (
            [&["contour", asset, "--up", "0,0,1"][..], &camera].concat(),
            "--up",
        ),
        (
            [
                &["render", asset, "-o", "no.png", "--up", "0,0,1"][..],
                &camera,
            ]
            .concat(),
            "--up",
        ),
        (
            vec![
                "render",
                asset,
                "-o",
                "no.png",
                "--eye",
                "0,0,5",
                "--photograph",
                "behind",
            ],
            "--camera",
        ),
        (
            vec!["contour", asset, "--eye", "0,0,5", "--distorted"],
            "--camera",
        ),
        (vec!["evaluate", asset], "--model"),
        (
            vec!["evaluate", asset, "--model", model, "--camera", folder],
            "--camera",
        ),
        (
            vec!["evaluate", asset, "--model", model, "--view", "front"],
            "--camera",
        ),
        (
            vec!["evaluate", asset, "--camera", folder, "--viewpoints", "3"],
            "--viewpoints",
        ),
        (vec!["align", model, "--mask", "no.png"], "--start"),
    ] {
        let ended = run(&words);
        assert_eq!(ended.code, 2, "{words:?}: {}", ended.err);
        assert!(ended.err.contains(more), "{words:?}: {}", ended.err);
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

/// On photographs: an asset of the carved hull is as near to each mask as the hull, but for what interpolation adds.
#[test]
fn real_photographs_lie_under_their_renders() {
    let Some(capture) = common::outside::shared("captures/squirrel") else {
        return;
    };
    let folder = scratch("captured-cameras-squirrel");
    let asset = folder.join("squirrel.glb");
    let mut words = vec![
        "build",
        path(&capture),
        "-o",
        path(&asset),
        "--json",
        "--no-photographs",
    ];
    words.extend(["--voxels", "96", "--backend", "cpu"]);
    words.extend([
        "--views",
        "200",
        "--keep",
        "80",
        "--resolution",
        "256",
        "--faces",
        "200",
    ]);
    words.extend(["--texture-views", "4", "--texture-size", "32"]);
    let built = run_json(&words);
    let told = run_json(&[
        "evaluate",
        path(&asset),
        "--camera",
        path(&capture),
        "--method",
        "tight",
        "--json",
    ]);
    let masks = built["masks"].as_array().unwrap();
    let views = told["per_viewpoint"].as_array().unwrap();
    assert_eq!((masks.len(), views.len()), (36, 36));
    for (mask, view) in masks.iter().zip(views) {
        assert_eq!(mask["name"], view["view"]);
        let (hull, asset) = (number(mask, "/overlap"), number(view, "/overlap"));
        assert!(
            asset > hull - 0.01,
            "{}: {asset} beside {hull}",
            mask["name"]
        );
    }
    if is_gpu_skipped() {
        return;
    }
    let out = folder.join("image_9.png");
    let words = [
        "render",
        path(&asset),
        "--camera",
        path(&capture),
        "--view",
        "image_9.jpg",
    ];
    let told = run_json(
        &[
            &words[..],
            &[
                "--photograph",
                "beside",
                "--size",
                "320x240",
                "-o",
                path(&out),
                "--json",
            ],
        ]
        .concat(),
    );
    assert!(
        number(&told, "/overlap") > number(&masks[9], "/overlap") - 0.01,
        "{told}"
    );
    assert_eq!(image::image_dimensions(&out).unwrap(), (3 * 320 + 16, 240));
}
