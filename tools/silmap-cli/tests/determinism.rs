//! The same input and options give the same file, for any number of threads.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;

use common::{SMALL_BUILD, fixture, run, scratch};

/// The bytes of an asset built from the common model with some options on top of the small ones.
fn built(name: &str, options: &[&str]) -> Vec<u8> {
    let out = scratch("determinism").join(name);
    let out_text = out.to_str().unwrap();
    let mut arguments = vec!["build", fixture().model.to_str().unwrap(), "-o", out_text];
    arguments.extend(SMALL_BUILD);
    arguments.extend(options);
    let ended = run(&arguments);
    assert_eq!(ended.code, 0, "{}", ended.err);
    fs::read(out).unwrap()
}

#[test]
fn threads_do_not_change_the_bytes() {
    let alone = built("one.glb", &["--threads", "1"]);
    let four = built("four.glb", &["--threads", "4"]);
    assert!(alone == four, "1 and 4 threads give different files");
    assert!(
        alone == fs::read(&fixture().asset).unwrap(),
        "a second run gives another file"
    );
    // And the comparison can fail.
    let coarser = built("coarser.glb", &["--tolerance", "2"]);
    assert!(
        alone != coarser,
        "an option that changes the contours changes nothing"
    );
}

#[test]
fn more_threads_than_are_of_use_are_not_started() {
    let model = fixture().model.to_str().unwrap();
    let edges = ["edges", model, "--eye", "0,0,9", "--list", "--json"];
    let with = |threads: &[&str]| {
        let ended = run(&[&edges[..], threads].concat());
        assert_eq!(ended.code, 0, "{}", ended.err);
        ended.err
    };
    assert_eq!(with(&["--threads", "2"]), "");
    let warning = with(&["--threads", "1000"]);
    let cores = std::thread::available_parallelism().unwrap().get();
    assert_eq!(
        warning.contains("--threads 1000"),
        2 * cores < 1000,
        "{warning}"
    );
}
