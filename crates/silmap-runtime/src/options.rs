//! What a renderer is made for: the formats of the pass it draws in, and how it clips. And why it cannot.

use silmap_gpu::wgpu;
use silmap_map::Method;
use silmap_map::polytope::PolytopeError;
use thiserror::Error;

/// Which way depth grows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthDirection {
    /// 0 is near: less is nearer.
    #[default]
    Forward,
    /// 1 is near: greater is nearer. The far plane may be infinitely far.
    Reversed,
}

/// The depth buffer of the pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTarget {
    /// Its format; with a stencil where [`ClipBy::Stencil`] is to be used.
    pub format: wgpu::TextureFormat,
    /// Which way depth grows in it.
    pub direction: DepthDirection,
}

/// What the pass draws to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TargetFormats {
    /// Format of the colour target; `None` for a pass that draws depth alone, such as a shadow map. Linear colour is written: an sRGB
    /// format encodes it. Alpha is premultiplied.
    pub colour: Option<wgpu::TextureFormat>,
    /// The depth buffer. Without one, instances are drawn back to front and parts of one hull may cover each other wrongly.
    pub depth: Option<DepthTarget>,
    /// Samples a pixel.
    pub samples: u32,
}

/// What clips the hulls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClipBy {
    /// The outlines in the stencil buffer, which must be zero where instances are and is left so.
    Stencil,
    /// A function of the outline in the fragment shader. It needs no stencil.
    Coverage,
}

/// How outlines are smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Antialias {
    /// By the samples of the target: not at all where it has one.
    Samples,
    /// By distance, a ramp one pixel wide which is blended with what is there. With [`ClipBy::Coverage`] in a target of one sample.
    Soft,
}

/// How carefully [`Paint::Relief`](crate::Paint::Relief) follows the eye's rays to the model's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ReliefQuality {
    /// Not at all: as [`Paint::Blended`](crate::Paint::Blended), and hulls have the hull's depth.
    Off,
    /// By two views in few steps, for weak devices.
    Low,
    /// By three views.
    #[default]
    High,
}

impl ReliefQuality {
    /// The constants of `shaders/relief.wgsl`.
    pub(crate) fn constants(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Off => &[],
            Self::Low => &[("RELIEF_VIEWS", 2.0), ("RELIEF_STEPS", 16.0)],
            Self::High => &[("RELIEF_VIEWS", 3.0), ("RELIEF_STEPS", 48.0)],
        }
    }
}

/// Set once for a renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct RendererOptions {
    /// The pass.
    pub formats: TargetFormats,
    /// What clips.
    pub clip: ClipBy,
    /// How outlines are smoothed.
    pub antialias: Antialias,
    /// How carefully the model's surface is found within the hull; needs colour and depth.
    pub relief: ReliefQuality,
    /// Whether assets are loaded with the model's normals, so that [lights](crate::Instance::light) of their instances can be moved. That
    /// takes a core a second or two for twenty depth pictures of 512 pixels a side, and four bytes a depth.
    pub relight: bool,
    /// How outlines are interpolated; by default the best that an asset allows.
    pub method: Option<Method>,
    /// How far an outline may be off, in pixels, where one is used that was interpolated for an eye nearby. At zero each frame
    /// interpolates each outline anew.
    pub reuse_error_px: f64,
    /// How many outlines a frame interpolates where those it has are off by less than twice [`RendererOptions::reuse_error_px`].
    pub outlines_per_frame: usize,
    /// Memory on the device for outlines, in bytes.
    pub outline_bytes: u64,
    /// Memory of the program for outlines seen from the polytope of views, in bytes: those of eyes off it are put together from them. At
    /// zero each is interpolated as often as it is needed; pictures are the same.
    pub polytope_bytes: u64,
}

impl RendererOptions {
    /// Options for a pass: the stencil where it has one, else the coverage function, smoothed by samples or softly.
    #[must_use]
    pub fn new(formats: TargetFormats) -> Self {
        let has_stencil = formats.depth.is_some_and(|d| d.format.has_stencil_aspect());
        let clip = if has_stencil {
            ClipBy::Stencil
        } else {
            ClipBy::Coverage
        };
        let is_soft = !has_stencil && formats.samples == 1 && formats.colour.is_some();
        Self {
            formats,
            clip,
            antialias: if is_soft {
                Antialias::Soft
            } else {
                Antialias::Samples
            },
            relief: ReliefQuality::default(),
            relight: false,
            method: None,
            reuse_error_px: 0.25,
            outlines_per_frame: 32,
            outline_bytes: 32 << 20,
            polytope_bytes: 32 << 20,
        }
    }
}

/// Why there is no renderer.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum OptionsError {
    /// The stencil is to clip and there is none.
    #[error("outlines are to clip in the stencil, and the target has none: clip by coverage")]
    NoStencil,
    /// The depth format has no depth.
    #[error("{format:?} is no depth format")]
    NoDepth {
        /// The format.
        format: wgpu::TextureFormat,
    },
    /// Soft edges need one sample, a colour target and the coverage function.
    #[error("soft outlines need a colour target of one sample, and clipping by coverage")]
    NotSoft,
    /// The device's textures are too small for outlines.
    #[error(
        "the device allows textures of {limit} texels a side, and outlines need {needed}: ask for more when it is opened"
    )]
    TexturesTooSmall {
        /// The device's limit.
        limit: u32,
        /// What is needed.
        needed: u32,
    },
    /// There is neither colour nor depth.
    #[error("the pass draws to neither colour nor depth")]
    NoTarget,
}

impl RendererOptions {
    /// Whether hulls can show relief.
    pub(crate) fn has_relief(&self) -> bool {
        let formats = &self.formats;
        formats.colour.is_some() && formats.depth.is_some() && self.relief != ReliefQuality::Off
    }

    pub(crate) fn check(&self) -> Result<(), OptionsError> {
        let formats = &self.formats;
        if let Some(DepthTarget { format, .. }) = formats.depth
            && !format.has_depth_aspect()
        {
            return Err(OptionsError::NoDepth { format });
        }
        if formats.colour.is_none() && formats.depth.is_none() {
            return Err(OptionsError::NoTarget);
        }
        let has_stencil = formats.depth.is_some_and(|d| d.format.has_stencil_aspect());
        if self.clip == ClipBy::Stencil && !has_stencil {
            return Err(OptionsError::NoStencil);
        }
        let can_be_soft =
            formats.samples == 1 && formats.colour.is_some() && self.clip == ClipBy::Coverage;
        if self.antialias == Antialias::Soft && !can_be_soft {
            return Err(OptionsError::NotSoft);
        }
        Ok(())
    }
}

/// Why an asset is not loaded.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The silhouette map is broken.
    #[error(transparent)]
    Map(#[from] PolytopeError),
    /// Parts of the hull do not belong together.
    #[error("the asset's hull is broken: {what}")]
    BadHull {
        /// What does not fit.
        what: &'static str,
    },
    /// A texture's bytes are no picture.
    #[error("texture {index} of the asset cannot be decoded: {reason}")]
    BadTexture {
        /// Which texture view; their count stands for the atlas.
        index: usize,
        /// What the decoder said.
        reason: String,
    },
    /// The texture views differ in size.
    #[error(
        "texture view {index} of the asset has {width} × {height} pixels, the first one {first_width} × {first_height}"
    )]
    TextureSizesDiffer {
        /// The odd one.
        index: usize,
        /// Its columns.
        width: u32,
        /// Its rows.
        height: u32,
        /// Columns of the first.
        first_width: u32,
        /// Rows of the first.
        first_height: u32,
    },
    /// A texture is larger than the device can hold.
    #[error(
        "a texture of {width} × {height} pixels is over this graphics adapter's limit of {limit} a side"
    )]
    TextureTooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The device's limit.
        limit: u32,
    },
    /// There are more texture views than can be used.
    #[error("the asset has {count} texture views; at most {limit} can be used")]
    TooManyTextures {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
}

/// Why a frame draws nothing.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum PrepareError {
    /// The camera's matrix holds NaN or infinity.
    #[error("a number of the camera's matrix is not finite")]
    ViewNotFinite,
    /// The camera's matrix is no projection.
    #[error("the camera's matrix maps the world to a plane: it is no projection")]
    ViewDegenerate,
    /// The direction to an instance's light is none.
    #[error("the direction to a light has no length, or one that is not finite")]
    NoLight,
}
