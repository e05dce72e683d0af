//! Builds a crate as a module for browsers, with the JavaScript beside it: `examples/web` as a folder that any web server can serve, and
//! the outlines of `tools/web/silmap-three`.
//!
//! The library that wasm-bindgen's command consists of makes the JavaScript, so that no command needs to be installed. It is a feature
//! of this package, which the task asks for itself: other tasks do not wait for it to be built.

use std::path::Path;

/// What is built.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Module {
    /// The example that is a page, into a folder.
    Page,
    /// The outlines of the package for three.js, into its `dist`.
    Three,
}

/// Largest size of the outlines' module for three.js, compressed.
#[cfg(feature = "web")]
const THREE_AT_MOST_BYTES: u64 = 250 * 1024;

/// Builds into `folder`.
#[cfg(not(feature = "web"))]
pub(crate) fn run(
    root: &Path,
    module: Module,
    folder: &Path,
    is_release: bool,
) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["run", "--quiet", "--locked", "--package", "xtask"]);
    command.args(["--features", "web", "--manifest-path"]);
    command.arg(root.join("Cargo.toml"));
    match module {
        Module::Page => command.args(["--", "web"]).arg(folder),
        Module::Three => command.args(["--", "three"]),
    };
    command.args(is_release.then_some("--release"));
    let status = command.status().context("cargo could not be started")?;
    ensure!(status.success(), "the module was not built");
    Ok(String::new())
}

/// Builds into `folder`.
#[cfg(feature = "web")]
pub(crate) fn run(
    root: &Path,
    module: Module,
    folder: &Path,
    is_release: bool,
) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    let (package, name, profile) = match module {
        Module::Page => ("example-web", "example_web", "web"),
        Module::Three => ("silmap-outlines", "silmap_outlines", "three"),
    };
    let built = build(root, package, is_release.then_some(profile))?;
    wasm_bindgen_cli_support::Bindgen::new()
        .input_path(built.join(format!("{name}.wasm")))
        .web(true)?
        .typescript(matches!(module, Module::Three))
        .omit_default_module_path(false)
        .remove_name_section(is_release)
        .remove_producers_section(is_release)
        .generate(folder)
        .context("wasm-bindgen does not take the module")?;
    let file = folder.join(format!("{name}_bg.wasm"));
    let bytes = std::fs::read(&file)?;
    let megabytes = bytes.len() as f64 / 1e6;
    let place = folder.display();
    match module {
        Module::Page => {
            let page = root.join("examples/web/index.html");
            std::fs::copy(&page, folder.join("index.html"))
                .with_context(|| format!("{} cannot be copied", page.display()))?;
            Ok(format!("{place}: the module has {megabytes:.1} MB\n"))
        }
        Module::Three => {
            let packed = compressed(&bytes)?;
            ensure!(
                !is_release || packed <= THREE_AT_MOST_BYTES,
                "the module has {packed} bytes compressed, more than the {THREE_AT_MOST_BYTES} that it may have"
            );
            Ok(format!(
                "{place}: the module has {megabytes:.2} MB, {packed} bytes compressed\n"
            ))
        }
    }
}

/// Builds a package for browsers, with a profile or that of development; returns the folder that the module is in.
#[cfg(feature = "web")]
fn build(root: &Path, package: &str, profile: Option<&str>) -> anyhow::Result<std::path::PathBuf> {
    use anyhow::{Context, ensure};
    const TARGET: &str = "wasm32-unknown-unknown";
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["build", "--locked", "--target", TARGET]);
    command.args(["--package", package]);
    command.args(["--profile", profile.unwrap_or("dev")]);
    let status = command.current_dir(root).status();
    ensure!(
        status.context("cargo could not be started")?.success(),
        "{package} does not build"
    );
    let built = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), Into::into);
    Ok(built.join(TARGET).join(profile.unwrap_or("debug")))
}

/// Bytes of the same as a web server sends them.
#[cfg(feature = "web")]
fn compressed(bytes: &[u8]) -> anyhow::Result<u64> {
    use std::io::Write;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len() as u64)
}
