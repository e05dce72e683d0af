//! Options of the commands that work on a mesh alone: hulls, exact silhouettes, benches, and models of silmap's own.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use silmap_hull::Tightening;

use super::{
    CapturedCameraArgs, KeptPartsArgs, MendingArgs, MeshOutArgs, ModelArgs, OutputArgs, PoolArgs,
};
use crate::values::{Length, Size, parse_length, parse_point, parse_positive, parse_size};

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
    /// The hull to write: .obj, .ply, .off, .stl or .glb; all but .stl hold the model's colours, at vertices
    #[arg(short, long, value_name = "HULL")]
    pub(crate) out: PathBuf,
    /// Stop at this many faces [default: 500, unless another limit is given]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) faces: Option<u32>,
    /// Make a hull that the model encloses
    #[arg(long)]
    pub(crate) inner: bool,
    /// Stop before the hull's volume over the model's passes this; cavities that are left out count as filled
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
    pub(crate) parts: KeptPartsArgs,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    /// Check independently that nothing of the model is outside, or of an inner hull outside the model; exit code 1 if something is
    ///
    /// A triangle that nothing passes through is proved, by exact signs. Where model and hull pass through one another the check samples:
    /// near each such place, and 20,000 random points of the surface, on a sphere a fortieth of its radius apart
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
    /// The same by a balanced-aspect-ratio tree
    DualBar,
}

impl From<ExtractionArg> for silmap_exact::ExtractionMethod {
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
            ExtractionArg::DualBar => Self::DualBar,
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
  silmap edges bunny.ply --close-holes --direction 0,0,1 --method table --list --json > edges.json
  silmap edges bunny.ply --close-holes --eye 0.3,0.2,0.4 --outline outline.json
  silmap edges bunny.ply --close-holes --eye 0.3,0.2,0.4 --method cones --forest bunny.cones
  silmap edges scan.ply --camera cameras.json --view image_9 --outline outline.json")]
#[command(group = clap::ArgGroup::new("viewpoint").required(true).args(["eye", "direction", "camera"]))]
pub(crate) struct EdgesArgs {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// Viewpoint, in model units
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,
    /// Direction in which the viewpoint is infinitely far away
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) direction: Option<DVec3>,
    #[command(flatten)]
    pub(crate) captured: CapturedCameraArgs,
    /// How edges are found
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ExtractionArg::Brute)]
    pub(crate) method: ExtractionArg,
    /// Go on from the viewpoint around the model in steps of 0.5°, to this many viewpoints
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000), conflicts_with = "camera")]
    pub(crate) walk: u32,
    /// Keep the forest of `--method cones` in this file: read when it is there, else built and written
    #[arg(long, value_name = "FILE")]
    pub(crate) forest: Option<PathBuf>,
    /// How often every viewpoint is timed
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) repeat: u32,
    /// List the edges too, as pairs of vertices with the front face on the left, and the vertices
    #[arg(long)]
    pub(crate) list: bool,
    /// Draw the edges, hidden ones too, into this file
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Write the outline against the background into this file: JSON with a camera, that of --view or one in which the model's bounding
    /// sphere just fits, and polygons in its pixels that do not cross
    #[arg(long, value_name = "FILE")]
    pub(crate) outline: Option<PathBuf>,
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
///
/// With `--pixels` it draws a scene of many instances in one pass, around which a camera walks. Rows are `full`, `lod-500`, `lod-5000` and
/// `lod-equal-error` (the mesh simplified to as many faces, and to as many as have the clipped hull's outline error), `hull`,
/// `clipped-stencil`, `clipped-coverage`, and `each-a-pass` (a pass for each instance).
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap bench bunny.ply --close-holes --json
  silmap bench bunny.ply --close-holes --asset bunny.glb --faces-full 1200000 --edges brute --edges jc
  silmap bench bunny.ply --close-holes --asset bunny.glb --instances 1000 --pixels 128 --size 2048x2048")]
pub(crate) struct BenchArgs {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// Its asset [default: built with the defaults of `silmap build`]
    #[arg(long, value_name = "ASSET.glb")]
    pub(crate) asset: Option<PathBuf>,
    /// Cut the faces of the full mesh into four while there are at most this many
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=50_000_000))]
    pub(crate) faces_full: u32,
    /// Draw this many in a frame: with --pixels in one scene, else one after the other, each from the next viewpoint of the walk
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) instances: u32,
    /// Measure one scene in one pass, in which the sphere about each instance is so many pixels wide
    #[arg(long, value_name = "PX", value_parser = parse_positive, conflicts_with_all = ["edges", "comparison"])]
    pub(crate) pixels: Option<f64>,
    /// With --pixels, let the camera stand still instead of walking half a degree a frame
    #[arg(long, requires = "pixels")]
    pub(crate) still: bool,
    /// Size of the pictures in pixels; a scene's is square
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = parse_size)]
    pub(crate) size: Size,
    /// Frames of each row
    #[arg(long, value_name = "N", default_value_t = 31, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) repeat: u32,
    /// Methods of extraction to measure; may be given several times [default: all]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) edges: Vec<ExtractionArg>,
    /// Also over the model's resolution, as in a report: every method of extraction on hulls with fewer faces, and how many faces can be
    /// drawn unclipped in the same time; takes minutes
    #[arg(long)]
    pub(crate) comparison: bool,
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
    #[command(flatten)]
    pub(crate) mesh: MeshOutArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}
