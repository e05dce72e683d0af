//! One module for each subcommand.

mod align;
mod attach;
mod bench;
mod build;
mod capture_check;
mod capture_page;
mod captured;
mod contour;
mod demo;
mod demo_captured;
mod edges;
mod evaluate;
mod evaluate_captured;
mod evaluation;
mod generate;
mod hull;
mod inspect;
mod leave_one_out;
mod manifest;
mod render;
mod report;
mod simplify;
mod view;

use silmap_gpu::Gpu;

use crate::args::Command;
use crate::exit::NoAdapter;

/// Opens the graphics adapter.
///
/// # Errors
/// [`NoAdapter`], which ends in an exit code of its own.
pub(crate) fn open_gpu() -> Result<Gpu, NoAdapter> {
    Gpu::new().map_err(NoAdapter)
}

/// Runs a subcommand.
///
/// # Errors
/// One sentence.
pub(crate) fn run(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Demo(args) if args.captured => demo_captured::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Build(args) => build::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Contour(args) => contour::run(&args),
        Command::Attach(args) => attach::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Hull(args) => hull::run(&args),
        Command::Edges(args) => edges::run(&args),
        Command::Simplify(args) => simplify::run(&args),
        Command::Align(args) => align::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::View(args) => view::run(&args),
    }
}
