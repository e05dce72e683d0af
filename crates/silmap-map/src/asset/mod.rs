//! The asset: everything a picture is made from, in memory and as a `.glb`.
//!
//! On disk it is a standard binary glTF 2.0 file: the coarse hull, unwelded at the atlas's seams, with the atlas as base
//! colour and, where they were baked, its normals. The rest is in the optional extension [`EXTENSION_NAME`] at the root of the document: [`silhouettes`], [`paint`]
//! and what [`hull_mesh`] needs to undo the unwelding. A reader that does not know the extension sees a plain low-polygon
//! model, at the model's place. Modules: [`container`] (chunks, checksum), [`document`] (JSON), [`packing`] (numbers as bytes), [`levels`]
//! (contours of less detail), [`contours`] (silhouettes of several parts, by [`contour_coder`]), [`map_bytes`] (either, by version), [`rounding`] (what numbers are rounded to), [`references`] (what the extension refers to, and its checksum), [`contents`] (bytes behind a document), [`attach`](mod@attach) (putting data back), [`order`] (how to go on losing views), [`relief`] (depths of texture views, by [`arithmetic`]), [`placement`] (where it stands), and [`write`](mod@write) and [`read`](mod@read), which put them together.
//!
//! Writing rounds contours to 1/16 pixel, depths to 1/4096 of the radius or a quarter of a pixel, and the error curve to single precision;
//! everything else comes back bit for bit, and writing what was read gives the same bytes.

mod arithmetic;
mod attach;
mod container;
mod contents;
mod contour_coder;
mod contours;
mod document;
mod hull_mesh;
mod levels;
mod map_bytes;
mod nodes;
mod order;
mod packing;
mod paint;
mod pictures;
mod placement;
mod polytope;
mod quantise;
mod read;
mod references;
mod relief;
mod rounding;
mod same_hull;
mod silhouettes;
mod tangents;
#[cfg(test)]
mod tests;
mod write;

use silmap_geometry::camera::in_short;
use silmap_geometry::{Camera, CameraError};
use thiserror::Error;

use crate::SilhouetteMap;

pub use attach::{AttachError, Attached, attach};
pub use container::{HEADER_BYTES, json_length};
pub use contents::Beside;
pub use document::{EXTENSION_NAME, FORMAT_VERSION};
pub use map_bytes::depth_steps_per_radius;
pub use order::{CapturedErrors, CollapseOrder, CollapseStep};
pub use placement::Placement;
pub use quantise::quantise;
pub use read::{model_name, read, read_map, read_with, sizes, sizes_with};
pub use rounding::POINT_STEPS_PER_PX;
pub use same_hull::{HullDifference, SAME_HULL_SHARE, Triangles};

pub use tangents::TangentFrames;
pub use write::write;

/// Most texture views an asset may have: one bit each in a face's visibility word.
pub const MAX_TEXTURE_VIEWS: usize = 64;

/// Bits that a depth of [`Relief`] may have.
pub const DEPTH_BITS: std::ops::RangeInclusive<u32> = relief::BITS;

/// An image file in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// `image/png`, `image/jpeg` or `image/webp`.
    pub mime_type: String,
    /// The file's bytes.
    pub bytes: Vec<u8>,
}

/// The coarse mesh that encloses the model, in the asset's single precision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoarseHull {
    /// Vertex positions, object space.
    pub positions: Vec<[f32; 3]>,
    /// Faces, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// P(v): per vertex, the point of the original surface it stands for (section 7).
    pub surface_points: Vec<[f32; 3]>,
    /// Volume of the hull over volume of the original, whose cavities count as filled where they were left out.
    pub volume_ratio: f64,
}

/// A shaded picture of the original that is projected onto the hull (section 8.2).
#[derive(Clone, Debug, PartialEq)]
pub struct TextureView {
    /// The camera it was taken with; its size is the image's.
    pub camera: Camera,
    /// The picture.
    pub image: EncodedImage,
}

/// One texture for the whole hull, for viewers without support for silhouettes.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// The picture, sRGB; PNG or JPEG.
    pub image: EncodedImage,
    /// The original's normals, in the frames of [`TangentFrames`], for viewers that light the model; PNG or JPEG, of the
    /// picture's size.
    pub normals: Option<EncodedImage>,
    /// Columns and rows of the picture.
    pub size_px: [u32; 2],
    /// Per face and corner: texture coordinates, u right and v down from the top-left.
    pub corner_uvs: Vec<[[f32; 2]; 3]>,
}

/// What the hull is painted with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureSet {
    /// The projected pictures, at most 64.
    pub views: Vec<TextureView>,
    /// Per face: bit i says that view i sees the whole face.
    pub visible_views: Vec<u64>,
    /// The atlas, for faces no view sees and for plain glTF viewers.
    pub atlas: Option<Atlas>,
    /// How deep the model lies in each picture.
    pub relief: Option<Relief>,
}

/// How deep the model lies in the pictures of the texture views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Relief {
    /// Bits of a code, 2 to 14.
    pub bits: u32,
    /// Columns of each depth picture, at most 4096. It has the field of view of the texture view's camera.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// As many as there are texture views.
    pub views: Vec<DepthPicture>,
}

/// How deep the model lies in a texture view: lengths along the camera's forward direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DepthPicture {
    /// The depth of code 1.
    pub near: f64,
    /// The depth of the largest code.
    pub far: f64,
    /// Per pixel, row by row: 0 where nothing is seen, else a step from `near` to `far`.
    pub codes: Vec<u16>,
}

impl Relief {
    /// Bytes that it takes in a file; zero where it cannot be stored.
    #[must_use]
    pub fn stored_bytes(&self) -> u64 {
        relief::encode(self, self.views.len()).map_or(0, |bytes| bytes.len() as u64)
    }

    /// The depth that a code of a view stands for; `None` where nothing is seen.
    #[must_use]
    pub fn depth(&self, view: usize, code: u16) -> Option<f64> {
        let steps = f64::from((1_u32 << self.bits) - 2);
        let DepthPicture { near, far, .. } = self.views[view];
        let step = code.checked_sub(1)?;
        Some(near + (far - near) * f64::from(step) / steps)
    }
}

/// How an asset was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BuildRecord {
    /// Name of the model (its file stem).
    pub name: String,
    /// Faces of the original.
    pub model_faces: u64,
    /// Vertices of the original.
    pub model_vertices: u64,
    /// CRC-32 of the original's geometry, so that `--model` can be checked against the asset.
    pub model_crc32: u32,
    /// Captured views before simplification.
    pub captured_views: u32,
    /// Views kept and mean misclassified share after each collapse that was recorded, most views first, down to the map as it
    /// is; the share is stored in single precision. [`CollapseOrder::curve`] goes on from there.
    pub error_curve: Vec<(u32, f64)>,
    /// Views and mean misclassified share of maps of evenly spread views, most views first, to compare the error curve with.
    pub uniform_curve: Vec<(u32, f64)>,
    /// How the map can lose further views; `None` in files of earlier versions.
    pub order: Option<CollapseOrder>,
    /// Version of silmap.
    pub generator: String,
    /// The options, as text.
    pub options: String,
    /// The options as data, in the form of the program that built it; null in files of earlier versions.
    pub params: serde_json::Value,
}

/// Everything a picture is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// How it was made.
    pub record: BuildRecord,
    /// The silhouettes.
    pub map: SilhouetteMap,
    /// The coarse hull.
    pub hull: CoarseHull,
    /// Its paint.
    pub textures: TextureSet,
    /// Where it stands.
    pub placement: Placement,
}

/// Bytes of a `.glb` by what they hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssetSizes {
    /// Views, contours, depths and the polytope.
    pub map: u64,
    /// The coarse hull: glTF geometry, P(v) and how the two correspond.
    pub hull: u64,
    /// Texture views with their cameras and visibility bits, and the atlas picture.
    pub textures: u64,
    /// The whole file, with its JSON.
    pub total: u64,
    /// Version of the format that the file has.
    pub format_version: u32,
}

/// Why bytes are not an asset, or an asset cannot be written.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AssetError {
    /// The bytes are not a binary glTF file.
    #[error("it is not a whole binary glTF file: {reason}")]
    NotGlb {
        /// What is wrong with the container.
        reason: &'static str,
    },
    /// The glTF document is not what this program writes.
    #[error("its glTF document cannot be read: {reason}")]
    Document {
        /// What is wrong, with the place in the JSON text.
        reason: String,
    },
    /// A proper glTF file, but without silhouettes.
    #[error("{}", no_map(*.was_asset, .by.as_deref()))]
    NoSilhouetteMap {
        /// Whether something in it shows that it was an asset.
        was_asset: bool,
        /// The program that wrote the file.
        by: Option<String>,
    },
    /// The silhouette map's JSON is there, but not the data that it refers to.
    #[error(
        "its silhouette map has lost its data: {} kept the JSON alone, or the file is damaged; `silmap attach` puts the data back from \
         the asset as it was",
        program(.by.as_deref())
    )]
    LostData {
        /// The program that wrote the file.
        by: Option<String>,
    },
    /// Written by a later version of this program.
    #[error(
        "its silhouette map has format version {found}, this program reads version {known}: update it or build again"
    )]
    UnknownVersion {
        /// Version in the file.
        found: u32,
        /// Version of this program.
        known: u32,
    },
    /// The checksum does not fit the bytes.
    #[error("it is damaged{}: its checksum says {stored}, its bytes say {computed}", or_changed(.by.as_deref()))]
    Damaged {
        /// Checksum in the file.
        stored: String,
        /// Checksum of the bytes.
        computed: String,
        /// The program that wrote the file.
        by: Option<String>,
    },
    /// A part ends before its contents do.
    #[error("it is damaged: the {part} end too early")]
    Truncated {
        /// Which part.
        part: &'static str,
    },
    /// A part goes on after its contents.
    #[error("it is damaged: {bytes} bytes too many after the {part}")]
    Trailing {
        /// Which part.
        part: &'static str,
        /// Bytes left over.
        bytes: usize,
    },
    /// Two counts that must agree do not.
    #[error("{found} {what} where there must be {expected}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
    /// Something refers to an element that does not exist.
    #[error("{what} {index} does not exist: there are {count}")]
    NoSuch {
        /// Kind of element.
        what: &'static str,
        /// Its index.
        index: u64,
        /// How many there are.
        count: usize,
    },
    /// A number is not finite or larger than the format holds.
    #[error(
        "{what} {} cannot be stored: it must be finite and at most {} in size",
        in_short(*.value), in_short(*.limit)
    )]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The largest that can be stored.
        limit: f64,
    },
    /// A captured view's camera is not the one that its eye determines.
    #[error(
        "view {view} was not captured with the camera that fits the bounding sphere from its eye"
    )]
    ForeignCamera {
        /// Index of the view.
        view: usize,
    },
    /// A texture view's camera has no orthonormal frame, does not look at its picture's middle, or has impossible numbers.
    #[error(
        "the camera of texture view {view} is not a pinhole camera with an orthonormal frame that looks at its picture's middle"
    )]
    TextureCamera {
        /// Index of the texture view.
        view: usize,
    },
    /// The glTF mesh and the extension describe different hulls.
    #[error("the hull contradicts itself at vertex {vertex}")]
    HullContradiction {
        /// Index of the hull vertex.
        vertex: usize,
    },
    /// A camera cannot be rebuilt.
    #[error("the camera of view {view} is impossible: {source}")]
    Camera {
        /// Index of the view.
        view: usize,
        /// Why.
        source: CameraError,
    },
    /// A contour is no loop at its coarsest level of detail.
    #[error(
        "it is damaged: contour {contour} of view {view} has {vertices} vertices at its coarsest level of detail, fewer than 3"
    )]
    CoarseContour {
        /// Index of the view.
        view: usize,
        /// Index of the contour in the view.
        contour: usize,
        /// Vertices left.
        vertices: usize,
    },
    /// The levels of detail were written by a later version of this program.
    #[error(
        "its levels of detail have coding {found}, this program reads coding {known}: update it or build again"
    )]
    LevelCoding {
        /// Coding in the file.
        found: u8,
        /// Coding of this program.
        known: u8,
    },
    /// A view's contours are not in the order of their parts, or there are too many parts.
    #[error("it is damaged: the contours of view {view} are of no parts that there can be")]
    PartOrder {
        /// Index of the view.
        view: usize,
    },
    /// A step of the collapse order cannot be carried out.
    #[error("it is damaged: step {step} of its collapse order {reason}")]
    CollapseOrder {
        /// Index of the step.
        step: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A picture is of no type that may be there, or not what its type says.
    #[error(
        "the picture {what} is not the PNG, JPEG or (for texture views) WebP that its type {mime_type:?} says"
    )]
    NotAPicture {
        /// Which picture.
        what: &'static str,
        /// The type it claims.
        mime_type: String,
    },
    /// The file would pass the 4 GiB that a binary glTF may have.
    #[error("the asset would take {bytes} bytes: a binary glTF file ends at 4 GiB")]
    TooLarge {
        /// Bytes needed.
        bytes: usize,
    },
}

/// How the name of the program that writes assets begins.
const OURS: &str = "silmap";

/// The program that wrote a file, for the beginning of a sentence about what it left out.
fn program(by: Option<&str>) -> &str {
    by.filter(|by| !by.starts_with(OURS))
        .unwrap_or("a program that rewrote the file")
}

/// What else may have happened to a damaged file that another program wrote.
fn or_changed(by: Option<&str>) -> String {
    match by.filter(|by| !by.starts_with(OURS)) {
        Some(by) => format!(", or {by}, which rewrote it, changed what belongs to the silhouettes"),
        None => String::new(),
    }
}

/// What to say of a file without silhouettes.
fn no_map(was_asset: bool, by: Option<&str>) -> String {
    const BACK: &str = "`silmap attach` puts it back from the asset as it was, and tools/web has the class by which glTF-Transform keeps it";
    if was_asset {
        return format!(
            "it has no silhouette map any more: {} left it out; {BACK}",
            program(by)
        );
    }
    format!(
        "it has no silhouette map (not a silmap asset): make one with `silmap build`, or if it was one that another program rewrote, {BACK}"
    )
}
