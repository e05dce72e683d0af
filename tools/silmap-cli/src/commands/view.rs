//! `silmap view`: starts the viewer, a program of its own, so that servers need no window system to have the other commands.

use std::path::PathBuf;
use std::process::Command;

use crate::args::ViewArgs;

/// The viewer's file, without a suffix.
const VIEWER: &str = "silmap-viewer";

pub(crate) fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let mut viewer = Command::new(program());
    viewer.args(&args.words);
    start(viewer)
}

/// The one that was built with this program, or else the one that the system finds.
fn program() -> PathBuf {
    let name = format!("{VIEWER}{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe()
        .ok()
        .map(|own| own.with_file_name(&name));
    beside
        .filter(|path| path.is_file())
        .unwrap_or_else(|| PathBuf::from(name))
}

fn missing(error: &std::io::Error) -> anyhow::Error {
    anyhow::anyhow!(
        "{VIEWER} cannot be started ({error}): it is neither beside silmap nor on the PATH; build it with \
         `cargo build --release --package {VIEWER}`"
    )
}

/// Becomes the viewer.
#[cfg(unix)]
fn start(mut viewer: Command) -> anyhow::Result<()> {
    use std::os::unix::process::CommandExt;
    // Only returns when it failed.
    Err(missing(&viewer.exec()))
}

/// Waits for the viewer and ends as it does.
#[cfg(not(unix))]
fn start(mut viewer: Command) -> anyhow::Result<()> {
    let status = viewer.status().map_err(|error| missing(&error))?;
    std::process::exit(status.code().unwrap_or(1));
}
