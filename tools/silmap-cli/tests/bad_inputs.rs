//! Broken and tricky files of other programs: each ends in one sentence or is handled, none in a panic, a hang, or a partial
//! output. The files are not part of this repository; without them there is nothing to check, and the test says so.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{Ended, SMALL_BUILD, bare, check_one_sentence, scratch};

/// Folders of mesh files, and whether a file in them may be built at all.
const MESHES: &[(&str, Outcome)] = &[
    ("reject", Outcome::Refused),
    ("not-closed", Outcome::Either),
    ("valid-but-tricky", Outcome::Either),
    ("gltf", Outcome::Refused),
];
/// Longest time that any of these small files may take.
const PATIENCE: Duration = Duration::from_secs(60);

#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Refused,
    Either,
}

fn files_in(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.is_file())
        .collect();
    files.sort();
    files
}

/// Builds a file with some options and checks how that ends.
fn check(file: &Path, options: &[&str], outcome: Outcome) -> bool {
    let folder = scratch("bad-inputs");
    let out = folder.join("out.glb");
    let since = Instant::now();
    let ended = Ended::of(
        bare()
            .args(["build", file.to_str().unwrap(), "-o", out.to_str().unwrap()])
            .args(SMALL_BUILD)
            .args(options),
    );
    let what = format!("{} {options:?}", file.display());
    assert!(
        since.elapsed() < PATIENCE,
        "{what} took {:?}",
        since.elapsed()
    );
    let name = file.file_name().unwrap().to_str().unwrap();
    if ended.code == 0 {
        assert!(
            outcome != Outcome::Refused,
            "{what} was built: {}",
            ended.err
        );
        assert!(fs::metadata(&out).unwrap().len() > 0, "{what}");
    } else {
        check_one_sentence(&ended, &what);
        assert!(ended.err.contains(name), "{what}: {}", ended.err);
        assert_eq!(
            fs::read_dir(&folder).unwrap().count(),
            0,
            "{what} left something"
        );
    }
    ended.code == 0
}

#[test]
fn every_bad_file_ends_well() {
    let Some(root) = common::outside::shared("bad-inputs") else {
        return;
    };
    let (mut checked, mut built) = (0, 0);
    for (folder, outcome) in MESHES {
        for file in files_in(&root.join(folder)) {
            for options in [&[][..], &["--close-holes", "--repair"]] {
                built += u32::from(check(&file, options, *outcome));
                checked += 1;
            }
        }
    }
    for file in files_in(&root.join("images")) {
        check(&file, &[], Outcome::Refused);
        checked += 1;
    }
    // Three photographs of a turntable are a capture, if a poor one, and a mask may be half as large as its image.
    for file in files_in(&root.join("cameras")) {
        let name = file.file_name().unwrap_or_default();
        let is_good = name == "good.json" || name == "mask-wrong-size.json";
        let outcome = if is_good {
            Outcome::Either
        } else {
            Outcome::Refused
        };
        check(&file, &["--voxels", "40"], outcome);
        checked += 1;
    }
    assert!(checked > 100, "only {checked} files were found");
    assert!(
        built > 10,
        "only {built} of the files that are in order were built"
    );
}
