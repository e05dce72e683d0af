//! Running the binary, and one small asset for everybody.

#![allow(
    dead_code,
    reason = "each test file is a crate of its own and uses a part of this"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

pub(crate) mod captured;

#[allow(unreachable_pub, reason = "the file is shared with a library")]
#[path = "../../../../tests/src/outside.rs"]
pub(crate) mod outside;

/// Options of a build that takes a second.
pub(crate) const SMALL_BUILD: &[&str] = &[
    "--views",
    "64",
    "--keep",
    "20",
    "--resolution",
    "96",
    "--faces",
    "120",
    "--texture-views",
    "4",
    "--texture-size",
    "32",
];

/// How a run of the binary ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Exit code; −1 when a signal ended it.
    pub(crate) code: i32,
    /// Standard output.
    pub(crate) out: String,
    /// Standard error.
    pub(crate) err: String,
}

impl Ended {
    /// Runs a command to its end.
    pub(crate) fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// The binary, with lines of one width whatever the terminal.
pub(crate) fn bare() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_silmap"));
    command.env("COLUMNS", "100");
    command
}

/// Runs the binary.
pub(crate) fn run(arguments: &[&str]) -> Ended {
    Ended::of(bare().args(arguments))
}

/// Runs the binary, which must succeed, and reads what it printed.
pub(crate) fn run_json(arguments: &[&str]) -> Value {
    let ended = run(arguments);
    assert_eq!(ended.code, 0, "{arguments:?}: {}", ended.err);
    serde_json::from_str(&ended.out).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {}", ended.out))
}

/// Asserts that a run ended in exit code 1 and one sentence, after warnings at most.
pub(crate) fn check_one_sentence(ended: &Ended, what: &str) {
    assert_eq!(ended.code, 1, "{what}: {ended:?}");
    let (error, before) = ended
        .err
        .trim_end()
        .rsplit_once('\n')
        .map_or((ended.err.as_str(), ""), |(before, error)| (error, before));
    assert!(
        error.starts_with("silmap: error: "),
        "{what}: {}",
        ended.err
    );
    assert!(
        before
            .lines()
            .all(|line| line.starts_with("silmap: warning: ")),
        "{what}: {}",
        ended.err
    );
    assert!(!ended.err.contains("panicked"), "{what}: {}", ended.err);
    let mut parts = error["silmap: error: ".len()..].split(": ");
    let file = parts.next();
    assert_ne!(file, parts.next(), "{what}: says it twice");
}

/// Starts the binary, which must still be at work after some time, interrupts it, and asserts that it ends soon and says so.
#[cfg(unix)]
pub(crate) fn interrupt_after(arguments: &[&str], wait: std::time::Duration) {
    use std::io::Read;
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let mut child = bare()
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(wait);
    assert!(
        child.try_wait().unwrap().is_none(),
        "it ended too early: {arguments:?}"
    );
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let since = Instant::now();
    let status = child.wait().unwrap();
    assert!(since.elapsed() < Duration::from_secs(20), "{arguments:?}");
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert_eq!(status.code(), Some(130), "{arguments:?}: {err}");
    assert_eq!(err, "silmap: interrupted\n");
}

/// An empty folder for one test.
pub(crate) fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether tests with a graphics adapter are to be left out; says so.
pub(crate) fn is_gpu_skipped() -> bool {
    let is_skipped = std::env::var("SILMAP_GPU").is_ok_and(|v| v == "skip");
    if is_skipped {
        outside::skip("tests on a graphics adapter: SILMAP_GPU=skip");
    }
    is_skipped
}

/// A generated torus and the asset made from it.
#[derive(Debug)]
pub(crate) struct Fixture {
    /// The mesh.
    pub(crate) model: PathBuf,
    /// The asset.
    pub(crate) asset: PathBuf,
    /// What `build --json` printed.
    pub(crate) build: Value,
}

/// The fixture of this test file, made when it is first asked for.
pub(crate) fn fixture() -> &'static Fixture {
    static MADE: OnceLock<Fixture> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = scratch(concat!("fixture-", env!("CARGO_CRATE_NAME")));
        let (model, asset) = (folder.join("torus.ply"), folder.join("torus.glb"));
        let model_text = model.to_str().unwrap();
        let made = run(&["generate", "torus", "--faces", "1200", "-o", model_text]);
        assert_eq!(made.code, 0, "{}", made.err);
        let mut arguments = vec!["build", model_text, "-o", asset.to_str().unwrap(), "--json"];
        arguments.extend(SMALL_BUILD);
        let build = run_json(&arguments);
        Fixture {
            model,
            asset,
            build,
        }
    })
}

/// Asserts that a JSON object has a value at each path, its parts split by dots.
pub(crate) fn check_fields(object: &Value, paths: &[&str]) {
    for path in paths {
        let pointer = format!("/{}", path.replace('.', "/"));
        assert!(
            object.pointer(&pointer).is_some_and(|v| !v.is_null()),
            "{path} is missing in {object}"
        );
    }
}

/// A path as an argument.
pub(crate) fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}
