//! The renderer of single pictures: an asset, a full mesh or both, a camera and an outline.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.

use glam::DVec3;
use silmap_geometry::{Camera, CameraError, ColourImage, TriangleMesh};
use silmap_gpu::{Gpu, PendingRead, Readback, wgpu};
use silmap_map::{Asset, MapReader, Outline, SilhouetteMap};
use silmap_runtime::LoadError;

use crate::clip::ClipBuffers;
use crate::depth_range::depth_range;
use crate::hulls::Hulls;
use crate::image_precision::{EdgeLinesUniform, Soup};
use crate::layouts::{Layouts, TintUniform, ViewUniform, bind, uniform_buffer};
use crate::model::ModelBuffers;
use crate::passes::{Canvas, FrameRecorder};
use crate::picture::unpremultiply;
use crate::pipelines::Pipelines;
use crate::shadow::Shadows;
use crate::targets::{Targets, texture_2d};
use crate::{Background, ClipShape, FrameParams, Mode, PictureOptions, RenderError};

/// Format of pictures that are read back.
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Format of item buffers.
const ITEMS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// What a recorded frame shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drawn {
    /// What its mode says.
    Frame,
    /// The nearest faces by their numbers.
    Items,
}

/// How bright the backdrop of [`Mode::Difference`] is.
const BACKDROP_DIM: f32 = 0.35;

/// Inside of the outline in [`Mode::Silhouette`], linear colour and alpha.
const OUTLINE_FILL: [f32; 4] = [0.13, 0.30, 0.62, 0.30];

/// Its line.
const OUTLINE_LINE: [f32; 4] = [0.02, 0.06, 0.20, 1.0];

/// Draws frames. What it draws is loaded once; what depends on the image's size is kept while the size stays.
#[derive(Debug)]
pub struct PictureRenderer {
    options: PictureOptions,
    layouts: Layouts,
    pipelines: Pipelines,
    view: wgpu::Buffer,
    view_group: wgpu::BindGroup,
    tints: [wgpu::Buffer; 2],
    clip: ClipBuffers,
    targets: Option<Targets>,
    hulls: Hulls,
    shadows: Shadows,
    model: Option<ModelBuffers>,
    soup: Option<Soup>,
    map: Option<(SilhouetteMap, MapReader)>,
    readback: Option<((u32, u32), wgpu::Texture, Readback)>,
}

impl PictureRenderer {
    /// A renderer with nothing loaded.
    #[must_use]
    pub fn new(gpu: &Gpu, options: PictureOptions) -> Self {
        let relight = options.relight;
        let layouts = Layouts::new(&gpu.device);
        let view = uniform_buffer(
            &gpu.device,
            "view",
            &bytemuck::Zeroable::zeroed() as &ViewUniform,
        );
        let view_group = bind(
            &gpu.device,
            "view",
            &layouts.view,
            &[view.as_entire_binding()],
        );
        let tints = [OUTLINE_FILL, OUTLINE_LINE]
            .map(|colour| uniform_buffer(&gpu.device, "tint", &TintUniform { colour }));
        Self {
            options,
            layouts,
            pipelines: Pipelines::new(),
            view,
            view_group,
            tints,
            clip: ClipBuffers::new(gpu),
            targets: None,
            hulls: Hulls::new(relight),
            shadows: Shadows::new(gpu),
            model: None,
            soup: None,
            map: None,
            readback: None,
        }
    }

    /// Takes an asset's hull, paint and silhouettes in place of those loaded before.
    ///
    /// # Errors
    /// When its parts do not belong together, its textures cannot be decoded or are too large, or the device fails.
    pub fn load_asset(&mut self, gpu: &Gpu, asset: &Asset) -> Result<(), RenderError> {
        let reader = MapReader::new(&asset.map).map_err(LoadError::from)?;
        self.hulls.load(gpu, PICTURE, asset)?;
        self.shadows.load(asset);
        self.map = Some((asset.map.clone(), reader));
        Ok(())
    }

    /// Whether another light can shine on the asset, or on the mesh where there is no asset.
    #[must_use]
    pub fn can_relight(&self) -> bool {
        self.options.relight && self.hulls.can_relight()
    }

    /// Takes a full mesh in place of the one loaded before.
    ///
    /// # Errors
    /// When its parts do not belong together, its textures are too large, or the device fails.
    pub fn load_model(&mut self, gpu: &Gpu, mesh: &TriangleMesh) -> Result<(), RenderError> {
        self.model = Some(ModelBuffers::new(gpu, &self.layouts, mesh)?);
        Ok(())
    }

    /// Takes a full mesh for [`Mode::Edges`] in place of the one loaded before; its faces need not be closed.
    ///
    /// # Errors
    /// When a face names a vertex that does not exist, or the device fails.
    pub fn load_edge_model(&mut self, gpu: &Gpu, mesh: &TriangleMesh) -> Result<(), RenderError> {
        self.soup = Some(Soup::new(gpu, &self.layouts, mesh)?);
        Ok(())
    }

    /// Draws a frame, clipped by the outline that the asset gives where the mode asks for one, and returns the picture.
    ///
    /// # Errors
    /// When what the mode needs is not loaded, the camera is inside the model, the image is more than the device can hold,
    /// or the device fails; always on the web, where nothing may wait.
    pub fn render(&mut self, gpu: &Gpu, params: &FrameParams) -> Result<ColourImage, RenderError> {
        let outline = self.outline(params)?;
        self.render_shape(gpu, params, &clip_shape(outline.as_ref()))
    }

    /// As [`PictureRenderer::render`], without waiting.
    ///
    /// # Errors
    /// As [`PictureRenderer::render`].
    pub async fn render_async(
        &mut self,
        gpu: &Gpu,
        params: &FrameParams,
    ) -> Result<ColourImage, RenderError> {
        let outline = self.outline(params)?;
        let shape = clip_shape(outline.as_ref());
        self.render_shape_async(gpu, params, &shape).await
    }

    /// Records a frame into `encoder`, drawn to `target`, which has the options' format and the camera's size. Colours are
    /// premultiplied by alpha. At most one frame may be recorded between two submissions.
    ///
    /// # Errors
    /// As [`PictureRenderer::render`].
    pub fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        params: &FrameParams,
    ) -> Result<(), RenderError> {
        let outline = self.outline(params)?;
        let shape = clip_shape(outline.as_ref());
        self.record_shape(gpu, encoder, target, (params, &shape))
    }

    /// The outline of the frame, where its mode asks for one.
    fn outline(&mut self, params: &FrameParams) -> Result<Option<Outline>, RenderError> {
        let mode = params.mode;
        if mode == Mode::Exact {
            return Err(RenderError::NoLoops { mode });
        }
        if !mode.needs_outline() {
            return Ok(None);
        }
        let (map, scratch) = self.map.as_mut().ok_or(RenderError::NoAsset { mode })?;
        let outline = silmap_map::outline(map, &params.camera, params.method, scratch)?;
        Ok(Some(outline))
    }

    /// Draws a frame clipped by `shape`, whatever its origin, and returns the picture.
    ///
    /// # Errors
    /// When what the mode needs is not loaded, the camera is inside the model, the image or the shape is more than the
    /// device can hold, or the device fails; always on the web, where nothing may wait.
    pub fn render_shape(
        &mut self,
        gpu: &Gpu,
        params: &FrameParams,
        shape: &ClipShape<'_>,
    ) -> Result<ColourImage, RenderError> {
        if self.wants_items(params) {
            let (pending, _) = self.start_items(gpu, params)?;
            let (items, _) = pending.wait(gpu)?;
            self.take_items(gpu, params, &items);
        }
        let (pending, texture) = self.start(gpu, params, shape)?;
        let (pixels, readback) = pending.wait(gpu)?;
        Ok(self.finish(params, pixels, (texture, readback)))
    }

    /// As [`PictureRenderer::render_shape`], without waiting.
    ///
    /// # Errors
    /// As [`PictureRenderer::render_shape`].
    pub async fn render_shape_async(
        &mut self,
        gpu: &Gpu,
        params: &FrameParams,
        shape: &ClipShape<'_>,
    ) -> Result<ColourImage, RenderError> {
        if self.wants_items(params) {
            let (pending, _) = self.start_items(gpu, params)?;
            let (items, _) = pending.finish(gpu).await?;
            self.take_items(gpu, params, &items);
        }
        let (pending, texture) = self.start(gpu, params, shape)?;
        let (pixels, readback) = pending.finish(gpu).await?;
        Ok(self.finish(params, pixels, (texture, readback)))
    }

    /// As [`PictureRenderer::record`], clipped by `shape`.
    ///
    /// # Errors
    /// As [`PictureRenderer::render_shape`].
    pub fn record_shape(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        (params, shape): (&FrameParams, &ClipShape<'_>),
    ) -> Result<(), RenderError> {
        let canvas = Canvas {
            view: target,
            format: self.options.target_format,
            background: params.background.clear_colour(),
        };
        self.record_frame(gpu, encoder, canvas, (params, shape), Drawn::Frame)
    }

    /// Whether the nearest faces have to be found before the frame.
    fn wants_items(&self, params: &FrameParams) -> bool {
        let is_tagged = |soup: &Soup| soup.is_tagged_for(&params.camera);
        matches!(params.mode, Mode::Edges(_))
            && params.edges.by_item_buffer
            && !self.soup.as_ref().is_some_and(is_tagged)
    }

    /// Draws the item buffer of a frame.
    fn start_items(
        &mut self,
        gpu: &Gpu,
        params: &FrameParams,
    ) -> Result<(PendingRead, wgpu::Texture), RenderError> {
        check_size(gpu, &params.camera)?;
        let mode = params.mode;
        let soup = self.soup.as_mut().ok_or(RenderError::NoModel { mode })?;
        soup.number(gpu);
        let size_px = (params.camera.width_px, params.camera.height_px);
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let texture = texture_2d(&gpu.device, "items", size_px, ITEMS, (1, usage));
        let readback = Readback::new(gpu, size_px, ITEMS)?;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("items"),
            });
        let canvas = Canvas {
            view: &view,
            format: ITEMS,
            background: wgpu::Color::TRANSPARENT,
        };
        let of_frame = (params, &ClipShape::EMPTY);
        self.record_frame(gpu, &mut encoder, canvas, of_frame, Drawn::Items)?;
        Ok((readback.start(gpu, encoder, &texture), texture))
    }

    fn take_items(&mut self, gpu: &Gpu, params: &FrameParams, items: &[u8]) {
        if let Some(soup) = &mut self.soup {
            soup.tag(gpu, &params.camera, items);
        }
    }

    fn start(
        &mut self,
        gpu: &Gpu,
        params: &FrameParams,
        shape: &ClipShape<'_>,
    ) -> Result<(PendingRead, wgpu::Texture), RenderError> {
        check_size(gpu, &params.camera)?;
        let size_px = (params.camera.width_px, params.camera.height_px);
        let (texture, readback) = match self.readback.take() {
            Some((size, texture, readback)) if size == size_px => (texture, readback),
            _ => {
                let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
                let texture = texture_2d(&gpu.device, "picture", size_px, PICTURE, (1, usage));
                (texture, Readback::new(gpu, size_px, PICTURE)?)
            }
        };
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("frame"),
            });
        let canvas = Canvas {
            view: &view,
            format: PICTURE,
            background: params.background.clear_colour(),
        };
        self.record_frame(gpu, &mut encoder, canvas, (params, shape), Drawn::Frame)?;
        Ok((readback.start(gpu, encoder, &texture), texture))
    }

    fn finish(
        &mut self,
        params: &FrameParams,
        mut rgba: Vec<u8>,
        (texture, readback): (wgpu::Texture, Readback),
    ) -> ColourImage {
        let (width, height) = (params.camera.width_px, params.camera.height_px);
        self.readback = Some(((width, height), texture, readback));
        if params.background == Background::Transparent {
            unpremultiply(&mut rgba);
        }
        ColourImage {
            width,
            height,
            rgba,
        }
    }

    fn record_frame(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        canvas: Canvas<'_>,
        (params, shape): (&FrameParams, &ClipShape<'_>),
        drawn: Drawn,
    ) -> Result<(), RenderError> {
        gpu.check()?;
        check_size(gpu, &params.camera)?;
        self.check_eye(&params.camera)?;
        let size_px = (params.camera.width_px, params.camera.height_px);
        if self.targets.as_ref().is_none_or(|t| t.size_px != size_px) {
            let of_all_sizes = (&self.layouts, &self.tints);
            self.targets = Some(Targets::new(&gpu.device, of_all_sizes, size_px));
        }
        if !params.mode.shows_hull() {
            self.write_view(gpu, params)?;
            if params.mode.needs_outline() {
                self.clip.load(gpu, shape)?;
            }
        }
        let ground = self.record_shadow(gpu, encoder, params)?;
        let needs_items = params.edges.by_item_buffer;
        let mut frame = FrameRecorder {
            gpu,
            encoder,
            canvas,
            layouts: &self.layouts,
            pipelines: &mut self.pipelines,
            view_group: &self.view_group,
            clip: &self.clip,
            targets: self
                .targets
                .as_mut()
                .expect("invariant: made just above for this size"),
        };
        match (params.mode, &self.model) {
            (Mode::Coarse | Mode::Textured | Mode::Clipped | Mode::Exact, _) => {
                let of_frame = (params, shape);
                let hulls = self.hulls.prepare(gpu, canvas.format, of_frame)?;
                frame.hulls(hulls, ground.as_ref());
            }
            (Mode::Original, Some(model)) => frame.original(model, params.antialias),
            (Mode::Silhouette, _) => frame.silhouette(params.antialias),
            (Mode::Difference, Some(model)) => frame.difference(model),
            (mode @ Mode::Edges(style), _) => {
                let soup = self.soup.as_ref().ok_or(RenderError::NoModel { mode })?;
                match drawn {
                    Drawn::Items => frame.items(soup),
                    Drawn::Frame if needs_items && !soup.is_tagged_for(&params.camera) => {
                        return Err(RenderError::NoNearestFaces);
                    }
                    Drawn::Frame => frame.edges(soup, style, params.antialias),
                }
            }
            (mode @ (Mode::Original | Mode::Difference), None) => {
                return Err(RenderError::NoModel { mode });
            }
        }
        gpu.check()?;
        Ok(())
    }

    /// Records what the light of a frame with a shadow sees. Returns what the ground is drawn with.
    fn record_shadow(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        params: &FrameParams,
    ) -> Result<Option<wgpu::BindGroup>, RenderError> {
        let mode = params.mode;
        let Some(shadow) = &params.shadow else {
            return Ok(None);
        };
        if !mode.casts_shadow() {
            return Err(RenderError::NoShadow { mode });
        }
        let asset = self.hulls.asset().ok_or(RenderError::NoAsset { mode })?;
        let of_frame = (params, shadow);
        (self.shadows).record((gpu, &self.layouts), encoder, asset, of_frame)
    }

    /// Whether the eye is outside of what is loaded.
    fn check_eye(&self, camera: &Camera) -> Result<(), RenderError> {
        let of_soup = self.soup.as_ref().map(|s| (s.origin, s.radius));
        let of_model = self.model.as_ref().map(|m| (m.origin, m.radius));
        let of_asset = self.map.as_ref().map(|(map, _)| (map.center, map.radius));
        if let Some((center, radius)) = of_asset.or(of_model).or(of_soup) {
            let distance = camera.eye.distance(center);
            if distance <= radius {
                return Err(CameraError::EyeInsideBounds { distance, radius }.into());
            }
        }
        Ok(())
    }

    /// Brings camera and light to the device.
    fn write_view(&self, gpu: &Gpu, params: &FrameParams) -> Result<(), RenderError> {
        let mode = params.mode;
        let (origin, radius) = if matches!(mode, Mode::Edges(_)) {
            let soup = self.soup.as_ref().ok_or(RenderError::NoModel { mode })?;
            (soup.origin, soup.radius)
        } else if mode.needs_model() {
            let model = self.model.as_ref().ok_or(RenderError::NoModel { mode })?;
            (model.origin, model.radius)
        } else {
            (DVec3::ZERO, 1.0)
        };
        let dim = if mode == Mode::Difference {
            BACKDROP_DIM
        } else {
            1.0
        };
        let (near, far) = depth_range(&params.camera, origin, radius);
        if let (Mode::Edges(style), Some(soup)) = (mode, &self.soup) {
            let of_style = (style, &params.edges);
            let lines =
                EdgeLinesUniform::new(&params.camera, (origin, radius), (near, far), of_style);
            soup.write_lines(gpu, &lines);
        }
        let uniform = ViewUniform::new(&params.camera, origin, (near, far), (params.light, dim))?;
        gpu.queue
            .write_buffer(&self.view, 0, bytemuck::bytes_of(&uniform));
        Ok(())
    }
}

/// The shape of an outline.
fn clip_shape(outline: Option<&Outline>) -> ClipShape<'_> {
    outline.map_or(ClipShape::EMPTY, |outline| ClipShape {
        loops: outline.simple_loops(),
        outline: outline.simple_loops(),
    })
}

fn check_size(gpu: &Gpu, camera: &Camera) -> Result<(), RenderError> {
    let (width, height) = (camera.width_px, camera.height_px);
    if width == 0 || height == 0 {
        return Err(CameraError::ImageSize { width, height }.into());
    }
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if width > limit || height > limit {
        return Err(RenderError::ImageTooLarge {
            width,
            height,
            limit,
        });
    }
    Ok(())
}
