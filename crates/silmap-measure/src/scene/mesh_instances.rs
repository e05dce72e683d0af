//! Drawing a mesh many times with one call, to compare with.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3};
use silmap_geometry::{TriangleMesh, lighting};
use silmap_gpu::wgpu::util::DeviceExt;
use silmap_gpu::{Gpu, wgpu};
use silmap_runtime::{Transform, View};

/// A vertex: position and normal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    normal: [i16; 4],
}

const VERTEX: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm16x4];
const MATRIX: [wgpu::VertexAttribute; 4] = wgpu::vertex_attr_array![
    2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4
];

/// The uniform of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Scene {
    lights: [[f32; 4]; 2],
    albedo: [f32; 4],
}

/// A mesh on the device, and its places.
#[derive(Debug)]
pub(super) struct MeshInstances {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    n_indices: u32,
    matrices: Vec<[[f32; 4]; 4]>,
    instances: wgpu::Buffer,
    origin: DVec3,
    /// Bytes of vertices and indices.
    pub(super) bytes: u64,
}

impl MeshInstances {
    pub(super) fn new(
        gpu: &Gpu,
        mesh: &TriangleMesh,
        (colour, depth): (wgpu::TextureFormat, wgpu::TextureFormat),
        most: usize,
    ) -> Self {
        let device = &gpu.device;
        let origin = mesh.bounds().center;
        let normals = mesh.vertex_normals();
        let vertices: Vec<Vertex> = mesh
            .positions
            .iter()
            .zip(&normals)
            .map(|(&p, n)| Vertex {
                position: (p - origin).as_vec3().to_array(),
                normal: n.extend(0.0).to_array().map(|x| (x * 32767.0) as i16),
            })
            .collect();
        let filled = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let [r, g, b] = lighting::DEFAULT_ALBEDO;
        let scene = Scene {
            lights: lighting::LIGHTS.map(|[x, y, z, intensity]| {
                let length = (x * x + y * y + z * z).sqrt();
                [x / length, y / length, z / length, intensity]
            }),
            albedo: [r, g, b, lighting::AMBIENT],
        };
        let uniform = filled(
            "scene",
            bytemuck::bytes_of(&scene),
            wgpu::BufferUsages::UNIFORM,
        );
        let pipeline = pipeline(device, colour, depth);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: uniform.as_entire_binding(),
            }],
        });
        let vertex_bytes: &[u8] = bytemuck::cast_slice(&vertices);
        let index_bytes: &[u8] = bytemuck::cast_slice(mesh.faces.as_flattened());
        Self {
            pipeline,
            group,
            vertices: filled("mesh", vertex_bytes, wgpu::BufferUsages::VERTEX),
            indices: filled("faces", index_bytes, wgpu::BufferUsages::INDEX),
            n_indices: 3 * mesh.faces.len() as u32,
            matrices: Vec::with_capacity(most),
            instances: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("places"),
                size: 64 * most.max(1) as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            origin,
            bytes: (vertex_bytes.len() + index_bytes.len()) as u64,
        }
    }

    /// The processor's part of a frame.
    pub(super) fn plan(&mut self, view: &View, transforms: &[Transform]) {
        self.matrices.clear();
        let matrix = |t: &Transform| -> DMat4 { view.clip_from_world * t.matrix(self.origin) };
        let all = transforms
            .iter()
            .map(|t| matrix(t).as_mat4().to_cols_array_2d());
        self.matrices.extend(all);
    }

    pub(super) fn upload(&self, queue: &wgpu::Queue) {
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.matrices));
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_vertex_buffer(1, self.instances.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.n_indices, 0, 0..self.matrices.len() as u32);
    }
}

fn pipeline(
    device: &wgpu::Device,
    colour: wgpu::TextureFormat,
    depth: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let text = include_str!("../../shaders/instanced_mesh.wgsl");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("instanced mesh"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let buffer = |array_stride, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride,
            step_mode,
            attributes,
        })
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("instanced mesh"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                buffer(
                    size_of::<Vertex>() as u64,
                    wgpu::VertexStepMode::Vertex,
                    &VERTEX,
                ),
                buffer(64, wgpu::VertexStepMode::Instance, &MATRIX),
            ],
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: Some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(colour.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
