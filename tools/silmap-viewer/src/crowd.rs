//! Many instances of the asset in one pass, as a host of `silmap-runtime` draws them.

use glam::{DQuat, DVec3};
use silmap_geometry::Camera;
use silmap_gpu::Gpu;
use silmap_map::{Asset, BoundingSphere, Method};
use silmap_runtime::{
    DepthDirection, DepthTarget, FrameStats, Instance, LoadedAsset, Paint, Renderer,
    RendererOptions, TargetFormats, Transform, View,
};
use silmap_study::{Background, PictureOptions, RenderError};

const SAMPLES: u32 = 4;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// The distance between neighbours, in radii of a model.
const SPACING_REL: f64 = 2.1;

/// The near plane, as a share of the radius.
const NEAR_REL: f64 = 0.05;

/// A frame of many instances.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CrowdParams {
    pub(crate) camera: Camera,
    pub(crate) count: u32,
    /// Across the plane that they stand on.
    pub(crate) upwards: DVec3,
    pub(crate) method: Method,
    pub(crate) paint: Paint,
    pub(crate) background: Background,
    /// The direction to a light that shines instead of the studio's.
    pub(crate) light: Option<DVec3>,
}

/// The sphere about so many instances of a model, the first of which is in its place.
#[must_use]
pub(crate) fn sphere_of(model: BoundingSphere, count: u32) -> BoundingSphere {
    let reach = place(model.radius, count.saturating_sub(1)).length();
    BoundingSphere {
        center: model.center,
        radius: model.radius + reach,
    }
}

/// From the first instance to number `k`: on a spiral in the plane y = 0, as the seeds of a sunflower.
fn place(radius: f64, k: u32) -> DVec3 {
    let angle = f64::from(k) * 2.399_963;
    let distance = SPACING_REL * radius * f64::from(k).sqrt();
    DVec3::new(distance * angle.sin(), 0.0, distance * angle.cos())
}

/// What is kept from frame to frame.
#[derive(Debug)]
pub(crate) struct Crowd {
    renderer: Renderer,
    method: Method,
    asset: LoadedAsset,
    transforms: Vec<Transform>,
    upwards: DVec3,
    samples: Option<((u32, u32), [wgpu::TextureView; 2])>,
    stats: FrameStats,
}

impl Crowd {
    /// Loads an asset, to be drawn by a method.
    pub(crate) fn new(
        gpu: &Gpu,
        options: &PictureOptions,
        (method, asset): (Method, &Asset),
    ) -> Result<Self, RenderError> {
        let formats = TargetFormats {
            colour: Some(options.target_format),
            depth: Some(DepthTarget {
                format: DEPTH,
                direction: DepthDirection::Forward,
            }),
            samples: SAMPLES,
        };
        let options = RendererOptions {
            method: Some(method),
            relight: options.relight,
            ..RendererOptions::new(formats)
        };
        let renderer =
            Renderer::new(&gpu.device, options).expect("invariant: the options go together");
        let asset = renderer.load(&gpu.device, &gpu.queue, asset)?;
        Ok(Self {
            renderer,
            method,
            asset,
            transforms: Vec::new(),
            upwards: DVec3::Y,
            samples: None,
            stats: FrameStats::default(),
        })
    }

    /// The method that it draws by.
    pub(crate) fn method(&self) -> Method {
        self.method
    }

    /// What the frame that was drawn last took.
    pub(crate) fn stats(&self) -> FrameStats {
        self.stats
    }

    /// Puts as many up as are asked for.
    fn stand(&mut self, count: u32, upwards: DVec3) {
        let bounds = self.asset.model_bounds();
        if self.upwards != upwards {
            self.upwards = upwards;
            self.transforms.clear();
        }
        let basis = DQuat::from_rotation_arc(DVec3::Y, upwards);
        let had = self.transforms.len() as u32;
        self.transforms.truncate(count as usize);
        for k in had..count {
            // All but the first turned, each another way.
            let turn = DQuat::from_axis_angle(upwards, f64::from(k) * 1.7);
            let to = basis * place(bounds.radius, k);
            let stand = bounds.center - turn * bounds.center;
            let transform = Transform::new(1.0, turn, stand + to);
            self.transforms.extend(transform.ok());
        }
    }

    /// Draws a frame.
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        params: &CrowdParams,
    ) -> Result<(), RenderError> {
        self.stand(params.count, params.upwards);
        let camera = &params.camera;
        let size_px = (camera.width_px, camera.height_px);
        let model = self.asset.bounds();
        let all = sphere_of(model, params.count);
        let distance = camera.eye.distance(all.center);
        let near = (distance - all.radius).max(NEAR_REL * model.radius);
        let far = distance + all.radius;
        let view = View {
            clip_from_world: camera.clip_from_object(near, far),
            size_px,
        };
        let instances: Vec<_> = (self.transforms.iter())
            .map(|&transform| Instance {
                paint: params.paint,
                light: params.light,
                ..Instance::new(&self.asset, transform)
            })
            .collect();
        self.stats = (self.renderer).prepare(&gpu.device, &gpu.queue, &view, &instances)?;
        let is_there = self
            .samples
            .as_ref()
            .is_some_and(|(size, _)| *size == size_px);
        if !is_there {
            let colour = self.renderer.options().formats.colour;
            let formats = [colour.unwrap_or(wgpu::TextureFormat::Rgba8UnormSrgb), DEPTH];
            let views = formats.map(|format| samples(&gpu.device, size_px, format));
            self.samples = Some((size_px, views));
        }
        let Some((_, [colour, depth])) = &self.samples else {
            return Ok(());
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("instances"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: colour,
                depth_slice: None,
                resolve_target: Some(target),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(params.background.clear_colour()),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
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
        self.renderer.draw(&mut pass);
        drop(pass);
        gpu.check()?;
        Ok(())
    }
}

fn samples(
    device: &wgpu::Device,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("samples"),
        size: wgpu::Extent3d {
            width,
            height,
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
}
