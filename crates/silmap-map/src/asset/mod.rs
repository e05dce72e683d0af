//! The asset: everything a picture is made from, in memory and as a `.glb`.

use silmap_geometry::Camera;
use thiserror::Error;

use crate::SilhouetteMap;

/// An image file in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// `image/png` or `image/jpeg`.
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
    /// Volume of the hull over volume of the original.
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

/// One texture for the whole hull, for viewers that know nothing of silhouettes.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// The picture, sRGB.
    pub image: EncodedImage,
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
    /// Views kept and mean misclassified share after each collapse that was recorded, most views first.
    pub error_curve: Vec<(u32, f64)>,
    /// Version of silmap.
    pub generator: String,
    /// The options, as text.
    pub options: String,
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
}

/// Why bytes are not an asset.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AssetError {
    /// The bytes are not a binary glTF file.
    #[error("it is not a binary glTF file: {reason}")]
    NotGlb {
        /// What is wrong with the container.
        reason: String,
    },
}
