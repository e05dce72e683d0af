//! The command's border to the world: pipes that wait, input without end, several results at once, names that collide, and files that
//! are not what they are taken for.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::{check_one_sentence, fixture, path, run, run_json, scratch};

#[cfg(unix)]
mod unix {
    use std::fs;
    use std::io::Read;
    use std::path::Path;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    use super::common::{bare, fixture, path, run, scratch};

    fn make_pipe(path: &Path) {
        let made = Command::new("mkfifo").arg(path).status().unwrap();
        assert!(made.success());
    }

    /// Starts the binary, which waits for a pipe, sends it a signal, and asserts that it ends at once and says so.
    fn signal_ends(arguments: &[&str], signal: &str) {
        let mut child = bare()
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(1000));
        let ended = child.try_wait().unwrap();
        assert!(ended.is_none(), "it did not wait: {arguments:?}");
        let sent = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status()
            .unwrap();
        assert!(sent.success());
        let since = Instant::now();
        let status = child.wait().unwrap();
        assert!(since.elapsed() < Duration::from_secs(5), "{arguments:?}");
        let mut err = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut err)
            .unwrap();
        assert_eq!(
            (status.code(), err.as_str()),
            (Some(130), "silmap: interrupted\n"),
            "{arguments:?}"
        );
    }

    #[test]
    fn a_signal_is_heard_while_a_pipe_has_no_other_end() {
        let folder = scratch("waiting");
        let (pipe, out) = (folder.join("pipe"), folder.join("out"));
        make_pipe(&pipe);
        let (pipe, out) = (path(&pipe), path(&out));
        let (model, asset) = (path(&fixture().model), path(&fixture().asset));
        for (arguments, signal) in [
            (&["inspect", pipe][..], "-INT"),
            (&["edges", pipe, "--eye", "0,0,9"], "-TERM"),
            (
                &["simplify", model, "--eyes", pipe, "-o", "never.obj"],
                "-INT",
            ),
            (&["align", model, "--mask", pipe, "--start", pipe], "-TERM"),
            (&["contour", asset, "--eye", "0,0,9", "-o", pipe], "-INT"),
            (
                &[
                    "edges",
                    model,
                    "--eye",
                    "0,0,9",
                    "--svg",
                    out,
                    "--outline",
                    pipe,
                ],
                "-INT",
            ),
        ] {
            signal_ends(arguments, signal);
        }
        // Neither the other result nor a part of it.
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn of_several_results_none_is_there_when_one_cannot_be() {
        let folder = scratch("together");
        let model = path(&fixture().model);
        let [one, two] = ["one.obj", "two.bin"].map(|name| folder.join(name));
        for arguments in [
            vec![
                "edges",
                model,
                "--eye",
                "0,0,9",
                "--svg",
                path(&one),
                "--outline",
                "/dev/full",
            ],
            vec![
                "hull",
                model,
                "--faces",
                "200",
                "-o",
                path(&one),
                "--sequence",
                "/dev/full",
            ],
            vec![
                "hull",
                model,
                "--faces",
                "200",
                "-o",
                path(&one),
                "--sequence",
                path(&two),
                "--strip",
                "/dev/full",
            ],
        ] {
            let ended = run(&arguments);
            assert_eq!(ended.code, 4, "{arguments:?}: {}", ended.err);
            assert!(ended.err.contains("/dev/full"), "{}", ended.err);
            assert_eq!(fs::read_dir(&folder).unwrap().count(), 0, "{arguments:?}");
        }
        let well = [
            "hull",
            model,
            "--faces",
            "200",
            "-o",
            path(&one),
            "--sequence",
            path(&two),
        ];
        assert_eq!(run(&well).code, 0);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
    }

    #[test]
    fn a_reader_who_has_seen_enough_is_no_error() {
        let asset = path(&fixture().asset);
        for line in [
            "\"$0\" contour \"$1\" --eye 0,0,9 | head -c 10 > /dev/null; exit ${PIPESTATUS[0]}",
            "\"$0\" contour \"$1\" --eye 0,0,9 -o /dev/stdout | head -c 10 > /dev/null; exit ${PIPESTATUS[0]}",
            "\"$0\" inspect \"$1\" --full | true; exit ${PIPESTATUS[0]}",
        ] {
            let Ok(ended) = Command::new("bash")
                .args(["-c", line, env!("CARGO_BIN_EXE_silmap"), asset])
                .output()
            else {
                super::common::outside::skip("pipes that end early: there is no bash");
                return;
            };
            let err = String::from_utf8_lossy(&ended.stderr);
            assert_eq!(ended.status.code(), Some(0), "{line}: {err}");
            assert!(!err.contains("rror") && !err.contains("panicked"), "{err}");
        }
    }
}

#[test]
fn more_than_can_be_read_is_refused_by_its_size() {
    let folder = scratch("too-large");
    for name in ["large.ply", "large.glb"] {
        let file = folder.join(name);
        // Of holes alone: nothing is stored.
        fs::File::create(&file).unwrap().set_len(5 << 30).unwrap();
        for arguments in [
            vec!["inspect", path(&file)],
            vec!["edges", path(&file), "--eye", "0,0,9"],
        ] {
            let ended = run(&arguments);
            // Where there is little memory, it is worth trying elsewhere.
            assert!(ended.code == 1 || ended.code == 4, "{ended:?}");
            assert!(ended.err.contains(name), "{}", ended.err);
            assert!(ended.err.contains("Gi bytes"), "{}", ended.err);
            assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
        }
    }
}

#[test]
fn what_is_read_is_not_replaced_and_no_two_results_are_one_file() {
    let folder = scratch("collide");
    let (model, asset) = (folder.join("m.ply"), folder.join("m.glb"));
    fs::copy(&fixture().model, &model).unwrap();
    fs::copy(&fixture().asset, &asset).unwrap();
    let before = [&model, &asset].map(|file| fs::read(file).unwrap());
    let (m, a) = (path(&model), path(&asset));
    let roundabout = format!("{}/../collide/m.ply", path(&folder));
    let [one, same] = ["x.obj", "./x.obj"].map(|n| format!("{}/{n}", path(&folder)));
    for arguments in [
        vec!["build", m, "-o", &roundabout],
        vec!["build", m, "-o", m],
        vec!["contour", a, "--eye", "0,0,9", "-o", a],
        vec!["edges", m, "--eye", "0,0,9", "--svg", m],
        vec!["hull", m, "-o", &one, "--sequence", &same],
        vec![
            "edges",
            m,
            "--eye",
            "0,0,9",
            "--svg",
            &one,
            "--outline",
            &one,
        ],
    ] {
        let ended = run(&arguments);
        assert_eq!(ended.code, 2, "{arguments:?}: {}", ended.err);
    }
    let after = [&model, &asset].map(|file| fs::read(file).unwrap());
    assert!(before == after);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn a_mesh_in_an_assets_place_gets_the_command_that_makes_one() {
    let model = path(&fixture().model);
    let out = scratch("in-place");
    let (png, glb, folder) = (out.join("a.png"), out.join("a.glb"), out.join("report"));
    for arguments in [
        vec!["inspect", model],
        vec!["contour", model, "--eye", "0,0,9"],
        vec!["render", model, "--eye", "0,0,9", "-o", path(&png)],
        vec!["evaluate", model, "--model", model],
        vec!["report", model, "--model", model, "-o", path(&folder)],
        vec!["build", "--from", model, "--keep", "9", "-o", path(&glb)],
    ] {
        let ended = run(&arguments);
        check_one_sentence(&ended, &format!("{arguments:?}"));
        assert!(ended.err.contains("silmap build "), "{}", ended.err);
    }
    let ended = run(&[
        "render",
        "--mode",
        "original",
        "--eye",
        "0,0,9",
        "-o",
        path(&png),
    ]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("--model"), "{}", ended.err);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 0);
}

#[test]
fn simplifying_keeps_colours_where_the_format_has_them_and_says_where_not() {
    let folder = scratch("colours");
    let model = folder.join("c.ply");
    let made = run(&["generate", "organic", "--faces", "3000", "-o", path(&model)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let simplified = |name: &str| {
        let out = folder.join(name);
        let call = [
            "simplify",
            path(&model),
            "--faces",
            "500",
            "--eye",
            "3,1,2",
            "--json",
        ];
        let json = run_json(&[&call[..], &["-o", path(&out)]].concat());
        let warnings = json["warnings"].as_array().unwrap().len();
        (fs::read(&out).unwrap(), warnings, json)
    };
    let (ply, warnings, _) = simplified("s.ply");
    assert!(String::from_utf8_lossy(&ply).contains("property uchar red"));
    assert_eq!(warnings, 0);
    let (obj, warnings, _) = simplified("s.obj");
    let obj = String::from_utf8(obj).unwrap();
    let first = obj.lines().find(|line| line.starts_with("v ")).unwrap();
    assert_eq!((first.split(' ').count(), warnings), (7, 0), "{first}");
    // Of more than one colour.
    let colours = |line: &str| line.split(' ').skip(4).collect::<Vec<_>>().join(" ");
    let vertices = obj.lines().filter(|line| line.starts_with("v "));
    let mut different: Vec<String> = vertices.map(colours).collect();
    different.sort();
    different.dedup();
    assert!(different.len() > 50, "{}", different.len());
    let (_, warnings, json) = simplified("s.stl");
    assert_eq!(warnings, 1, "{json}");
    assert!(
        json["warnings"][0]
            .as_str()
            .unwrap()
            .contains("vertex colours")
    );
}

#[test]
fn texture_coordinates_and_materials_go_through_simplifying() {
    let folder = scratch("textured");
    let model = folder.join("t.obj");
    fs::write(&model, textured_sphere()).unwrap();
    let library = "newmtl skin\nKd 1 1 1\nmap_Kd skin.png\n";
    fs::write(folder.join("skin.mtl"), library).unwrap();
    let picture =
        image::RgbImage::from_fn(16, 16, |x, y| image::Rgb([x as u8 * 16, y as u8 * 16, 0]));
    picture.save(folder.join("skin.png")).unwrap();
    let simplified = |from: &str, to: &str, faces: &str| {
        let [from, to] = [from, to].map(|name| folder.join(name));
        run_json(&[
            "simplify",
            path(&from),
            "--faces",
            faces,
            "--eye",
            "9,1,2",
            "--json",
            "-o",
            path(&to),
        ])
    };
    let none = serde_json::json!([]);
    assert_eq!(simplified("t.obj", "s.glb", "400")["warnings"], none);
    assert_eq!(simplified("t.obj", "s.obj", "400")["warnings"], none);
    for name in ["s.mtl", "s-texture-0.png"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
    // What was written is read again, textures and all, and simplified further.
    for from in ["s.glb", "s.obj"] {
        assert_eq!(
            simplified(from, "again.ply", "200")["warnings"],
            none,
            "{from}"
        );
        let ply = fs::read(folder.join("again.ply")).unwrap();
        let head = String::from_utf8_lossy(&ply[..400]).into_owned();
        assert!(
            head.contains("comment TextureFile again-texture-0.png"),
            "{head}"
        );
        assert!(head.contains("float texcoord"), "{head}");
    }
    let told = simplified("t.obj", "s.off", "400");
    assert!(
        told["warnings"][0]
            .as_str()
            .unwrap()
            .contains("texture coordinates and materials")
    );
    // A library that was not written here stays.
    let ended = run(&[
        "simplify",
        path(&model),
        "--eye",
        "9,1,2",
        "-o",
        path(&folder.join("skin.obj")),
    ]);
    check_one_sentence(&ended, "skin.obj");
    assert_eq!(
        fs::read(folder.join("skin.mtl")).unwrap(),
        library.as_bytes()
    );
    assert!(!folder.join("skin.obj").exists());
}

/// A sphere with longitude and latitude for texture coordinates, and so with a seam and two poles.
fn textured_sphere() -> String {
    const AROUND: usize = 40;
    const DOWN: usize = 20;
    let mut text = "mtllib skin.mtl\nusemtl skin\nv 0 1 0\nv 0 -1 0\n".to_owned();
    let at = |k: usize, n: usize| k as f64 / n as f64;
    for j in 1..DOWN {
        let (s, y) = (std::f64::consts::PI * at(j, DOWN)).sin_cos();
        for i in 0..AROUND {
            let (z, x) = (std::f64::consts::TAU * at(i, AROUND)).sin_cos();
            text.push_str(&format!("v {} {y} {}\n", s * x, s * z));
        }
    }
    for j in 0..=DOWN {
        for i in 0..=AROUND {
            text.push_str(&format!("vt {} {}\n", at(i, AROUND), 1.0 - at(j, DOWN)));
        }
    }
    let vertex = |i: usize, j: usize| match j {
        0 => 1,
        DOWN => 2,
        _ => 3 + (j - 1) * AROUND + i % AROUND,
    };
    let uv = |i: usize, j: usize| 1 + j * (AROUND + 1) + i;
    for j in 0..DOWN {
        for i in 0..AROUND {
            let corner = |i: usize, j: usize| format!("{}/{}", vertex(i, j), uv(i, j));
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| corner(i, j));
            if j > 0 {
                text.push_str(&format!("f {a} {b} {c}\n"));
            }
            if j + 1 < DOWN {
                text.push_str(&format!("f {a} {c} {d}\n"));
            }
        }
    }
    text
}
