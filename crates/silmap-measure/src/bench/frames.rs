//! Timing frames: drawing to a texture, by the device's own clock where it has one.

use std::time::Instant;

use silmap_exact::Extractor;
use silmap_geometry::{Camera, Mask, TriangleMesh};
use silmap_gpu::{FrameTimer, Gpu, wait_for, wgpu};
use silmap_map::{Asset, Method};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};

use crate::{ExactShape, MeasureError};

/// Draws frames to a texture and times them.
pub(crate) struct Drawer<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) renderer: PictureRenderer,
    target: wgpu::TextureView,
    timer: Option<FrameTimer>,
}

/// How a frame gets the region that it is clipped to.
pub(super) enum Region<'r, 'm> {
    /// None, or interpolated.
    Own,
    /// Exact edges.
    Exact(&'r mut Extractor<'m>),
}

/// What a frame shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) mode: Mode,
    pub(crate) method: Method,
    pub(crate) antialias: Antialias,
    pub(crate) paint: Paint,
}

impl Look {
    /// With the hull's own surface.
    pub(crate) fn new(mode: Mode, method: Method, antialias: Antialias) -> Self {
        Self {
            mode,
            method,
            antialias,
            paint: Paint::Blended,
        }
    }
}

pub(crate) fn params(camera: Camera, look: Look) -> FrameParams {
    FrameParams {
        camera,
        mode: look.mode,
        method: look.method,
        paint: look.paint,
        antialias: look.antialias,
        background: Background::Transparent,
        edges: EdgeParams::default(),
        light: None,
        shadow: None,
    }
}

impl<'g> Drawer<'g> {
    /// A renderer of `asset` and `full` that draws pictures of this size.
    pub(super) fn new(
        gpu: &'g Gpu,
        (width, height): (u32, u32),
        asset: &Asset,
        full: &TriangleMesh,
    ) -> Result<Self, MeasureError> {
        let options = PictureOptions::default();
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("measured frame"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: options.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let mut renderer = PictureRenderer::new(gpu, options);
        renderer.load_asset(gpu, asset)?;
        renderer.load_model(gpu, full)?;
        Ok(Self {
            gpu,
            renderer,
            target: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            timer: FrameTimer::new(gpu),
        })
    }

    /// Whether times are the device's own.
    pub(super) fn has_timestamps(&self) -> bool {
        self.timer.is_some()
    }
}

impl Region<'_, '_> {
    fn shape(
        &mut self,
        frame: &FrameParams,
        mesh: &TriangleMesh,
    ) -> Result<Option<ExactShape>, MeasureError> {
        let Self::Exact(extractor) = self else {
            return Ok(None);
        };
        let mut edges = Vec::new();
        extractor.extract(&silmap_exact::Viewpoint::Eye(frame.camera.eye), &mut edges);
        ExactShape::new(mesh, &edges, &frame.camera, false).map(Some)
    }
}

impl Drawer<'_> {
    /// Seconds of the device and of the processor for a frame of several instances, each drawn over the last.
    pub(super) fn frame(
        &mut self,
        instances: &[FrameParams],
        region: &mut Region<'_, '_>,
        mesh: &TriangleMesh,
    ) -> Result<(f64, f64), MeasureError> {
        wait_for(self.gpu, None)?;
        let (mut on_processor, mut submitted) = (0.0, 0.0);
        for (k, frame) in instances.iter().enumerate() {
            let since = Instant::now();
            let mut encoder = (self.gpu.device)
                .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            if let (0, Some(timer)) = (k, &self.timer) {
                timer.start(&mut encoder);
            }
            let (gpu, target) = (self.gpu, &self.target);
            match region.shape(frame, mesh)? {
                Some(shape) => {
                    let of_frame = (frame, &shape.clip_shape());
                    (self.renderer).record_shape(gpu, &mut encoder, target, of_frame)?;
                }
                None => self.renderer.record(gpu, &mut encoder, target, frame)?,
            }
            if let (true, Some(timer)) = (k + 1 == instances.len(), &self.timer) {
                timer.end(&mut encoder);
            }
            let commands = encoder.finish();
            on_processor += since.elapsed().as_secs_f64();
            let since = Instant::now();
            self.gpu.queue.submit([commands]);
            if self.timer.is_none() {
                wait_for(self.gpu, None)?;
            }
            submitted += since.elapsed().as_secs_f64();
        }
        let on_device = match &self.timer {
            Some(timer) => timer.seconds(self.gpu)?,
            None => submitted,
        };
        Ok((on_device, on_processor))
    }

    /// The pixels that a picture covers.
    pub(super) fn mask(
        &mut self,
        frame: &FrameParams,
        region: &mut Region<'_, '_>,
        mesh: &TriangleMesh,
    ) -> Result<Mask, MeasureError> {
        let picture = match region.shape(frame, mesh)? {
            Some(shape) => (self.renderer).render_shape(self.gpu, frame, &shape.clip_shape())?,
            None => self.renderer.render(self.gpu, frame)?,
        };
        let mut mask = Mask::new(picture.width, picture.height);
        for (i, pixel) in (0..).zip(picture.rgba.chunks_exact(4)) {
            mask.set(i % picture.width, i / picture.width, pixel[3] > 127);
        }
        Ok(mask)
    }
}
