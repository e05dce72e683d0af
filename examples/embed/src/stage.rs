//! Device, surface and passes of the window, and what can happen to them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, anyhow};
use silmap_map::Asset;
use silmap_runtime::{DepthDirection, DepthTarget, FrameStats, TargetFormats, View};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use crate::Options;
use crate::adapter;
use crate::fly_camera::FlyCamera;
use crate::scene::Scene;

const SAMPLES: u32 = 4;
const SKY: wgpu::Color = wgpu::Color {
    r: 0.35,
    g: 0.5,
    b: 0.7,
    a: 1.0,
};

/// All that belongs to one device.
pub(crate) struct Stage {
    instance: wgpu::Instance,
    adapter: wgpu::Adapter,
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    formats: TargetFormats,
    /// Samples of colour, and depth; none while the window has no area.
    attachments: Option<[wgpu::TextureView; 2]>,
    scene: Scene,
    is_lost: Arc<AtomicBool>,
    /// What the device refused.
    refusal: Arc<Mutex<Option<String>>>,
}

impl Stage {
    pub(crate) fn open(
        window: &Arc<Window>,
        display: Box<OwnedDisplayHandle>,
        asset: &Asset,
        options: &Options,
    ) -> anyhow::Result<Self> {
        // OpenGL draws to windows of this display alone.
        let described = wgpu::InstanceDescriptor::new_with_display_handle_from_env(display);
        let instance = wgpu::Instance::new(described);
        let surface = instance.create_surface(Arc::clone(window));
        let surface = surface.map_err(|_| anyhow!("no graphics driver draws to this window"))?;
        let adapter = pollster::block_on(adapter::find(&instance, &surface))?;
        let (device, queue) = pollster::block_on(
            adapter.request_device(&wgpu::DeviceDescriptor {
                label: Some("embed"),
                required_limits: wgpu::Limits::downlevel_webgl2_defaults()
                    .using_resolution(adapter.limits())
                    .using_alignment(adapter.limits()),
                ..Default::default()
            }),
        )?;
        let is_lost = Arc::new(AtomicBool::new(false));
        let lost = Arc::clone(&is_lost);
        device.set_device_lost_callback(move |_, _| lost.store(true, Ordering::Relaxed));
        let refusal = Arc::new(Mutex::new(None));
        let refused = Arc::clone(&refusal);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut first = refused.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert_with(|| error.to_string());
        }));
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .context("the graphics adapter does not draw to this display")?;
        // Linear colours are drawn; the target encodes them.
        let colour = config.format.add_srgb_suffix();
        if colour != config.format {
            config.view_formats.push(colour);
        }
        let formats = TargetFormats {
            colour: Some(colour),
            depth: Some(DepthTarget {
                format: if options.coverage {
                    wgpu::TextureFormat::Depth32Float
                } else {
                    wgpu::TextureFormat::Depth24PlusStencil8
                },
                direction: DepthDirection::Reversed,
            }),
            samples: SAMPLES,
        };
        let scene = Scene::new(&device, &queue, formats, asset, options.instances)?;
        let mut stage = Self {
            instance,
            adapter,
            device,
            queue,
            surface,
            config,
            formats,
            attachments: None,
            scene,
            is_lost,
            refusal,
        };
        stage.resize(size.width, size.height);
        Ok(stage)
    }

    /// Whether the device is gone, and all with it.
    pub(crate) fn is_lost(&self) -> bool {
        self.is_lost.load(Ordering::Relaxed)
    }

    pub(crate) fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({:?})", info.name, info.backend)
    }

    /// Follows the window's size, which may be zero.
    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        self.attachments = None;
        if width == 0 || height == 0 {
            return;
        }
        let most = self.device.limits().max_texture_dimension_2d;
        (self.config.width, self.config.height) = (width.min(most), height.min(most));
        self.surface.configure(&self.device, &self.config);
        let texture = |label, format| {
            let texture = self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: self.config.width,
                    height: self.config.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: SAMPLES,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        if let (Some(colour), Some(depth)) = (self.formats.colour, self.formats.depth) {
            self.attachments = Some([texture("samples", colour), texture("depth", depth.format)]);
        }
    }

    /// The texture to draw to; none where there is none now.
    fn next_texture(
        &mut self,
        window: &Arc<Window>,
    ) -> anyhow::Result<Option<wgpu::SurfaceTexture>> {
        use wgpu::CurrentSurfaceTexture::{
            Lost, Occluded, Outdated, Suboptimal, Success, Timeout, Validation,
        };
        match self.surface.get_current_texture() {
            // A size that is no longer the window's is followed by an event.
            Success(texture) | Suboptimal(texture) => Ok(Some(texture)),
            Outdated => {
                self.follow(window);
                Ok(None)
            }
            // With its device: the next frame opens another.
            Lost | Validation if self.is_lost() => {
                window.request_redraw();
                Ok(None)
            }
            Lost => {
                self.surface = self.instance.create_surface(Arc::clone(window))?;
                self.follow(window);
                Ok(None)
            }
            Timeout => {
                window.request_redraw();
                Ok(None)
            }
            Occluded => Ok(None),
            Validation => Err(anyhow!("the window's surface cannot be used")),
        }
    }

    fn follow(&mut self, window: &Window) {
        let size = window.inner_size();
        self.resize(size.width, size.height);
        window.request_redraw();
    }

    /// Draws a frame; `None` where there is nothing to draw to.
    pub(crate) fn frame(
        &mut self,
        window: &Arc<Window>,
        camera: &FlyCamera,
    ) -> anyhow::Result<Option<FrameStats>> {
        if self.attachments.is_none() {
            return Ok(None);
        }
        let Some(frame) = self.next_texture(window)? else {
            return Ok(None);
        };
        let Some([samples, depth]) = &self.attachments else {
            return Ok(None);
        };
        let (width, height) = (self.config.width, self.config.height);
        let view = View {
            clip_from_world: camera.clip_from_world(f64::from(width) / f64::from(height)),
            size_px: (width, height),
        };
        let stats = self.scene.prepare(&self.device, &self.queue, &view)?;
        let resolved = frame.texture.create_view(&wgpu::TextureViewDescriptor {
            format: self.formats.colour,
            ..Default::default()
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.scene.draw_shadow(&mut encoder);
        {
            let discard = wgpu::StoreOp::Discard;
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("scene"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: samples,
                    depth_slice: None,
                    resolve_target: Some(&resolved),
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(SKY),
                        store: discard,
                    },
                })],
                depth_stencil_attachment: self.formats.depth.map(|target| {
                    wgpu::RenderPassDepthStencilAttachment {
                        view: depth,
                        // Reversed: 0 is infinitely far.
                        depth_ops: Some(wgpu::Operations {
                            load: wgpu::LoadOp::Clear(0.0),
                            store: discard,
                        }),
                        stencil_ops: target.format.has_stencil_aspect().then_some(
                            wgpu::Operations {
                                load: wgpu::LoadOp::Clear(0),
                                store: discard,
                            },
                        ),
                    }
                }),
                ..Default::default()
            });
            self.scene.draw(&mut pass);
        }
        self.queue.submit([encoder.finish()]);
        window.pre_present_notify();
        self.queue.present(frame);
        let refusal = (self.refusal.lock().unwrap_or_else(PoisonError::into_inner)).take();
        match refusal {
            Some(reason) if !self.is_lost() => {
                Err(anyhow!("the graphics device refused a command: {reason}"))
            }
            _ => Ok(Some(stats)),
        }
    }
}
