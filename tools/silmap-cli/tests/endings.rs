//! How the binary ends when something is wrong: bad files, full disks, no adapter, interrupts, closed streams.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::io::Read;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use common::{Ended, SMALL_BUILD, bare, check_one_sentence, fixture, path, run, run_json, scratch};

#[test]
fn an_eye_that_sees_nothing_is_refused() {
    let (asset, folder) = (path(&fixture().asset), scratch("eye"));
    let out = folder.join("never.png");
    let center = run_json(&["inspect", asset, "--json"])["model"]["center"].clone();
    let center: Vec<String> = center
        .as_array()
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    for eye in ["0.6,0,0", &center.join(","), "nan,0,3", "inf,0,0"] {
        let eye = format!("--eye={eye}");
        for arguments in [
            vec!["contour", asset, &eye],
            vec!["contour", asset, &eye, "--fov", "40"],
            vec!["render", asset, &eye, "-o", path(&out)],
        ] {
            let ended = run(&arguments);
            check_one_sentence(&ended, &format!("{arguments:?}"));
            assert_eq!(ended.out, "");
        }
    }
    for (option, value) in [
        ("--fov", "0"),
        ("--fov", "180"),
        ("--up", "0,0,0"),
        ("--up", "0,0,5"),
    ] {
        let ended = run(&["contour", asset, "--eye", "0,0,4", option, value]);
        check_one_sentence(&ended, &format!("{option} {value}"));
    }
    assert!(!out.exists());
}

#[test]
fn a_broken_asset_is_refused() {
    let folder = scratch("broken");
    let file = folder.join("broken.glb");
    let good = fs::read(&fixture().asset).unwrap();
    let mut broken: Vec<(String, Vec<u8>)> = vec![
        ("empty".to_owned(), Vec::new()),
        ("not one".to_owned(), b"a text".to_vec()),
        ("longer".to_owned(), [&good[..], b"more"].concat()),
    ];
    for part in [
        1,
        11,
        12,
        19,
        20,
        good.len() / 3,
        good.len() - 4,
        good.len() - 1,
    ] {
        broken.push((format!("cut at {part}"), good[..part].to_vec()));
    }
    let stride = good.len() / 300;
    for place in (0..24).chain((0..300).map(|k| k * stride + 7)) {
        let mut bytes = good.clone();
        bytes[place] ^= 0x10;
        broken.push((format!("byte {place} flipped"), bytes));
    }
    let whole = run(&["inspect", path(&fixture().asset)]).out;
    let mut unharmed = 0;
    for (what, bytes) in broken {
        fs::write(&file, bytes).unwrap();
        let ended = run(&["inspect", path(&file)]);
        // What lies around the silhouettes may be rewritten by other programs; then nothing else is read of them.
        if what.ends_with("flipped") && ended.code == 0 {
            assert_eq!(ended.out, whole, "{what}");
            unharmed += 1;
            continue;
        }
        check_one_sentence(&ended, &what);
        assert!(ended.err.contains("broken.glb"), "{what}: {}", ended.err);
    }
    assert!(unharmed < 100, "{unharmed}");
    let missing = run(&["inspect", path(&folder.join("missing.glb"))]);
    check_one_sentence(&missing, "missing");
    // A mesh where an asset is needed.
    check_one_sentence(&run(&["inspect", path(&fixture().model)]), "a mesh");
}

#[test]
fn what_cannot_be_written_is_said_before_the_work() {
    let folder = scratch("unwritable");
    let model = path(&fixture().model);
    let file = folder.join("file");
    fs::write(&file, "a file, not a folder").unwrap();
    let outs = [
        folder.join("missing/out.glb"),
        file.join("out.glb"),
        folder.clone(),
        PathBuf::from("/proc/out.glb"),
    ];
    for out in &outs {
        // The full settings would take a minute.
        let since = Instant::now();
        let ended = run(&["build", model, "-o", path(out)]);
        check_one_sentence(&ended, path(out));
        assert!(
            since.elapsed() < Duration::from_secs(10),
            "{}",
            out.display()
        );
    }
    for (out, says) in [
        (&outs[0], "the folder does not exist"),
        (&outs[1], "not a directory"),
        (
            &folder.join("out.xyz"),
            "out.xyz: cannot be written as this kind of file",
        ),
    ] {
        let ended = run(&["hull", model, "-o", path(out)]);
        check_one_sentence(&ended, path(out));
        assert!(ended.err.contains(says), "{}", ended.err);
        assert!(!ended.err.contains(".part"), "{}", ended.err);
    }
    for command in [
        vec!["hull", model, "-o", path(&outs[1])],
        vec!["generate", "torus", "-o", path(&outs[1])],
        vec!["demo", "-o", path(&file)],
    ] {
        check_one_sentence(&run(&command), &format!("{command:?}"));
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said() {
    let ended = run(&[
        "contour",
        path(&fixture().asset),
        "--eye",
        "0,0,4",
        "-o",
        "/dev/full",
    ]);
    // Out of resources: worth trying elsewhere.
    assert_eq!(ended.code, 4, "{ended:?}");
    assert_eq!(ended.err.lines().count(), 1, "{ended:?}");
    assert!(
        ended.err.starts_with("silmap: error: /dev/full: "),
        "{ended:?}"
    );
}

#[test]
fn a_failed_build_leaves_what_was_there() {
    let folder = scratch("failed");
    let (model, out) = (folder.join("open.obj"), folder.join("out.glb"));
    fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(&out, "what was there").unwrap();
    let ended = run(&["build", path(&model), "-o", path(&out)]);
    check_one_sentence(&ended, "an open mesh");
    assert!(ended.err.contains("open.obj"), "{}", ended.err);
    assert_eq!(fs::read(&out).unwrap(), b"what was there");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn without_an_adapter_only_pictures_are_impossible() {
    let (asset, model, folder) = (
        path(&fixture().asset),
        path(&fixture().model),
        scratch("adapter"),
    );
    let without = |arguments: &[&str]| {
        let mut command = bare();
        command.args(arguments).env("WGPU_BACKEND", "vulkan");
        for name in ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
            command.env(name, "/nonexistent/driver.json");
        }
        Ended::of(&mut command)
    };
    let picture = folder.join("never.png");
    let ended = without(&["render", asset, "--eye", "0,0,4", "-o", path(&picture)]);
    assert_eq!(ended.code, 3, "{}", ended.err);
    assert!(ended.err.contains("mesa-vulkan-drivers"), "{}", ended.err);
    assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
    assert!(!picture.exists());

    let out = folder.join("again.glb");
    let mut build = vec!["build", model, "-o", path(&out)];
    build.extend(SMALL_BUILD);
    assert_eq!(without(&build).code, 0);
    assert_eq!(without(&["contour", asset, "--eye", "0,0,4"]).code, 0);
    assert_eq!(without(&["inspect", asset]).code, 0);
    let evaluate = ["evaluate", asset, "--model", model, "--viewpoints", "1"];
    assert_eq!(without(&evaluate).code, 0);

    build.extend(["--backend", "gpu"]);
    let refused = without(&build);
    assert_eq!(refused.code, 3, "{}", refused.err);
}

#[cfg(unix)]
#[test]
fn an_interrupted_build_leaves_nothing() {
    let folder = scratch("interrupted");
    let model = folder.join("big.ply");
    let made = run(&["generate", "torus", "--faces", "60000", "-o", path(&model)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let out = folder.join("out.glb");
    // Far more work than the test waits for.
    common::interrupt_after(
        &["build", path(&model), "-o", path(&out), "--views", "20000"],
        Duration::from_millis(2500),
    );
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn interrupted_applications_leave_nothing() {
    let folder = scratch("interrupted-applications");
    let [model, eyes, mask, start] =
        ["big.ply", "eyes.txt", "mask.png", "start.json"].map(|n| folder.join(n));
    let ended = run(&["generate", "torus", "--faces", "200000", "-o", path(&model)]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    // Eyes by the thousand, each of which looks at every face.
    fs::write(&eyes, "0,0,5\n0,5,0\n".repeat(5_000)).unwrap();
    // Nothing that this model could look like, so that every start is tried to the end.
    let mut image = image::GrayImage::new(512, 512);
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let is_inside =
            (128..384).contains(&x) && (96..416).contains(&y) && (x / 16 + y / 16) % 3 > 0;
        pixel.0 = [if is_inside { 255 } else { 0 }];
    }
    image.save(&mask).unwrap();
    fs::write(&start, r#"{"eye": [0.5, 0.4, 6]}"#).unwrap();
    let (simple, pose) = (folder.join("simple.obj"), folder.join("pose.json"));
    let long = Duration::from_millis(1500);
    common::interrupt_after(
        &[
            "simplify",
            path(&model),
            "--eyes",
            path(&eyes),
            "-o",
            path(&simple),
        ],
        long,
    );
    // And in the middle of collapsing.
    let few = ["--eye", "0,0,5", "--faces", "100"];
    common::interrupt_after(
        &[&["simplify", path(&model), "-o", path(&simple)][..], &few].concat(),
        long,
    );
    // The search of 200,000 faces takes far longer to build.
    let cones = ["--eye", "0,0,5", "--method", "cones"];
    common::interrupt_after(&[&["edges", path(&model)][..], &cones].concat(), long);
    let from = ["--mask", path(&mask), "--start", path(&start)];
    common::interrupt_after(
        &[&["align", path(&model), "-o", path(&pose)][..], &from].concat(),
        long,
    );
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 4);
}

#[test]
fn nobody_listening_is_no_panic() {
    let mut child = bare()
        .args(["inspect", path(&fixture().asset), "--full"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let status = child.wait().unwrap();
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert_eq!((status.code(), err.as_str()), (Some(0), ""));
}
