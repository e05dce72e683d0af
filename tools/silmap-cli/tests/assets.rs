//! Assets that other programs rewrote, and building one again by its own record: the binary as a process.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;

use common::{check_one_sentence, fixture, is_gpu_skipped, path, run, run_json, scratch};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

/// The JSON text and the binary chunk of a file.
fn open(file: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(file).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    (document, bytes[28 + length..].to_vec())
}

fn save(file: &Path, document: &Value, binary: &[u8]) {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    let total = 28 + text.len() + binary.len();
    for (words, part) in [
        ([total, text.len()], &b"JSON"[..]),
        ([binary.len(); 2], &b"BIN\0"[..]),
    ] {
        let first = usize::from(part != b"JSON");
        for word in &words[first..] {
            bytes.extend((*word as u32).to_le_bytes());
        }
        bytes.extend(part);
        bytes.extend(if first == 0 { &text[..] } else { binary });
    }
    fs::write(file, bytes).unwrap();
}

/// The asset as a program without support for silhouettes leaves it: with a node that turns it and a material of its own.
fn plain(change: impl Fn(&mut Value, &mut Vec<u8>)) -> std::path::PathBuf {
    use std::sync::atomic::{AtomicUsize, Ordering};
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let folder = scratch(&format!("plain-{}", COUNT.fetch_add(1, Ordering::Relaxed)));
    let (mut document, mut binary) = open(&fixture().asset);
    document["extensions"] = json!({});
    document["asset"]["generator"] = "Other 3.1".into();
    document["materials"] = json!([{ "name": "theirs" }]);
    document["nodes"] = json!([{ "mesh": 0, "rotation": [0.0, 0.0, 1.0, 0.0], "translation": [1, 2, 3] }, { "name": "lamp" }]);
    document["scenes"] = json!([{ "nodes": [0, 1] }]);
    change(&mut document, &mut binary);
    let file = folder.join("plain.glb");
    save(&file, &document, &binary);
    file
}

/// The first bytes of the SHA-256 of a small asset's binary chunk, made on an AMD EPYC without a graphics adapter. It changes when
/// building changes, and not with the machine.
const DATA_SHA256: &str = "b4a4be1171ec2125";

#[test]
fn a_build_gives_the_bytes_that_it_gave_elsewhere() {
    let (document, binary) = open(&fixture().asset);
    let digest = Sha256::digest(&binary);
    let found: String = digest.iter().take(8).map(|b| format!("{b:02x}")).collect();
    assert_eq!(found, DATA_SHA256, "{document}");
}

fn contour(asset: &Path) -> Value {
    run_json(&["contour", path(asset), "--eye", "1,2,2.5", "--json"])["loops"].clone()
}

/// Where the positions of the hull begin in the binary chunk, and how many there are.
fn positions(document: &Value) -> (usize, usize) {
    let accessor = &document["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
    let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    (number(&view["byteOffset"]), number(&accessor["count"]))
}

#[test]
fn data_are_put_back_and_all_else_stays() {
    let file = plain(|_, _| {});
    let ended = run(&["inspect", path(&file)]);
    check_one_sentence(&ended, path(&file));
    assert!(
        ended
            .err
            .contains("no silhouette map any more: Other 3.1 left it out")
            && ended.err.contains("silmap attach"),
        "{}",
        ended.err
    );
    let whole = file.with_file_name("whole.glb");
    let original = path(&fixture().asset);
    let told = run_json(&[
        "attach",
        path(&file),
        "--from",
        original,
        "-o",
        path(&whole),
        "--json",
    ]);
    assert_eq!(told["views"], fixture().build["kept"]);
    assert_eq!(told["hull_faces"], fixture().build["hull_faces"]);
    assert_eq!(contour(&whole), contour(&fixture().asset));
    let (document, _) = open(&whole);
    assert_eq!(document["materials"][0]["name"], "theirs");
    assert_eq!(document["nodes"][1]["name"], "lamp");
    assert_eq!(document["asset"]["generator"], "Other 3.1");
    // The pictures and the mesh are the file's own still: only silhouettes were added.
    let (before, _) = open(&file);
    assert_eq!(document["accessors"], before["accessors"]);
    assert_eq!(document["images"], before["images"]);
    // Over the file itself, without -o.
    run_json(&["attach", path(&file), "--from", original, "--json"]);
    assert_eq!(fs::read(&file).unwrap(), fs::read(&whole).unwrap());
    let ended = run(&["attach", path(&file), "--from", original]);
    check_one_sentence(&ended, path(&file));
    assert!(
        ended.err.contains("nothing is to be put back"),
        "{}",
        ended.err
    );
}

#[test]
fn a_rounded_hull_is_the_same_and_a_changed_one_is_not() {
    let original = path(&fixture().asset);
    let moved = |by: f32| {
        plain(move |document, binary| {
            let (start, count) = positions(document);
            for (k, chunk) in binary[start..start + 12 * count]
                .chunks_exact_mut(4)
                .enumerate()
            {
                let x = f32::from_le_bytes((&*chunk).try_into().unwrap());
                let x = x + if k % 2 == 0 { by } else { -by };
                chunk.copy_from_slice(&x.to_le_bytes());
            }
        })
    };
    let near = moved(1e-4);
    run_json(&["attach", path(&near), "--from", original, "--json"]);
    assert_eq!(contour(&near), contour(&fixture().asset));
    let refusal = |file: &Path, words: &str| {
        let before = fs::read(file).unwrap();
        let ended = run(&["attach", path(file), "--from", original]);
        check_one_sentence(&ended, path(file));
        assert!(ended.err.contains(words), "{}", ended.err);
        assert_eq!(fs::read(file).unwrap(), before, "it stays as it was");
    };
    refusal(&moved(0.2), "from the nearest vertex of the hull");
    let fewer = plain(|document, _| {
        let indices = document["meshes"][0]["primitives"][0]["indices"]
            .as_u64()
            .unwrap();
        let count = &mut document["accessors"][indices as usize]["count"];
        *count = (count.as_u64().unwrap() - 3).into();
    });
    refusal(&fewer, "triangles, the hull has");
    let turned = plain(|document, binary| {
        let indices = document["meshes"][0]["primitives"][0]["indices"]
            .as_u64()
            .unwrap();
        let view = document["accessors"][indices as usize]["bufferView"]
            .as_u64()
            .unwrap();
        let start = document["bufferViews"][view as usize]["byteOffset"]
            .as_u64()
            .unwrap() as usize;
        // 16-bit indices of the first triangle.
        binary.swap(start, start + 2);
        binary.swap(start + 1, start + 3);
    });
    refusal(
        &turned,
        "triangle 0 of mesh \"torus\" is none of the hull's",
    );
    refusal(
        &plain(|d, _| d["meshes"] = json!([])),
        "the file has no triangles",
    );
}

#[test]
fn a_file_that_lost_its_data_names_the_program() {
    let file = plain(|_, _| {});
    let (mut document, binary) = open(&fixture().asset);
    document["asset"]["generator"] = "Other 3.1".into();
    document["bufferViews"].as_array_mut().unwrap().truncate(4);
    save(&file, &document, &binary);
    let ended = run(&["contour", path(&file), "--eye", "1,2,2.5"]);
    check_one_sentence(&ended, path(&file));
    assert!(
        ended
            .err
            .contains("lost its data: Other 3.1 kept the JSON alone"),
        "{}",
        ended.err
    );
    // Rewritten, but whole: another text, another order of keys, another generator.
    let (mut document, binary) = open(&fixture().asset);
    document["asset"]["generator"] = "Other 3.1".into();
    save(&file, &document, &binary);
    assert_eq!(contour(&file), contour(&fixture().asset));
}

#[test]
fn an_asset_is_built_again_by_its_record() {
    let folder = scratch("record");
    let model = path(&fixture().model);
    let names = ["odd.glb", "again.glb", "fewer.glb", "fewer-again.glb"];
    let [odd, again, fewer, fewer_again] = names.map(|n| folder.join(n));
    let options = "--views 40 --keep 20 --method tight --resolution 48 --tolerance 0.8 --coverage any --radius 4.5 --faces 90 \
        --texture-views 2 --texture-size 16 --texture-format webp --texture-quality 61 --texture-bytes 9K --atlas-size 48 --tiles fixed \
        --parametrisation closest-point --no-normals --repair --close-holes --backend cpu --json";
    let options: Vec<&str> = options.split_whitespace().collect();
    run_json(&[&["build", model, "-o", path(&odd)][..], &options].concat());
    let by = |of: &Path, out: &Path| {
        run_json(&[
            "build",
            model,
            "--params-from",
            path(of),
            "-o",
            path(out),
            "--json",
        ]);
        fs::read(out).unwrap()
    };
    assert_eq!(by(&odd, &again), fs::read(&odd).unwrap());
    let keep = ["--keep", "14", "-o", path(&fewer), "--json"];
    run_json(&[&["build", "--from", path(&odd)][..], &keep].concat());
    assert_eq!(by(&fewer, &fewer_again), fs::read(&fewer).unwrap());

    let full = run_json(&["inspect", path(&odd), "--full", "--json"]);
    assert_eq!(
        full["params"]["build"]["load"]["repair"], true,
        "{}",
        full["params"]
    );
    assert_eq!(full["params"]["build"]["capture"]["backend"], "cpu");
    assert_eq!(full["params"]["build"]["resolution_px"], 48);
    assert!(run_json(&["inspect", path(&odd), "--json"])["params"].is_null());
    let conflict = [
        "--params-from",
        path(&odd),
        "--faces",
        "80",
        "-o",
        path(&again),
    ];
    assert_eq!(run(&[&["build", model][..], &conflict].concat()).code, 2);
    // Not from another mesh without a word.
    let other = folder.join("other.ply");
    assert_eq!(
        run(&[
            "generate",
            "trefoil-knot",
            "--faces",
            "600",
            "-o",
            path(&other)
        ])
        .code,
        0
    );
    let ended = run(&[
        "build",
        path(&other),
        "--params-from",
        path(&odd),
        "-o",
        path(&again),
    ]);
    assert!(
        ended
            .err
            .contains("not the mesh that the asset was made from"),
        "{}",
        ended.err
    );
}

#[test]
fn an_asset_taken_for_a_mesh_is_told() {
    let folder = scratch("taken");
    let asset = path(&fixture().asset);
    let hull = folder.join("hull.obj");
    let ended = run(&["hull", asset, "--faces", "60", "-o", path(&hull)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(
        ended.err.contains("this is an asset") && ended.err.contains("(torus)"),
        "{}",
        ended.err
    );
    let ended = run(&[
        "hull",
        path(&fixture().model),
        "--faces",
        "60",
        "-o",
        path(&hull),
    ]);
    assert!(!ended.err.contains("this is an asset"), "{}", ended.err);
}

#[test]
fn names_that_promise_something_else_are_refused() {
    let folder = scratch("names");
    let model = path(&fixture().model);
    let wrong = folder.join("x.gltf");
    let ended = run(&["build", model, "-o", path(&wrong)]);
    check_one_sentence(&ended, path(&wrong));
    assert!(
        ended.err.contains("binary glTF file, not .gltf"),
        "{}",
        ended.err
    );
    let asset = path(&fixture().asset);
    let gif = folder.join("x.gif");
    let ended = run(&["render", asset, "--eye", "1,2,2.5", "-o", path(&gif)]);
    check_one_sentence(&ended, path(&gif));
    assert!(!wrong.exists() && !gif.exists());
    if is_gpu_skipped() {
        return;
    }
    for (name, start) in [
        ("x.jpg", &b"\xff\xd8\xff"[..]),
        ("x.webp", b"RIFF"),
        ("x.png", b"\x89PNG"),
    ] {
        let out = folder.join(name);
        let ended = run(&[
            "render",
            asset,
            "--eye",
            "1,2,2.5",
            "--size",
            "40x30",
            "-o",
            path(&out),
        ]);
        assert_eq!(ended.code, 0, "{}", ended.err);
        assert!(fs::read(&out).unwrap().starts_with(start), "{name}");
    }
}

#[test]
fn assets_for_larger_screens_are_finer_and_told_so() {
    let folder = scratch("heights");
    let model = path(&fixture().model);
    let build = |name: &str, height: &str, options: &[&str]| {
        let out = folder.join(name);
        let few = "--views 48 --keep 12 --faces 90 --texture-views 2 --backend cpu --json";
        let few: Vec<&str> = few.split(' ').collect();
        let of_height = ["build", model, "-o", path(&out), "--for-height", height];
        let built = run_json(&[&of_height[..], &few, options].concat());
        let full = run_json(&["inspect", path(&out), "--full", "--json"]);
        (built["bytes"].as_u64().unwrap(), full, out)
    };
    let [small, large] = [("s.glb", "256"), ("l.glb", "600")].map(|(n, h)| build(n, h, &[]));
    assert!(large.0 > small.0, "{} and {}", large.0, small.0);
    for ((_, full, _), height) in [(&small, 256), (&large, 600)] {
        let build = &full["params"]["build"];
        assert_eq!(build["for_height_px"], height);
        assert_eq!(build["resolution_px"], height / 2);
        assert_eq!(full["map"]["resolution"], height / 2);
    }
    // What is given stays.
    let (_, given, _) = build("g.glb", "600", &["--resolution", "64"]);
    assert_eq!(given["map"]["resolution"], 64);
    // Both ways of going on from an asset keep it.
    let [again, fewer] = ["again.glb", "fewer.glb"].map(|n| folder.join(n));
    run_json(&[
        "build",
        model,
        "--params-from",
        path(&small.2),
        "-o",
        path(&again),
        "--json",
    ]);
    assert!(fs::read(&again).unwrap() == fs::read(&small.2).unwrap());
    let keep = ["--keep", "8", "-o", path(&fewer), "--json"];
    run_json(&[&["build", "--from", path(&small.2)][..], &keep].concat());
    let fewer = run_json(&["inspect", path(&fewer), "--full", "--json"]);
    assert_eq!(fewer["params"]["build"]["for_height_px"], 256);
    let conflict = ["build", "--from", path(&small.2), "--for-height", "300"];
    assert_eq!(run(&[&conflict[..], &keep].concat()).code, 2);
}
