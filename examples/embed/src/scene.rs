//! What is in the scene: instances on a ground, and a sun whose shadow map the ground reads.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DQuat, DVec3};
use silmap_map::{Asset, BoundingSphere};
use silmap_runtime::{
    DepthDirection, DepthTarget, FrameStats, Instance, LoadedAsset, Renderer, RendererOptions,
    TargetFormats, Transform, View,
};

/// Texels a side of the shadow map.
const SHADOW_SIDE: u32 = 2048;
const SHADOW_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Towards the sun.
const TO_SUN: DVec3 = DVec3::new(0.5, 0.8, 0.35);

/// The distance between neighbours, in radii of a model. From near the ground they overlap on the screen.
const SPACING: f64 = 2.1;

/// `Ground` of `ground.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GroundUniform {
    clip_from_world: [[f32; 4]; 4],
    light_from_world: [[f32; 4]; 4],
}

/// The scene on the device.
pub(crate) struct Scene {
    asset: LoadedAsset,
    transforms: Vec<Transform>,
    /// One renderer for each view of a frame.
    models: Renderer,
    shadows: Renderer,
    sun: View,
    shadow_map: wgpu::TextureView,
    ground: wgpu::RenderPipeline,
    ground_uniform: wgpu::Buffer,
    ground_group: wgpu::BindGroup,
}

impl Scene {
    /// Makes everything for passes of `formats`.
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        formats: TargetFormats,
        asset: &Asset,
        count: u32,
    ) -> anyhow::Result<Self> {
        let models = Renderer::new(device, RendererOptions::new(formats))?;
        let shadow_formats = TargetFormats {
            colour: None,
            depth: Some(DepthTarget {
                format: SHADOW_FORMAT,
                direction: DepthDirection::Forward,
            }),
            samples: 1,
        };
        let shadows = Renderer::new(device, RendererOptions::new(shadow_formats))?;
        let loaded = models.load(device, queue, asset)?;
        let lowest = asset.hull.positions.iter().map(|p| f64::from(p[1]));
        let foot = lowest.fold(f64::INFINITY, f64::min);
        let transforms = (0..count)
            .map(|k| place(&loaded, foot, k))
            .collect::<Result<_, _>>()?;
        let shadow_map = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: wgpu::Extent3d {
                width: SHADOW_SIDE,
                height: SHADOW_SIDE,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SHADOW_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let shadow_map = shadow_map.create_view(&wgpu::TextureViewDescriptor::default());
        let ground_uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("ground"),
            size: size_of::<GroundUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let ground = ground_pipeline(device, &formats);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow map"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let resources = [
            ground_uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadow_map),
            wgpu::BindingResource::Sampler(&sampler),
        ];
        let entries = (0..).zip(resources);
        let entries = entries.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        let ground_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("ground"),
            layout: &ground.get_bind_group_layout(0),
            entries: &entries.collect::<Vec<_>>(),
        });
        Ok(Self {
            asset: loaded,
            transforms,
            models,
            shadows,
            sun: sun(f64::from(count))?,
            shadow_map,
            ground,
            ground_uniform,
            ground_group,
        })
    }

    /// Brings a frame to the device: once for the sun, once for the camera.
    pub(crate) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        camera: &View,
    ) -> anyhow::Result<FrameStats> {
        let instances: Vec<_> = (self.transforms.iter())
            .map(|&transform| Instance::new(&self.asset, transform))
            .collect();
        self.shadows.prepare(device, queue, &self.sun, &instances)?;
        let stats = self.models.prepare(device, queue, camera, &instances)?;
        let columns = |matrix: DMat4| matrix.as_mat4().to_cols_array_2d();
        let uniform = GroundUniform {
            clip_from_world: columns(camera.clip_from_world),
            light_from_world: columns(self.sun.clip_from_world),
        };
        queue.write_buffer(&self.ground_uniform, 0, bytemuck::bytes_of(&uniform));
        Ok(stats)
    }

    /// Draws what the sun sees.
    pub(crate) fn draw_shadow(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.shadow_map,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.shadows.draw(&mut pass);
    }

    /// Draws the ground, and the instances on it.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.ground);
        pass.set_bind_group(0, &self.ground_group, &[]);
        pass.draw(0..6, 0..1);
        self.models.draw(pass);
    }
}

/// The place of the instance number `k`: on a spiral, as the seeds of a sunflower, turned and sized at random.
fn place(asset: &LoadedAsset, foot: f64, k: u32) -> anyhow::Result<Transform> {
    // Two numbers that are as good as random.
    let share = |salt: u32| {
        let mut bits = (2 * k + salt).wrapping_mul(0x9e37_79b1);
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca6b);
        f64::from((bits ^ (bits >> 13)) >> 8) / f64::from(1 << 24)
    };
    let angle = f64::from(k) * 2.399_963;
    let distance = SPACING * (f64::from(k) / std::f64::consts::PI).sqrt();
    let bounds = asset.model_bounds();
    let scale = (0.6 + 0.5 * share(0)) / bounds.radius;
    let turn = DQuat::from_rotation_y(share(1) * std::f64::consts::TAU);
    let stand = DVec3::new(bounds.center.x, foot, bounds.center.z);
    let to = DVec3::new(distance * angle.cos(), 0.0, distance * angle.sin());
    Ok(Transform::new(scale, turn, to - turn * (stand * scale))?)
}

/// The sun sees all of the spiral, and what stands on it.
fn sun(count: f64) -> anyhow::Result<View> {
    let all = BoundingSphere {
        center: DVec3::ZERO,
        radius: SPACING * (count / std::f64::consts::PI).sqrt() + 3.0,
    };
    Ok(View::directional(
        TO_SUN,
        all,
        SHADOW_SIDE,
        DepthDirection::Forward,
    )?)
}

fn ground_pipeline(device: &wgpu::Device, formats: &TargetFormats) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("ground.wgsl"));
    let target = formats.colour.map(wgpu::ColorTargetState::from);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("ground"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: formats.depth.map(|depth| wgpu::DepthStencilState {
            format: depth.format,
            depth_write_enabled: Some(true),
            depth_compare: Some(match depth.direction {
                DepthDirection::Forward => wgpu::CompareFunction::Less,
                DepthDirection::Reversed => wgpu::CompareFunction::Greater,
            }),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: formats.samples,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[target],
        }),
        multiview_mask: None,
        cache: None,
    })
}
