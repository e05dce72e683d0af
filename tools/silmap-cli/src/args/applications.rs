//! Options of `simplify` and `align`.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;

use super::{CapturedCameraArgs, MeshOutArgs, ModelArgs, OutputArgs, PoolArgs};
use crate::values::{parse_angle, parse_point, parse_positive};

/// Simplifies a model but keeps its silhouettes
///
/// Edges are collapsed by their quadric error, which weighs many times more on or near a silhouette as seen from the given
/// viewpoints. Nothing encloses the model here: for that there is `silmap hull`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap simplify bunny.ply --close-holes --faces 800 --eye 0.3,0.2,0.4 -o simple.obj
  silmap simplify bunny.ply --close-holes --faces 800 --eyes path.txt -o simple.ply --json")]
#[command(group = clap::ArgGroup::new("viewpoints").required(true).multiple(true).args(["eye", "eyes"]))]
pub(crate) struct SimplifyArgs {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    #[command(flatten)]
    pub(crate) mesh: MeshOutArgs,
    /// Stop at this many faces
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) faces: u32,
    /// Viewpoint whose silhouettes are kept, in model units; may be given several times
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) eye: Vec<DVec3>,
    /// A text file of further viewpoints, one x,y,z a line
    #[arg(long, value_name = "FILE")]
    pub(crate) eyes: Option<PathBuf>,
    /// Faces seen within this angle of edge-on are near a silhouette, degrees
    #[arg(long, value_name = "DEGREES", default_value = "12", value_parser = parse_angle)]
    pub(crate) band: f64,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Finds the camera from which a model fits an outline in an image
///
/// The pose to start from is a JSON file with a camera as `silmap contour` prints it: eye, target, up and fov_y_degrees; without
/// the last the model's bounding sphere just fits. Eye and orientation are refined, the field of view is kept. Where no pose fits, the
/// command says how far apart the outlines stay, writes no file and exits 1.
///
/// With --camera the intrinsics are those of a photograph's camera, which the mask belongs to, and its pose is the one to start from, unless
/// --start has another; how far the refined pose is from the captured one is printed. The mask may be smaller or larger than the image.
///
/// In the mask, inside is: what is more than half opaque, where the picture has an alpha channel that is not the same everywhere (a
/// cut-out); the brighter of two brightnesses, whichever they are (0 and 1, 0 and 255); else what is brighter than half of white. A
/// bright background around a dark model is noticed and taken the other way round, with a warning.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap align bunny.ply --close-holes --mask bunny.png --start pose.json -o refined.json
  silmap align scan.ply --mask masks/image_9.png --camera cameras.json --view image_9 -o refined.json")]
#[command(group = clap::ArgGroup::new("begin").required(true).multiple(true).args(["start", "camera"]))]
pub(crate) struct AlignArgs {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// A picture of the outline: a mask that is bright inside, or a cut-out; PNG, JPEG or WebP
    #[arg(long, value_name = "IMG")]
    pub(crate) mask: PathBuf,
    /// The camera to start from [default: that of --view]
    #[arg(long, value_name = "POSE")]
    pub(crate) start: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) captured: CapturedCameraArgs,
    /// How far apart the outlines may be on average, pixels [default: 1 % of the outline's extent in the mask, and at least 1]
    #[arg(long, value_name = "PX", value_parser = parse_positive)]
    pub(crate) within: Option<f64>,
    /// Write the refined pose here: it can be started from again
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}
