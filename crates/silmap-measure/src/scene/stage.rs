//! One pass of a scene, timed: the processor's parts, and the device.

use std::time::Instant;

use silmap_gpu::{FrameTimer, Gpu, wait_for, wgpu};

use crate::MeasureError;

pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// Seconds of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FrameSeconds {
    pub(super) device: f64,
    /// Finding what is in the picture and its outlines.
    pub(super) outlines: f64,
    pub(super) upload: f64,
    pub(super) encode: f64,
    /// Outlines that were interpolated for it.
    pub(super) interpolated: usize,
}

impl FrameSeconds {
    pub(super) fn processor(&self) -> f64 {
        self.outlines + self.upload + self.encode
    }
}

/// What scenes are drawn to.
#[derive(Debug)]
pub(super) struct Stage<'g> {
    pub(super) gpu: &'g Gpu,
    pub(super) colour: wgpu::TextureView,
    depth: wgpu::TextureView,
    timer: Option<FrameTimer>,
}

impl<'g> Stage<'g> {
    pub(super) fn new(gpu: &'g Gpu, side_px: u32) -> Self {
        let view = |label, format| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: side_px,
                    height: side_px,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        Self {
            gpu,
            colour: view("scene", COLOUR),
            depth: view("scene's depth", DEPTH),
            timer: FrameTimer::new(gpu),
        }
    }

    pub(super) fn has_timestamps(&self) -> bool {
        self.timer.is_some()
    }

    /// Records and submits what `record` puts into an encoder; seconds of the device, and of recording.
    pub(super) fn submit(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), MeasureError>,
    ) -> Result<(f64, f64), MeasureError> {
        wait_for(self.gpu, None)?;
        let mut encoder =
            (self.gpu.device).create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if let Some(timer) = &self.timer {
            timer.start(&mut encoder);
        }
        let since = Instant::now();
        record(&mut encoder)?;
        let recorded = since.elapsed().as_secs_f64();
        if let Some(timer) = &self.timer {
            timer.end(&mut encoder);
        }
        let commands = encoder.finish();
        let since = Instant::now();
        self.gpu.queue.submit([commands]);
        let device = match &self.timer {
            Some(timer) => timer.seconds(self.gpu)?,
            None => {
                wait_for(self.gpu, None)?;
                since.elapsed().as_secs_f64()
            }
        };
        Ok((device, recorded))
    }

    /// One pass of the scene.
    pub(super) fn pass(
        &self,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) -> Result<(f64, f64), MeasureError> {
        self.submit(|encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("scene"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.colour,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0),
                        store: wgpu::StoreOp::Discard,
                    }),
                }),
                ..Default::default()
            });
            draw(&mut pass);
            Ok(())
        })
    }
}
