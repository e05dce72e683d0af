//! The `silmap` command: options in, one library call, result out.

mod args;
mod camera;
mod captured_camera;
mod commands;
mod driver_chatter;
mod exit;
mod files;
mod frame_names;
mod interrupt;
mod machine;
mod made_capture;
mod names;
mod numbers;
mod output;
mod photograph;
mod pictures;
mod pose_file;
mod progress;
mod scene;
mod strip;
mod turn;
mod values;

use std::num::NonZeroUsize;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;

use crate::args::Cli;

fn main() -> ExitCode {
    exit::keep_panics_quiet();
    exit::run(|| run(Cli::parse()))
}

fn run(cli: Cli) -> anyhow::Result<()> {
    driver_chatter::keep_quiet(&cli.command);
    interrupt::install_handler(exit::ExitClass::Interrupted.code())?;
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
