//! What can be typed: every subcommand with its options, as clap reads them.
//!
//! Values that a library params struct knows a default for show that default here; a test in `commands::build` holds the
//! two together.

mod applications;

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use silmap_map::{Method, SilhouetteMap, ViewContour};
use silmap_preprocess::hull::Tightening;
use silmap_preprocess::texture::{Parametrisation, PictureFormat, TileSizes};

pub(crate) use applications::{AlignArgs, SimplifyArgs};

use crate::values::{
    Backdrop, Length, Share, Size, parse_backdrop, parse_bytes, parse_length, parse_point,
    parse_positive, parse_share, parse_size,
};

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

Exit codes: 0 done, 1 could not (one sentence says why), 2 usage, 3 no graphics adapter, 130 interrupted."
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
    /// Size of the thread pool that was asked for.
    pub(crate) fn threads(&self) -> Option<u32> {
        match self {
            Self::Demo(a) => a.pool.threads,
            Self::Build(a) => a.pool.threads,
            Self::Evaluate(a) => a.pool.threads,
            Self::Report(a) => a.pool.threads,
            Self::Hull(a) => a.pool.threads,
            Self::Edges(a) => a.pool.threads,
            Self::Simplify(a) => a.pool.threads,
            Self::Align(a) => a.pool.threads,
            Self::Bench(a) => a.pool.threads,
            Self::Render(_) | Self::Contour(_) | Self::Inspect(_) | Self::Generate(_) => None,
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
    /// The graphics adapter, software ones included
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

/// Makes everything on a model of its own: an asset, comparison pictures, a report.
///
/// Nothing is needed but an empty folder: the model is generated. The asset, the pictures and `report.html` are put into
/// the folder, and the last line says where to look.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  silmap demo -o silmap-demo")]
pub(crate) struct DemoArgs {
    /// Folder for the results
    #[arg(short, long, value_name = "DIR", default_value = "silmap-demo")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// What has no meaning for an asset that is there already.
const FROM_CONFLICTS: [&str; 20] = [
    "model",
    "views",
    "method",
    "resolution",
    "tolerance",
    "coverage",
    "radius",
    "faces",
    "texture_views",
    "texture_size",
    "texture_format",
    "texture_quality",
    "texture_bytes",
    "atlas_size",
    "tiles",
    "parametrisation",
    "no_normals",
    "close_holes",
    "repair",
    "backend",
];

/// What pictures are stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PictureFormatArg {
    /// JPEG, or PNG where that is no larger
    Jpeg,
    /// PNG: nothing is lost
    Png,
    /// WebP for the projected pictures; the atlas stays JPEG, which every glTF viewer reads
    Webp,
}

impl From<PictureFormatArg> for PictureFormat {
    fn from(format: PictureFormatArg) -> Self {
        match format {
            PictureFormatArg::Jpeg => Self::Jpeg,
            PictureFormatArg::Png => Self::Png,
            PictureFormatArg::Webp => Self::Webp,
        }
    }
}

/// How large the tiles of the atlas are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TilesArg {
    /// All the same
    Fixed,
    /// Larger for larger faces, by powers of two
    Adaptive,
}

impl From<TilesArg> for TileSizes {
    fn from(tiles: TilesArg) -> Self {
        match tiles {
            TilesArg::Fixed => Self::Fixed,
            TilesArg::Adaptive => Self::Adaptive,
        }
    }
}

/// Which point of the model a point of the hull shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ParametrisationArg {
    /// The one along the hull's interpolated normal
    NormalShooting,
    /// The nearest one, to compare with: it jumps where the model is hollow
    ClosestPoint,
}

impl From<ParametrisationArg> for Parametrisation {
    fn from(how: ParametrisationArg) -> Self {
        match how {
            ParametrisationArg::NormalShooting => Self::NormalShooting,
            ParametrisationArg::ClosestPoint => Self::ClosestPoint,
        }
    }
}

/// Makes an asset (.glb) out of a mesh.
///
/// Reads OBJ, PLY, STL, OFF, glTF and GLB. The mesh must be closed and consistently oriented; `--close-holes` and
/// `--repair` help. The asset opens in any glTF viewer as a plain textured low-polygon model.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap build bunny.ply --close-holes -o bunny.glb
  silmap build torus.obj -o torus.glb --max-error 0.5% --coverage any --json
  silmap build --from bunny.glb --keep 64 -o smaller.glb")]
pub(crate) struct BuildArgs {
    /// The mesh
    #[arg(required_unless_present = "from")]
    pub(crate) model: Option<PathBuf>,
    /// Take an asset instead of a mesh, and remove views until --keep or --max-error is met
    #[arg(long, value_name = "ASSET.glb", conflicts_with_all = FROM_CONFLICTS)]
    pub(crate) from: Option<PathBuf>,
    /// The asset to write
    #[arg(short, long, value_name = "OUT.glb")]
    pub(crate) out: PathBuf,
    /// Views to capture around the model
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(12..=65_536))]
    pub(crate) views: u32,
    /// Views to keep in the map [default: 128]
    #[arg(long, value_name = "N", conflicts_with = "max_error", value_parser = clap::value_parser!(u32).range(4..=65_536))]
    pub(crate) keep: Option<u32>,
    /// Keep as few views as hold this mean share of misclassified pixels, such as 0.5%
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub(crate) max_error: Option<Share>,
    /// The method whose error decides which views to keep; all methods can be used on the asset
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = MethodArg::Hull)]
    pub(crate) method: MethodArg,
    /// Side of the captured pictures in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) resolution: u32,
    /// How far a contour may move when it is simplified, in pixels
    #[arg(long, value_name = "PIXELS", default_value = "0.5", value_parser = parse_positive)]
    pub(crate) tolerance: f64,
    /// Which pixels the model covers
    #[arg(long, value_name = "RULE", value_enum, default_value_t = CoverageArg::Center)]
    pub(crate) coverage: CoverageArg,
    /// Radius of the view sphere: 3R is three times the model's bounding sphere, a bare number is in model units
    #[arg(long, value_name = "LENGTH", default_value = "3R", value_parser = parse_length)]
    pub(crate) radius: Length,
    /// Faces of the coarse hull; it is tightened as by `silmap hull --tighten fast`
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) faces: u32,
    /// Pictures of the model that are projected onto the hull
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(crate) texture_views: u32,
    /// Side of those pictures in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub(crate) texture_size: u32,
    /// What pictures are stored as
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = PictureFormatArg::Jpeg)]
    pub(crate) texture_format: PictureFormatArg,
    /// Quality of pictures that lose something
    #[arg(long, value_name = "1..100", default_value_t = 88, value_parser = clap::value_parser!(u8).range(1..=100))]
    pub(crate) texture_quality: u8,
    /// Most bytes of all pictures together, such as 400K: quality falls to 60 first, then sides, then quality again
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub(crate) texture_bytes: Option<u64>,
    /// Side of the atlas in pixels; it becomes more when the hull has too many faces for it
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub(crate) atlas_size: u32,
    /// How large the faces' tiles in the atlas are
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = TilesArg::Adaptive)]
    pub(crate) tiles: TilesArg,
    /// Which point of the model a point of the hull shows in the atlas
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ParametrisationArg::NormalShooting)]
    pub(crate) parametrisation: ParametrisationArg,
    /// Leave out the atlas's normals, which viewers that light the model themselves use
    #[arg(long)]
    pub(crate) no_normals: bool,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    /// What draws the captured views
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = BackendArg::Auto)]
    pub(crate) backend: BackendArg,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
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
}

/// What `render` draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ModeArg {
    /// The full mesh (needs --model)
    Original,
    /// The hull, shaded, without its textures
    Coarse,
    /// The hull with its textures
    Textured,
    /// The textured hull, clipped to the interpolated silhouette
    Clipped,
    /// The textured hull, clipped to the exact silhouette of the full mesh (needs --model)
    Exact,
    /// The interpolated silhouette alone
    Silhouette,
    /// Where the silhouette is wrong: red too much, blue too little (needs --model)
    Difference,
    /// Silhouette edges of the full mesh, hidden ones left out, found pixel by pixel (needs --model, as all of these): where faces
    /// behind are as deep as those in front
    EdgesEqual,
    /// The edges of faces behind, as lines
    EdgesWireframe,
    /// Faces behind, pulled towards the eye: thin on round rims, wide at sharp edges
    EdgesTranslate,
    /// Faces behind, fattened by one width
    EdgesFatten,
    /// Fattened in greys, with strokes along grazing faces
    EdgesCharcoal,
}

/// What the hull shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaintArg {
    /// The texture views nearest to the eye, blended; tiles of the atlas where no view sees a face
    Blended,
    /// The one nearest view that sees a face, as in the paper; tiles where none does
    Nearest,
    /// The blended texture views alone
    Views,
    /// The atlas alone, as in any glTF viewer
    Tiles,
}

/// How the outline is smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AntialiasArg {
    /// Not at all
    None,
    /// The contour once more as a soft line
    Soft,
    /// Four samples a pixel
    Msaa,
}

/// Draws one picture of an asset.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap render bunny.glb --eye -0.2,0.2,0.3 -o bunny.png
  silmap render bunny.glb --eye 0.3,0.2,0.4 --mode difference --model bunny.ply --close-holes -o wrong.png
  silmap render --model bunny.ply --close-holes --eye 0.3,0.2,0.4 --mode edges-fatten --width 3 -o lines.png")]
pub(crate) struct RenderArgs {
    /// The asset; original and edges-* do without
    #[arg(required_unless_present = "model")]
    pub(crate) asset: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    /// The picture to write
    #[arg(short, long, value_name = "IMG.png")]
    pub(crate) out: PathBuf,
    /// What to draw
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ModeArg::Clipped)]
    pub(crate) mode: ModeArg,
    /// How silhouettes are interpolated [default: tight, or hull where silhouettes have no depths]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) method: Option<MethodArg>,
    /// What the hull shows in the modes textured and clipped
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = PaintArg::Blended)]
    pub(crate) paint: PaintArg,
    /// How the outline is smoothed
    #[arg(long, value_name = "HOW", value_enum, default_value_t = AntialiasArg::Soft)]
    pub(crate) antialias: AntialiasArg,
    /// What is behind the model: #rrggbb or transparent
    #[arg(long, value_name = "COLOUR", default_value = "#ffffff", value_parser = parse_backdrop)]
    pub(crate) background: Backdrop,
    /// The full mesh, for modes that need it
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: Option<PathBuf>,
    /// Width of lines in modes edges-*, outside of the model, in pixels; edges-equal has none, those of edges-translate lie inside
    /// and are this wide on rims as round as a sixteenth of the model
    #[arg(long, value_name = "PX", default_value = "2", value_parser = parse_positive)]
    pub(crate) width: f64,
    /// In modes edges-*: take the model as it is, open or with faces turned any way, and find the nearest faces by an item buffer
    #[arg(long, conflicts_with_all = ["close_holes", "repair"])]
    pub(crate) soup: bool,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// The file formats of a contour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ContourFormat {
    /// One object with camera and loops
    Json,
    /// One path, filled
    Svg,
    /// A mask, white inside
    Png,
}

/// Interpolates the outline of the model from a viewpoint.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap contour bunny.glb --eye 0.3,0.2,0.4 --format svg -o outline.svg
  silmap contour bunny.glb --eye=-0.3,0.2,0.4 --method paper > outline.json")]
pub(crate) struct ContourArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    /// How silhouettes are interpolated [default: tight, or hull where silhouettes have no depths]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) method: Option<MethodArg>,
    /// Level of detail of the contours: 0 has all their vertices, each next one keeps to twice the tolerance [default: the coarsest
    /// within a quarter of a pixel]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(..=i64::from(ViewContour::COARSEST_LEVEL)))]
    pub(crate) detail: Option<u8>,
    /// What to write
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = ContourFormat::Json)]
    pub(crate) format: ContourFormat,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Says what is in an asset.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  silmap inspect bunny.glb --full --json")]
pub(crate) struct InspectArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    /// List views, polytope triangles and the error curve too
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Where test viewpoints are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum WhereArg {
    /// Where random rays from the center meet the polytope of views
    Polytope,
    /// On the view sphere
    Sphere,
    /// At distances log-uniform in 1.5R to 10R, R the radius of the bounding sphere
    Shell,
}

/// Measures how far interpolated outlines are from the true ones.
///
/// The share of misclassified pixels, relative to the pixels inside the true outline, and the part of it that is inside but
/// predicted outside ("escaped").
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  silmap evaluate bunny.glb --model bunny.ply --close-holes --viewpoints 200 --json")]
pub(crate) struct EvaluateArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    /// The mesh it was made from
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: PathBuf,
    /// How many test viewpoints
    #[arg(long, value_name = "K", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) viewpoints: u32,
    /// Seed of the random directions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Side of the test pictures in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) resolution: u32,
    /// How silhouettes are interpolated [default: every method]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) method: Option<MethodArg>,
    /// Measure the textures too: the colours inside the outline at K viewpoints on the view sphere, which needs a graphics adapter, and
    /// how often the atlas's parametrisation jumps, beside the other one
    #[arg(long, value_name = "K", num_args = 0..=1, default_missing_value = "8", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) textures: Option<u32>,
    /// Where the viewpoints are
    #[arg(long = "where", value_name = "WHERE", value_enum, default_value_t = WhereArg::Polytope)]
    pub(crate) placement: WhereArg,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Writes a page with everything that is known about an asset's outlines, and the numbers behind it.
///
/// `report.html` needs nothing but a browser, not even a network: errors of all methods and places, over all directions and
/// over the number of views, the worst viewpoints, polytope and contours in pictures, sizes and times. `report.json` has the numbers.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap report bunny.glb --model bunny.ply --close-holes -o bunny-report
  silmap report torus.glb --model torus.obj --viewpoints 50 --directions 200 -o quick --json")]
pub(crate) struct ReportArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    /// The mesh it was made from
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: PathBuf,
    /// Folder for report.html and report.json, made when it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// How many test viewpoints in each place
    #[arg(long, value_name = "K", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) viewpoints: u32,
    /// Seed of the random directions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(crate) seed: u64,
    /// How many directions the maps of the sphere are measured at
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u32).range(12..=100_000))]
    pub(crate) directions: u32,
    /// Side of the test pictures in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) resolution: u32,
    /// Compare with exact extraction by every method and at several resolutions of the model; takes minutes
    #[arg(long)]
    pub(crate) comparison: bool,
    /// How many of the worst viewpoints of the best method to show
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=100))]
    pub(crate) worst: u32,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// How much work goes into making a hull tighter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TightenArg {
    /// None: every hull of fewer faces encloses those of more
    Off,
    /// Vertices are placed anew against the model: about twice the time
    Fast,
    /// Edges are collapsed against the model too: about ten times the time
    Best,
}

impl From<TightenArg> for Tightening {
    fn from(tighten: TightenArg) -> Self {
        match tighten {
            TightenArg::Off => Self::Off,
            TightenArg::Fast => Self::Fast,
            TightenArg::Best => Self::Best,
        }
    }
}

/// Makes a coarse mesh that encloses a model.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap hull bunny.ply --close-holes --faces 500 --verify -o hull.obj
  silmap hull bunny.ply --close-holes --tighten best --strip levels.png -o hull.obj
  silmap hull bunny.ply --close-holes --faces 100 --sequence bunny.hulls -o hull.obj
  silmap hull bunny.hulls --faces 300 -o finer.obj
  silmap hull bunny.ply --close-holes --volume-ratio 1.05 -o hull.glb")]
pub(crate) struct HullArgs {
    /// The mesh, or a sequence saved by --sequence
    pub(crate) model: PathBuf,
    /// The hull to write: .obj, .ply or .glb
    #[arg(short, long, value_name = "HULL")]
    pub(crate) out: PathBuf,
    /// Stop at this many faces [default: 500, unless another limit is given]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) faces: Option<u32>,
    /// Make a hull that the model encloses
    #[arg(long)]
    pub(crate) inner: bool,
    /// Stop before the hull's volume over the model's passes this
    #[arg(long, value_name = "X", value_parser = parse_positive)]
    pub(crate) volume_ratio: Option<f64>,
    /// Stop before a vertex is farther than this from the model; 0.01R is a hundredth of its bounding sphere's radius
    #[arg(long, value_name = "LENGTH", value_parser = parse_length)]
    pub(crate) max_distance: Option<Length>,
    /// Keep the hull from passing through itself, where the model does not; takes longer
    #[arg(long)]
    pub(crate) no_self_intersections: bool,
    /// Make the hull tighter than its collapses leave it; it encloses the model all the same
    #[arg(long, value_name = "HOW", value_enum, default_value_t = TightenArg::Off)]
    pub(crate) tighten: TightenArg,
    /// Save the whole sequence of hulls: any level comes out of it again without the work
    #[arg(long, value_name = "FILE")]
    pub(crate) sequence: Option<PathBuf>,
    /// Draw the model and hulls of ever fewer faces side by side
    #[arg(long, value_name = "IMG.png")]
    pub(crate) strip: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    /// Check independently that nothing of the model is outside
    #[arg(long)]
    pub(crate) verify: bool,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// How exact silhouette edges are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExtractionArg {
    /// Every face and every edge, on one core
    Brute,
    /// The same, several faces at a time and on all cores
    BruteParallel,
    /// A list of candidates that front faces toggle
    List,
    /// The list as a table with a row for each vertex
    Hash,
    /// The neighbours of front faces
    Table,
    /// A forest whose nodes are passed over where all their faces look one way; takes long to build
    Cones,
    /// A hierarchy whose nodes are passed over in the same way, bounded more simply
    Jc,
    /// What changed since the last viewpoint, by an octree in dual space: for --walk
    Dual,
}

impl From<ExtractionArg> for silmap_exact::Method {
    fn from(method: ExtractionArg) -> Self {
        match method {
            ExtractionArg::Brute => Self::Brute,
            ExtractionArg::BruteParallel => Self::BruteParallel,
            ExtractionArg::List => Self::List,
            ExtractionArg::Hash => Self::Hash,
            ExtractionArg::Table => Self::Table,
            ExtractionArg::Cones => Self::Cones,
            ExtractionArg::Jc => Self::Jc,
            ExtractionArg::Dual => Self::Dual,
        }
    }
}

/// Finds the exact silhouette edges of a model from a viewpoint.
///
/// An edge is on the silhouette when one of its faces shows its front and the other does not. All methods find the same
/// edges; they differ in time and in what they keep about the model.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap edges bunny.ply --close-holes --eye 0.3,0.2,0.4 --svg lines.svg
  silmap edges bunny.ply --close-holes --direction 0,0,1 --method table --list --json > edges.json")]
#[command(group = clap::ArgGroup::new("viewpoint").required(true).args(["eye", "direction"]))]
pub(crate) struct EdgesArgs {
    /// The mesh
    pub(crate) model: PathBuf,
    /// Viewpoint, in model units
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,
    /// Direction in which the viewpoint is infinitely far away
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) direction: Option<DVec3>,
    /// How edges are found
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ExtractionArg::Brute)]
    pub(crate) method: ExtractionArg,
    /// Go on from the viewpoint around the model in steps of 0.5°, to this many viewpoints
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) walk: u32,
    /// How often every viewpoint is timed
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) repeat: u32,
    /// List the edges too, as pairs of vertices with the front face on the left, and the vertices
    #[arg(long)]
    pub(crate) list: bool,
    /// Draw the edges, hidden ones too, into this file
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Measures interpolation, extraction and frames of a model side by side.
///
/// Rows are `full` (the mesh), `hull` (the painted hull, unclipped), `clipped-METHOD-ANTIALIAS`, `exact-METHOD` (the hull clipped by
/// exact edges, unsmoothed), and without drawing `edges-METHOD` (extraction) and `contour-METHOD` (interpolation). Each is timed at
/// the viewpoints of one walk around the model in steps of 0.5°.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap bench bunny.ply --close-holes --json
  silmap bench bunny.ply --close-holes --asset bunny.glb --faces-full 1200000 --edges brute --edges jc")]
pub(crate) struct BenchArgs {
    /// The mesh
    pub(crate) model: PathBuf,
    /// Its asset [default: built with the defaults of `silmap build`]
    #[arg(long, value_name = "ASSET.glb")]
    pub(crate) asset: Option<PathBuf>,
    /// Cut the faces of the full mesh into four while there are at most this many
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=50_000_000))]
    pub(crate) faces_full: u32,
    /// Draw this many in a frame, one after the other, each from the next viewpoint of the walk
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) instances: u32,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = parse_size)]
    pub(crate) size: Size,
    /// Frames of each row
    #[arg(long, value_name = "N", default_value_t = 31, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) repeat: u32,
    /// Methods of extraction to measure; may be given several times [default: all]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) edges: Vec<ExtractionArg>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// The models silmap makes itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ModelKind {
    /// A torus
    Torus,
    /// A tube along a trefoil knot
    TrefoilKnot,
    /// A body with three handles
    ThreeHoledTorus,
    /// A coloured creature-like shape with lobes, hollows and fine relief
    Organic,
}

/// Generates a model to try things on.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  silmap generate torus --faces 65536 -o torus.ply")]
pub(crate) struct GenerateArgs {
    /// Which model
    pub(crate) kind: ModelKind,
    /// How many faces, at least approximately
    #[arg(long, value_name = "N", default_value_t = 65_536, value_parser = clap::value_parser!(u32).range(100..=20_000_000))]
    pub(crate) faces: u32,
    /// The mesh to write: .obj, .ply or .glb
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}
