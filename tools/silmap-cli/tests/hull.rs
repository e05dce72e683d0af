//! `silmap hull` as a process: formats, sequences, tightening, and what it promises about where a model may be.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::{
    Ended, bare, check_fields, check_one_sentence, fixture, path, run, run_json, scratch,
};

#[test]
fn hull_says_what_scripts_read_and_writes_every_format() {
    let (model, folder) = (path(&fixture().model), scratch("hull"));
    for name in ["hull.obj", "hull.ply", "hull.glb", "hull.off", "hull.stl"] {
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
    let ended = run(&["hull", path(&sequence), "--faces", "20", "-o", path(&again)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let is_said = ended
        .err
        .contains("the saved hulls end at 100 faces (20 asked for)");
    assert!(is_said, "{}", ended.err);
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
    // The file records the option, and one written without it is refused.
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

/// Axis-aligned cubes in a row, as an OBJ.
fn row_of_cubes(count: usize) -> String {
    const SIDES: [[usize; 4]; 6] = [
        [1, 4, 3, 2],
        [5, 6, 7, 8],
        [1, 2, 6, 5],
        [2, 3, 7, 6],
        [3, 4, 8, 7],
        [4, 1, 5, 8],
    ];
    let mut text = String::new();
    for n in 0..count {
        let x = 2 * n;
        for [i, j, k] in [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ] {
            text += &format!("v {} {j} {k}\n", x + i);
        }
        for side in SIDES {
            let [a, b, c, d] = side.map(|v| v + 8 * n);
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    text
}

fn warnings(ended: &Ended) -> Vec<&str> {
    let lines = ended.err.lines();
    lines
        .filter(|l| l.starts_with("silmap: warning: "))
        .collect()
}

#[test]
fn a_hull_says_when_it_stops_above_what_was_asked_for() {
    let folder = scratch("stops");
    let (model, out) = (folder.join("cubes.obj"), folder.join("hull.ply"));
    fs::write(&model, row_of_cubes(12)).unwrap();
    let to = ["-o", path(&out), "--json"];
    for (limits, said) in [
        (&["--faces", "20"][..], Some("(20 asked for)")),
        (&["--faces", "20", "--inner"], Some("inside the model")),
        (
            &["--faces", "20", "--volume-ratio", "1.5"],
            Some("within 1.5 times its volume"),
        ),
        (
            &["--faces", "20", "--max-distance", "0.1"],
            Some("within 0.1 units of it"),
        ),
        (&["--faces", "144"], None),
        (&["--volume-ratio", "1.5"], None),
        (&["--max-distance", "0.1R"], None),
        // No vertex may move, but single precision holds them all.
        (&["--max-distance", "1e-9R"], None),
    ] {
        let ended = run(&[&["hull", path(&model)][..], limits, &to].concat());
        assert_eq!(ended.code, 0, "{limits:?}: {}", ended.err);
        let hull: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
        let warnings = warnings(&ended);
        match said {
            None => assert!(warnings.is_empty(), "{limits:?}: {warnings:?}"),
            Some(part) => {
                let stopped = format!("stopped at {} faces", hull["faces"]);
                let is_said = |w: &&str| w.contains(&stopped) && w.contains(part);
                assert!(warnings.iter().any(is_said), "{limits:?}: {warnings:?}");
                assert!(hull["faces"].as_u64() > Some(20));
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn models_and_sequences_are_read_from_pipes() {
    use std::io::Write;
    use std::process::Stdio;
    let (model, folder) = (&fixture().model, scratch("pipes"));
    let (sequence, out) = (folder.join("all.hulls"), folder.join("hull.obj"));
    let obj = folder.join("model.obj");
    let limits = ["--faces", "200", "-o"];
    let made = run(&[
        &["hull", path(model), "--sequence", path(&sequence)][..],
        &limits,
        &[path(&out)],
    ]
    .concat());
    assert_eq!(made.code, 0, "{}", made.err);
    let wanted = fs::read(&out).unwrap();
    let whole = ["--faces", "1200", "-o", path(&obj)];
    let written = run(&[&["hull", path(model)][..], &whole].concat());
    assert_eq!(written.code, 0, "{}", written.err);
    for (input, is_same) in [(model, true), (&sequence, true), (&obj, false)] {
        fs::remove_file(&out).unwrap();
        let mut child = bare()
            .args(["hull", "/dev/stdin"])
            .args(limits)
            .arg(&out)
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdin.take().unwrap();
        pipe.write_all(&fs::read(input).unwrap()).unwrap();
        drop(pipe);
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{}: {said}", input.display());
        let is_right = !is_same || fs::read(&out).unwrap() == wanted;
        assert!(is_right, "{}", input.display());
    }
}

#[test]
fn a_textured_model_has_a_hull_of_its_colours_and_says_what_is_left_out() {
    let folder = scratch("textured");
    let (model, texture) = (folder.join("cube.obj"), folder.join("red.png"));
    let red = image::RgbaImage::from_pixel(4, 4, image::Rgba([255, 0, 0, 255]));
    red.save(&texture).unwrap();
    fs::write(folder.join("cube.mtl"), "newmtl skin\nmap_Kd red.png\n").unwrap();
    let plain = row_of_cubes(1);
    let textured: String = (plain.lines())
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => {
                let corners: Vec<String> = corners.split(' ').map(|c| format!("{c}/1")).collect();
                format!("f {}\n", corners.join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    fs::write(
        &model,
        format!("mtllib cube.mtl\nvt 0.5 0.5\nusemtl skin\n{textured}"),
    )
    .unwrap();
    for (name, holds_colours) in [
        ("hull.obj", true),
        ("hull.ply", true),
        ("hull.off", true),
        ("hull.glb", true),
        ("hull.stl", false),
    ] {
        let out = folder.join(name);
        let ended = run(&["hull", path(&model), "--faces", "12", "-o", path(&out)]);
        assert_eq!(ended.code, 0, "{}", ended.err);
        let warnings = warnings(&ended);
        assert_eq!(warnings.len(), 1, "{name}: {warnings:?}");
        for part in [path(&out), "texture coordinates", "textures", "materials"] {
            assert!(warnings[0].contains(part), "{name}: {warnings:?}");
        }
        let says_colours_are_gone = warnings[0].contains("and colours are left out");
        assert_eq!(says_colours_are_gone, !holds_colours, "{warnings:?}");
        let bytes = fs::read(&out).unwrap();
        let holds = |part: &[u8]| bytes.windows(part.len()).any(|w| w == part);
        match name {
            "hull.obj" => assert!(holds(b" 1.00000 0.00000 0.00000\n")),
            "hull.off" => assert!(holds(b" 255 0 0 255\n")),
            "hull.ply" => assert!(holds(b"property uchar red") && holds(&[255, 0, 0])),
            "hull.glb" => assert!(holds(b"COLOR_0")),
            _ => {}
        }
    }
    // A sequence holds none either.
    let (out, sequence) = (folder.join("hull.ply"), folder.join("all.hulls"));
    let saved = ["--sequence", path(&sequence), "-o", path(&out)];
    let ended = run(&[&["hull", path(&model)][..], &saved].concat());
    assert!(
        warnings(&ended).iter().any(|w| w.contains("all.hulls")),
        "{}",
        ended.err
    );
}

/// The checksum of ISO 3309, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
    !(bytes.iter()).fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn a_sequence_with_numbers_that_are_none_is_refused_by_its_element() {
    let folder = scratch("altered");
    let (sequence, out) = (folder.join("all.hulls"), folder.join("hull.obj"));
    let model = path(&fixture().model);
    let saved = [
        "--faces",
        "100",
        "--sequence",
        path(&sequence),
        "-o",
        path(&out),
    ];
    run_json(&[&["hull", model, "--json"][..], &saved].concat());
    let bytes = fs::read(&sequence).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let first_vertex = 52 + number(44) * 16;
    let first_split = first_vertex + number(40) * 48;
    for (at, named) in [
        (first_vertex + 3 * 48, "vertex 3"),
        (first_split + 40, "split 0"),
    ] {
        for value in [f64::NAN, f64::NEG_INFINITY, 1e300] {
            let mut altered = bytes.clone();
            altered[at..at + 8].copy_from_slice(&value.to_le_bytes());
            let crc = crc32(&altered[16..]);
            altered[12..16].copy_from_slice(&crc.to_le_bytes());
            fs::write(&sequence, altered).unwrap();
            let ended = run(&[
                "hull",
                path(&sequence),
                "--tighten",
                "fast",
                "-o",
                path(&out),
            ]);
            check_one_sentence(&ended, path(&sequence));
            assert!(ended.err.contains(named), "{}", ended.err);
            assert!(ended.err.contains(path(&sequence)), "{}", ended.err);
        }
    }
}
