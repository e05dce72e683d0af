//! Development tasks: `cargo xtask check-deps` checks the dependencies of crates and modules, `cargo xtask bless` accepts what a test
//! produced as its new reference, `cargo xtask web` builds the viewer's page, `cargo xtask example-web` the example that is a page, `cargo
//! xtask three` the module of the package for three.js.

mod bless;
mod check_deps;
mod module_cycles;
mod web;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::web::Product;

const USAGE: &str = "\
usage: cargo xtask TASK

  check-deps       fails when a crate depends on one it may not know, or modules of a crate depend on each other
  bless            lists references that a test run found different or missing
  bless NAME...    accepts what the tests produced for them (`bless --all` for every one)
  web DIR [--release]
                   builds the viewer's page as a folder for a web server
  example-web DIR [--release]
                   builds examples/web likewise
  three [--release]
                   builds the outlines of tools/web/silmap-three
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.split_first() {
        Some((task, [])) if task == "check-deps" => check_deps::run(&repository_root()),
        Some((task, names)) if task == "bless" => bless::run(&repository_root(), names),
        Some((task, [folder])) if task == "web" => build_page(Product::Viewer, folder, false),
        Some((task, [folder, release])) if task == "web" && release == "--release" => {
            build_page(Product::Viewer, folder, true)
        }
        Some((task, [folder])) if task == "example-web" => {
            build_page(Product::Example, folder, false)
        }
        Some((task, [folder, release])) if task == "example-web" && release == "--release" => {
            build_page(Product::Example, folder, true)
        }
        Some((task, [])) if task == "three" => build_three(false),
        Some((task, [release])) if task == "three" && release == "--release" => build_three(true),
        _ => {
            say_to(&mut std::io::stderr(), USAGE);
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(summary) => {
            say_to(&mut std::io::stdout(), &summary);
            ExitCode::SUCCESS
        }
        Err(error) => {
            say_to(&mut std::io::stderr(), &format!("xtask: {error:#}\n"));
            ExitCode::FAILURE
        }
    }
}

fn build_page(product: Product, folder: &str, is_release: bool) -> anyhow::Result<String> {
    let folder = PathBuf::from(folder);
    web::run(&repository_root(), product, &folder, is_release)
}

fn build_three(is_release: bool) -> anyhow::Result<String> {
    let root = repository_root();
    let folder = root.join("tools/web/silmap-three/dist");
    web::run(&root, Product::Three, &folder, is_release)
}

/// Prints; a closed stream has no reader, which is not a failure.
fn say_to(stream: &mut dyn Write, text: &str) {
    let _ = stream.write_all(text.as_bytes());
}

fn repository_root() -> PathBuf {
    let package = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    package
        .ancestors()
        .nth(2)
        .map_or(package.clone(), PathBuf::from)
}
