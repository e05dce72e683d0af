//! Textures to draw to, and the pixels read back.

use std::sync::{Arc, Mutex, PoisonError};

use silmap_runtime::TargetFormats;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

use crate::device::Gpu;

/// How long the device is waited for, in milliseconds and tries.
const PAUSE_MILLIS: i32 = 4;
const MOST_PAUSES: u32 = 15_000;

/// What a pass draws to: colour, with as many samples as the formats say, and depth.
#[derive(Debug)]
pub(crate) struct Frame {
    picture: wgpu::Texture,
    resolved: wgpu::TextureView,
    sampled: Option<wgpu::TextureView>,
    depth: Option<(wgpu::TextureView, bool)>,
    side: u32,
}

impl Frame {
    pub(crate) fn new(device: &wgpu::Device, formats: &TargetFormats, side: u32) -> Self {
        let texture = |format, sample_count, more| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("target"),
                size: wgpu::Extent3d {
                    width: side,
                    height: side,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | more,
                view_formats: &[],
            })
        };
        let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        let colour = formats
            .colour
            .unwrap_or(wgpu::TextureFormat::Rgba8UnormSrgb);
        let none = wgpu::TextureUsages::empty();
        let picture = texture(colour, 1, wgpu::TextureUsages::COPY_SRC);
        Self {
            resolved: view(&picture),
            sampled: (formats.samples > 1).then(|| view(&texture(colour, formats.samples, none))),
            depth: formats.depth.map(|depth| {
                let texture = texture(depth.format, formats.samples, none);
                (view(&texture), depth.format.has_stencil_aspect())
            }),
            picture,
            side,
        }
    }

    /// A pass over white.
    pub(crate) fn pass<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        let discard = wgpu::StoreOp::Discard;
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.sampled.as_ref().unwrap_or(&self.resolved),
                depth_slice: None,
                resolve_target: self.sampled.as_ref().map(|_| &self.resolved),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: self.depth.as_ref().map(|(view, has_stencil)| {
                wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: discard,
                    }),
                    stencil_ops: has_stencil.then_some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0),
                        store: discard,
                    }),
                }
            }),
            ..Default::default()
        })
    }

    /// Submits what was encoded and returns the picture's bytes, row by row.
    pub(crate) async fn read(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
    ) -> Result<Vec<u8>, JsError> {
        let row = 4 * self.side;
        let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pixels"),
            size: u64::from(stride) * u64::from(self.side),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
        gpu.queue.submit([encoder.finish()]);
        let answer = Arc::new(Mutex::new(None));
        let heard = Arc::clone(&answer);
        buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
            *heard.lock().unwrap_or_else(PoisonError::into_inner) = Some(mapped.is_ok());
        });
        let mut pauses = 0;
        let is_mapped = loop {
            // WebGL2 says that it is done when it is asked, WebGPU by itself.
            let _ = gpu.device.poll(wgpu::PollType::Poll);
            if let Some(answer) = *answer.lock().unwrap_or_else(PoisonError::into_inner) {
                break answer;
            }
            if pauses == MOST_PAUSES {
                break false;
            }
            pauses += 1;
            pause().await?;
        };
        gpu.check()?;
        if !is_mapped {
            return Err(JsError::new("the graphics device does not answer"));
        }
        let bytes = buffer.get_mapped_range(..)?;
        let rows = bytes.chunks_exact(stride as usize);
        Ok(rows.flat_map(|r| &r[..row as usize]).copied().collect())
    }
}

/// Gives the browser time.
async fn pause() -> Result<(), JsError> {
    let promise = js_sys::Promise::new(&mut |resolve, _| {
        if let Some(window) = web_sys::window() {
            let _ = window
                .set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, PAUSE_MILLIS);
        }
    });
    let waited = JsFuture::from(promise).await;
    waited
        .map(|_| ())
        .map_err(|_| JsError::new("the page cannot wait"))
}
