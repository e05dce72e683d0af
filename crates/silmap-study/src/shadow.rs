//! The shadow that the object casts on the ground under it: a pass from the light that draws depths alone, and a plane that is darkened
//! where they are.
//!
//! The ground itself is not drawn, and hides nothing: whatever is behind the picture shows through it.
//!
//! Source: Williams. Casting Curved Shadows on Curved Surfaces. SIGGRAPH 1978, for depths from the light; Reeves, Salesin, Cook. Rendering
//! Antialiased Shadows with Depth Maps. SIGGRAPH 1987, for the mean of several comparisons.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec3};
use silmap_geometry::Camera;
use silmap_gpu::{Gpu, wgpu};
use silmap_map::{Asset, Method};
use silmap_runtime::{
    ClipBy, DepthDirection, DepthTarget, Instance, LoadedAsset, Outline, Renderer, RendererOptions,
    TargetFormats, Transform, View,
};

use crate::layouts::{Layouts, bind, uniform_buffer};
use crate::targets::texture_2d;
use crate::{FrameParams, RenderError, ShadowParams};

/// Format of the light's depths.
const DEPTHS: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Texels of the light's picture for a pixel of the camera's, and between how many its side has.
const TEXELS_PER_PX: u32 = 2;
const LEAST_SIDE: u32 = 512;
const MOST_SIDE: u32 = 4096;

/// Alpha of a full shadow.
const STRENGTH: f32 = 0.5;

/// The sine of the light's least height above the ground: one degree.
const LEAST_SINE: f64 = 0.017;

/// `Ground` of `shaders/ground_shadow.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct GroundUniform {
    /// Where the corners of the light's picture fall on the ground, in clip space.
    pub corners: [[f32; 4]; 4],
    /// Alpha of a full shadow.
    pub strength: f32,
    /// A texel of the depths, in texture coordinates.
    pub texel: f32,
    /// Unused.
    pub room: [f32; 2],
}

/// Depths as the light sees them, and what reads them.
#[derive(Debug)]
struct DepthImage {
    side_px: u32,
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
}

/// What casts shadows.
#[derive(Debug)]
pub(crate) struct Shadows {
    ground: wgpu::Buffer,
    sampler: wgpu::Sampler,
    depths: Option<DepthImage>,
    /// What draws depths, with outlines by a method.
    caster: Option<(Method, Renderer)>,
    /// Points of the object's surface.
    surface: Vec<DVec3>,
}

impl Shadows {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            ground: uniform_buffer(&gpu.device, "ground", &GroundUniform::zeroed()),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::LessEqual),
                ..Default::default()
            }),
            depths: None,
            caster: None,
            surface: Vec::new(),
        }
    }

    /// Takes what is known of an asset's surface.
    pub(crate) fn load(&mut self, asset: &Asset) {
        let points = asset.hull.surface_points.iter();
        self.surface = points.map(|&p| Vec3::from(p).as_dvec3()).collect();
    }

    /// Records the light's pass of a frame of an asset. Returns what the ground is drawn with; nothing where the eye is below it.
    pub(crate) fn record(
        &mut self,
        (gpu, layouts): (&Gpu, &Layouts),
        encoder: &mut wgpu::CommandEncoder,
        asset: &LoadedAsset,
        (params, shadow): (&FrameParams, &ShadowParams),
    ) -> Result<Option<wgpu::BindGroup>, RenderError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let camera = &params.camera;
        let side_px = (TEXELS_PER_PX * camera.width_px.max(camera.height_px))
            .clamp(LEAST_SIDE, MOST_SIDE.min(limit));
        let direction = DepthDirection::Forward;
        let view = View::directional(shadow.to_light, asset.bounds(), side_px, direction)?;
        let up = shadow.up.try_normalize();
        let up = up.ok_or(RenderError::LightBelowGround)?;
        let to_light = shadow.to_light / shadow.to_light.abs().max_element();
        if to_light.normalize_or_zero().dot(up) < LEAST_SINE {
            return Err(RenderError::LightBelowGround);
        }
        let heights = self.surface.iter().map(|p| p.dot(up));
        let lowest = heights.fold(f64::INFINITY, f64::min);
        if camera.eye.dot(up) <= lowest {
            return Ok(None);
        }
        let ground = GroundUniform {
            corners: corners(&view, camera, (to_light, up, lowest)),
            strength: STRENGTH,
            texel: 1.0 / side_px as f32,
            room: [0.0; 2],
        };
        (gpu.queue).write_buffer(&self.ground, 0, bytemuck::bytes_of(&ground));
        let group = self.make_depths(gpu, layouts, side_px);
        self.draw_depths(gpu, encoder, &view, (asset, params))?;
        Ok(Some(group))
    }

    /// Makes an image for depths, where there is none of this size.
    fn make_depths(&mut self, gpu: &Gpu, layouts: &Layouts, side_px: u32) -> wgpu::BindGroup {
        let kept = self.depths.take().filter(|d| d.side_px == side_px);
        let depths = kept.unwrap_or_else(|| {
            let usage =
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
            let size_px = (side_px, side_px);
            let view = texture_2d(&gpu.device, "light's depths", size_px, DEPTHS, (1, usage))
                .create_view(&wgpu::TextureViewDescriptor::default());
            let resources = [
                self.ground.as_entire_binding(),
                wgpu::BindingResource::TextureView(&view),
                wgpu::BindingResource::Sampler(&self.sampler),
            ];
            let group = bind(&gpu.device, "ground", &layouts.ground, &resources);
            DepthImage {
                side_px,
                view,
                group,
            }
        });
        self.depths.insert(depths).group.clone()
    }

    /// Draws what the light sees.
    fn draw_depths(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        (asset, params): (&LoadedAsset, &FrameParams),
    ) -> Result<(), RenderError> {
        let is_clipped = params.mode.needs_outline();
        let kept = self.caster.take().filter(|(by, _)| *by == params.method);
        let (_, caster) = self
            .caster
            .insert(kept.unwrap_or_else(|| (params.method, caster(gpu, params.method))));
        let instance = Instance {
            outline: if is_clipped {
                Outline::OfAsset
            } else {
                Outline::Whole
            },
            ..Instance::new(asset, Transform::IDENTITY)
        };
        let stats = caster.prepare(&gpu.device, &gpu.queue, view, &[instance])?;
        if is_clipped && stats.whole > 0 {
            return Err(RenderError::NoOutlineOfShadow);
        }
        let depths = self.depths.as_ref().map(|d| &d.view);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: depths.map(|view| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        caster.draw(&mut pass);
        Ok(())
    }
}

/// A renderer of depths alone, whose outlines are the light's own.
fn caster(gpu: &Gpu, method: Method) -> Renderer {
    let options = RendererOptions {
        clip: ClipBy::Coverage,
        method: Some(method),
        reuse_error_px: 0.0,
        polytope_bytes: 0,
        ..RendererOptions::new(TargetFormats {
            colour: None,
            depth: Some(DepthTarget {
                format: DEPTHS,
                direction: DepthDirection::Forward,
            }),
            samples: 1,
        })
    };
    Renderer::new(&gpu.device, options).expect("invariant: the options go together")
}

/// Where the corners of a directional light's picture fall on the ground, in the camera's clip space.
fn corners(
    view: &View,
    camera: &Camera,
    (to_light, up, lowest): (DVec3, DVec3, f64),
) -> [[f32; 4]; 4] {
    let world_from_light = view.clip_from_world.inverse();
    // Depth does not matter.
    let clip_from_world: DMat4 = camera.clip_from_object(1.0, 2.0);
    let signs = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    signs.map(|(x, y)| {
        let point = world_from_light.project_point3(DVec3::new(x, y, 0.5));
        let fallen = point - to_light * ((point.dot(up) - lowest) / to_light.dot(up));
        let clip: DVec4 = clip_from_world * fallen.extend(1.0);
        clip.as_vec4().to_array()
    })
}
