//! Parameters of texture baking.

use serde::{Deserialize, Serialize};
use silmap_map::asset::{DEPTH_BITS, MAX_TEXTURE_VIEWS};

use super::TextureError;

/// How a point of the hull finds the point of the original that it shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parametrisation {
    /// Along the hull's interpolated normal: few jumps.
    #[default]
    NormalShooting,
    /// The nearest point: jumps where the original is hollow.
    ClosestPoint,
}

impl Parametrisation {
    /// Both.
    pub const ALL: [Self; 2] = [Self::NormalShooting, Self::ClosestPoint];

    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NormalShooting => "normal-shooting",
            Self::ClosestPoint => "closest-point",
        }
    }
}

/// How large the tiles of the atlas are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TileSizes {
    /// All the same.
    Fixed,
    /// Larger for larger faces, by powers of two.
    #[default]
    Adaptive,
}

impl TileSizes {
    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Adaptive => "adaptive",
        }
    }
}

/// What pictures are stored as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PictureFormat {
    /// JPEG, or PNG where that is no larger.
    #[default]
    Jpeg,
    /// PNG: nothing is lost.
    Png,
    /// WebP for the texture views; the atlas, which plain glTF viewers show, as by [`Self::Jpeg`].
    Webp,
}

impl PictureFormat {
    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Jpeg => "jpeg",
            Self::Png => "png",
            Self::Webp => "webp",
        }
    }
}

/// How the hull is painted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TextureParams {
    /// Most texture views to choose; at most [`MAX_TEXTURE_VIEWS`]. The paper takes 20.
    pub views: u32,
    /// Side of the texture views' square pictures, pixels.
    pub size_px: u32,
    /// Whether their sides are half as long again, or twice as long, where the model has detail that would be lost otherwise.
    // Recipes of earlier versions have neither this nor relief; those without relief are as they were.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub detailed: bool,
    /// Side of the atlas, pixels; it becomes less by rounding, and more when the hull has too many faces for it. 512 gives 500
    /// faces the 512 texels each that the paper gives them, and more faces fewer, as there.
    pub atlas_px: u32,
    /// How large its tiles are.
    pub tiles: TileSizes,
    /// Where its colours and normals come from.
    pub parametrisation: Parametrisation,
    /// Whether it has normals beside colours.
    pub normals: bool,
    /// Viewpoints to choose from, spread evenly over the view sphere.
    pub candidates: u32,
    /// Distance of the viewpoints from the center, bounding radii.
    pub distance_rel: f64,
    /// What pictures are stored as.
    pub format: PictureFormat,
    /// Quality of pictures that lose something, 1 to 100; the most, where there is a budget.
    pub quality: u8,
    /// Side of the depth pictures that texture views carry, pixels; 0 for none. There are none where a texture view is a photograph.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub relief_px: u32,
    /// Bits of a depth: it is off by at most half a step of 2⁻ᵇⁱᵗˢ of what a view sees from its nearest to its farthest point.
    #[serde(default = "relief_bits", skip_serializing_if = "is_default")]
    pub relief_bits: u32,
    /// Most bytes of all pictures together, depths included: quality falls first, then their sides.
    pub budget_bytes: Option<u64>,
}

fn is_zero(side: &u32) -> bool {
    *side == 0
}

/// A step of a 500th of what a view sees: the mean error of depth is a tenth of it.
fn relief_bits() -> u32 {
    9
}

fn is_default(bits: &u32) -> bool {
    *bits == relief_bits()
}

impl Default for TextureParams {
    fn default() -> Self {
        Self {
            views: 20,
            size_px: 512,
            detailed: true,
            atlas_px: 512,
            tiles: TileSizes::default(),
            parametrisation: Parametrisation::default(),
            normals: true,
            candidates: 200,
            distance_rel: 3.0,
            format: PictureFormat::default(),
            quality: 94,
            relief_px: 512,
            relief_bits: relief_bits(),
            budget_bytes: None,
        }
    }
}

/// Sides of pictures that are worth making and can be held while they are drawn in several samples a pixel, pixels.
const SIZES_PX: std::ops::RangeInclusive<u32> = 16..=MAX_SIDE_PX;

/// Most of them.
pub(super) const MAX_SIDE_PX: u32 = 2048;

/// Most viewpoints to choose from.
const MAX_CANDIDATES: u32 = 10_000;

impl TextureParams {
    /// Checks that the numbers can be worked with.
    ///
    /// # Errors
    /// The first number that is out of range.
    pub fn validate(&self) -> Result<(), TextureError> {
        let checks = [
            ("texture views", self.views, 0..=MAX_TEXTURE_VIEWS as u32),
            ("pixels of a texture view", self.size_px, SIZES_PX),
            ("pixels of the atlas", self.atlas_px, SIZES_PX),
            ("candidate viewpoints", self.candidates, 1..=MAX_CANDIDATES),
            ("as a picture's quality", self.quality.into(), 1..=100),
            ("bits of a depth", self.relief_bits, DEPTH_BITS),
        ];
        let sides =
            (self.relief_px > 0).then_some(("pixels of a depth picture", self.relief_px, SIZES_PX));
        for (what, value, range) in checks.into_iter().chain(sides) {
            if !range.contains(&value) {
                let (low, high) = range.into_inner();
                return Err(TextureError::Parameter {
                    what,
                    value,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }
}
