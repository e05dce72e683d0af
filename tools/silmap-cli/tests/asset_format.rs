//! The format of an asset as docs/asset-format.md has it: a reader written from that page alone reads what silmap reads.
//!
//! The reader is `tests/asset-format/read_asset.py`; it needs Python and nothing else. The page's schema is checked by
//! `tests/gltf-validator/schema.js`, which `tools/test` runs.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{Ended, SMALL_BUILD, fixture, outside, path, run, run_json, scratch};
use glam::DVec2;
use serde_json::Value;
use silmap_geometry::Mask;
use silmap_geometry::polygon::fill_non_zero;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Runs the reader; `None`, said aloud, where there is no Python.
fn read(arguments: &[&str]) -> Option<Ended> {
    if Command::new("python3").arg("--version").output().is_err() {
        outside::skip("assets read by their format alone: python3 is not here");
        return None;
    }
    let mut reader = Command::new("python3");
    reader.arg(root().join("tests/asset-format/read_asset.py"));
    Some(Ended::of(reader.args(arguments)))
}

fn read_json(arguments: &[&str]) -> Option<Value> {
    let ended = read(arguments)?;
    assert_eq!(ended.code, 0, "{arguments:?}: {}", ended.err);
    Some(serde_json::from_str(&ended.out).unwrap())
}

/// Asserts that all that is in `ours` is in `theirs`.
fn check_same(ours: &Value, theirs: &Value, at: &str) {
    match (ours, theirs) {
        (Value::Object(ours), Value::Object(theirs)) => {
            for (key, value) in ours {
                check_same(value, &theirs[key], &format!("{at}.{key}"));
            }
        }
        (Value::Array(ours), Value::Array(theirs)) => {
            assert_eq!(ours.len(), theirs.len(), "{at}");
            for (k, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
                check_same(ours, theirs, &format!("{at}[{k}]"));
            }
        }
        (Value::Number(_), _) => assert_eq!(ours.as_f64(), theirs.as_f64(), "{at}"),
        _ => assert_eq!(ours, theirs, "{at}"),
    }
}

type Loops = Vec<Vec<[f64; 2]>>;

fn loops(value: &Value) -> Loops {
    serde_json::from_value(value["loops"].clone()).unwrap()
}

fn distance_to_segment([x, y]: [f64; 2], [ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let length_squared = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    let along = (((x - ax) * dx + (y - ay) * dy) / length_squared).clamp(0.0, 1.0);
    (x - ax - along * dx).hypot(y - ay - along * dy)
}

/// The largest distance of a vertex of `from` to the nearest side of `to`, pixels.
fn largest_distance(from: &Loops, to: &Loops) -> f64 {
    let nearest = |point: [f64; 2]| {
        to.iter()
            .flat_map(|l| l.iter().zip(l.iter().cycle().skip(1)))
            .map(|(&a, &b)| distance_to_segment(point, a, b))
            .fold(f64::INFINITY, f64::min)
    };
    from.iter()
        .flatten()
        .map(|&p| nearest(p))
        .fold(0.0, f64::max)
}

/// How far apart two outlines are, pixels.
fn apart(one: &Loops, other: &Loops) -> f64 {
    largest_distance(one, other).max(largest_distance(other, one))
}

/// Compares what both readers find in an asset, and at some captured views the outlines, which must be those that were captured.
fn check_asset(asset: &str, method: &str) {
    let Some(ours) = read_json(&[asset]) else {
        return;
    };
    let theirs = run_json(&["inspect", asset, "--full", "--json"]);
    check_same(&ours, &theirs, asset);
    assert!(ours["views"].as_array().unwrap().len() >= 8);
    let side = ours["map"]["resolution"].to_string();
    for (view, level) in [("0", "0"), ("3", "1"), ("7", "0")] {
        let captured = read_json(&[asset, "--view", view, "--level", level]).unwrap();
        let eye: Vec<String> = (captured["camera"]["eye"].as_array().unwrap().iter())
            .map(Value::to_string)
            .collect();
        let shown = run_json(&[
            "contour",
            asset,
            &format!("--eye={}", eye.join(",")),
            "--detail",
            level,
            "--size",
            &format!("{side}x{side}"),
            "--method",
            method,
            "--json",
        ]);
        let parts: Vec<u64> = serde_json::from_value(captured["parts"].clone()).unwrap();
        let (captured, shown) = (loops(&captured), loops(&shown));
        if parts.iter().any(|part| *part != parts[0]) {
            check_united(&captured, &shown, side.parse().unwrap());
            continue;
        }
        assert_eq!(captured.len(), shown.len(), "{asset}: view {view}");
        let px = apart(&captured, &shown);
        assert!(
            px < 1e-9,
            "{asset}: view {view} at level {level}: {px} px apart"
        );
        // What is a tenth of a pixel aside is not the same.
        let aside = |l: &Vec<[f64; 2]>| l.iter().map(|[x, y]| [x + 0.1, *y]).collect();
        assert!(apart(&captured.iter().map(aside).collect(), &shown) > 0.05);
    }
}

/// Where contours are of several parts, what is shown is what any of them holds.
fn check_united(captured: &Loops, shown: &Loops, side: u32) {
    let filled = |loops: &Loops, aside: f64| {
        let mut mask = Mask::new(side, side);
        let moved = |l: &Vec<[f64; 2]>| -> Vec<DVec2> {
            l.iter().map(|[x, y]| DVec2::new(x + aside, *y)).collect()
        };
        fill_non_zero(loops.iter().map(moved), &mut mask);
        mask
    };
    let whole = filled(captured, 0.0);
    let off = whole.count_different(&filled(shown, 0.0));
    let control = whole.count_different(&filled(shown, 1.0));
    assert!(
        4 * off < control,
        "{off} pixels, {control} where it is moved by one"
    );
    // Whatever bounds it bounds a part.
    assert!(largest_distance(shown, captured) < 0.2);
    assert!(shown.len() <= captured.len());
}

#[test]
fn an_asset_is_read_by_its_format_alone() {
    check_asset(path(&fixture().asset), "tight");
}

#[test]
fn assets_of_other_kinds_are_read_too() {
    let folder = scratch("formats");
    let asset = folder.join("any.glb");
    let asset = path(&asset);
    let mut arguments = vec!["build", path(&fixture().model), "-o", asset];
    arguments.extend(SMALL_BUILD);
    arguments.extend([
        "--coverage",
        "any",
        "--texture-format",
        "webp",
        "--no-normals",
        "--parts",
        "1",
    ]);
    let ended = run(&arguments);
    assert_eq!(ended.code, 0, "{}", ended.err);
    check_asset(asset, "tight");
    let fewer = folder.join("fewer.glb");
    let ended = run(&["build", "--from", asset, "--keep", "10", "-o", path(&fewer)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    check_asset(path(&fewer), "paper");
}

#[test]
fn an_asset_of_version_1_is_read() {
    let asset = root().join("crates/silmap-map/src/asset/format-1.glb");
    let Some(ours) = read_json(&[path(&asset)]) else {
        return;
    };
    assert_eq!(ours["format_version"], 1);
    check_asset(path(&asset), "tight");
}

#[test]
fn an_asset_far_from_the_origin_is_read() {
    let folder = scratch("formats-far");
    let [near, model, asset] = ["near.obj", "far.obj", "far.glb"].map(|name| folder.join(name));
    let made = run(&["generate", "torus", "--faces", "300", "-o", path(&near)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let far: String = fs::read_to_string(&near)
        .unwrap()
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            Some(point) => {
                let (x, rest) = point.split_once(' ').unwrap();
                format!("v {} {rest}\n", x.parse::<f64>().unwrap() + 4e6)
            }
            None => format!("{line}\n"),
        })
        .collect();
    fs::write(&model, far).unwrap();
    let mut arguments = vec!["build", path(&model), "-o", path(&asset)];
    arguments.extend(SMALL_BUILD);
    let ended = run(&arguments);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let Some(ours) = read_json(&[path(&asset)]) else {
        return;
    };
    let theirs = run_json(&["inspect", path(&asset), "--full", "--json"]);
    check_same(&ours["map"], &theirs["map"], "map");
    // In the asset positions count from its origin, which is printed too.
    let eyes = |value: &Value| value["views"][0]["eye"][0].as_f64().unwrap();
    let origin = ours["model"]["origin"][0].as_f64().unwrap();
    assert!(origin > 3e6, "{origin}");
    assert!((eyes(&ours) + origin - eyes(&theirs)).abs() < 1e-6);
}

#[test]
fn a_damaged_asset_is_refused_by_its_checksum() {
    let sound = fs::read(&fixture().asset).unwrap();
    let file = scratch("formats-damaged").join("damaged.glb");
    let json = u32::from_le_bytes(sound[12..16].try_into().unwrap()) as usize;
    let text = String::from_utf8_lossy(&sound[20..20 + json]).into_owned();
    let radius = 20 + text.find("\"radius\":").unwrap() + 11;
    for place in [radius, 28 + json + 40, sound.len() / 2, sound.len() - 40] {
        let mut damaged = sound.clone();
        damaged[place] ^= 1;
        fs::write(&file, damaged).unwrap();
        let Some(ended) = read(&[path(&file)]) else {
            return;
        };
        assert_eq!(ended.code, 1, "a change at byte {place} is not noticed");
        assert!(!ended.err.contains("Traceback"), "{}", ended.err);
        assert_eq!(run(&["inspect", path(&file)]).code, 1);
    }
}
