//! The `silmap` command: options in, one library call, result out.

mod args;
mod bench;
mod camera;
mod commands;
mod comparison;
mod driver_chatter;
mod exact_shape;
mod exit;
mod files;
mod interrupt;
mod machine;
mod measure;
mod names;
mod numbers;
mod output;
mod pictures;
mod pose_file;
mod progress;
mod strip;
mod subdivide;
mod texture_errors;
mod values;

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
    interrupt::install_handler()?;
    if let Some(threads) = cli.command.threads() {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build_global()
            .context("the threads cannot be started")?;
    }
    commands::run(cli.command)
}
