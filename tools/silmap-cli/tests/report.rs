//! `silmap report` on a small torus: the page and the numbers, and that there is all of it or nothing.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use common::{Ended, check_one_sentence, fixture, is_gpu_skipped, run, run_json, scratch};
use image::AnimationDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::LoopCount;
use serde_json::Value;

/// Options that make it quick.
const QUICK: [&str; 6] = [
    "--viewpoints",
    "6",
    "--directions",
    "40",
    "--resolution",
    "96",
];

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The arguments of a quick report on an asset.
fn arguments<'a>(asset: &'a Path, model: &'a Path, out: &'a Path) -> Vec<&'a str> {
    let mut arguments = vec![
        "report",
        text(asset),
        "--model",
        text(model),
        "-o",
        text(out),
    ];
    arguments.extend(QUICK);
    arguments
}

fn report(asset: &Path, model: &Path, out: &Path) -> Ended {
    run(&arguments(asset, model, out))
}

fn number(object: &Value, pointer: &str) -> f64 {
    object
        .pointer(pointer)
        .and_then(Value::as_f64)
        .unwrap_or_else(|| panic!("{pointer} is no number"))
}

#[test]
fn page_and_numbers_say_what_scripts_read() {
    let (made, folder) = (fixture(), scratch("report"));
    let out = folder.join("new");
    let mut with_json = arguments(&made.asset, &made.model, &out);
    with_json.push("--json");
    let printed = run_json(&with_json);
    assert!(printed["report"].as_str().unwrap().ends_with("report.html"));
    assert!(
        printed["numbers"]
            .as_str()
            .unwrap()
            .ends_with("report.json")
    );
    let mut names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["report.html", "report.json"]);
    assert_eq!(
        fs::read_dir(&folder).unwrap().count(),
        1,
        "something was left beside it"
    );

    let json = fs::read_to_string(out.join("report.json")).unwrap();
    let numbers: Value = serde_json::from_str(&json).unwrap();
    for place in ["polytope", "sphere", "shell"] {
        assert_eq!(numbers["places"][place]["viewpoints"], 6, "{place}");
        for method in ["paper", "hull", "tight"] {
            let of = |name: &str| {
                number(
                    &numbers,
                    &format!("/places/{place}/methods/{method}/{name}"),
                )
            };
            let (mean, median, max) = (
                of("misclassified_mean"),
                of("misclassified_median"),
                of("misclassified_max"),
            );
            assert!(
                mean > 0.0 && mean <= max && median <= max && max < 1.0,
                "{place}, {method}"
            );
            assert!(of("escaped_mean") <= of("escaped_max") && of("escaped_max") <= max);
            assert!(of("deviation_px/largest_median") <= of("deviation_px/largest"));
        }
    }
    for method in ["paper", "hull", "tight"] {
        assert!(number(&numbers, &format!("/seconds/contour/{method}/median")) > 0.0);
    }
    assert_eq!(
        numbers["bytes"]["whole file"],
        fs::metadata(&made.asset).unwrap().len()
    );
    assert_eq!(numbers["views"].as_array().unwrap().len(), 20);
    assert!(numbers["curve"]["kept"].as_array().unwrap().len() > 1);
    // The asset does not hold this one.
    let even = numbers["curve"]["uniform"].as_array().unwrap();
    assert_eq!((even.len(), &even[0][0]), (1, &16.into()), "{even:?}");
    assert_eq!(
        numbers["directions"][0]["samples"]
            .as_array()
            .unwrap()
            .len(),
        40
    );
    assert!(
        !numbers["conditions"]["machine"]
            .as_str()
            .unwrap()
            .is_empty()
    );

    let html = fs::read_to_string(out.join("report.html")).unwrap();
    for part in [
        "Errors of the outline",
        "Views and error",
        "Error by direction",
        "Worst viewpoints",
        "How far the outline strays",
        "Where outlines stray farthest",
        "The polytope of views",
        "64 views captured",
        "20 views kept",
        "A contour in space",
        "A pair of views",
        "Sizes",
        "Times",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
    assert!(
        !html.contains("http:") && !html.contains("https:"),
        "the page needs the network"
    );
}

#[test]
fn extraction_is_compared_on_request() {
    let (made, folder) = (fixture(), scratch("comparison"));
    let out = folder.join("new");
    let mut with_comparison = arguments(&made.asset, &made.model, &out);
    with_comparison.push("--comparison");
    let ended = run(&with_comparison);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let json = fs::read_to_string(out.join("report.json")).unwrap();
    let numbers: Value = serde_json::from_str(&json).unwrap();
    let levels = numbers["comparison"]["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 2, "500 faces, and the model");
    for level in levels {
        let methods = level["methods"].as_object().unwrap();
        assert_eq!(methods.len(), silmap_exact::ExtractionMethod::ALL.len());
        for viewpoints in ["walk", "scattered"] {
            let found: Vec<f64> = (methods.values())
                .map(|m| m[viewpoints]["silhouette_edges"].as_f64().unwrap())
                .collect();
            assert!(
                found[0] > 10.0 && found.iter().all(|&n| n == found[0]),
                "{viewpoints}: {found:?}"
            );
            let seconds = |m: &Value| m[viewpoints]["seconds_median"].as_f64().unwrap();
            assert!(methods.values().all(|m| seconds(m) > 0.0));
        }
        // One walk is like the other: brute force takes the same, what goes on from the viewpoint before does not test the same.
        let tested = |viewpoints: &str| {
            level["methods"]["dual"][viewpoints]["tested_edges"]
                .as_f64()
                .unwrap()
        };
        assert!(tested("walk") < 0.5 * tested("scattered"));
    }
    let error = |method: &str| {
        number(
            &numbers,
            &format!("/comparison/contours/{method}/outline_error"),
        )
    };
    assert!(error("tight") > 0.0 && error("tight") < error("paper").max(error("hull")));
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(html.contains("Exact extraction beside interpolation"));
    assert!(!html.contains("http:") && !html.contains("https:"));
    if is_gpu_skipped() {
        return;
    }
    let full = numbers["comparison"]["frames"]["full"].as_array().unwrap();
    let faces: Vec<u64> = full.iter().map(|f| f[0].as_u64().unwrap()).collect();
    assert_eq!(faces, [500, 1_200, 4_800], "both levels and a finer mesh");
    for level in levels {
        for method in level["methods"].as_object().unwrap().values() {
            assert!(method["frame_seconds"].as_f64().unwrap() > 0.0);
        }
    }
    assert!(html.contains("As frames"));
}

/// The bytes of the pictures of a kind that a page has in itself.
fn embedded(html: &str, start: &str) -> Vec<u8> {
    let (_, address) = html.split_once(start).unwrap();
    let (base64, _) = address.split_once('"').unwrap();
    STANDARD.decode(base64).unwrap()
}

/// A turn of the model beside the asset; it stands still for readers who asked for that. Only pictures: the numbers know nothing of it.
#[test]
fn the_model_and_the_asset_turn() {
    if is_gpu_skipped() {
        return;
    }
    let (made, folder) = (fixture(), scratch("report-turn"));
    let ended = report(&made.asset, &made.model, &folder);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    let moving = embedded(&html, "src=\"data:image/webp;base64,");
    let still = embedded(
        &html,
        "media=\"(prefers-reduced-motion: reduce)\" srcset=\"data:image/webp;base64,",
    );
    assert!(moving.len() < 300_000, "{} bytes", moving.len());
    let frames = |bytes: Vec<u8>| {
        let decoder = WebPDecoder::new(Cursor::new(bytes)).unwrap();
        assert!(matches!(decoder.loop_count(), LoopCount::Infinite));
        decoder.into_frames().collect_frames().unwrap()
    };
    let (moving, still) = (frames(moving), frames(still));
    assert_eq!((moving.len(), still.len()), (36, 1));
    assert!(moving[0].buffer() == still[0].buffer());
    // Both halves show something, on white, that is alike and changes.
    let half = |frame: usize, left: u32| {
        let image = moving[frame].buffer();
        assert_eq!(image.dimensions(), (192 + 8 + 192, 192));
        image::imageops::crop_imm(image, left, 0, 192, 192).to_image()
    };
    let dark = |image: &image::RgbaImage| -> Vec<bool> {
        image
            .pixels()
            .map(|p| p.0.iter().any(|&c| c < 200))
            .collect()
    };
    let differing = |one: &[bool], other: &[bool]| {
        let differing = one.iter().zip(other).filter(|(a, b)| a != b).count();
        differing as f64 / one.iter().filter(|&&a| a).count() as f64
    };
    for k in [0, 9, 20] {
        let [model, clipped] = [0, 200].map(|left| dark(&half(k, left)));
        let later = dark(&half((k + 9) % 36, 0));
        let (alike, moved) = (differing(&model, &clipped), differing(&model, &later));
        assert!(alike < 0.1 && moved > 2.0 * alike, "{k}: {alike}, {moved}");
    }
    let json = fs::read_to_string(folder.join("report.json")).unwrap();
    assert!(!json.contains("turn") && !json.contains("frame"), "{json}");
}

/// Frames of many instances: each scene has a table, a plot and a sentence on what to take; the numbers are those of `bench`.
#[test]
fn scenes_are_drawn_as_the_benchmark_draws_them() {
    let (made, folder) = (fixture(), scratch("report-scenes"));
    let mut with_scene = arguments(&made.asset, &made.model, &folder);
    with_scene.extend(["--scene", "many"]);
    let ended = run(&with_scene);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("a scene is NxPX"), "{}", ended.err);
    if is_gpu_skipped() {
        return;
    }
    *with_scene.last_mut().unwrap() = "3x80";
    let ended = run(&with_scene);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let json = fs::read_to_string(folder.join("report.json")).unwrap();
    let numbers: Value = serde_json::from_str(&json).unwrap();
    let [scene] = numbers["scenes"].as_array().unwrap().as_slice() else {
        panic!("one scene");
    };
    assert_eq!(
        (number(scene, "/instances"), number(scene, "/pixels")),
        (3.0, 80.0)
    );
    let names: Vec<&str> = (scene["rows"].as_array().unwrap().iter())
        .map(|row| row["name"].as_str().unwrap())
        .collect();
    let wanted =
        "full lod-500 lod-5000 lod-equal-error hull clipped-stencil clipped-coverage each-a-pass";
    assert_eq!(names.join(" "), wanted);
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    for part in [
        "Frames of many instances",
        "3 of 80 pixels",
        "Time of a frame over outline error",
        "In this scene ",
    ] {
        assert!(html.contains(part), "{part}");
    }
}

#[test]
fn errors_are_those_that_evaluate_measures() {
    let (made, folder) = (fixture(), scratch("report-as-evaluate"));
    let ended = report(&made.asset, &made.model, &folder);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let json = fs::read_to_string(folder.join("report.json")).unwrap();
    let numbers: Value = serde_json::from_str(&json).unwrap();
    let (asset, model) = (text(&made.asset), text(&made.model));
    let mut arguments = vec![
        "evaluate",
        asset,
        "--model",
        model,
        "--json",
        "--viewpoints",
        "6",
    ];
    arguments.extend(["--resolution", "96"]);
    let evaluated = run_json(&arguments);
    let worst = number(&evaluated, "/methods/tight/misclassified_max");
    for name in ["misclassified_mean", "misclassified_max", "escaped_mean"] {
        assert_eq!(
            numbers["places"]["polytope"]["methods"]["tight"][name],
            evaluated["methods"]["tight"][name],
            "{name}"
        );
    }
    let shown = numbers["worst"].as_array().unwrap();
    assert_eq!(shown.len(), 4 + 2, "four of tight, one of each other");
    assert!((number(&shown[0], "/misclassified") - worst).abs() < 1e-12);
}

#[test]
fn the_errors_of_another_model_are_large() {
    let (made, folder) = (fixture(), scratch("report-another"));
    let other = folder.join("knot.ply");
    let knot = run(&[
        "generate",
        "trefoil-knot",
        "--faces",
        "800",
        "-o",
        text(&other),
    ]);
    assert_eq!(knot.code, 0, "{}", knot.err);
    // The knot must fit the torus's bounding sphere to be drawn at all; where it does not, that is said and nothing is left.
    let out = folder.join("out");
    let ended = report(&made.asset, &other, &out);
    assert!(ended.err.contains("this is not the mesh"), "{}", ended.err);
    if ended.code == 0 {
        let json = fs::read_to_string(out.join("report.json")).unwrap();
        let numbers: Value = serde_json::from_str(&json).unwrap();
        let mean = number(
            &numbers,
            "/places/polytope/methods/tight/misclassified_mean",
        );
        assert!(mean > 0.2, "{mean}");
    } else {
        check_one_sentence(&ended, "another model");
        assert!(!out.exists());
    }
}

#[test]
fn bad_input_leaves_nothing() {
    let (made, folder) = (fixture(), scratch("report-bad"));
    let out = folder.join("out");
    let open = folder.join("open.obj");
    fs::write(&open, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let file = folder.join("file");
    fs::write(&file, "a file, not a folder").unwrap();
    let missing = folder.join("missing");
    for (what, ended) in [
        ("no asset", report(&missing, &made.model, &out)),
        (
            "a mesh for an asset",
            report(&made.model, &made.model, &out),
        ),
        ("no model", report(&made.asset, &missing, &out)),
        ("an open model", report(&made.asset, &open, &out)),
        (
            "a file for the folder",
            report(&made.asset, &made.model, &file),
        ),
        (
            "below a file",
            report(&made.asset, &made.model, &file.join("out")),
        ),
        (
            "below nothing",
            report(&made.asset, &made.model, &missing.join("out")),
        ),
    ] {
        check_one_sentence(&ended, what);
        assert_eq!(ended.out, "", "{what}");
    }
    assert_eq!(
        fs::read_dir(&folder).unwrap().count(),
        2,
        "something was left"
    );
    let asset = text(&made.asset);
    for wrong in [
        vec!["report", asset, "-o", "x"],
        vec!["report", asset, "--model", "m.ply"],
        vec![
            "report",
            asset,
            "--model",
            "m.ply",
            "-o",
            "x",
            "--viewpoints",
            "0",
        ],
        vec![
            "report",
            asset,
            "--model",
            "m.ply",
            "-o",
            "x",
            "--directions",
            "1",
        ],
    ] {
        let ended = run(&wrong);
        assert_eq!(ended.code, 2, "{wrong:?}: {}", ended.err);
    }
}

#[test]
fn a_folder_that_is_there_keeps_its_other_files() {
    let (made, folder) = (fixture(), scratch("report-again"));
    fs::write(folder.join("mine.txt"), "mine").unwrap();
    fs::write(folder.join("report.html"), "an old one").unwrap();
    let ended = report(&made.asset, &made.model, &folder);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert_eq!(fs::read(folder.join("mine.txt")).unwrap(), b"mine");
    assert!(
        fs::read_to_string(folder.join("report.html"))
            .unwrap()
            .starts_with("<!DOCTYPE html>")
    );
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 3);
}
