//! Accepts what a test produced as its new reference.
//!
//! A test that finds its reference different or missing fails, leaves what it got under `target/image-tests/actual/` and
//! names the command that accepts it. Accepting is a copy into `tests/golden/`, for a person to look at in the diff.

use std::fs;
use std::path::Path;

use anyhow::{Context, bail, ensure};

/// Where tests leave what they got, from the repository's root.
const ACTUAL_DIR: &str = "target/image-tests/actual";
/// Where the references are.
const GOLDEN_DIR: &str = "tests/golden";
/// Largest reference in bytes: they live in the repository for ever.
const LARGEST_REFERENCE_BYTES: u64 = 16 * 1024;

/// Accepts the named references, all of them for `--all`; lists them when there is no name.
pub(crate) fn run(root: &Path, names: &[String]) -> anyhow::Result<String> {
    let waiting = waiting_names(&root.join(ACTUAL_DIR))?;
    if names.is_empty() {
        return Ok(if waiting.is_empty() {
            "no reference differs: run the tests first\n".to_owned()
        } else {
            format!("{}\n", waiting.join("\n"))
        });
    }
    let chosen = match names {
        [all] if all == "--all" => waiting.clone(),
        _ => names.to_vec(),
    };
    let mut summary = String::new();
    for name in &chosen {
        ensure!(
            waiting.contains(name),
            "no test left anything for {name}: run the tests, then `cargo xtask bless` to see what waits"
        );
        accept(root, name)?;
        summary.push_str(&format!("{GOLDEN_DIR}/{name}\n"));
    }
    Ok(summary)
}

/// Names of the files that tests left, sorted.
fn waiting_names(folder: &Path) -> anyhow::Result<Vec<String>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let entries =
        fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        names.extend(entry?.file_name().into_string());
    }
    names.sort();
    Ok(names)
}

fn accept(root: &Path, name: &str) -> anyhow::Result<()> {
    let (from, to) = (root.join(ACTUAL_DIR).join(name), root.join(GOLDEN_DIR));
    let bytes = fs::metadata(&from)
        .with_context(|| format!("{} cannot be read", from.display()))?
        .len();
    if bytes > LARGEST_REFERENCE_BYTES {
        bail!("{name} has {bytes} bytes; a reference may have {LARGEST_REFERENCE_BYTES}");
    }
    fs::create_dir_all(&to).with_context(|| format!("{} cannot be made", to.display()))?;
    fs::copy(&from, to.join(name)).with_context(|| format!("{name} cannot be copied"))?;
    fs::remove_file(&from).with_context(|| format!("{} cannot be removed", from.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of its own for one test, emptied first.
    fn scratch(name: &str) -> std::path::PathBuf {
        let root = std::env::temp_dir().join(format!("xtask-bless-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&root);
        fs::create_dir_all(root.join(ACTUAL_DIR)).unwrap();
        root
    }

    #[test]
    fn accepting_moves_the_file_into_the_references() {
        let root = scratch("accepting");
        fs::write(root.join(ACTUAL_DIR).join("a.txt"), "new").unwrap();
        assert_eq!(run(&root, &[]).unwrap(), "a.txt\n");
        run(&root, &["a.txt".to_owned()]).unwrap();
        assert_eq!(
            fs::read_to_string(root.join(GOLDEN_DIR).join("a.txt")).unwrap(),
            "new"
        );
        assert!(run(&root, &["a.txt".to_owned()]).is_err());
        fs::remove_dir_all(&root).unwrap();
    }

    #[test]
    fn a_big_reference_is_refused() {
        let root = scratch("big");
        fs::write(
            root.join(ACTUAL_DIR).join("b.png"),
            vec![0; LARGEST_REFERENCE_BYTES as usize + 1],
        )
        .unwrap();
        assert!(run(&root, &["--all".to_owned()]).is_err());
        assert!(!root.join(GOLDEN_DIR).join("b.png").exists());
        fs::remove_dir_all(&root).unwrap();
    }
}
