//! The `silmap` command: options in, one library call, result out.

mod args;
mod bench;
mod camera;
mod commands;
mod comparison;
mod exact_shape;
mod files;
mod interrupt;
mod machine;
mod measure;
mod output;
mod pictures;
mod progress;
mod strip;
mod subdivide;
mod texture_errors;
mod values;

use std::num::NonZeroUsize;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;

use crate::args::Cli;
use crate::commands::NoAdapter;
use crate::interrupt::EXIT_INTERRUPTED;

/// Exit code when there is no graphics adapter.
const EXIT_NO_ADAPTER: u8 = 3;
/// Exit code when the command could not do what it was asked.
const EXIT_FAILED: u8 = 1;

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) if interrupt::is_requested() => {
            output::say("silmap: interrupted");
            ExitCode::from(EXIT_INTERRUPTED)
        }
        Err(error) => {
            output::say(&format!("silmap: error: {error:#}"));
            let code = if error.is::<NoAdapter>() {
                EXIT_NO_ADAPTER
            } else {
                EXIT_FAILED
            };
            ExitCode::from(code)
        }
    }
}

fn run(cli: Cli) -> anyhow::Result<()> {
    interrupt::install_handler()?;
    if let Some(threads) = cli.command.threads() {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads_of_use(threads as usize))
            .build_global()
            .context("the threads cannot be started")?;
    }
    commands::run(cli.command)
}

/// A few threads may be asked for on any machine, to see that their number changes nothing.
const LEAST_CAP: usize = 8;
/// So many threads for each core do no harm; thousands take many times as long to find nothing to do.
const THREADS_PER_CORE: usize = 2;

/// As many of the threads asked for as are of use on this machine; the result does not depend on their number.
fn threads_of_use(wanted: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let most = (THREADS_PER_CORE * cores).max(LEAST_CAP);
    if wanted > most {
        output::warn(&format!(
            "--threads {wanted}: {most} are used, as there are {cores} cores"
        ));
    }
    wanted.min(most)
}
