//! What is loaded to the graphics device, and the pictures that are drawn of it.
//!
//! Pictures are drawn to textures of the view's size when something changed, and placed into the window in every frame.

use std::sync::Arc;

use silmap_gpu::{Gpu, GpuError, PendingRead, Readback};
use silmap_map::Method;
use silmap_study::{FrameParams, Mode, PictureOptions, PictureRenderer, RenderError};

use crate::blit::{Blit, PictureCallback, Placed};
use crate::crowd::{Crowd, CrowdParams};
use crate::making::Maker;

/// What one picture shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Picture {
    /// One model.
    Single(FrameParams),
    /// Many instances.
    Crowd(CrowdParams),
}

/// What a picture was drawn with, to see whether it is still right.
#[derive(Debug)]
struct Drawn {
    picture: Picture,
    generation: u64,
}

/// A texture to draw to.
#[derive(Debug)]
struct Target {
    size_px: (u32, u32),
    view: wgpu::TextureView,
    texture: wgpu::Texture,
    drawn: Option<Drawn>,
}

/// The device's side of the viewer.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) gpu: Gpu,
    renderer: PictureRenderer,
    crowd: Option<Crowd>,
    options: PictureOptions,
    blit: Arc<Blit>,
    targets: [Option<Target>; 2],
    placed: Option<Arc<Placed>>,
    /// Counts what was loaded.
    generation: u64,
}

impl Stage {
    /// On the window's device.
    pub(crate) fn new(state: &egui_wgpu::RenderState) -> Self {
        let gpu = Gpu::of_host(
            state.instance.clone(),
            state.adapter.clone(),
            state.device.clone(),
            state.queue.clone(),
        );
        let options = PictureOptions::default();
        Self {
            renderer: PictureRenderer::new(&gpu, options.clone()),
            crowd: None,
            blit: Arc::new(Blit::new(&gpu.device, state.target_format)),
            targets: [None, None],
            placed: None,
            generation: 0,
            options,
            gpu,
        }
    }

    /// What makes scenes ready for this device.
    pub(crate) fn maker(&self) -> Maker {
        Maker {
            gpu: self.gpu.clone(),
            options: self.options.clone(),
        }
    }

    /// Draws what was made from now on; what is not there stays as it is.
    pub(crate) fn take(
        &mut self,
        renderer: Option<PictureRenderer>,
        crowd: Option<Crowd>,
        relight: bool,
    ) {
        if let Some(renderer) = renderer {
            self.renderer = renderer;
            self.crowd = None;
            self.options.relight = relight;
        }
        if crowd.is_some() {
            self.crowd = crowd;
        }
        self.generation += 1;
    }

    /// The method that many instances are drawn by, where they can be.
    pub(crate) fn crowd_method(&self) -> Option<Method> {
        self.crowd.as_ref().map(Crowd::method)
    }

    /// Whether lights can be moved.
    pub(crate) fn can_relight(&self) -> bool {
        self.options.relight
    }

    /// Draws the picture of a pane, where it is not there yet. Returns whether it was drawn.
    pub(crate) fn draw(
        &mut self,
        pane: usize,
        size_px: (u32, u32),
        picture: &Picture,
    ) -> Result<bool, RenderError> {
        let target = self.targets[pane].take();
        let mut target = match target {
            Some(target) if target.size_px == size_px => target,
            _ => {
                self.placed = None;
                Target::new(&self.gpu.device, size_px, self.options.target_format)
            }
        };
        let is_it =
            |drawn: &Drawn| drawn.generation == self.generation && drawn.picture == *picture;
        if target.drawn.as_ref().is_some_and(is_it) {
            self.targets[pane] = Some(target);
            return Ok(false);
        }
        let made = self.record(&target.view, picture);
        target.drawn = made.is_ok().then(|| Drawn {
            picture: picture.clone(),
            generation: self.generation,
        });
        self.targets[pane] = Some(target);
        made.map(|()| true)
    }

    fn record(&mut self, view: &wgpu::TextureView, picture: &Picture) -> Result<(), RenderError> {
        let described = wgpu::CommandEncoderDescriptor {
            label: Some("picture"),
        };
        let mut encoder = self.gpu.device.create_command_encoder(&described);
        match picture {
            Picture::Single(params) => {
                (self.renderer).record(&self.gpu, &mut encoder, view, params)?;
            }
            Picture::Crowd(params) => {
                let mode = Mode::Clipped;
                let crowd = self.crowd.as_mut().ok_or(RenderError::NoAsset { mode })?;
                crowd.record(&self.gpu, &mut encoder, view, params)?;
            }
        }
        self.gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// What puts the pictures into the window: the left one up to a column, the right one, so far to the right of it, from there on.
    pub(crate) fn callback(
        &mut self,
        origin_px: [f32; 2],
        (split_px, shift_px): (f32, f32),
    ) -> Option<PictureCallback> {
        if self.placed.is_none() {
            let [left, right] = &self.targets;
            let left = left.as_ref()?;
            let same = |target: &&Target| target.size_px == left.size_px;
            let right = right.as_ref().filter(same).unwrap_or(left);
            let views = [&left.view, &right.view];
            self.placed = Some(Arc::new(self.blit.place(&self.gpu.device, views)));
        }
        Some(PictureCallback {
            placed: Arc::clone(self.placed.as_ref()?),
            origin_px,
            split_px,
            shift_px,
        })
    }

    /// What the frame of many instances took that was drawn last.
    pub(crate) fn crowd_stats(&self) -> Option<silmap_runtime::FrameStats> {
        self.crowd.as_ref().map(Crowd::stats)
    }

    /// What the device says, where it fails: once, unless it is lost.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        self.gpu.check_once()
    }

    /// Begins to read a pane's picture back; also its size.
    pub(crate) fn read_back(&self, pane: usize) -> Result<(PendingRead, (u32, u32)), String> {
        let target = self.targets[pane].as_ref().ok_or("there is no picture")?;
        let (gpu, texture) = (&self.gpu, &target.texture);
        let readback = Readback::new(gpu, target.size_px, texture.format());
        let encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let readback = readback.map_err(|e| e.to_string())?;
        Ok((readback.start(gpu, encoder, texture), target.size_px))
    }
}

impl Target {
    fn new(device: &wgpu::Device, size_px: (u32, u32), format: wgpu::TextureFormat) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d {
                width: size_px.0,
                height: size_px.1,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Self {
            size_px,
            view: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            texture,
            drawn: None,
        }
    }
}
