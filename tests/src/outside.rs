//! Files that are not part of the repository, in `../shared` beside it, and a list of what was skipped without them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A file or folder of `../shared`, or nothing where it is missing, which is noted as skipped.
#[must_use]
pub fn shared(name: &str) -> Option<PathBuf> {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = crate_folder.ancestors();
    let root = folders.find(|folder| folder.join("Cargo.lock").exists())?;
    let path = root.join("../shared").join(name);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("../shared/{name} is not here"));
    None
}

/// Notes that something was not tested, and why: on standard error, and as a line of the file that the environment names as
/// `SILMAP_SKIPPED`, which `tools/test` prints at its end.
pub fn skip(why: &str) {
    eprintln!("skipped: {why}");
    if let Some(list) = std::env::var_os("SILMAP_SKIPPED") {
        let file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(list);
        // One write, so that lines of several processes do not mix.
        let written = file.and_then(|mut file| file.write_all(format!("{why}\n").as_bytes()));
        if let Err(reason) = written {
            eprintln!("the list of skipped tests cannot be written: {reason}");
        }
    }
}
