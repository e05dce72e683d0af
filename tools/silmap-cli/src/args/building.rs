//! Options of `demo` and `build`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use silmap_geometry::CoverageRule;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::for_height::HEIGHTS_PX;
use silmap_preprocess::parts::PartParams;
use silmap_preprocess::pipeline::BuildParams;
use silmap_preprocess::texture::{Parametrisation, PictureFormat, TextureParams, TileSizes};

use super::{CarveArgs, KeptPartsArgs, ManifestArgs, MendingArgs, MethodArg, OutputArgs, PoolArgs};
use crate::values::{Length, Share, parse_bytes, parse_length, parse_positive, parse_share};

/// Makes everything on a model of its own: an asset, comparison pictures, a report.
///
/// Nothing is needed but an empty folder: the model is generated. The asset, the pictures and `report.html` are put into
/// the folder, and the last line says where to look.
///
/// With `--captured` the way begins at photographs: a capture of the model is made and put into `DIR/capture`, 44 photographs whose
/// exposures differ, with masks whose outlines are off by about a pixel. An asset is built of it as `build` does, and compared with the
/// model, which is known here: the last lines print misclassified pixels from the photographs' eyes and from eyes in between.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap demo -o silmap-demo
  silmap demo --captured -o silmap-captured
  silmap demo --captured --spoil 2% -o spoiled && silmap build spoiled/capture --check")]
pub(crate) struct DemoArgs {
    /// Folder for the results
    #[arg(short, long, value_name = "DIR", default_value = "silmap-demo")]
    pub(crate) out: PathBuf,
    /// Begin at photographs, made of the model, and build an asset of them
    #[arg(long)]
    pub(crate) captured: bool,
    /// Spoil this share of the masks, rounded up to whole ones: a bite out, or a blob added
    #[arg(long, value_name = "SHARE", requires = "captured", value_parser = parse_share)]
    pub(crate) spoil: Option<Share>,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// What has no meaning for an asset that is there already.
const FROM_CONFLICTS: [&str; 28] = [
    "model",
    "for_height",
    "views",
    "choose_by",
    "resolution",
    "tolerance",
    "parts",
    "coverage",
    "radius",
    "faces",
    "texture_views",
    "texture_size",
    "texture_format",
    "texture_quality",
    "texture_bytes",
    "relief",
    "relief_bits",
    "atlas_size",
    "tiles",
    "parametrisation",
    "no_normals",
    "close_holes",
    "repair",
    "alpha",
    "weld",
    "keep_cavities",
    "backend",
    "uniform_curve",
];

/// What an asset that is built like another takes from that one.
const PARAMS_FROM_CONFLICTS: [&str; 29] = {
    let mut names = ["from"; 29];
    names[1] = "keep";
    names[2] = "max_error";
    // All of those between the model and what is not a param.
    let mut k = 1;
    while k + 1 < FROM_CONFLICTS.len() {
        names[k + 2] = FROM_CONFLICTS[k];
        k += 1;
    }
    names
};

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

/// Which views are captured, and how.
#[derive(Clone, Debug, Args)]
pub(crate) struct CaptureArgs {
    /// Views to capture around the model. Five times --keep of them, evenly spread, are candidates for it; errors are counted over all
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(12..=65_536))]
    pub(crate) views: u32,
    /// Height at most at which the model is seen on the screen, in pixels: that of a picture that just holds its bounding sphere, as those
    /// of `silmap render` do. It sets --resolution, --texture-size, --relief and --atlas-size to half of it, and --relief-bits, where
    /// they are not given; --tolerance is in pixels of --resolution, and follows. The defaults are those for 1024
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(heights()))]
    pub(crate) for_height: Option<u32>,
    /// Side of the captured pictures in pixels [default: 512; of a capture as fine as most photographs, from 256 to 1024]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) resolution: Option<u32>,
    /// How far a contour may move when it is simplified, in pixels [default: 0.5, or 0.75 with --coverage any, where it moves
    /// outward only]
    #[arg(long, value_name = "PIXELS", value_parser = parse_positive)]
    pub(crate) tolerance: Option<f64>,
    /// Parts at most that the model is cut into, whose outlines are interpolated by themselves: fewer leave nicks where parts hide one
    /// another, 1 leaves the model whole
    #[arg(long, value_name = "N", default_value_t = PartParams::default().most, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(crate) parts: u32,
    /// Which pixels the model covers
    #[arg(long, value_name = "RULE", value_enum, default_value_t = CoverageArg::Center)]
    pub(crate) coverage: CoverageArg,
    /// Radius of the view sphere: 3R is three times the model's bounding sphere, a bare number is in model units
    #[arg(long, value_name = "LENGTH", default_value = "3R", value_parser = parse_length)]
    pub(crate) radius: Length,
    /// What draws the captured views
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = BackendArg::Auto)]
    pub(crate) backend: BackendArg,
}

/// Which views are kept.
#[derive(Clone, Debug, Args)]
pub(crate) struct KeptViewsArgs {
    /// Views to keep in the map [default: 128]
    #[arg(long, value_name = "N", conflicts_with = "max_error", value_parser = clap::value_parser!(u32).range(4..=65_536))]
    pub(crate) keep: Option<u32>,
    /// Keep as few views as hold this mean share of misclassified pixels, such as 0.5%
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub(crate) max_error: Option<Share>,
    /// The method whose error decides which views to keep. All methods can be used on the asset, but others have more error then: choose
    /// by the one that you draw by, which is tight unless `render` is told otherwise
    #[arg(long, visible_alias = "method", value_name = "WHICH", value_enum, default_value_t = MethodArg::Tight)]
    pub(crate) choose_by: MethodArg,
}

/// What the hull is painted with.
#[derive(Clone, Debug, Args)]
pub(crate) struct TextureArgs {
    /// Pictures of the model that are projected onto the hull
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(crate) texture_views: u32,
    /// Side of those pictures in pixels [default: 512, or with relief 768 or 1024 where the model has detail that is lost otherwise]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub(crate) texture_size: Option<u32>,
    /// What pictures are stored as
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = PictureFormatArg::Jpeg)]
    pub(crate) texture_format: PictureFormatArg,
    /// Quality of pictures that lose something [default: 94, without relief 88]
    #[arg(long, value_name = "1..100", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub(crate) texture_quality: Option<u8>,
    /// Most bytes of all pictures together, such as 400K: quality falls to 60 first, then sides, then quality again
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub(crate) texture_bytes: Option<u64>,
    /// Side of the depth pictures that the texture views carry, by which the model's surface is found within the hull; `off` for none, and
    /// there are none where texture views are photographs [default: 512, or --texture-size where that is less]
    #[arg(long, value_name = "PIXELS|off", value_parser = parse_relief)]
    pub(crate) relief: Option<u32>,
    /// Bits of a depth [default: 9]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=14))]
    pub(crate) relief_bits: Option<u32>,
    /// Side of the atlas in pixels; it becomes more when the hull has too many faces for it [default: 512]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub(crate) atlas_size: Option<u32>,
    /// How large the faces' tiles in the atlas are
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = TilesArg::Adaptive)]
    pub(crate) tiles: TilesArg,
    /// Which point of the model a point of the hull shows in the atlas
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = ParametrisationArg::NormalShooting)]
    pub(crate) parametrisation: ParametrisationArg,
    /// Leave out the atlas's normals, which viewers that light the model themselves use
    #[arg(long)]
    pub(crate) no_normals: bool,
}

/// Colours that lie beside their places are not worth more.
const QUALITY_WITHOUT_RELIEF: u8 = 88;

/// A side in pixels, or 0 for `off`.
fn parse_relief(text: &str) -> Result<u32, String> {
    match text.parse() {
        _ if text == "off" => Ok(0),
        Ok(side @ 16..=2048) => Ok(side),
        _ => Err("it is neither `off` nor a number of pixels from 16 to 2048".into()),
    }
}

/// `--for-height` as clap takes ranges.
fn heights() -> std::ops::RangeInclusive<i64> {
    i64::from(*HEIGHTS_PX.start())..=i64::from(*HEIGHTS_PX.end())
}

impl CaptureArgs {
    /// The params that options which are not given keep.
    pub(crate) fn defaults(&self) -> BuildParams {
        (self.for_height).map_or_else(BuildParams::default, BuildParams::for_height)
    }
}

impl TextureArgs {
    /// The options as params; those that are not given keep the defaults.
    pub(crate) fn params(&self, default: TextureParams) -> TextureParams {
        let args = self;
        let size_px = args.texture_size.unwrap_or(default.size_px);
        let relief_px = args.relief.unwrap_or(default.relief_px.min(size_px));
        let is_plain = relief_px == 0;
        let quality = if is_plain {
            QUALITY_WITHOUT_RELIEF
        } else {
            default.quality
        };
        TextureParams {
            views: args.texture_views,
            size_px,
            detailed: default.detailed && args.texture_size.is_none() && !is_plain,
            format: args.texture_format.into(),
            quality: args.texture_quality.unwrap_or(quality),
            relief_px,
            relief_bits: args.relief_bits.unwrap_or(default.relief_bits),
            budget_bytes: args.texture_bytes,
            atlas_px: args.atlas_size.unwrap_or(default.atlas_px),
            tiles: args.tiles.into(),
            parametrisation: args.parametrisation.into(),
            normals: !args.no_normals,
            ..default
        }
    }
}

impl From<CoverageArg> for CoverageRule {
    fn from(coverage: CoverageArg) -> Self {
        match coverage {
            CoverageArg::Center => Self::Center,
            CoverageArg::Any => Self::Any,
        }
    }
}

impl From<BackendArg> for Backend {
    fn from(backend: BackendArg) -> Self {
        match backend {
            BackendArg::Auto => Self::Auto,
            BackendArg::Cpu => Self::Cpu,
            BackendArg::Gpu => Self::Gpu,
        }
    }
}

/// Makes an asset (.glb) out of a mesh, or out of a capture: photographs' cameras and masks.
///
/// Reads OBJ, PLY, STL, OFF, glTF and GLB. The mesh must be closed and consistently oriented; `--close-holes` and
/// `--repair` help. The asset opens in any glTF viewer as a plain textured low-polygon model. The error that is printed is over the
/// captured views, where those that were kept count as right: `silmap evaluate` measures in between.
///
/// A capture is a folder that holds `cameras.json` (matrices), `transforms.json` (nerfstudio), a COLMAP model (also in `sparse/0`),
/// `transforms_train.json` (NeRF), `*_par.txt` (Middlebury), `cameras.xml` (Metashape), `txt/*.txt` (PMVS) or plain 3×4 matrices, or such a
/// file, with a mask for each view: where the file names it, else `masks/NAME.png`, `masks/NAME.jpg.png`, or the photograph's alpha
/// channel. The hull that all masks leave is carved, coloured from the photographs, and built like a mesh. The asset's views are the
/// photographs' own silhouettes, and those of the carved hull where nobody took one. Lens distortion is taken out. `--check` says how well
/// the masks agree.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  silmap build bunny.ply --close-holes -o bunny.glb
  silmap build torus.obj -o torus.glb --max-error 0.5% --coverage any --json
  silmap build --from bunny.glb --keep 64 -o smaller.glb
  silmap build --manifest models.jsonl --out-dir assets --resume --timeout 600
  silmap build bunny.ply --params-from bunny.glb -o again.glb
  silmap build squirrel/ --check
  silmap build squirrel/ -o squirrel.glb")]
pub(crate) struct BuildArgs {
    /// The mesh, or the capture: a folder or a camera file
    #[arg(required_unless_present_any = ["from", "manifest"])]
    pub(crate) model: Option<PathBuf>,
    /// Take an asset instead of a mesh, and remove views until --keep or --max-error is met
    #[arg(long, value_name = "ASSET.glb", conflicts_with_all = FROM_CONFLICTS)]
    pub(crate) from: Option<PathBuf>,
    /// Build as an asset was built, by the options that it records, those that mend the mesh included: from the same mesh the same
    /// bytes
    #[arg(long, value_name = "ASSET.glb", conflicts_with_all = PARAMS_FROM_CONFLICTS)]
    pub(crate) params_from: Option<PathBuf>,
    /// The asset to write
    #[arg(
        short,
        long,
        value_name = "OUT.glb",
        required_unless_present_any = ["manifest", "check"]
    )]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) list: ManifestArgs,
    #[command(flatten)]
    pub(crate) capture: CaptureArgs,
    #[command(flatten)]
    pub(crate) map: KeptViewsArgs,
    /// Faces of the coarse hull; it is tightened as by `silmap hull --tighten fast`
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) faces: u32,
    #[command(flatten)]
    pub(crate) textures: TextureArgs,
    #[command(flatten)]
    pub(crate) parts: KeptPartsArgs,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    /// Measure maps of evenly spread views as well, and note their errors in the asset: the curve beside its own that `silmap report`
    /// measures otherwise
    #[arg(long)]
    pub(crate) uniform_curve: bool,
    #[command(flatten)]
    pub(crate) carving: CarveArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

impl BuildArgs {
    /// The asset to write.
    pub(crate) fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }
}

/// Puts the silhouettes back into a file that another program made of an asset.
///
/// Most programs that read and write glTF leave out what they do not know, and keep the hull and its textures alone. Where the hull
/// is the same, within 1/1024 of its extent, everything else that the asset has is put back: silhouettes, texture views and how it
/// was built. The file keeps its own materials, textures, nodes and animations. A hull that was changed is refused.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  silmap attach edited.glb --from bunny.glb -o whole.glb")]
pub(crate) struct AttachArgs {
    /// The file that another program wrote
    #[arg(value_name = "PLAIN.glb")]
    pub(crate) plain: PathBuf,
    /// The asset as it was
    #[arg(long, value_name = "ASSET.glb")]
    pub(crate) from: PathBuf,
    /// The asset to write [default: over PLAIN.glb]
    #[arg(short, long, value_name = "OUT.glb")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}
