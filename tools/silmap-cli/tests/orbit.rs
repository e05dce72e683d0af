//! `silmap render --orbit`: numbered pictures and animations of a turn are those of single renders, or there is nothing.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::time::Duration;

use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::LoopCount;
use image::{AnimationDecoder, RgbaImage};
use serde_json::Value;

use common::{
    check_fields, check_one_sentence, fixture, is_gpu_skipped, path, run, run_json, scratch,
};

const EYE: &str = "--eye=1.5,1.2,3.5";

/// A small picture, so that a software adapter takes no time.
const SIZE: [&str; 2] = ["--size", "72x48"];

fn words<'a>(parts: &[&[&'a str]]) -> Vec<&'a str> {
    parts.concat()
}

/// Every file's name in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// The eye of a frame as an argument.
fn eye(turn: &Value, frame: usize) -> String {
    let numbers = turn["eyes"][frame].as_array().unwrap();
    let numbers: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    format!("--eye={}", numbers.join(","))
}

/// Numbered pictures of a turn, and what is printed about them.
fn pictures(subject: &[&str], frames: &str, pattern: &Path) -> Value {
    let turn = ["--orbit", frames, "-o", path(pattern), "--json"];
    run_json(&words(&[&["render"], subject, &turn]))
}

fn open(file: &Path) -> RgbaImage {
    image::open(file).unwrap().into_rgba8()
}

/// Frames, the milliseconds that each is shown, and whether they play for ever.
fn decoded(file: &Path) -> (Vec<RgbaImage>, Vec<u32>, bool) {
    let reader = Cursor::new(fs::read(file).unwrap());
    let (frames, count) = if file.extension().unwrap() == "webp" {
        let decoder = WebPDecoder::new(reader).unwrap();
        assert!(decoder.has_animation());
        let count = decoder.loop_count();
        (decoder.into_frames(), count)
    } else {
        let decoder = PngDecoder::new(reader).unwrap().apng().unwrap();
        let count = decoder.loop_count();
        (decoder.into_frames(), count)
    };
    let frames = frames.collect_frames().unwrap();
    let millis = frames.iter().map(|frame| {
        let (over, under) = frame.delay().numer_denom_ms();
        over / under
    });
    let millis = millis.collect();
    let images = frames.into_iter().map(image::Frame::into_buffer).collect();
    (images, millis, matches!(count, LoopCount::Infinite))
}

/// Mean difference of channels, of 255.
fn difference(one: &RgbaImage, other: &RgbaImage) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let pairs = one.iter().zip(other.iter());
    let sum: u64 = pairs.map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / one.len() as f64
}

#[test]
fn each_frame_is_the_render_of_its_eye() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, model) = (path(&fixture().asset), path(&fixture().model));
    let folder = scratch("orbit-frames");
    let subjects: [&[&str]; 9] = [
        &[asset, EYE],
        &[
            asset,
            EYE,
            "--paint",
            "tiles",
            "--background",
            "transparent",
        ],
        &[
            asset,
            EYE,
            "--up",
            "1,2,0",
            "--target",
            "0.2,0,0.1",
            "--fov",
            "50",
        ],
        &[asset, EYE, "--light=-1,0.5,1", "--antialias", "msaa"],
        &[asset, EYE, "--shadow", "1,2,-1", "--fov", "60"],
        &[asset, EYE, "--mode", "silhouette", "--method", "paper"],
        &[asset, EYE, "--mode", "difference", "--model", model],
        &[asset, EYE, "--mode", "exact", "--model", model],
        &[EYE, "--mode", "edges-fatten", "--model", model],
    ];
    for (k, subject) in subjects.iter().enumerate() {
        let subject = words(&[subject, &SIZE]);
        let turn = pictures(&subject, "3", &folder.join(format!("{k}-%02d.png")));
        check_fields(
            &turn,
            &[
                "files.2", "bytes", "frames", "seconds", "width", "adapter", "eyes.2.2", "up.2",
            ],
        );
        assert!(turn.get("fps").is_none());
        let files: Vec<PathBuf> = (0..3)
            .map(|n| folder.join(format!("{k}-0{n}.png")))
            .collect();
        let bytes: u64 = files.iter().map(|f| fs::metadata(f).unwrap().len()).sum();
        assert_eq!(turn["bytes"], bytes);
        let alone = folder.join("alone.png");
        for (frame, file) in files.iter().enumerate() {
            // The first as it was typed.
            let at = if frame == 0 {
                EYE.to_owned()
            } else {
                eye(&turn, frame)
            };
            let others: Vec<&str> = subject
                .iter()
                .copied()
                .filter(|&word| word != EYE)
                .collect();
            let ended = run(&words(&[&["render", &at, "-o", path(&alone)], &others]));
            assert_eq!(ended.code, 0, "{ended:?}");
            let same = fs::read(file).unwrap() == fs::read(&alone).unwrap();
            assert!(same, "{subject:?}, frame {frame}");
        }
        // Another frame is another picture.
        let [first, second] = [0, 1].map(|frame| open(&files[frame]));
        assert!(difference(&first, &second) > 0.2, "{subject:?}");
    }
    assert_eq!(names(&folder).len(), 9 * 3 + 1);
}

#[test]
fn a_turn_closes() {
    if is_gpu_skipped() {
        return;
    }
    let folder = scratch("orbit-closes");
    let subject = words(&[&[path(&fixture().asset), EYE], &SIZE]);
    let four = pictures(&subject, "4", &folder.join("four-%d.png"));
    let eight = pictures(&subject, "8", &folder.join("eight-%d.png"));
    for k in 0..4 {
        assert_eq!(four["eyes"][k], eight["eyes"][2 * k], "{k}");
        let [one, other] = [format!("four-{k}.png"), format!("eight-{}.png", 2 * k)];
        let [one, other] = [one, other].map(|name| fs::read(folder.join(name)).unwrap());
        assert!(one == other, "frame {k}");
    }
    let point = |k: usize| {
        let at = |axis: usize| eight["eyes"][k % 8][axis].as_f64().unwrap();
        glam::DVec3::new(at(0), at(1), at(2))
    };
    let steps: Vec<f64> = (0..8).map(|k| point(k).distance(point(k + 1))).collect();
    assert!(
        steps.iter().all(|step| (step - steps[0]).abs() < 1e-9),
        "{steps:?}"
    );
    assert!(
        (0..8).all(|k| (point(k).y - 1.2).abs() < 1e-9),
        "the height is kept"
    );
    assert_eq!(point(0).to_array(), [1.5, 1.2, 3.5]);
}

#[test]
fn animations_hold_those_frames_and_play_for_ever() {
    if is_gpu_skipped() {
        return;
    }
    let folder = scratch("orbit-animations");
    for (backdrop, is_opaque) in [("#ffffff", true), ("transparent", false)] {
        let subject = [path(&fixture().asset), EYE, "--background", backdrop];
        let subject = words(&[&subject, &SIZE]);
        pictures(&subject, "5", &folder.join("%d.png"));
        let frames: Vec<RgbaImage> = (0..5)
            .map(|k| open(&folder.join(format!("{k}.png"))))
            .collect();
        let animated = |name: &str, options: &[&str]| {
            let file = folder.join(name);
            let turn = ["render", "--orbit", "5", "-o", path(&file), "--json"];
            let printed = run_json(&words(&[&turn, &subject, options]));
            assert_eq!(printed["files"], serde_json::json!([path(&file)]));
            assert_eq!(printed["bytes"], fs::metadata(&file).unwrap().len());
            (decoded(&file), printed)
        };
        let rates: [(&[&str], f64, [u32; 5]); 2] = [
            (&[], 25.0, [40; 5]),
            (&["--fps", "30"], 30.0, [33, 34, 33, 33, 34]),
        ];
        for (options, per_second, wanted) in rates {
            for name in ["turn.webp", "turn.png"] {
                let ((found, millis, is_endless), printed) = animated(name, options);
                assert!(found == frames, "{name}, {backdrop}");
                assert!(is_endless, "{name}");
                assert_eq!(printed["fps"], per_second);
                if name == "turn.webp" {
                    assert_eq!(millis, wanted);
                }
            }
        }
        // A reader that knows no animations shows the plain render.
        assert!(open(&folder.join("turn.png")) == frames[0]);
        let exact = fs::metadata(folder.join("turn.webp")).unwrap().len();
        let ((found, _, _), printed) = animated("lossy.webp", &["--quality", "75"]);
        assert!(printed["bytes"].as_u64().unwrap() < exact);
        for (k, (lossy, frame)) in found.iter().zip(&frames).enumerate() {
            let [own, other] = [frame, &frames[(k + 1) % 5]].map(|f| {
                // Colours under what is not seen are free.
                let seen = |image: &RgbaImage| {
                    let mut image = image.clone();
                    image
                        .pixels_mut()
                        .filter(|p| p.0[3] == 0)
                        .for_each(|p| p.0 = [0; 4]);
                    image
                };
                difference(&seen(lossy), &seen(f))
            });
            assert!(
                own > 0.0 && own < 3.0 && own < 0.5 * other,
                "{k}: {own}, {other}"
            );
            assert_eq!(is_opaque, lossy.pixels().all(|p| p.0[3] == 255));
        }
    }
}

#[test]
fn the_same_turn_has_the_same_bytes() {
    if is_gpu_skipped() {
        return;
    }
    let folder = scratch("orbit-bytes");
    let subject = words(&[&["render", path(&fixture().asset), EYE], &SIZE]);
    for (name, options) in [
        ("turn.webp", &["--quality", "60"][..]),
        ("turn.png", &[]),
        ("exact.webp", &[]),
    ] {
        let made = ["one", "two"].map(|which| {
            let file = folder.join(format!("{which}-{name}"));
            let turn = ["--orbit", "3", "-o", path(&file)];
            let ended = run(&words(&[&subject, &turn, options]));
            assert_eq!((ended.code, ended.out.as_str()), (0, ""), "{ended:?}");
            assert!(ended.err.starts_with(path(&file)) && ended.err.contains("3 frames"));
            fs::read(file).unwrap()
        });
        assert!(made[0] == made[1], "{name}");
    }
}

#[test]
fn what_does_not_go_together_is_refused() {
    let folder = scratch("orbit-refused");
    let asset = path(&fixture().asset);
    let (pattern, webp, png) = (
        folder.join("%04d.png"),
        folder.join("turn.webp"),
        folder.join("turn.png"),
    );
    let (pattern, webp, png) = (path(&pattern), path(&webp), path(&png));
    let inside = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let [jpeg, wrong, twice] = ["turn.jpg", "%4d.png", "%d-%d.png"].map(inside);
    let usage: [(&[&str], &str); 14] = [
        (&["--orbit", "0", "-o", webp], "1..=3600"),
        (&["--orbit", "3601", "-o", webp], "1..=3600"),
        (&["--orbit", "-3", "-o", webp], "unexpected argument"),
        (
            &["--orbit", "4", "-o", &jpeg],
            "a JPEG file holds one picture",
        ),
        (&["--orbit", "4", "-o", &wrong], "begins a frame's number"),
        (&["--orbit", "4", "-o", &twice], "two numbers"),
        (
            &["--orbit", "4", "--fps", "9", "-o", pattern],
            "an animation only",
        ),
        (
            &["--orbit", "4", "--quality", "9", "-o", pattern],
            "an animation only",
        ),
        (
            &["--orbit", "4", "--quality", "9", "-o", png],
            "an animated .webp only",
        ),
        (&["--orbit", "4", "--quality", "101", "-o", webp], "0..=100"),
        (
            &["--orbit", "4", "--fps", "61", "-o", webp],
            "from 0.1 to 60",
        ),
        (
            &["--orbit", "4", "--size", "16384x9", "-o", webp],
            "16383 pixels a side",
        ),
        (&["--fps", "9", "-o", webp], "--orbit"),
        (&["--quality", "9", "-o", webp], "--orbit"),
    ];
    for (options, says) in usage {
        let ended = run(&words(&[&["render", asset, EYE], options]));
        assert_eq!(ended.code, 2, "{options:?}: {ended:?}");
        assert!(ended.err.contains(says), "{options:?}: {}", ended.err);
    }
    let camera = ["--camera", "cameras.json", "--view", "front"];
    let ended = run(&words(&[
        &["render", asset, "--orbit", "4", "-o", webp],
        &camera,
    ]));
    assert_eq!(ended.code, 2, "{ended:?}");
    assert!(
        ended.err.contains("a turn begins at '--eye"),
        "{}",
        ended.err
    );
    let over = run(&["render", asset, EYE, "--orbit", "4", "-o", asset]);
    assert_eq!(over.code, 1, "an asset is no picture: {over:?}");

    let [missing, gif, frames] = ["missing/turn.webp", "turn.gif", "missing/%04d.png"].map(inside);
    let jpegs = inside("%d.jpg");
    let input: [(&[&str], &str); 6] = [
        (&[EYE, "-o", &missing], "the folder does not exist"),
        (&[EYE, "-o", &frames], "the folder does not exist"),
        (&[EYE, "-o", &gif], "not .gif"),
        (
            &[EYE, "-o", &jpegs, "--background", "transparent"],
            "no transparency",
        ),
        (&["--eye=0.2,0,0", "-o", webp], "--eye 0.2,0,0"),
        (&["--eye=0,5,0", "--up", "0,1,0", "-o", webp], "--eye 0,5,0"),
    ];
    for (options, says) in input {
        let ended = run(&words(&[&["render", asset, "--orbit", "4"], options]));
        check_one_sentence(&ended, &format!("{options:?}"));
        assert!(ended.err.contains(says), "{options:?}: {}", ended.err);
    }
    assert_eq!(names(&folder), [""; 0], "something was left");
}

#[cfg(target_os = "linux")]
#[test]
fn a_turn_for_a_device_comes_at_the_end() {
    if is_gpu_skipped() {
        return;
    }
    let turn = words(&[
        &["render", path(&fixture().asset), EYE, "--orbit", "2"],
        &SIZE,
    ]);
    let ended = run(&words(&[&turn, &["-o", "/dev/full"]]));
    assert_eq!(ended.code, 4, "{ended:?}");
    assert!(
        ended.err.contains("/dev/full: it cannot be written"),
        "{ended:?}"
    );
    let ended = run(&words(&[&turn, &["-o", "/dev/null"]]));
    assert_eq!(ended.code, 0, "{ended:?}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_turn_leaves_what_was_there() {
    if is_gpu_skipped() {
        return;
    }
    let folder = scratch("orbit-interrupted");
    let old = folder.join("turn.webp");
    fs::write(&old, "what was there").unwrap();
    for name in ["turn.webp", "turn.png", "%04d.png"] {
        let out = folder.join(name);
        // Far more frames than the test waits for.
        let turn = ["--orbit", "3600", "--size", "640x640", "-o", path(&out)];
        let turn = words(&[&["render", path(&fixture().asset), EYE], &turn]);
        common::interrupt_after(&turn, Duration::from_millis(2500));
        assert_eq!(names(&folder), ["turn.webp"], "{name}");
    }
    assert_eq!(fs::read(&old).unwrap(), b"what was there");
}
