//! Groups of options that several commands have, with the same names, defaults and sentences in each.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use silmap_map::{Method, SilhouetteMap};
use silmap_mesh_io::AlphaUse;

use crate::values::{Size, parse_point, parse_positive, parse_size};

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
#[derive(Clone, Debug, Args)]
#[command(group = clap::ArgGroup::new("viewpoint").required(true).args(["eye", "camera"]))]
pub(crate) struct CameraArgs {
    /// Viewpoint, in model units
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,
    /// Point that is looked at [default: the model's center]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true, conflicts_with = "camera")]
    pub(crate) target: Option<DVec3>,
    /// Direction that is up in the picture [default: +Y, near the poles +Z]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) up: Option<DVec3>,
    /// Vertical field of view in degrees [default: the model's bounding sphere just fits]
    #[arg(
        long,
        value_name = "DEGREES",
        allow_hyphen_values = true,
        conflicts_with = "camera"
    )]
    pub(crate) fov: Option<f64>,
    /// Size of the picture in pixels [default: 512x512; with --camera that of the view's image, whose shape any other size must have]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<Size>,
    #[command(flatten)]
    pub(crate) captured: CapturedCameraArgs,
    /// Bend the picture as the lens of --camera does, so that it lies over the photograph as it was taken
    #[arg(long, requires = "camera")]
    pub(crate) distorted: bool,
}

/// A camera of a capture, as `edges` and `align` take it too.
#[derive(Clone, Debug, Args)]
pub(crate) struct CapturedCameraArgs {
    /// Look through a photograph's camera: a capture's camera file, or its folder. Masks need not be there
    #[arg(long, value_name = "FILE", requires = "view")]
    pub(crate) camera: Option<PathBuf>,
    /// Which camera of FILE: the view's name, its photograph's file, or the beginning of one of them
    #[arg(long, value_name = "NAME", requires = "camera")]
    pub(crate) view: Option<String>,
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

/// A mesh that is read, and how it may be mended.
#[derive(Clone, Debug, Args)]
pub(crate) struct ModelArgs {
    /// The mesh
    #[arg(id = "model", value_name = "MODEL")]
    pub(crate) path: PathBuf,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
}

/// An asset, and the mesh that it is compared with.
#[derive(Clone, Debug, Args)]
pub(crate) struct AssetOfModelArgs {
    /// The asset
    pub(crate) asset: PathBuf,
    /// The mesh it was made from
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
}

/// A mesh that is written.
#[derive(Clone, Debug, Args)]
pub(crate) struct MeshOutArgs {
    /// The mesh to write: .obj, .ply or .glb
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

/// Which parts of a mesh are left out.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct KeptPartsArgs {
    /// Keep parts that no eye outside can see: walls of cavities, and bodies within others
    #[arg(long)]
    pub(crate) keep_cavities: bool,
}

/// Random pictures that outlines are compared in.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TestPictureArgs {
    /// Seed of the random directions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Side of the test pictures in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) resolution: u32,
}

/// How an asset's outline is found.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct InterpolationArgs {
    /// How silhouettes are interpolated [default: tight, or hull where silhouettes have no depths]
    #[arg(long, value_name = "WHICH", value_enum)]
    pub(crate) method: Option<MethodArg>,
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
