//! Checks the dependencies of crates against ARCHITECTURE.md, and those of modules for cycles.
//!
//! [`ARROWS`] is that table as data. `cargo metadata` says which workspace crates name which others, whatever the kind of
//! dependency; `cargo tree` says which outside crates each of the portable crates reaches, so that nothing which needs
//! threads or files slips into a web build by way of a third.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};
use serde_json::Value;

use crate::module_cycles::ModuleGraph;

/// Crate, and the workspace crates it may depend on.
const ARROWS: &[(&str, &[&str])] = &[
    ("silmap-geometry", &[]),
    ("silmap-gpu", &[]),
    ("silmap-map", &["silmap-geometry"]),
    ("silmap-curve", &["silmap-geometry", "silmap-map"]),
    ("silmap-mesh-io", &["silmap-geometry"]),
    ("silmap-hull", &["silmap-geometry"]),
    ("silmap-models", &["silmap-geometry"]),
    ("silmap-capture", &["silmap-geometry", "silmap-mesh-io"]),
    (
        "silmap-preprocess",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-hull",
            "silmap-mesh-io",
        ],
    ),
    (
        "silmap-runtime",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-curve",
            "silmap-gpu",
        ],
    ),
    (
        "silmap-study",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-runtime",
        ],
    ),
    ("silmap-exact", &["silmap-geometry"]),
    (
        "silmap-measure",
        &[
            "silmap-capture",
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-hull",
            "silmap-preprocess",
            "silmap-runtime",
            "silmap-study",
            "silmap-exact",
        ],
    ),
    (
        "silmap-report",
        &["silmap-geometry", "silmap-map", "silmap-measure"],
    ),
    (
        "silmap-viewer",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-mesh-io",
            "silmap-capture",
            "silmap-preprocess",
            "silmap-runtime",
            "silmap-study",
            "silmap-measure",
            "silmap-report",
        ],
    ),
    (
        "silmap-cli",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-hull",
            "silmap-mesh-io",
            "silmap-models",
            "silmap-capture",
            "silmap-preprocess",
            "silmap-runtime",
            "silmap-study",
            "silmap-exact",
            "silmap-measure",
            "silmap-report",
        ],
    ),
    (
        "silmap-tests",
        &[
            "silmap-geometry",
            "silmap-map",
            "silmap-gpu",
            "silmap-hull",
            "silmap-mesh-io",
            "silmap-models",
            "silmap-capture",
            "silmap-preprocess",
            "silmap-runtime",
            "silmap-study",
            "silmap-exact",
            "silmap-measure",
            "silmap-report",
            "silmap-cli",
        ],
    ),
    (
        "example-headless",
        &["silmap-geometry", "silmap-map", "silmap-runtime"],
    ),
    ("example-embed", &["silmap-map", "silmap-runtime"]),
    ("silmap-outlines", &["silmap-map", "silmap-curve"]),
    (
        "example-web",
        &["silmap-geometry", "silmap-map", "silmap-runtime"],
    ),
    ("xtask", &[]),
];

/// Crate, and the workspace crates that its tests, benchmarks and examples alone may use besides.
const TEST_ARROWS: &[(&str, &[&str])] = &[
    ("silmap-hull", &["silmap-models", "silmap-mesh-io"]),
    ("silmap-exact", &["silmap-models", "silmap-mesh-io"]),
    ("silmap-preprocess", &["silmap-models"]),
    ("silmap-capture", &["silmap-models"]),
    ("silmap-measure", &["silmap-models", "silmap-mesh-io"]),
    ("silmap-viewer", &["silmap-models"]),
];

/// One crate names another.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Arrow {
    from: String,
    to: String,
    /// Whether it is a dependency of tests and benchmarks alone.
    is_for_tests: bool,
}

/// Crates that must build for the web.
const PORTABLE: &[&str] = &[
    "silmap-geometry",
    "silmap-map",
    "silmap-curve",
    "silmap-outlines",
    "silmap-gpu",
    "silmap-runtime",
    "silmap-study",
];

/// The target of the web build.
const WEB_TARGET: &str = "wasm32-unknown-unknown";

/// Outside crates that no portable crate may reach: files, triangulation for preprocessing, threads.
const NATIVE_ONLY: &[&str] = &["spade", "rayon"];

/// Checks the whole workspace under `root`; the summary says how many arrows were looked at.
pub(crate) fn run(root: &Path) -> anyhow::Result<String> {
    let metadata = workspace_metadata(root)?;
    let arrows = workspace_arrows(&metadata)?;
    ensure!(
        !arrows.is_empty(),
        "cargo metadata shows no arrow between workspace crates: nothing was checked"
    );
    let mut faults = arrow_faults(&arrows);
    for &name in PORTABLE {
        faults.extend(reach_faults(name, &reached_crates(root, name)?));
    }
    faults.extend(document_faults(
        &read(root, "Cargo.toml")?,
        &read(root, "ARCHITECTURE.md")?,
    )?);
    let mut module_arrows = 0;
    for (package, crate_root) in crate_roots(&metadata)? {
        let graph = ModuleGraph::read(&crate_root)
            .with_context(|| format!("the modules of {package} cannot be read"))?;
        module_arrows += graph.arrow_count();
        let cycles = graph.cycles().into_iter();
        faults.extend(cycles.map(|cycle| format!("{package} has a cycle of modules: {cycle}")));
    }
    ensure!(
        module_arrows > 0,
        "no module names another: nothing was checked"
    );
    if !faults.is_empty() {
        bail!(
            "{} (the arrows are in tools/xtask/src/check_deps.rs, the reasons in ARCHITECTURE.md)",
            faults.join("; ")
        );
    }
    Ok(format!(
        "{} arrows between crates, all allowed; {module_arrows} between modules, no cycle\n",
        arrows.len()
    ))
}

/// One sentence for each arrow that is not in the table and each crate that the table does not know.
fn arrow_faults(arrows: &BTreeSet<Arrow>) -> Vec<String> {
    let allows = |table: &[(&str, &[&str])], arrow: &Arrow| {
        let row = table.iter().find(|(from, _)| *from == arrow.from);
        row.map(|(_, to)| to.contains(&arrow.to.as_str()))
    };
    arrows
        .iter()
        .filter_map(|arrow| {
            let Arrow { from, to, .. } = arrow;
            let by_tests = arrow.is_for_tests && allows(TEST_ARROWS, arrow) == Some(true);
            match allows(ARROWS, arrow) {
                None => Some(format!("{from} is not in the table of arrows")),
                Some(false) if !by_tests => Some(format!("{from} may not depend on {to}")),
                Some(_) => None,
            }
        })
        .collect()
}

/// One sentence for each native-only crate among those that `name` reaches.
fn reach_faults(name: &str, reached: &BTreeSet<String>) -> Vec<String> {
    NATIVE_ONLY
        .iter()
        .filter(|&&banned| reached.contains(banned))
        .map(|banned| format!("{name} must build for the web, yet it reaches {banned}"))
        .collect()
}

/// One sentence for each outside crate of the workspace that the document's table gives no reason for.
fn document_faults(manifest: &str, document: &str) -> anyhow::Result<Vec<String>> {
    let listed: BTreeSet<&str> = document
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split('|').next())
        .flat_map(|names| names.split(',').map(str::trim))
        .collect();
    let named: Vec<&str> = manifest
        .lines()
        .skip_while(|line| *line != "[workspace.dependencies]")
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| Some(line.split_once(" = ")?.0))
        .filter(|name| !name.starts_with("silmap-"))
        .collect();
    ensure!(
        !named.is_empty(),
        "Cargo.toml names no outside crate: nothing was checked"
    );
    Ok(named
        .into_iter()
        .filter(|name| !listed.contains(name))
        .map(|name| format!("ARCHITECTURE.md does not say what {name} is for"))
        .collect())
}

fn read(root: &Path, name: &str) -> anyhow::Result<String> {
    std::fs::read_to_string(root.join(name)).with_context(|| format!("{name} cannot be read"))
}

fn workspace_metadata(root: &Path) -> anyhow::Result<Value> {
    let text = cargo(
        root,
        &["metadata", "--format-version", "1", "--no-deps", "--locked"],
    )?;
    serde_json::from_str(&text).context("cargo metadata is not JSON")
}

/// Root files of all libraries and programs, each with its package's name.
fn crate_roots(metadata: &Value) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let targets = packages.flat_map(|package| {
        let targets = package["targets"].as_array().into_iter().flatten();
        targets.map(move |target| (&package["name"], target))
    });
    let is_checked = |target: &Value| {
        let kinds = target["kind"].as_array().into_iter().flatten();
        kinds
            .filter_map(Value::as_str)
            .any(|k| k == "lib" || k == "bin")
    };
    targets
        .filter(|(_, target)| is_checked(target))
        .map(|(name, target)| {
            let name = name.as_str().context("a package has no name")?;
            let path = target["src_path"]
                .as_str()
                .context("a target has no file")?;
            Ok((name.to_owned(), PathBuf::from(path)))
        })
        .collect()
}

/// From each crate to each workspace crate that it names, with any kind of dependency.
fn workspace_arrows(metadata: &Value) -> anyhow::Result<BTreeSet<Arrow>> {
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata lists no packages")?;
    let members: BTreeSet<&str> = packages.iter().filter_map(|p| p["name"].as_str()).collect();
    let mut arrows = BTreeSet::new();
    for package in packages {
        let from = package["name"].as_str().context("a package has no name")?;
        let dependencies = package["dependencies"].as_array();
        for dependency in dependencies.into_iter().flatten() {
            let to = dependency["name"]
                .as_str()
                .context("a dependency has no name")?;
            if members.contains(to) {
                arrows.insert(Arrow {
                    from: from.to_owned(),
                    to: to.to_owned(),
                    is_for_tests: dependency["kind"] == "dev",
                });
            }
        }
    }
    Ok(arrows)
}

/// Names of all crates that `name` builds with for the web, its tests left out.
fn reached_crates(root: &Path, name: &str) -> anyhow::Result<BTreeSet<String>> {
    let text = cargo(
        root,
        &[
            "tree",
            "--locked",
            "--package",
            name,
            "--edges",
            "normal,build",
            "--target",
            WEB_TARGET,
            "--prefix",
            "none",
            "--format",
            "{p}",
        ],
    )?;
    let names: BTreeSet<String> = text
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect();
    ensure!(
        names.contains(name),
        "cargo tree does not show {name} itself: nothing was checked"
    );
    Ok(names)
}

fn cargo(root: &Path, arguments: &[&str]) -> anyhow::Result<String> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(program)
        .args(arguments)
        .current_dir(root)
        .output()
        .context("cargo could not be started")?;
    ensure!(
        output.status.success(),
        "cargo {} failed: {}",
        arguments[0],
        String::from_utf8_lossy(&output.stderr).trim()
    );
    String::from_utf8(output.stdout).context("cargo printed something other than UTF-8")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrows(pairs: &[(&str, &str)], is_for_tests: bool) -> BTreeSet<Arrow> {
        pairs
            .iter()
            .map(|(from, to)| Arrow {
                from: (*from).to_owned(),
                to: (*to).to_owned(),
                is_for_tests,
            })
            .collect()
    }

    #[test]
    fn allowed_arrows_pass() {
        let fine = [
            ("silmap-map", "silmap-geometry"),
            ("silmap-cli", "silmap-preprocess"),
        ];
        for is_for_tests in [false, true] {
            let faults = arrow_faults(&arrows(&fine, is_for_tests));
            assert_eq!(faults, Vec::<String>::new());
        }
    }

    #[test]
    fn an_arrow_of_tests_is_for_tests() {
        let models = [("silmap-hull", "silmap-models")];
        assert_eq!(arrow_faults(&arrows(&models, true)), Vec::<String>::new());
        let faults = arrow_faults(&arrows(&models, false));
        assert_eq!(faults, ["silmap-hull may not depend on silmap-models"]);
    }

    #[test]
    fn every_other_arrow_is_a_fault() {
        for (from, to) in [
            ("silmap-preprocess", "silmap-runtime"),
            ("silmap-runtime", "silmap-preprocess"),
            ("silmap-preprocess", "silmap-exact"),
            ("silmap-preprocess", "silmap-measure"),
            ("silmap-runtime", "silmap-measure"),
            ("silmap-measure", "silmap-report"),
            ("silmap-geometry", "silmap-map"),
            ("silmap-map", "silmap-tests"),
            ("silmap-newcomer", "silmap-geometry"),
        ] {
            let faults = arrow_faults(&arrows(&[(from, to)], false));
            assert_eq!(faults.len(), 1, "{from} -> {to} gave {faults:?}");
            assert!(faults[0].contains(from), "{faults:?}");
        }
    }

    #[test]
    fn a_native_crate_on_the_web_is_a_fault() {
        let reached = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        assert!(reach_faults("silmap-map", &reached(&["glam", "thiserror"])).is_empty());
        let faults = reach_faults("silmap-map", &reached(&["glam", "rayon", "spade"]));
        assert_eq!(faults.len(), 2, "{faults:?}");
    }

    #[test]
    fn a_crate_without_a_reason_is_a_fault() {
        let manifest =
            "[workspace.dependencies]\nsilmap-map = 1\nglam = 1\nserde = 1\n\n[lints]\nx = 1\n";
        let document = "| crate | what for |\n| glam, serde | because |\n";
        assert!(document_faults(manifest, document).unwrap().is_empty());
        let faults = document_faults(manifest, "| glam | because |").unwrap();
        assert_eq!(faults, ["ARCHITECTURE.md does not say what serde is for"]);
        assert!(document_faults("", document).is_err());
    }

    #[test]
    fn the_table_has_no_circle() {
        // Taking away crates whose dependencies are all gone must empty the table.
        let mut left: BTreeSet<&str> = ARROWS.iter().map(|(name, _)| *name).collect();
        let is_free = |left: &BTreeSet<&str>, name: &str| {
            (ARROWS.iter().chain(TEST_ARROWS))
                .filter(|(from, _)| *from == name)
                .all(|(_, to)| to.iter().all(|t| !left.contains(t)))
        };
        while !left.is_empty() {
            let free: Vec<&str> = left
                .iter()
                .copied()
                .filter(|name| is_free(&left, name))
                .collect();
            assert!(!free.is_empty(), "a circle among {left:?}");
            left.retain(|name| !free.contains(name));
        }
    }
}
