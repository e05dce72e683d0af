//! Hulls, whole or clipped: a renderer of `silmap-runtime` for each kind of pass that they are drawn in.
//!
//! Outlines are those of the frame's own eye, given loop by loop, so that a picture shows no outline that was kept from elsewhere.

use silmap_gpu::{Gpu, wgpu};
use silmap_map::Asset;
use silmap_runtime::{
    self as runtime, ClipBy, DepthDirection, DepthTarget, Instance, LoadedAsset, Outline, Renderer,
    RendererOptions, SpaceLoops, TargetFormats, Transform, View,
};

use crate::depth_range::depth_range;
use crate::frame::all_finite;
use crate::targets::{DEPTH_STENCIL, SAMPLES};
use crate::{Antialias, ClipShape, FrameParams, Mode, Paint, RenderError};

/// Room for the outline of a picture, exact ones of large meshes too.
const OUTLINE_BYTES: u64 = 16 << 20;

/// What draws hulls, and the one that is loaded.
#[derive(Debug, Default)]
pub(crate) struct Hulls {
    asset: Option<LoadedAsset>,
    /// Made when first needed, by the format they draw to and how they smooth.
    renderers: Vec<(wgpu::TextureFormat, Antialias, Renderer)>,
    region: SpaceLoops,
    /// Whether assets are loaded with normals.
    relight: bool,
}

/// A renderer for pictures of a format, over depth and stencil as [`Targets`](crate::targets::Targets) have them.
fn renderer_for(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    antialias: Antialias,
    relight: bool,
) -> Renderer {
    let samples = match antialias {
        Antialias::Msaa => SAMPLES,
        Antialias::None | Antialias::Soft => 1,
    };
    let mut options = RendererOptions::new(TargetFormats {
        colour: Some(format),
        depth: Some(DepthTarget {
            format: DEPTH_STENCIL,
            direction: DepthDirection::Forward,
        }),
        samples,
    });
    // Each picture brings one outline with it.
    options.outline_bytes = OUTLINE_BYTES;
    options.polytope_bytes = 0;
    options.relight = relight;
    if antialias == Antialias::Soft {
        options.clip = ClipBy::Coverage;
        options.antialias = runtime::Antialias::Soft;
    }
    Renderer::new(&gpu.device, options).expect("invariant: the options go together")
}

impl Hulls {
    /// None loaded yet; those that are can be lit anew or not.
    pub(crate) fn new(relight: bool) -> Self {
        Self {
            relight,
            ..Self::default()
        }
    }

    /// Whether another light can shine on what is loaded; on nothing it can.
    pub(crate) fn can_relight(&self) -> bool {
        self.asset.as_ref().is_none_or(LoadedAsset::can_relight)
    }

    /// Takes an asset in place of the one loaded before.
    pub(crate) fn load(
        &mut self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        asset: &Asset,
    ) -> Result<(), RenderError> {
        let at = self.index_of(gpu, format, Antialias::default());
        let loaded = self.renderers[at].2.load(&gpu.device, &gpu.queue, asset)?;
        gpu.check()?;
        self.asset = Some(loaded);
        Ok(())
    }

    /// What is loaded.
    pub(crate) fn asset(&self) -> Option<&LoadedAsset> {
        self.asset.as_ref()
    }

    /// The renderer that draws to a format, smoothed in a way.
    fn index_of(&mut self, gpu: &Gpu, format: wgpu::TextureFormat, antialias: Antialias) -> usize {
        let is_it =
            |(of, by, _): &(wgpu::TextureFormat, Antialias, _)| (*of, *by) == (format, antialias);
        self.renderers.iter().position(is_it).unwrap_or_else(|| {
            let renderer = renderer_for(gpu, format, antialias, self.relight);
            self.renderers.push((format, antialias, renderer));
            self.renderers.len() - 1
        })
    }

    /// Makes a frame ready: the hull as its mode shows it, clipped by a shape where the mode is clipped. The renderer that is returned
    /// draws it.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        (params, shape): (&FrameParams, &ClipShape<'_>),
    ) -> Result<&Renderer, RenderError> {
        let mode = params.mode;
        let is_clipped = mode.needs_outline();
        let antialias = match params.antialias {
            // No outline to smooth: samples smooth the hull's own.
            Antialias::Soft if !is_clipped => Antialias::Msaa,
            chosen => chosen,
        };
        let at = self.index_of(gpu, format, antialias);
        let asset = self.asset.as_ref().ok_or(RenderError::NoAsset { mode })?;
        let sphere = asset.bounds();
        let (near, far) = depth_range(&params.camera, sphere.center, sphere.radius);
        let view = View {
            clip_from_world: params.camera.clip_from_object(near, far),
            size_px: (params.camera.width_px, params.camera.height_px),
        };
        if is_clipped {
            let depth = params.camera.depth(asset.model_bounds().center).max(near);
            set_region(&mut self.region, params, shape, depth)?;
        }
        if params.light.is_some() && mode != Mode::Coarse && !asset.can_relight() {
            return Err(RenderError::NotRelit);
        }
        let instance = Instance {
            light: params.light,
            paint: match mode {
                Mode::Coarse => Paint::Lit,
                _ => params.paint,
            },
            outline: if is_clipped {
                Outline::Given(&self.region)
            } else {
                Outline::Whole
            },
            ..Instance::new(asset, Transform::IDENTITY)
        };
        let renderer = &mut self.renderers[at].2;
        let stats = renderer.prepare(&gpu.device, &gpu.queue, &view, &[instance])?;
        if is_clipped && stats.whole > 0 {
            return Err(RenderError::OutlineTooDetailed {
                points: self.region.loops.iter().map(Vec::len).sum(),
            });
        }
        Ok(renderer)
    }
}

/// Takes the loops that clip a frame into space, at a depth in front of its camera.
fn set_region(
    region: &mut SpaceLoops,
    params: &FrameParams,
    shape: &ClipShape<'_>,
    depth: f64,
) -> Result<(), RenderError> {
    if !all_finite(shape.loops.iter().chain(shape.outline)) {
        return Err(RenderError::LoopNotFinite);
    }
    // Within overlapping loops there are edges that no ramp belongs to.
    let is_soft = params.antialias == Antialias::Soft && !shape.outline.is_empty();
    let loops = if is_soft { shape.outline } else { shape.loops };
    let in_space = |p: &_| params.camera.object_from_image(*p, depth);
    let loops = loops
        .iter()
        .map(|points| points.iter().map(in_space).collect());
    region.loops.clear();
    region.loops.extend(loops);
    Ok(())
}
