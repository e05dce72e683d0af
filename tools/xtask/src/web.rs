//! Builds `examples/web` as a folder that any web server can serve.
//!
//! The library that wasm-bindgen's command consists of makes the JavaScript beside the module, so that no command needs to be
//! installed. It is a feature of this package, which the task asks for itself: other tasks do not wait for it to be built.

use std::path::Path;

/// Builds into `folder`.
#[cfg(not(feature = "web"))]
pub(crate) fn run(root: &Path, folder: &str, is_release: bool) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["run", "--quiet", "--locked", "--package", "xtask"]);
    command.args(["--features", "web", "--manifest-path"]);
    command.arg(root.join("Cargo.toml"));
    command.args(["--", "web", folder]);
    command.args(is_release.then_some("--release"));
    let status = command.status().context("cargo could not be started")?;
    ensure!(status.success(), "the page was not built");
    Ok(String::new())
}

/// Builds into `folder`.
#[cfg(feature = "web")]
pub(crate) fn run(root: &Path, folder: &str, is_release: bool) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    const TARGET: &str = "wasm32-unknown-unknown";
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["build", "--locked", "--target", TARGET]);
    command.args(["--package", "example-web"]);
    let profile = if is_release { "web" } else { "dev" };
    command.args(["--profile", profile]);
    let status = command.current_dir(root).status();
    ensure!(
        status.context("cargo could not be started")?.success(),
        "the library of the page does not build"
    );
    let built = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), Into::into);
    let built = built
        .join(TARGET)
        .join(if is_release { profile } else { "debug" });
    let module = built.join("example_web.wasm");
    let folder = Path::new(folder);
    wasm_bindgen_cli_support::Bindgen::new()
        .input_path(&module)
        .web(true)?
        .typescript(false)
        .omit_default_module_path(false)
        .remove_name_section(is_release)
        .remove_producers_section(is_release)
        .generate(folder)
        .context("wasm-bindgen does not take the module")?;
    let page = root.join("examples/web/index.html");
    std::fs::copy(&page, folder.join("index.html"))
        .with_context(|| format!("{} cannot be copied", page.display()))?;
    let bytes = std::fs::metadata(folder.join("example_web_bg.wasm"))?.len();
    Ok(format!(
        "{}: the module has {:.1} MB\n",
        folder.display(),
        bytes as f64 / 1e6
    ))
}
