//! Options of the commands that read an asset.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use silmap_map::ViewContour;

use super::{
    AssetOfModelArgs, CameraArgs, InterpolationArgs, MaskArgs, MendingArgs, MethodArg, OrbitArgs,
    OutputArgs, PoolArgs, TestPictureArgs,
};
use crate::values::{Backdrop, parse_backdrop, parse_point, parse_positive};

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
    /// The model's surface within the hull, found by the depths of texture views; without them as `blended`
    Relief,
    /// The texture views nearest to the eye, blended; tiles of the atlas where no view sees a face
    Blended,
    /// The one nearest view that sees a face, as in the paper; tiles where none does
    Nearest,
    /// The blended texture views alone
    Views,
    /// The atlas alone, as in any glTF viewer
    Tiles,
}

/// Where `render` shows the photograph that is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PhotographArg {
    /// Behind what is drawn, in the place of the background
    Behind,
    /// Beside it: the photograph, the picture, and the photograph in grey with what is wrong beside its mask, red too much, blue too little
    Beside,
}

/// How the outline is smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AntialiasArg {
    /// Not at all
    None,
    /// By the distance from the outline, a ramp one pixel wide
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
  silmap render --model bunny.ply --close-holes --eye 0.3,0.2,0.4 --mode edges-fatten --width 3 -o lines.png
  silmap render squirrel.glb --camera squirrel/cameras.json --view image_9 --photograph beside -o beside.png
  silmap render bunny.glb --eye -0.2,0.2,0.3 --orbit 48 --size 360x360 --quality 75 -o turn.webp
  silmap render bunny.glb --eye -0.2,0.2,0.3 --orbit 120 -o frames/%04d.png")]
pub(crate) struct RenderArgs {
    /// The asset; original and edges-* do without
    pub(crate) asset: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    /// The picture to write: .png, .jpg or .webp; with --orbit also a pattern of names
    #[arg(short, long, value_name = "IMG.png")]
    pub(crate) out: PathBuf,
    /// What to draw
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ModeArg::Clipped)]
    pub(crate) mode: ModeArg,
    #[command(flatten)]
    pub(crate) interpolation: InterpolationArgs,
    /// What the hull shows in the modes textured and clipped
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = PaintArg::Relief)]
    pub(crate) paint: PaintArg,
    /// How the outline is smoothed
    #[arg(long, value_name = "HOW", value_enum, default_value_t = AntialiasArg::Soft)]
    pub(crate) antialias: AntialiasArg,
    /// What is behind the model: #rrggbb or transparent
    #[arg(long, value_name = "COLOUR", default_value = "#ffffff", value_parser = parse_backdrop)]
    pub(crate) background: Backdrop,
    /// Show the photograph of --view too
    #[arg(
        long,
        value_name = "WHERE",
        value_enum,
        requires = "camera",
        conflicts_with = "shadow"
    )]
    pub(crate) photograph: Option<PhotographArg>,
    #[command(flatten)]
    pub(crate) masks: MaskArgs,
    /// Show the shadow on the ground under the model, by light from this direction; modes coarse, textured and clipped. The ground
    /// lies across --up
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) shadow: Option<DVec3>,
    /// Light the model from this direction, in the model's coordinates, instead of by the studio light that its pictures have in them: that
    /// is divided out by the model's normals, as depths of texture views or the atlas tell them. Modes original, coarse, textured,
    /// clipped and exact
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) light: Option<DVec3>,
    /// The full mesh, for modes that need it
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: Option<PathBuf>,
    /// Width of lines in modes edges-*, outside of the model, in pixels; edges-equal has none, those of edges-translate lie inside
    /// and are this wide on rims as round as a sixteenth of the model
    #[arg(long, value_name = "PX", default_value = "2", value_parser = parse_positive)]
    pub(crate) width: f64,
    /// In modes edges-*: take the model as it is, open or with faces turned any way, and find the nearest faces by an item buffer
    #[arg(long, conflicts_with_all = ["close_holes", "repair", "weld"])]
    pub(crate) soup: bool,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) turn: OrbitArgs,
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
  silmap contour bunny.glb --eye=-0.3,0.2,0.4 --method paper > outline.json
  silmap contour squirrel.glb --camera squirrel/cameras.json --view image_9 --format png -o mask.png")]
pub(crate) struct ContourArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    #[command(flatten)]
    pub(crate) interpolation: InterpolationArgs,
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
    /// Draw from where outlines rest on photographs, as a map of all directions; for the asset of a capture
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) coverage: Option<PathBuf>,
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
/// predicted outside ("escaped"). Beside a mesh also how far the outline strays from the true one, in pixels of the test pictures: what is
/// thin has hardly an area, and its length is told here.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap evaluate bunny.glb --model bunny.ply --close-holes --viewpoints 200 --json
  silmap evaluate squirrel.glb --camera squirrel/cameras.json
  silmap evaluate squirrel --leave-one-out")]
#[command(group = clap::ArgGroup::new("compared").required(true).multiple(true).args(["model", "camera", "leave_one_out"]))]
pub(crate) struct EvaluateArgs {
    /// The asset, or with --leave-one-out the capture
    pub(crate) asset: PathBuf,
    /// The mesh it was made from
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    /// Compare with the masks of a capture, seen by its own cameras, in the place of a mesh: its camera file, or its folder
    #[arg(long, value_name = "FILE", conflicts_with_all = ["model", "close_holes", "repair", "alpha", "weld", "viewpoints", "seed", "resolution", "textures", "placement"])]
    pub(crate) camera: Option<PathBuf>,
    /// Only at this view of FILE, called as for `render`; may be given several times [default: all that have a mask]
    #[arg(long = "view", value_name = "NAME", requires = "camera")]
    pub(crate) views: Vec<String>,
    #[command(flatten)]
    pub(crate) masks: MaskArgs,
    /// Leave the views of a capture out, each in turn, and predict it from the rest: ASSET is the capture then. Where the object's mesh is
    /// known in the frame of the cameras, --model compares with its silhouettes, not with the masks, and with a map of its own
    #[arg(long, conflicts_with_all = ["camera", "viewpoints", "seed", "resolution", "textures", "placement", "method"])]
    pub(crate) leave_one_out: bool,
    /// Leave only every Nth view out [default: 1, of more than 100 views 4]
    #[arg(long, value_name = "N", requires = "leave_one_out", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) every: Option<u32>,
    /// How many test viewpoints
    #[arg(long, value_name = "K", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) viewpoints: u32,
    #[command(flatten)]
    pub(crate) pictures: TestPictureArgs,
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
  silmap report torus.glb --model torus.obj --viewpoints 50 --directions 200 -o quick --json
  silmap report bunny.glb --model bunny.ply --close-holes --scene 100x200 --scene 1000x128 -o scenes")]
pub(crate) struct ReportArgs {
    #[command(flatten)]
    pub(crate) compared: AssetOfModelArgs,
    /// Folder for report.html and report.json, made when it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// How many test viewpoints in each place
    #[arg(long, value_name = "K", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) viewpoints: u32,
    #[command(flatten)]
    pub(crate) pictures: TestPictureArgs,
    /// How many directions the maps of the sphere are measured at
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u32).range(12..=100_000))]
    pub(crate) directions: u32,
    /// Compare with exact extraction by every method and at several resolutions of the model; takes minutes
    #[arg(long)]
    pub(crate) comparison: bool,
    /// Measure frames of N instances that are PX pixels wide, as bench --pixels does; repeatable; needs a graphics adapter
    #[arg(long = "scene", value_name = "NxPX", value_parser = parse_scene)]
    pub(crate) scenes: Vec<(u32, f64)>,
    /// How many of the worst viewpoints of the best method to show
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=100))]
    pub(crate) worst: u32,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// A scene: instances, and pixels across each.
fn parse_scene(text: &str) -> Result<(u32, f64), String> {
    const MOST: u32 = 10_000;
    text.split_once(['x', 'X', '×'])
        .and_then(|(count, pixels)| Some((count.trim().parse().ok()?, pixels.trim().parse().ok()?)))
        .filter(|&(count, pixels): &(u32, f64)| {
            (1..=MOST).contains(&count) && pixels.is_finite() && pixels > 0.0
        })
        .ok_or_else(|| {
            format!("a scene is NxPX, 1 to {MOST} instances and their pixels, such as 1000x128")
        })
}
