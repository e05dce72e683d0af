//! What can be typed: every subcommand with its options, as clap reads them. Options that several commands have are in `groups`.
//!
//! Values that a library params struct knows a default for show that default here; a test in `commands::build` holds the
//! two together.

mod applications;
mod building;
mod captures;
mod groups;
mod looking;
mod manifest;
mod meshes;
mod orbit;
mod viewing;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

pub(crate) use applications::{AlignArgs, SimplifyArgs};
pub(crate) use building::{AttachArgs, BackendArg, BuildArgs, CoverageArg, DemoArgs};
pub(crate) use captures::{CarveArgs, MaskArgs};
pub(crate) use groups::{
    AssetOfModelArgs, CameraArgs, CapturedCameraArgs, InterpolationArgs, KeptPartsArgs,
    MendingArgs, MeshOutArgs, MethodArg, ModelArgs, OutputArgs, PoolArgs, TestPictureArgs,
};
pub(crate) use looking::{
    AntialiasArg, ContourArgs, ContourFormat, EvaluateArgs, InspectArgs, ModeArg, PaintArg,
    PhotographArg, RenderArgs, ReportArgs, WhereArg,
};
pub(crate) use manifest::{ManifestArgs, Shard};
pub(crate) use meshes::{BenchArgs, EdgesArgs, ExtractionArg, GenerateArgs, HullArgs, ModelKind};
pub(crate) use orbit::OrbitArgs;
pub(crate) use viewing::ViewArgs;

/// A coarse textured hull that wears the outline of the full mesh.
#[derive(Debug, Parser)]
#[command(
    name = "silmap",
    version,
    arg_required_else_help = true,
    propagate_version = true,
    after_help = "\
Examples:
  silmap demo
  silmap build bunny.ply --close-holes -o bunny.glb
  silmap render bunny.glb --eye 0.3,0.2,0.4 -o bunny.png

Exit codes: 0 done, 1 could not (one sentence says why), 2 usage, 3 no graphics adapter, 4 out of memory, disk or time, 70 a fault of silmap itself, 130 interrupted."
)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(DemoArgs),
    Build(BuildArgs),
    Attach(AttachArgs),
    Render(RenderArgs),
    Contour(ContourArgs),
    Inspect(InspectArgs),
    Evaluate(EvaluateArgs),
    Report(ReportArgs),
    Hull(HullArgs),
    Edges(EdgesArgs),
    Simplify(SimplifyArgs),
    Align(AlignArgs),
    Bench(BenchArgs),
    Generate(GenerateArgs),
    View(ViewArgs),
}

/// Ends the program for options that do not go together, as clap ends it for those that are wrong alone.
pub(crate) fn usage_error(kind: ErrorKind, sentence: &str) -> ! {
    Cli::command().error(kind, sentence).exit()
}

impl Command {
    /// Whether a graphics device may be opened.
    pub(crate) fn may_open_device(&self) -> bool {
        match self {
            Self::Demo(_) | Self::Render(_) | Self::Report(_) | Self::Bench(_) => true,
            Self::Build(a) => a.capture.backend != BackendArg::Cpu,
            Self::Evaluate(a) => a.textures.is_some(),
            _ => false,
        }
    }

    /// Size of the thread pool that was asked for.
    pub(crate) fn threads(&self) -> Option<u32> {
        match self {
            Self::Demo(a) => a.pool.threads,
            // A process that reads a list does nothing else.
            Self::Build(a) if a.list.manifest.is_some() => None,
            Self::Build(a) => a.pool.threads,
            Self::Evaluate(a) => a.pool.threads,
            Self::Report(a) => a.pool.threads,
            Self::Hull(a) => a.pool.threads,
            Self::Edges(a) => a.pool.threads,
            Self::Simplify(a) => a.pool.threads,
            Self::Align(a) => a.pool.threads,
            Self::Bench(a) => a.pool.threads,
            Self::Attach(_)
            | Self::Render(_)
            | Self::Contour(_)
            | Self::Inspect(_)
            | Self::Generate(_)
            | Self::View(_) => None,
        }
    }
}
