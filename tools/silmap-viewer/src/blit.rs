//! Brings the drawn pictures into the window's pass, texel by texel.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};

/// `Placement` of `blit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Placement {
    origin_px: [f32; 2],
    split_px: f32,
    shift_px: f32,
    encodes: [f32; 4],
}

/// What draws pictures into passes of one format.
#[derive(Debug)]
pub(crate) struct Blit {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    encodes: bool,
}

/// Two pictures, ready to be placed.
#[derive(Debug)]
pub(crate) struct Placed {
    blit: Arc<Blit>,
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl Blit {
    /// For the pass that the window's interface is drawn in.
    pub(crate) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("blit.wgsl"));
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("pictures"),
            entries: &[(0, uniform), (1, texture), (2, texture)].map(entry),
        });
        let of_pipeline = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("pictures"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("pictures"),
            layout: Some(&of_pipeline),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self {
            pipeline,
            layout,
            encodes: !target.is_srgb(),
        }
    }

    /// Takes two pictures of one size, which may be the same.
    pub(crate) fn place(
        self: &Arc<Self>,
        device: &wgpu::Device,
        [left, right]: [&wgpu::TextureView; 2],
    ) -> Placed {
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("placement"),
            size: size_of::<Placement>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("pictures"),
            layout: &self.layout,
            entries: &[
                (0, uniform.as_entire_binding()),
                (1, wgpu::BindingResource::TextureView(left)),
                (2, wgpu::BindingResource::TextureView(right)),
            ]
            .map(entry),
        });
        Placed {
            blit: Arc::clone(self),
            uniform,
            group,
        }
    }
}

/// Draws placed pictures where the interface leaves room for them.
pub(crate) struct PictureCallback {
    pub(crate) placed: Arc<Placed>,
    pub(crate) origin_px: [f32; 2],
    /// The column at which the right one begins, from the left one's first.
    pub(crate) split_px: f32,
    /// How far the right one is to the right of the left one.
    pub(crate) shift_px: f32,
}

impl CallbackTrait for PictureCallback {
    fn prepare(
        &self,
        _: &wgpu::Device,
        queue: &wgpu::Queue,
        _: &ScreenDescriptor,
        _: &mut wgpu::CommandEncoder,
        _: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let placement = Placement {
            origin_px: self.origin_px,
            split_px: self.split_px,
            shift_px: self.shift_px,
            encodes: [if self.placed.blit.encodes { 1.0 } else { 0.0 }; 4],
        };
        queue.write_buffer(&self.placed.uniform, 0, bytemuck::bytes_of(&placement));
        Vec::new()
    }

    fn paint(
        &self,
        _: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _: &CallbackResources,
    ) {
        pass.set_pipeline(&self.placed.blit.pipeline);
        pass.set_bind_group(0, &self.placed.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_placement_lies_in_memory_as_the_shader_reads_it() {
        let module = naga::front::wgsl::parse_str(include_str!("blit.wgsl")).unwrap();
        let span = module.types.iter().find_map(|(_, found)| {
            let naga::TypeInner::Struct { span, .. } = found.inner else {
                return None;
            };
            (found.name.as_deref() == Some("Placement")).then_some(span)
        });
        assert_eq!(span, Some(size_of::<Placement>() as u32));
        // WebGL2 refuses others.
        assert_eq!(size_of::<Placement>() % 16, 0);
    }
}
