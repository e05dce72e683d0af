//! Parameters and errors of a frame.

use glam::{DVec2, DVec3};
use silmap_geometry::lighting::linear_from_srgb;
use silmap_geometry::{Camera, CameraError, Loop};
use silmap_gpu::{GpuError, wgpu};
use silmap_map::{InterpolateError, Method};
use silmap_runtime::{LightError, LoadError, Paint, PrepareError};
use thiserror::Error;

/// What is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The full mesh.
    Original,
    /// The hull without paint or clipping: its facets.
    Coarse,
    /// The painted hull without clipping.
    Textured,
    /// The painted hull clipped by the outline: the method itself.
    #[default]
    Clipped,
    /// The painted hull clipped by a region that is given with the frame, such as the exact silhouette's: see
    /// [`PictureRenderer::render_shape`](crate::PictureRenderer::render_shape).
    Exact,
    /// The outline alone.
    Silhouette,
    /// The full mesh, dim, with the pixels that the outline gets wrong: red where too much, blue where too little.
    Difference,
    /// The visible silhouette edges of the full mesh, found by the device pixel by pixel.
    Edges(EdgeStyle),
}

/// How edges are found at image precision: what is drawn of the faces behind the nearest ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeStyle {
    /// Where they are as deep as the nearest.
    Equal,
    /// Their edges, as lines.
    Wireframe,
    /// The faces, pulled towards the eye.
    Translate,
    /// The faces, each fattened by one width in the image.
    Fatten,
    /// As `Fatten`, grazing front faces too, all in greys.
    Charcoal,
}

/// Lines at image precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeParams {
    /// Width in pixels, outside of the nearest faces. [`EdgeStyle::Equal`] has none; in [`EdgeStyle::Translate`] a line lies
    /// inside, and is this wide on rims as round as a sixteenth of the mesh.
    pub width_px: f32,
    /// Whether the nearest faces are found by an item buffer, for faces without a consistent orientation; otherwise they
    /// are those that show their front.
    pub by_item_buffer: bool,
}

impl Default for EdgeParams {
    fn default() -> Self {
        Self {
            width_px: 2.0,
            by_item_buffer: false,
        }
    }
}

impl Mode {
    /// Whether the mode shows the full mesh.
    #[must_use]
    pub fn needs_model(self) -> bool {
        matches!(self, Self::Original | Self::Difference | Self::Edges(_))
    }

    /// Whether the mode shows the hull.
    #[must_use]
    pub fn shows_hull(self) -> bool {
        matches!(
            self,
            Self::Coarse | Self::Textured | Self::Clipped | Self::Exact
        )
    }

    /// Whether the mode can show the object's shadow: the outline that a light sees is known.
    #[must_use]
    pub fn casts_shadow(self) -> bool {
        matches!(self, Self::Coarse | Self::Textured | Self::Clipped)
    }

    /// Whether the mode is clipped by an outline or shows it.
    #[must_use]
    pub fn needs_outline(self) -> bool {
        matches!(
            self,
            Self::Clipped | Self::Exact | Self::Silhouette | Self::Difference
        )
    }
}

/// How edges are smoothed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Antialias {
    /// Not at all.
    None,
    /// The outline by its distance, a ramp one pixel wide; what is not clipped by an outline, by four samples.
    #[default]
    Soft,
    /// Four samples a pixel.
    Msaa,
}

/// What is behind the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// Nothing: the picture's alpha is the coverage.
    #[default]
    Transparent,
    /// One colour, sRGB-encoded.
    Colour([u8; 3]),
}

impl Background {
    /// The colour that stands for it, linear and premultiplied.
    #[must_use]
    pub fn clear_colour(self) -> wgpu::Color {
        match self {
            Self::Transparent => wgpu::Color::TRANSPARENT,
            Self::Colour(encoded) => {
                let [r, g, b] = encoded.map(|c| f64::from(linear_from_srgb(f32::from(c) / 255.0)));
                wgpu::Color { r, g, b, a: 1.0 }
            }
        }
    }
}

/// A region of the image, as loops of whatever origin.
#[derive(Clone, Copy, Debug)]
pub struct ClipShape<'a> {
    /// Loops in pixels of the frame's camera. They hold the points about which they wind a number of times other than zero; up to 127
    /// windings are counted.
    pub loops: &'a [Loop],
    /// The region's outline without overlaps, for smoothing; may be empty unless [`Antialias::Soft`] or
    /// [`Mode::Silhouette`] is asked for.
    pub outline: &'a [Loop],
}

impl ClipShape<'_> {
    /// The region without a point.
    pub const EMPTY: Self = Self {
        loops: &[],
        outline: &[],
    };
}

/// Set once for a renderer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureOptions {
    /// Format of what is drawn to; it must encode sRGB by itself and be blendable.
    pub target_format: wgpu::TextureFormat,
    /// Whether assets are loaded with normals, so that lights can be moved.
    pub relight: bool,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            target_format: wgpu::TextureFormat::Rgba8UnormSrgb,
            relight: false,
        }
    }
}

/// A shadow on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowParams {
    /// The direction to the light, of any length.
    pub to_light: DVec3,
    /// The direction away from the ground, of any length. The ground touches the object's lowest point.
    pub up: DVec3,
}

/// One frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameParams {
    /// The eye and the image.
    pub camera: Camera,
    /// What is drawn.
    pub mode: Mode,
    /// How the outline is interpolated.
    pub method: Method,
    /// What the hull shows.
    pub paint: Paint,
    /// How edges are smoothed.
    pub antialias: Antialias,
    /// What is behind it.
    pub background: Background,
    /// Lines in [`Mode::Edges`].
    pub edges: EdgeParams,
    /// The direction to a light that shines instead of the studio light, of any length, in modes that show the full mesh or the hull. Hulls
    /// are lit by it where [`PictureOptions::relight`] is set.
    pub light: Option<DVec3>,
    /// The shadow on the ground, in modes that [cast one](Mode::casts_shadow).
    pub shadow: Option<ShadowParams>,
}

/// Why there is no picture.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The camera cannot see the whole model.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The outline cannot be interpolated.
    #[error(transparent)]
    Interpolate(#[from] InterpolateError),
    /// The asset cannot be drawn.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The camera's matrix cannot be used.
    #[error(transparent)]
    View(#[from] PrepareError),
    /// The outline has more edges than can be told apart.
    #[error(
        "the outline has {points} points, more than soft edges can be made of: smooth it by samples, or not at all"
    )]
    OutlineTooDetailed {
        /// Its points.
        points: usize,
    },
    /// The image is larger than the adapter can draw.
    #[error(
        "an image of {width} × {height} pixels is over this graphics adapter's limit of {limit} a side"
    )]
    ImageTooLarge {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
        /// The adapter's limit.
        limit: u32,
    },
    /// A mode that shows the hull or its outline has no asset.
    #[error("no asset is loaded, and mode {mode:?} needs one")]
    NoAsset {
        /// The mode asked for.
        mode: Mode,
    },
    /// A mode that shows the full mesh has none.
    #[error("no model is loaded, and mode {mode:?} needs the full mesh")]
    NoModel {
        /// The mode asked for.
        mode: Mode,
    },
    /// The mode is clipped by a region that was not given.
    #[error("mode {mode:?} is clipped by loops that have to be given with the frame")]
    NoLoops {
        /// The mode asked for.
        mode: Mode,
    },
    /// The mode has no shadow.
    #[error("mode {mode:?} casts no shadow")]
    NoShadow {
        /// The mode asked for.
        mode: Mode,
    },
    /// The asset tells no normals, by which a light would fall.
    #[error(
        "the asset cannot be lit anew: it has neither depths of its texture views nor normals in its atlas, or its pictures are photographs"
    )]
    NotRelit,
    /// The light of the shadow has no view.
    #[error(transparent)]
    Light(#[from] LightError),
    /// The light does not fall on the ground from above.
    #[error("the light is not above the ground, by one degree at least: there is no shadow")]
    LightBelowGround,
    /// There is no outline from the light.
    #[error("the outline that the light sees cannot be interpolated")]
    NoOutlineOfShadow,
    /// The nearest faces have not been found for this camera.
    #[error(
        "the nearest faces have not been found for this camera: frames by item buffer can only be rendered, not recorded"
    )]
    NoNearestFaces,
    /// A loop has a point that is not a number.
    #[error("a loop of the outline has a point that is not finite")]
    LoopNotFinite,
    /// A texture is larger than the adapter can hold.
    #[error(
        "a texture of {width} × {height} pixels is over this graphics adapter's limit of {limit} a side"
    )]
    TextureTooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The adapter's limit.
        limit: u32,
    },
    /// A material's texture, or a material itself, is missing from the model.
    #[error("the model's appearance is broken: {what}")]
    BadModel {
        /// What does not fit.
        what: &'static str,
    },
}

/// Whether all points of the loops are finite.
pub(crate) fn all_finite<'a>(mut loops: impl Iterator<Item = &'a Loop>) -> bool {
    loops.all(|points| points.iter().copied().all(DVec2::is_finite))
}
