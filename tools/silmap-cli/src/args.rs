//! The command line: every subcommand with its options, parsed by clap.
//!
//! Values that a library params struct knows a default for show that default here; a test in `commands::build` holds the
//! two together.

mod applications;
mod building;
mod looking;
mod manifest;
mod meshes;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use silmap_map::{Method, SilhouetteMap};
use silmap_mesh_io::AlphaUse;

pub(crate) use applications::{AlignArgs, SimplifyArgs};
pub(crate) use building::{AttachArgs, BuildArgs, DemoArgs};
pub(crate) use looking::{
    AntialiasArg, ContourArgs, ContourFormat, EvaluateArgs, InspectArgs, ModeArg, PaintArg,
    RenderArgs, ReportArgs, WhereArg,
};
pub(crate) use manifest::{ManifestArgs, Shard};
pub(crate) use meshes::{BenchArgs, EdgesArgs, ExtractionArg, GenerateArgs, HullArgs, ModelKind};

use crate::values::{Size, parse_point, parse_positive, parse_size};

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

Exit codes: 0 done, 1 could not (one sentence says why), 2 usage, 3 no graphics adapter, 4 out of memory, disk or time, 70 a fault
of silmap itself, 130 interrupted."
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
            Self::Build(a) => a.backend != BackendArg::Cpu,
            Self::Evaluate(a) => a.textures.is_some(),
            _ => false,
        }
    }

    /// Size of the thread pool that was asked for.
    pub(crate) fn threads(&self) -> Option<u32> {
        match self {
            Self::Demo(a) => a.pool.threads,
            // Who reads a list does nothing else.
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
            | Self::Generate(_) => None,
        }
    }
}

/// How results are printed.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct OutputArgs {
    /// Print one JSON object on standard output and nothing else there
    #[arg(long)]
    pub(crate) json: bool,
}

/// How much of the machine is used.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct PoolArgs {
    /// Threads to work with; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

/// A camera, as `render` and `contour` take it.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct CameraArgs {
    /// Viewpoint, in model units
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) eye: DVec3,
    /// Point that is looked at [default: the model's center]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) target: Option<DVec3>,
    /// Direction that is up in the picture [default: +Y, near the poles +Z]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) up: Option<DVec3>,
    /// Vertical field of view in degrees [default: the model's bounding sphere just fits]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    pub(crate) fov: Option<f64>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = parse_size)]
    pub(crate) size: Size,
}

/// The rule that says which pixels a triangle covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CoverageArg {
    /// Pixels whose center is covered
    Center,
    /// Pixels of which any point is covered
    Any,
}

/// What draws the captured views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendArg {
    /// The graphics adapter when it is real hardware, otherwise the CPU
    Auto,
    /// Every core of the CPU; the same bytes on every machine
    Cpu,
    /// The graphics adapter, software ones included: a mesh is rasterised in fixed point that vendors choose, so a pixel on a border may differ between adapters, and contours and bytes with it
    Gpu,
}

/// How silhouettes are interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MethodArg {
    /// The paper's: cliques of spans, the nearest polytope edge first
    Paper,
    /// Every pair of spans, all three orders intersected: nothing of the model is cut away
    Hull,
    /// Arcs between the touching points, linked by depth, from edge to edge: the smallest error
    Tight,
}

impl MethodArg {
    /// The method asked for, or the best that `map` allows.
    pub(crate) fn resolve(choice: Option<Self>, map: &SilhouetteMap) -> Method {
        choice.map_or_else(|| Method::best_for(map), Method::from)
    }
}

impl From<MethodArg> for Method {
    fn from(method: MethodArg) -> Self {
        match method {
            MethodArg::Paper => Self::Paper,
            MethodArg::Hull => Self::Hull,
            MethodArg::Tight => Self::Tight,
        }
    }
}

/// What may be done to a mesh that is not closed and oriented.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct MendingArgs {
    /// Fill holes in the mesh
    #[arg(long)]
    pub(crate) close_holes: bool,
    /// Remove degenerate and duplicate faces, split non-manifold vertices, orient faces outward
    #[arg(long)]
    pub(crate) repair: bool,
    /// What materials do that cut out by their alpha (glTF's alphaMode MASK)
    #[arg(long, value_enum, value_name = "USE", default_value = "opaque")]
    pub(crate) alpha: AlphaArg,
    /// Join open edges that lie this close together, in model units; without it, those that miss by rounding are joined
    #[arg(long, value_name = "DISTANCE", value_parser = parse_positive)]
    pub(crate) weld: Option<f64>,
}

/// What becomes of faces that a material cuts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AlphaArg {
    /// They stay, with a warning
    Opaque,
    /// Those of which nothing shows go; where that opens the mesh, --close-holes and --repair may help
    Mask,
}

impl From<AlphaArg> for AlphaUse {
    fn from(alpha: AlphaArg) -> Self {
        match alpha {
            AlphaArg::Opaque => Self::Opaque,
            AlphaArg::Mask => Self::Mask,
        }
    }
}
