//! Models far from the origin, and cavities: what is made of them is what is made at the origin, or without them.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{
    SMALL_BUILD, check_one_sentence, fixture, is_gpu_skipped, path, run, run_json, scratch,
};
use glam::DVec2;
use serde_json::{Value, json};
use silmap_geometry::Mask;
use silmap_geometry::polygon::fill_even_odd;
use silmap_mesh_io::{self as mesh_io, LoadOptions};

/// Where map projections put things.
const FAR: [f64; 3] = [500_000.0, 5_400_000.0, 200.0];

/// A torus of radius 13 whose coordinates are multiples of 2⁻²⁰, which far away are held as well; moved.
fn torus(file: &Path, shift: [f64; 3]) {
    const GRID: f64 = (1 << 20) as f64;
    let (around, across) = (48, 24);
    let mut text = String::new();
    for i in 0..around {
        for j in 0..across {
            let turn = |k: i32, n: i32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
            let (a, b) = (turn(i, around), turn(j, across));
            let radius = 10.0 + 3.0 * b.cos();
            let point = [radius * a.cos(), radius * a.sin(), 3.0 * b.sin()];
            let [x, y, z] = [0, 1, 2].map(|k| (point[k] * GRID).round() / GRID + shift[k]);
            text.push_str(&format!("v {x} {y} {z}\n"));
        }
    }
    for i in 0..around {
        for j in 0..across {
            let v = |i: i32, j: i32| i % around * across + j % across + 1;
            let (i1, j1) = (i + 1, j + 1);
            text.push_str(&format!(
                "f {} {} {} {}\n",
                v(i, j),
                v(i1, j),
                v(i1, j1),
                v(i, j1)
            ));
        }
    }
    fs::write(file, text).unwrap();
}

fn eye_at(shift: [f64; 3]) -> String {
    let [x, y, z] = [0, 1, 2].map(|k| shift[k] + [16.0, -22.0, 27.0][k]);
    format!("--eye={x},{y},{z}")
}

/// The JSON of a `.glb`, and what is behind it.
fn split(bytes: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    (json, bytes[20 + length..].to_vec())
}

/// Two toruses, at the origin and far away, and the assets built of them.
fn two(name: &str) -> [(PathBuf, PathBuf, [f64; 3], Value); 2] {
    let folder = scratch(name);
    [("here", [0.0; 3]), ("far", FAR)].map(|(where_to, shift)| {
        let model = folder.join(where_to).join("torus.obj");
        fs::create_dir_all(model.parent().unwrap()).unwrap();
        torus(&model, shift);
        let asset = model.with_extension("glb");
        let mut arguments = vec!["build", path(&model), "-o", path(&asset), "--json"];
        arguments.extend(SMALL_BUILD);
        let built = run_json(&arguments);
        (model, asset, shift, built)
    })
}

#[test]
fn an_asset_far_away_is_the_one_at_the_origin_moved() {
    let [
        (near_model, near, _, built_near),
        (far_model, far, _, built_far),
    ] = two("far-asset");
    assert_eq!(built_near["volume_ratio"], built_far["volume_ratio"]);
    assert_eq!(built_near["error"], built_far["error"]);
    let ((near_json, near_bytes), (mut far_json, far_bytes)) = (
        split(&fs::read(&near).unwrap()),
        split(&fs::read(&far).unwrap()),
    );
    assert_eq!(near_bytes, far_bytes);
    assert_eq!(far_json["nodes"][0]["translation"], json!(FAR));
    assert!(near_json["nodes"][0].get("translation").is_none());
    // Nothing else differs in the document but the place in the record, and the checksums.
    far_json["nodes"][0]
        .as_object_mut()
        .unwrap()
        .remove("translation");
    let name = "SILMAP_silhouette_map";
    assert_eq!(far_json["extensions"][name]["model"]["origin"], json!(FAR));
    far_json["extensions"][name]["model"]
        .as_object_mut()
        .unwrap()
        .remove("origin");
    far_json["extensions"][name]["checksum"] = near_json["extensions"][name]["checksum"].clone();
    assert_eq!(near_json, far_json);

    // The same errors, at viewpoints reported in each model's own coordinates.
    let evaluated = [(&near_model, &near), (&far_model, &far)].map(|(model, asset)| {
        run_json(&[
            "evaluate",
            path(asset),
            "--model",
            path(model),
            "--viewpoints",
            "3",
            "--json",
        ])
    });
    assert_eq!(evaluated[0]["methods"], evaluated[1]["methods"]);
    let eyes = evaluated
        .each_ref()
        .map(|e| e["per_viewpoint"][0]["eye"].clone());
    for (k, shift) in FAR.into_iter().enumerate() {
        let [near, far] = eyes.each_ref().map(|eye| eye[k].as_f64().unwrap());
        assert!((far - near - shift).abs() < 1e-8, "{near} {far}");
    }
    // A mesh of another place is another mesh.
    let other = run(&[
        "evaluate",
        path(&far),
        "--model",
        path(&near_model),
        "--viewpoints",
        "1",
        "--json",
    ]);
    assert!(other.err.contains("not the mesh"), "{}", other.err);
    let center = &run_json(&["inspect", path(&far), "--json"])["model"]["center"];
    for (k, shift) in FAR.into_iter().enumerate() {
        assert!(
            (center[k].as_f64().unwrap() - shift).abs() < 0.1,
            "{center}"
        );
    }
}

#[test]
fn outlines_and_poses_far_away_are_those_at_the_origin() {
    let pair = two("far-outlines");
    let seen = pair.each_ref().map(|(model, asset, shift, _)| {
        let eye = eye_at(*shift);
        let contour = run_json(&["contour", path(asset), &eye, "--json"]);
        let outline = model.with_extension("json");
        let edges = run_json(&[
            "edges",
            path(model),
            &eye,
            "--list",
            "--repeat",
            "1",
            "--outline",
            path(&outline),
            "--json",
        ]);
        let exact: Value = serde_json::from_slice(&fs::read(&outline).unwrap()).unwrap();
        // The camera is reported in the model's own coordinates.
        for camera in [&contour["camera"], &exact["camera"]] {
            let told = camera["eye"].as_array().unwrap().iter();
            let told: Vec<String> = told.map(|x| x.as_f64().unwrap().to_string()).collect();
            assert_eq!(format!("--eye={}", told.join(",")), eye);
        }
        let simple = model.with_extension("simple.obj");
        let simplified = run_json(&[
            "simplify",
            path(model),
            "--faces",
            "400",
            &eye,
            "-o",
            path(&simple),
            "--json",
        ]);
        (
            contour["loops"].clone(),
            exact["loops"].clone(),
            edges["edges"].clone(),
            simplified["error"].clone(),
        )
    });
    assert!(!seen[0].0.as_array().unwrap().is_empty());
    assert_eq!(seen[0], seen[1]);
    // The camera printed is one to start from again, and the pose found is reported in the model's own coordinates.
    let poses = pair.each_ref().map(|(model, _, shift, _)| {
        let outline = model.with_extension("json");
        let mask = model.with_extension("png");
        draw_mask(&outline, &mask);
        let pose = run_json(&[
            "align",
            path(model),
            "--mask",
            path(&mask),
            "--start",
            path(&outline),
            "--json",
        ]);
        assert!(pose["distance_px"].as_f64().unwrap() < 0.5, "{pose}");
        [0, 1, 2].map(|k| pose["camera"]["eye"][k].as_f64().unwrap() - shift[k])
    });
    for (near, far) in poses[0].iter().zip(poses[1]) {
        assert!((near - far).abs() < 0.01, "{poses:?}");
    }
}

/// Fills the loops of `edges --outline` at a quarter of their size.
fn draw_mask(outline: &Path, mask: &Path) {
    const SIDE: u32 = 256;
    let outline: Value = serde_json::from_slice(&fs::read(outline).unwrap()).unwrap();
    let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(outline["loops"].clone()).unwrap();
    let scale = f64::from(SIDE) / outline["camera"]["width"].as_f64().unwrap();
    let loops: Vec<Vec<DVec2>> = (loops.iter())
        .map(|points| points.iter().map(|&p| DVec2::from(p) * scale).collect())
        .collect();
    let mut filled = Mask::new(SIDE, SIDE);
    fill_even_odd(&loops, &mut filled);
    let pixel = |x, y| image::Luma([if filled.get(x, y) { 255_u8 } else { 0 }]);
    image::GrayImage::from_fn(SIDE, SIDE, |x, y| pixel(x.into(), y.into()))
        .save(mask)
        .unwrap();
}

#[test]
fn hulls_far_away_are_written_with_all_digits() {
    let folder = scratch("far-hulls");
    let models = [("here", [0.0; 3]), ("far", FAR)].map(|(name, shift)| {
        let model = folder.join(format!("{name}.obj"));
        torus(&model, shift);
        (model, shift)
    });
    let load = |file: &Path| mesh_io::load(file, &LoadOptions::default()).unwrap().mesh;
    for extension in ["obj", "ply", "off", "glb"] {
        let hulls = models.each_ref().map(|(model, shift)| {
            let out = model.with_extension(format!("hull.{extension}"));
            let hull = run_json(&[
                "hull",
                path(model),
                "--faces",
                "120",
                "--verify",
                "-o",
                path(&out),
                "--json",
            ]);
            assert_eq!(hull["verified"], true, "{extension}: {hull}");
            let written = load(&out);
            assert_eq!(written.origin().to_array(), *shift, "{extension}");
            (hull["volume_ratio"].clone(), written.into_mesh())
        });
        // Both are in coordinates about the same point of the body.
        assert_eq!(hulls[0], hulls[1], "{extension}");
    }
    let (model, _) = &models[1];
    let stl = folder.join("far.stl");
    let rounded = run(&["hull", path(model), "--faces", "120", "-o", path(&stl)]);
    assert_eq!(rounded.code, 0, "{}", rounded.err);
    assert!(rounded.err.contains("single precision"), "{}", rounded.err);
    let doubted = run(&["hull", path(model), "--verify", "-o", path(&stl)]);
    assert!(doubted.err.contains("not verified"), "{}", doubted.err);
    // A saved sequence knows where it is.
    let [sequence, fresh, again] = ["all.hulls", "fresh.obj", "again.obj"].map(|n| folder.join(n));
    let made = run(&[
        "hull",
        path(model),
        "--faces",
        "90",
        "--sequence",
        path(&sequence),
        "-o",
        path(&fresh),
    ]);
    assert_eq!(made.code, 0, "{}", made.err);
    let taken = run(&["hull", path(&sequence), "--faces", "90", "-o", path(&again)]);
    assert_eq!(taken.code, 0, "{}", taken.err);
    assert_eq!(fs::read(&fresh).unwrap(), fs::read(&again).unwrap());
}

#[test]
fn what_has_too_few_digits_is_refused_in_a_sentence() {
    let folder = scratch("too-far");
    let model = folder.join("torus.obj");
    torus(&model, [0.0, 1e15, 0.0]);
    let out = folder.join("out.glb");
    let refused = run(&["build", path(&model), "-o", path(&out)]);
    check_one_sentence(&refused, "at 1e15");
    assert!(refused.err.contains("from the origin"), "{}", refused.err);
    assert!(!out.exists());
    torus(&model, [0.0, 1e9, 0.0]);
    let hull = run_json(&[
        "hull",
        path(&model),
        "--faces",
        "120",
        "--verify",
        "-o",
        path(&folder.join("h.obj")),
        "--json",
    ]);
    assert_eq!(hull["verified"], true, "{hull}");
}

#[test]
fn pictures_far_away_are_those_at_the_origin() {
    if is_gpu_skipped() {
        return;
    }
    let pair = two("far-pictures");
    for mode in ["clipped", "original", "exact", "textured"] {
        let pictures = pair.each_ref().map(|(model, asset, shift, _)| {
            let out = model.with_extension(format!("{mode}.png"));
            let eye = eye_at(*shift);
            let drawn = run(&[
                "render",
                path(asset),
                "--model",
                path(model),
                &eye,
                "--mode",
                mode,
                "--size",
                "96x96",
                "-o",
                path(&out),
            ]);
            assert_eq!(drawn.code, 0, "{}", drawn.err);
            fs::read(out).unwrap()
        });
        assert_eq!(pictures[0], pictures[1], "{mode}");
    }
    let errors = pair.each_ref().map(|(model, asset, _, _)| {
        run_json(&[
            "evaluate",
            path(asset),
            "--model",
            path(model),
            "--viewpoints",
            "1",
            "--textures",
            "2",
            "--resolution",
            "96",
            "--json",
        ])["textures"]
            .clone()
    });
    assert_eq!(errors[0], errors[1]);
}

/// Adds a sphere about the origin, whose faces look inward where asked for.
fn ball(text: &mut String, radius: f64, is_inward: bool) {
    const SEGMENTS: usize = 32;
    let first = text.lines().filter(|line| line.starts_with("v ")).count() + 1;
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut next = first;
    for row in 0..=SEGMENTS / 2 {
        let tilt = std::f64::consts::TAU * row as f64 / SEGMENTS as f64;
        let is_pole = row == 0 || row == SEGMENTS / 2;
        let mut vertices = Vec::new();
        for k in 0..if is_pole { 1 } else { SEGMENTS } {
            let turn = std::f64::consts::TAU * k as f64 / SEGMENTS as f64;
            let across = if is_pole { 0.0 } else { tilt.sin() };
            let point = [across * turn.cos(), across * turn.sin(), tilt.cos()];
            let [x, y, z] = point.map(|c| c * radius);
            text.push_str(&format!("v {x} {y} {z}\n"));
            vertices.push(next);
            next += 1;
        }
        rows.push(vertices);
    }
    for pair in rows.windows(2) {
        for k in 0..SEGMENTS {
            let at = |row: &[usize], k: usize| row[k % row.len()];
            let mut face = vec![
                at(&pair[0], k),
                at(&pair[1], k),
                at(&pair[1], k + 1),
                at(&pair[0], k + 1),
            ];
            face.dedup();
            if face.first() == face.last() {
                face.pop();
            }
            if is_inward {
                face.reverse();
            }
            let face: Vec<String> = face.iter().map(usize::to_string).collect();
            text.push_str(&format!("f {}\n", face.join(" ")));
        }
    }
}

#[test]
fn cavities_cost_nothing_unless_they_are_kept() {
    let folder = scratch("cavities");
    let [solid_model, hollow, asset, out] =
        ["solid.obj", "hollow.obj", "hollow.glb", "hull.obj"].map(|name| folder.join(name));
    let mut text = String::new();
    ball(&mut text, 1.0, false);
    fs::write(&solid_model, &text).unwrap();
    ball(&mut text, 0.5, true);
    fs::write(&hollow, &text).unwrap();
    let hull = |model: &Path, options: &[&str]| {
        let mut arguments = vec![
            "hull",
            path(model),
            "--faces",
            "120",
            "-o",
            path(&out),
            "--verify",
        ];
        arguments.extend(options);
        let ended = run(&[&arguments[..], &["--json"]].concat());
        assert_eq!(ended.code, 0, "{}", ended.err);
        let json: Value = serde_json::from_str(&ended.out).unwrap();
        (json, ended.err, fs::read(&out).unwrap())
    };
    let (solid, silent, written) = hull(&solid_model, &[]);
    let (seen, warned, seen_written) = hull(&hollow, &[]);
    assert!(silent.is_empty(), "{silent}");
    assert!(warned.contains("1 cavity wall (960 faces)"), "{warned}");
    assert_eq!(written, seen_written);
    assert_eq!(solid["volume_ratio"], seen["volume_ratio"]);
    assert_eq!(solid["verified"], true);
    let (kept, silent, _) = hull(&hollow, &["--keep-cavities"]);
    assert!(silent.is_empty(), "{silent}");
    // The cavity's volume is not the model's then, and its wall takes faces.
    let volume = |hull: &Value| hull["original_volume"].as_f64().unwrap();
    assert!(
        (volume(&kept) / volume(&solid) - 0.875).abs() < 1e-6,
        "{kept}"
    );

    let mut arguments = vec!["build", path(&hollow), "-o", path(&asset), "--json"];
    arguments.extend(SMALL_BUILD);
    let built = run_json(&arguments);
    assert!(
        built["warnings"][0]
            .as_str()
            .unwrap()
            .contains("cavity wall"),
        "{built}"
    );
    // The asset is that of the file as it is: it is accepted without a warning, and outlines agree.
    let evaluated = run(&[
        "evaluate",
        path(&asset),
        "--model",
        path(&hollow),
        "--viewpoints",
        "3",
        "--json",
    ]);
    assert_eq!(evaluated.err, "");
    let evaluated: Value = serde_json::from_str(&evaluated.out).unwrap();
    let wrong = evaluated["methods"]["tight"]["misclassified_mean"].as_f64();
    assert!(wrong.unwrap() < 0.05, "{evaluated}");
}

#[test]
fn an_asset_near_the_origin_says_nothing_of_its_place() {
    let (json, _) = split(&fs::read(&fixture().asset).unwrap());
    assert!(json["nodes"][0].get("translation").is_none(), "{json}");
    let extension = &json["extensions"]["SILMAP_silhouette_map"];
    assert!(extension["model"].get("origin").is_none(), "{extension}");
}
