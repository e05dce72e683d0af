//! `silmap hull` as a process: formats, sequences, tightening, and what it promises about where a model may be.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::{check_fields, check_one_sentence, fixture, path, run, run_json, scratch};

#[test]
fn hull_says_what_scripts_read_and_writes_every_format() {
    let (model, folder) = (path(&fixture().model), scratch("hull"));
    for name in ["hull.obj", "hull.ply", "hull.glb"] {
        let out = folder.join(name);
        let hull = run_json(&[
            "hull",
            model,
            "--faces",
            "120",
            "--verify",
            "-o",
            path(&out),
            "--json",
        ]);
        check_fields(
            &hull,
            &[
                "faces",
                "vertices",
                "volume",
                "original_volume",
                "volume_ratio",
                "seconds",
                "verified",
                "escaped_distance",
            ],
        );
        assert_eq!(hull["verified"], true, "{hull}");
        assert!(hull["faces"].as_u64().unwrap() <= 120);
        assert!(hull["volume_ratio"].as_f64().unwrap() > 1.0);
        // What was written is a model again.
        let again = run_json(&[
            "hull",
            path(&out),
            "--faces",
            "100000",
            "-o",
            path(&out),
            "--json",
        ]);
        assert_eq!(again["faces"], hull["faces"]);
    }
    let out = folder.join("inner.obj");
    let inner = run_json(&[
        "hull",
        model,
        "--faces",
        "120",
        "--inner",
        "-o",
        path(&out),
        "--json",
    ]);
    assert!(inner["volume_ratio"].as_f64().unwrap() < 1.0);
    assert!(inner["verified"].is_null());
}

#[test]
fn a_saved_sequence_gives_the_same_hulls_and_a_strip_shows_them() {
    let (model, folder) = (path(&fixture().model), scratch("sequence"));
    let [fresh, again] = ["fresh.obj", "again.obj"].map(|name| folder.join(name));
    let (sequence, strip) = (folder.join("all.hulls"), folder.join("strip.png"));
    let made = run_json(&[
        "hull",
        model,
        "--faces",
        "100",
        "--sequence",
        path(&sequence),
        "--strip",
        path(&strip),
        "-o",
        path(&fresh),
        "--json",
    ]);
    assert_eq!(made["faces"], 100);
    let picture = fs::read(&strip).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    let taken = run_json(&[
        "hull",
        path(&sequence),
        "--faces",
        "100",
        "-o",
        path(&again),
        "--json",
    ]);
    assert_eq!(taken["volume_ratio"], made["volume_ratio"]);
    assert_eq!(fs::read(&fresh).unwrap(), fs::read(&again).unwrap());
    let finer = run_json(&[
        "hull",
        path(&sequence),
        "--volume-ratio",
        "1.05",
        "--verify",
        "-o",
        path(&again),
        "--json",
    ]);
    assert!(finer["faces"].as_u64() > made["faces"].as_u64());
    assert!(finer["volume_ratio"].as_f64().unwrap() <= 1.05 + 1e-6);
    assert_eq!(finer["verified"], true);
    let mut bytes = fs::read(&sequence).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&sequence, &bytes).unwrap();
    let ended = run(&["hull", path(&sequence), "-o", path(&again)]);
    check_one_sentence(&ended, path(&sequence));
    assert!(ended.err.contains("damaged"), "{}", ended.err);
}

#[test]
fn tightened_hulls_are_smaller_and_verified() {
    let (model, folder) = (path(&fixture().model), scratch("tighten"));
    let out = folder.join("hull.ply");
    let ratios = ["off", "fast", "best"].map(|how| {
        let hull = run_json(&[
            "hull",
            model,
            "--faces",
            "150",
            "--tighten",
            how,
            "--verify",
            "-o",
            path(&out),
            "--json",
        ]);
        assert_eq!(hull["verified"], true, "{how}: {hull}");
        hull["volume_ratio"].as_f64().unwrap()
    });
    let [off, fast, best] = ratios;
    assert!(fast < off && best <= fast, "{ratios:?}");
}

#[test]
fn a_model_and_its_hull_keep_their_colours() {
    let folder = scratch("colours");
    let (model, hull) = (folder.join("organic.obj"), folder.join("hull.ply"));
    let ended = run(&["generate", "organic", "--faces", "3000", "-o", path(&model)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let text = fs::read_to_string(&model).unwrap();
    assert_eq!(
        text.lines().next().unwrap().split(' ').count(),
        7,
        "x y z r g b"
    );
    run_json(&[
        "hull",
        path(&model),
        "--faces",
        "2500",
        "-o",
        path(&hull),
        "--json",
    ]);
    let bytes = fs::read(&hull).unwrap();
    let vertices = bytes
        .split(|&b| b == b'\n')
        .take_while(|l| *l != b"end_header");
    assert!(
        vertices
            .into_iter()
            .any(|line| line == b"property uchar red")
    );
}

#[test]
fn a_hull_may_be_kept_from_passing_through_itself() {
    let (model, folder) = (path(&fixture().model), scratch("crossings"));
    let (out, sequence) = (folder.join("hull.obj"), folder.join("all.hulls"));
    let to = ["-o", path(&out), "--json"];
    let faces = ["--faces", "100", "--verify"];
    let kept = ["--no-self-intersections", "--sequence", path(&sequence)];
    let hull = run_json(&[&["hull", model][..], &faces, &kept, &to].concat());
    assert_eq!(hull["self_intersections"], 0);
    assert_eq!(hull["verified"], true);
    // The file remembers it, and another one is told apart.
    let taken = ["hull", path(&sequence), "--no-self-intersections"];
    run_json(&[&taken[..], &to].concat());
    let free = ["--sequence", path(&sequence)];
    run_json(&[&["hull", model][..], &free, &to].concat());
    let ended = run(&[&taken[..], &to].concat());
    check_one_sentence(&ended, path(&sequence));
    assert!(
        ended.err.contains("pass through themselves"),
        "{}",
        ended.err
    );
}

#[test]
fn a_model_far_from_the_origin_is_enclosed_by_what_is_written() {
    let folder = scratch("far");
    let model = folder.join("far.obj");
    let ended = run(&["generate", "torus", "--faces", "600", "-o", path(&model)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let moved: String = (fs::read_to_string(&model).unwrap().lines())
        .map(|line| {
            let Some(point) = line.strip_prefix("v ") else {
                return format!("{line}\n");
            };
            let far: Vec<String> = (point.split(' '))
                .map(|c| (c.parse::<f64>().unwrap() + 1e5).to_string())
                .collect();
            format!("v {}\n", far.join(" "))
        })
        .collect();
    fs::write(&model, moved).unwrap();
    for name in ["hull.obj", "hull.ply", "hull.glb"] {
        let out = folder.join(name);
        let to = ["--faces", "500", "--verify", "-o", path(&out), "--json"];
        let hull = run_json(&[&["hull", path(&model)][..], &to].concat());
        assert_eq!(hull["verified"], true, "{name}: {hull}");
    }
}
