//! How far what is drawn of an asset lies from the model's surface, pixel by pixel, along the eye's direction.
//!
//! The model's depths are rasterised on the processor, the asset's are what the renderer leaves in a depth buffer: neither knows of the
//! other, nor of depths that are stored in the asset.

use glam::DVec2;
use serde::Serialize;
use silmap_geometry::raster::ImageTriangle;
use silmap_geometry::{Camera, TriangleMesh, Watch};
use silmap_gpu::{Gpu, Readback, wgpu};
use silmap_map::Asset;
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, DepthTarget, Instance, Paint, Renderer, RendererOptions,
    TargetFormats, Transform, View,
};

use crate::MeasureError;
use crate::evaluate::{EvaluateParams, Place, viewpoints};

/// From here on a depth counts as off, in bounding radii.
pub const OFF_REL: f64 = 0.02;

/// Depths of an asset beside those of the model, where both are seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DepthErrors {
    /// Mean of their differences, in bounding radii.
    pub mean: f64,
    /// Share of pixels where they differ by more than [`OFF_REL`].
    pub off: f64,
    /// Pixels that were compared.
    pub pixels: u64,
}

/// Room before and behind the hull, in its radii.
const ROOM: f64 = 1.01;

/// Compares depths at random viewpoints on the sphere of the captured views, in square pictures of that side.
///
/// # Errors
/// When interrupted, or the asset cannot be drawn.
pub fn depth_errors(
    gpu: &Gpu,
    asset: &Asset,
    model: &TriangleMesh,
    (paint, eyes, seed, side_px): (Paint, u32, u64, u32),
    watch: &Watch<'_>,
) -> Result<DepthErrors, MeasureError> {
    let map = &asset.map;
    let params = EvaluateParams {
        viewpoints: eyes,
        seed,
        place: Place::Sphere,
        ..EvaluateParams::default()
    };
    let mut drawer = Drawer::new(gpu, asset, side_px)?;
    let (mut sum, mut off, mut pixels) = (0.0, 0_u64, 0_u64);
    for eye in viewpoints(map, &params)? {
        watch.check()?;
        let camera = Camera::fit_sphere(eye, map.center, map.radius, None, (side_px, side_px))?;
        let drawn = drawer.depths(&camera, paint)?;
        for (ours, theirs) in drawn.into_iter().zip(depths_of_mesh(&camera, model)) {
            if let (Some(ours), Some(theirs)) = (ours, theirs) {
                let error = (ours - theirs).abs() / map.radius;
                sum += error;
                off += u64::from(error > OFF_REL);
                pixels += 1;
            }
        }
    }
    let share = 1.0 / pixels.max(1) as f64;
    Ok(DepthErrors {
        mean: sum * share,
        off: off as f64 * share,
        pixels,
    })
}

/// Depths of a mesh's nearest faces at the pixels' centres.
fn depths_of_mesh(camera: &Camera, mesh: &TriangleMesh) -> Vec<Option<f64>> {
    let pixels = camera.width_px as usize * camera.height_px as usize;
    let mut inverse = vec![0.0_f64; pixels];
    for face in 0..mesh.faces.len() {
        if let Some(triangle) = ImageTriangle::project(camera, mesh.corners(face)) {
            triangle.visit(camera, |sample| {
                let nearest = &mut inverse[sample.pixel];
                *nearest = nearest.max(sample.inverse_depth);
            });
        }
    }
    let depth = |inverse: f64| (inverse > 0.0).then(|| 1.0 / inverse);
    inverse.into_iter().map(depth).collect()
}

/// Draws an asset as a program does that uses the renderer, and reads depths back.
struct Drawer<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    asset: silmap_runtime::LoadedAsset,
    side_px: u32,
}

const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

impl<'a> Drawer<'a> {
    fn new(gpu: &'a Gpu, asset: &Asset, side_px: u32) -> Result<Self, MeasureError> {
        let options = RendererOptions {
            clip: ClipBy::Coverage,
            antialias: Antialias::Samples,
            reuse_error_px: 0.0,
            ..RendererOptions::new(TargetFormats {
                colour: Some(COLOUR),
                depth: Some(DepthTarget {
                    format: DEPTH,
                    direction: DepthDirection::Forward,
                }),
                samples: 1,
            })
        };
        let renderer = Renderer::new(&gpu.device, options).map_err(MeasureError::from)?;
        let asset = renderer.load(&gpu.device, &gpu.queue, asset)?;
        Ok(Self {
            gpu,
            renderer,
            asset,
            side_px,
        })
    }

    fn depths(&mut self, camera: &Camera, paint: Paint) -> Result<Vec<Option<f64>>, MeasureError> {
        let gpu = self.gpu;
        let sphere = self.asset.bounds();
        let middle = camera.depth(sphere.center);
        let (near, far) = (middle - ROOM * sphere.radius, middle + ROOM * sphere.radius);
        let view = View {
            clip_from_world: camera.clip_from_object(near.max(1e-3 * far), far),
            size_px: (self.side_px, self.side_px),
        };
        let instance = Instance {
            paint,
            ..Instance::new(&self.asset, Transform::IDENTITY)
        };
        (self.renderer).prepare(&gpu.device, &gpu.queue, &view, &[instance])?;
        let texture = |label, format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: self.side_px,
                    height: self.side_px,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let colour = texture("colours", COLOUR, wgpu::TextureUsages::empty());
        let depth = texture("depths", DEPTH, wgpu::TextureUsages::COPY_SRC);
        let view_of = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder =
            (gpu.device).create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depths"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view_of(&colour),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view_of(&depth),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.renderer.draw(&mut pass);
        drop(pass);
        let readback = Readback::new(gpu, (self.side_px, self.side_px), DEPTH)?;
        let (bytes, _) = readback.start(gpu, encoder, &depth).wait(gpu)?;
        let object_from_clip = view.clip_from_world.inverse();
        let side = self.side_px as usize;
        let depth = |(k, bytes): (usize, &[u8; 4])| {
            let z = f32::from_le_bytes(*bytes);
            let place = DVec2::new((k % side) as f64 + 0.5, (k / side) as f64 + 0.5) / side as f64;
            let seen = place * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
            let point = object_from_clip.project_point3(seen.extend(z.into()));
            (z < 1.0).then(|| camera.depth(point))
        };
        Ok(bytes
            .as_chunks::<4>()
            .0
            .iter()
            .enumerate()
            .map(depth)
            .collect())
    }
}
