//! Device time of a frame, by timestamp queries.

use crate::{Gpu, GpuError, wait_for};

/// Bytes of two timestamps.
const BYTES: u64 = 16;

/// Two timestamps around what is submitted between them.
#[derive(Debug)]
pub struct FrameTimer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    /// A pixel that nothing is drawn to: passes, not encoders, take timestamps everywhere.
    pixel: wgpu::TextureView,
}

impl FrameTimer {
    /// A timer, where the device has timestamps.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Option<Self> {
        let device = &gpu.device;
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |label, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        let pixel = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("timed pixel"),
            size: wgpu::Extent3d {
                width: 1,
                height: 1,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("frame"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(
                "timestamps",
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            readable: buffer(
                "timestamps to read",
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            ),
            pixel: pixel.create_view(&wgpu::TextureViewDescriptor::default()),
        })
    }

    /// Time runs from here.
    pub fn start(&self, encoder: &mut wgpu::CommandEncoder) {
        self.stamp(encoder, 0);
    }

    /// Time runs to here.
    pub fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        self.stamp(encoder, 1);
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, BYTES);
    }

    fn stamp(&self, encoder: &mut wgpu::CommandEncoder, index: u32) {
        let _pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("timestamp"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.pixel,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            timestamp_writes: Some(wgpu::RenderPassTimestampWrites {
                query_set: &self.queries,
                beginning_of_pass_write_index: Some(index),
                end_of_pass_write_index: None,
            }),
            ..Default::default()
        });
    }

    /// Waits for what was submitted and gives the seconds between start and end.
    ///
    /// # Errors
    /// When the device was lost, refused the work or did not finish in time; always on the web, where nothing may block.
    pub fn seconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        self.readable.map_async(wgpu::MapMode::Read, .., |_| ());
        wait_for(gpu, None)?;
        let lost = |reason: String| GpuError::DeviceLost { reason };
        let view = (self.readable.get_mapped_range(..)).map_err(|e| lost(e.to_string()))?;
        let stamp = |bytes: &[u8]| (bytes.iter().rev()).fold(0, |sum, &b| sum << 8 | u64::from(b));
        let (first, last) = view.split_at(8);
        let ticks = stamp(last).saturating_sub(stamp(first));
        drop(view);
        self.readable.unmap();
        Ok(ticks as f64 * f64::from(gpu.queue.get_timestamp_period()) * 1e-9)
    }
}
