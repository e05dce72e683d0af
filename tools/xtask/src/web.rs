//! Builds crates as modules for browsers, with the JavaScript beside them: the viewer's page and `examples/web` as folders that any web
//! server can serve, and the outlines of `tools/web/silmap-three`.
//!
//! The library that wasm-bindgen's command consists of makes the JavaScript, so that no command needs to be installed. It is a feature
//! of this package, which the task asks for itself: other tasks do not wait for it to be built.

use std::path::Path;

/// What is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Product {
    /// The viewer's page: one module for WebGPU and one for WebGL2.
    Viewer,
    /// The example that is a page.
    Example,
    /// The outlines of the package for three.js.
    Three,
}

/// A module of a product.
#[cfg(feature = "web")]
struct Module {
    package: &'static str,
    /// What it has to be asked for besides.
    options: &'static [&'static str],
    /// Its file, without what comes after.
    name: &'static str,
    /// The folder in the product's.
    folder: &'static str,
    /// The most bytes of a release, as a web server sends them.
    at_most_bytes: Option<u64>,
}

#[cfg(feature = "web")]
impl Product {
    fn modules(self) -> Vec<Module> {
        let viewer = |options, folder, mebibytes: u64| Module {
            package: "silmap-viewer",
            options,
            name: "silmap-viewer",
            folder,
            at_most_bytes: Some(mebibytes << 20),
        };
        match self {
            Self::Viewer => vec![
                viewer(
                    &["--bin", "silmap-viewer", "--features", "webgpu"],
                    "webgpu",
                    2,
                ),
                viewer(
                    &["--bin", "silmap-viewer", "--features", "webgl"],
                    "webgl2",
                    3,
                ),
            ],
            Self::Example => vec![Module {
                package: "example-web",
                options: &[],
                name: "example_web",
                folder: "",
                at_most_bytes: None,
            }],
            Self::Three => vec![Module {
                package: "silmap-outlines",
                options: &[],
                name: "silmap_outlines",
                folder: "",
                at_most_bytes: Some(250 << 10),
            }],
        }
    }

    /// Files of its page, and the folder that they are in.
    fn page(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Viewer => ("tools/silmap-viewer/page", &["index.html", "viewer.js"]),
            Self::Example => ("examples/web", &["index.html"]),
            Self::Three => ("", &[]),
        }
    }
}

/// Builds into `folder`.
#[cfg(not(feature = "web"))]
pub(crate) fn run(
    root: &Path,
    product: Product,
    folder: &Path,
    is_release: bool,
) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["run", "--quiet", "--locked", "--package", "xtask"]);
    command.args(["--features", "web", "--manifest-path"]);
    command.arg(root.join("Cargo.toml"));
    match product {
        Product::Viewer => command.args(["--", "web"]).arg(folder),
        Product::Example => command.args(["--", "example-web"]).arg(folder),
        Product::Three => command.args(["--", "three"]),
    };
    command.args(is_release.then_some("--release"));
    let status = command.status().context("cargo could not be started")?;
    ensure!(status.success(), "the modules were not built");
    Ok(String::new())
}

/// Builds into `folder`.
#[cfg(feature = "web")]
pub(crate) fn run(
    root: &Path,
    product: Product,
    folder: &Path,
    is_release: bool,
) -> anyhow::Result<String> {
    use anyhow::{Context, ensure};
    let mut said = String::new();
    for module in product.modules() {
        let profile = match product {
            Product::Three => "three",
            _ => "web",
        };
        let built = build(root, &module, is_release.then_some(profile))?;
        let to = folder.join(module.folder);
        std::fs::create_dir_all(&to).with_context(|| to.display().to_string())?;
        wasm_bindgen_cli_support::Bindgen::new()
            .input_path(built.join(format!("{}.wasm", module.name)))
            .web(true)?
            .typescript(product == Product::Three)
            .omit_default_module_path(false)
            .remove_name_section(is_release)
            .remove_producers_section(is_release)
            .generate(&to)
            .context("wasm-bindgen does not take the module")?;
        let file = to.join(format!("{}_bg.wasm", module.name));
        let bytes = std::fs::read(&file).with_context(|| file.display().to_string())?;
        let packed = compressed(&bytes)?;
        let count = packed.len() as u64;
        if product == Product::Viewer {
            // Servers that can send it do.
            let beside = to.join(format!("{}_bg.wasm.gz", module.name));
            std::fs::write(&beside, &packed).with_context(|| beside.display().to_string())?;
        }
        let limit = module.at_most_bytes.filter(|_| is_release);
        ensure!(
            limit.is_none_or(|limit| count <= limit),
            "{}: {count} bytes compressed, more than the {} that it may have",
            file.display(),
            limit.unwrap_or_default()
        );
        said += &format!(
            "{}: {:.2} MB, {count} bytes compressed\n",
            file.display(),
            bytes.len() as f64 / 1e6
        );
    }
    let (from, names) = product.page();
    for name in names {
        let page = root.join(from).join(name);
        std::fs::copy(&page, folder.join(name))
            .with_context(|| format!("{} cannot be copied", page.display()))?;
    }
    Ok(said)
}

/// Builds a module, with a profile or that of development; returns the folder that it is in.
#[cfg(feature = "web")]
fn build(
    root: &Path,
    module: &Module,
    profile: Option<&str>,
) -> anyhow::Result<std::path::PathBuf> {
    use anyhow::{Context, ensure};
    const TARGET: &str = "wasm32-unknown-unknown";
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = std::process::Command::new(program);
    command.args(["build", "--locked", "--target", TARGET]);
    command.args(["--package", module.package]);
    command.args(module.options);
    command.args(["--profile", profile.unwrap_or("dev")]);
    let status = command.current_dir(root).status();
    ensure!(
        status.context("cargo could not be started")?.success(),
        "{} does not build",
        module.package
    );
    let built = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), Into::into);
    Ok(built.join(TARGET).join(profile.unwrap_or("debug")))
}

/// The same as a web server sends it; the same bytes whenever it is made.
#[cfg(feature = "web")]
fn compressed(bytes: &[u8]) -> anyhow::Result<Vec<u8>> {
    use std::io::Write;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}
