//! Rasterising masks of a mesh on the GPU, several views at a time.
//!
//! The device draws a view while earlier ones are on their way back, so that neither waits for the other. Vertices are
//! rounded to the device's own grid (1/256 pixel), so pixels whose centre lies that near to an edge may differ from the
//! processor's mask; no others do.
//!
//! Source: Silhouette Mapping, section 3, which reads its masks back from a graphics board.
//! Limits: [`CoverageRule::Center`] only. Marking every touched pixel needs an extension that few adapters have, and drawing
//! larger is not exact; [`capture()`](super::capture) sends [`CoverageRule::Any`] to the processor.
//!
//! [`CoverageRule::Center`]: silmap_geometry::CoverageRule::Center
//! [`CoverageRule::Any`]: silmap_geometry::CoverageRule::Any

use std::collections::VecDeque;

use glam::{DMat4, DVec3};
use silmap_geometry::{Camera, CameraError, Mask, TriangleMesh};
use silmap_gpu::{Gpu, GpuError, PendingRead, Readback, shaders, split_faces, wgpu};
use wgpu::util::DeviceExt;

use super::CaptureError;

/// Views drawn ahead of the one that is read: enough to hide the way back, few enough to keep their memory small.
const IN_FLIGHT: usize = 4;

/// One byte a pixel, which every device can draw to.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Bytes of a vertex and of a face on the device.
const ITEM_BYTES: u64 = 12;

/// Size of `View` in `shaders/shared/view.wgsl`; the mask needs its first 64 bytes, the matrix.
const VIEW_BYTES: u64 = 128;

/// A mesh on the device, ready to be drawn as masks.
#[derive(Debug)]
pub struct GpuCapture {
    gpu: Gpu,
    pipeline: wgpu::RenderPipeline,
    view_layout: wgpu::BindGroupLayout,
    chunks: Vec<(wgpu::Buffer, wgpu::Buffer, u32)>,
    /// Middle of the mesh; positions on the device are relative to it.
    origin: DVec3,
    radius: f64,
}

/// A view that was drawn and is on its way back.
#[derive(Debug)]
struct InFlight {
    index: usize,
    pending: PendingRead,
    size_px: (u32, u32),
    image: wgpu::Texture,
}

/// An image to draw to, and the buffer for bringing it back.
#[derive(Debug)]
struct Slot {
    size_px: (u32, u32),
    image: wgpu::Texture,
    readback: Readback,
}

impl GpuCapture {
    /// Brings a closed mesh to the device.
    ///
    /// # Errors
    /// When the device fails.
    pub fn new(gpu: &Gpu, mesh: &TriangleMesh) -> Result<Self, CaptureError> {
        let device = &gpu.device;
        let bounds = mesh.bounds();
        let room = (device.limits().max_buffer_size / ITEM_BYTES) as usize;
        let chunks = split_faces(&mesh.faces, mesh.positions.len(), room, room)
            .iter()
            .map(|chunk| {
                let positions: Vec<[f32; 3]> = chunk
                    .vertices
                    .iter()
                    .map(|&v| {
                        (mesh.positions[v as usize] - bounds.center)
                            .as_vec3()
                            .to_array()
                    })
                    .collect();
                let buffer = |label, contents, usage| {
                    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                        label: Some(label),
                        contents,
                        usage,
                    })
                };
                (
                    buffer(
                        "captured vertices",
                        bytemuck::cast_slice(&positions),
                        wgpu::BufferUsages::VERTEX,
                    ),
                    buffer(
                        "captured faces",
                        bytemuck::cast_slice(&chunk.faces),
                        wgpu::BufferUsages::INDEX,
                    ),
                    3 * chunk.faces.len() as u32,
                )
            })
            .collect();
        let view_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let pipeline = make_pipeline(device, &view_layout);
        gpu.check()?;
        Ok(Self {
            gpu: gpu.clone(),
            pipeline,
            view_layout,
            chunks,
            origin: bounds.center,
            radius: bounds.radius,
        })
    }

    /// Draws the mesh from each camera and hands out the masks in the cameras' order, with the camera's number.
    ///
    /// # Errors
    /// When an eye lies in the bounding sphere, an image is larger than the device can draw, the device fails, or `each` does, which stops the capture.
    pub fn capture(
        &self,
        cameras: &[Camera],
        each: &mut dyn FnMut(usize, Mask) -> Result<(), CaptureError>,
    ) -> Result<(), CaptureError> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let mut waiting: VecDeque<InFlight> = VecDeque::new();
        let mut free: Vec<Slot> = Vec::new();
        for (index, camera) in cameras.iter().enumerate() {
            let distance = camera.eye.distance(self.origin);
            if distance <= self.radius {
                let radius = self.radius;
                return Err(CameraError::EyeInsideBounds { distance, radius }.into());
            }
            if camera.width_px.max(camera.height_px) > limit {
                return Err(CaptureError::ImageTooLarge {
                    width: camera.width_px,
                    height: camera.height_px,
                    limit,
                });
            }
            if waiting.len() == IN_FLIGHT {
                free.extend(self.take_oldest(&mut waiting, each)?);
            }
            let size_px = (camera.width_px, camera.height_px);
            let slot = match free.iter().position(|s| s.size_px == size_px) {
                Some(at) => free.swap_remove(at),
                None => self.make_slot(size_px)?,
            };
            let encoder = self.draw(camera, &slot.image);
            let pending = slot.readback.start(&self.gpu, encoder, &slot.image);
            waiting.push_back(InFlight {
                index,
                pending,
                size_px,
                image: slot.image,
            });
        }
        while !waiting.is_empty() {
            self.take_oldest(&mut waiting, each)?;
        }
        Ok(())
    }

    /// Waits for the oldest view in flight and hands out its mask.
    fn take_oldest(
        &self,
        waiting: &mut VecDeque<InFlight>,
        each: &mut dyn FnMut(usize, Mask) -> Result<(), CaptureError>,
    ) -> Result<Option<Slot>, CaptureError> {
        let Some(view) = waiting.pop_front() else {
            return Ok(None);
        };
        let (pixels, readback) = view.pending.wait(&self.gpu)?;
        each(view.index, mask_of(view.size_px, &pixels))?;
        Ok(Some(Slot {
            size_px: view.size_px,
            image: view.image,
            readback,
        }))
    }

    fn make_slot(&self, size_px: (u32, u32)) -> Result<Slot, GpuError> {
        let image = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("mask"),
            size: wgpu::Extent3d {
                width: size_px.0,
                height: size_px.1,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Slot {
            size_px,
            image,
            readback: Readback::new(&self.gpu, size_px, FORMAT)?,
        })
    }

    /// Records one view.
    fn draw(&self, camera: &Camera, image: &wgpu::Texture) -> wgpu::CommandEncoder {
        let device = &self.gpu.device;
        let view_group = self.view_group(camera);
        let target = image.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("capture"),
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("capture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &view_group, &[]);
        for (vertices, indices, count) in &self.chunks {
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*count, 0, 0..1);
        }
        drop(pass);
        encoder
    }

    fn view_group(&self, camera: &Camera) -> wgpu::BindGroup {
        // Nothing is hidden in a mask: depth only has to stay within what is drawn.
        let depth = camera.depth(self.origin);
        let far = depth.max(0.0) + 2.0 * self.radius;
        let near = (depth - 2.0 * self.radius).max(far * 1e-4);
        let clip = camera.clip_from_object(near, far) * DMat4::from_translation(self.origin);
        let mut bytes = vec![0; VIEW_BYTES as usize];
        bytes[..64].copy_from_slice(bytemuck::bytes_of(&clip.as_mat4().to_cols_array()));
        let uniform = self
            .gpu
            .device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("view"),
                contents: &bytes,
                usage: wgpu::BufferUsages::UNIFORM,
            });
        self.gpu
            .device
            .create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("view"),
                layout: &self.view_layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: uniform.as_entire_binding(),
                }],
            })
    }
}

/// Packs one byte a pixel into bits.
fn mask_of((width, height): (u32, u32), pixels: &[u8]) -> Mask {
    let mut mask = Mask::new(width, height);
    for (y, row) in (0..).zip(pixels.chunks_exact(width.max(1) as usize)) {
        for (word, bytes) in mask.row_mut(y).iter_mut().zip(row.chunks(64)) {
            *word = bytes
                .iter()
                .rev()
                .fold(0, |bits, &value| bits << 1 | u64::from(value >> 7));
        }
    }
    mask
}

fn make_pipeline(
    device: &wgpu::Device,
    view_layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let shader = shaders::CAPTURE_MASK;
    let module = shader.module(device);
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(shader.name),
        bind_group_layouts: &[Some(view_layout)],
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader.name),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: ITEM_BYTES,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        // The mesh is closed: its front covers whatever its back does.
        primitive: wgpu::PrimitiveState {
            cull_mode: Some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_become_bits_in_their_places() {
        let (width, height) = (67, 3);
        let set = |x: u32, y: u32| (x * 7 + y * 5).is_multiple_of(3);
        let pixels: Vec<u8> = (0..height)
            .flat_map(|y| (0..width).map(move |x| if set(x, y) { 255 } else { 0 }))
            .collect();
        let mask = mask_of((width, height), &pixels);
        for y in 0..height {
            for x in 0..width {
                assert_eq!(mask.get(x.into(), y.into()), set(x, y), "({x}, {y})");
            }
        }
    }
}
