//! A pass of the caller's, as a program that uses the renderer has it: colour, depth, samples, and pictures read back.

use glam::DMat4;
use silmap_geometry::{Camera, ColourImage};
use silmap_gpu::{Gpu, Readback, wgpu};
use silmap_runtime::{DepthDirection, DepthTarget, Renderer, TargetFormats, View};

/// The format that pictures are read back in.
pub const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Formats with colour and a depth buffer.
#[must_use]
pub fn formats(
    colour: wgpu::TextureFormat,
    depth: wgpu::TextureFormat,
    direction: DepthDirection,
    samples: u32,
) -> TargetFormats {
    TargetFormats {
        colour: Some(colour),
        depth: Some(DepthTarget {
            format: depth,
            direction,
        }),
        samples,
    }
}

/// A view from a camera that looks at the origin, about which something of a radius lies.
#[must_use]
pub fn view_of(camera: &Camera, radius: f64, direction: DepthDirection) -> View {
    let distance = camera.eye.length();
    let (near, far) = (
        (distance - 2.0 * radius).max(0.05 * distance),
        distance + 2.0 * radius,
    );
    let mut matrix = camera.clip_from_object(near, far);
    if direction == DepthDirection::Reversed {
        // 1 − depth.
        let flip = DMat4::from_cols_array(&[
            1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0,
        ]);
        matrix = flip * matrix;
    }
    View {
        clip_from_world: matrix,
        size_px: (camera.width_px, camera.height_px),
    }
}

/// Draws in one pass over a background and returns the pixels, in the target's format of four bytes.
///
/// # Panics
/// When the device fails.
#[must_use]
pub fn picture(
    gpu: &Gpu,
    formats: &TargetFormats,
    (width, height): (u32, u32),
    background: wgpu::Color,
    draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
) -> ColourImage {
    let colour = formats.colour.expect("the picture has colours");
    let texture = |label, format, sample_count, usage| {
        gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let picture = texture(
        "picture",
        colour,
        1,
        attached | wgpu::TextureUsages::COPY_SRC,
    );
    let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
    let resolved = view(&picture);
    let sampled =
        (formats.samples > 1).then(|| view(&texture("samples", colour, formats.samples, attached)));
    let depth = formats.depth.map(|d| {
        let texture = texture("depth", d.format, formats.samples, attached);
        (view(&texture), d)
    });
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: sampled.as_ref().unwrap_or(&resolved),
                depth_slice: None,
                resolve_target: sampled.as_ref().map(|_| &resolved),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(background),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: depth.as_ref().map(|(view, target)| {
                wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(match target.direction {
                            DepthDirection::Forward => 1.0,
                            DepthDirection::Reversed => 0.0,
                        }),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: (target.format.has_stencil_aspect()).then_some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0),
                        store: wgpu::StoreOp::Discard,
                    }),
                }
            }),
            ..Default::default()
        });
        draw(&mut pass);
    }
    let readback = Readback::new(gpu, (width, height), colour).expect("it can be read back");
    let (rgba, _) = readback
        .start(gpu, encoder, &picture)
        .wait(gpu)
        .expect("the device draws");
    ColourImage {
        width,
        height,
        rgba,
    }
}

/// What a renderer has prepared, over nothing.
///
/// # Panics
/// When the device fails.
#[must_use]
pub fn drawn(gpu: &Gpu, renderer: &Renderer, size_px: (u32, u32)) -> ColourImage {
    let formats = renderer.options().formats;
    picture(gpu, &formats, size_px, wgpu::Color::TRANSPARENT, |pass| {
        renderer.draw(pass);
    })
}
