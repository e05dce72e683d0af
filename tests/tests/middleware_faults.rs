//! What a renderer cannot draw: cameras that are none, textures over the device's limits, a device that is gone.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DQuat;
use silmap_geometry::ColourImage;
use silmap_gpu::{Gpu, wgpu};
use silmap_runtime::{DepthDirection, Instance, Renderer, RendererOptions, Transform, View};
use silmap_tests::instances::{
    SIDE_PX, STENCIL, Stage, by_coverage, cameras, draw, mask, renderer,
};
use silmap_tests::pass::{COLOUR, drawn, formats, view_of};
use silmap_tests::{device, scene};

/// What cannot be drawn draws nothing, and says so where it is the camera.
#[test]
fn what_cannot_be_drawn_draws_nothing() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    let camera = cameras(1).last().unwrap();
    let view = view_of(&camera, radius, DepthDirection::Forward);
    for change in [(|_| {}) as fn(&mut RendererOptions), by_coverage] {
        let mut renderer = renderer(gpu, change);
        assert_eq!(mask(&draw(gpu, &mut renderer, &view, &[])).count(), 0);
        let behind = Transform::new(1.0, DQuat::IDENTITY, camera.eye * 3.0).unwrap();
        let instance = Instance::new(&stage.loaded, behind);
        let stats = renderer
            .prepare(&gpu.device, &gpu.queue, &view, &[instance])
            .unwrap();
        assert_eq!((stats.drawn, stats.out_of_view), (0, 1));
        let broken = View {
            clip_from_world: view.clip_from_world * f64::NAN,
            ..view
        };
        let refused = renderer.prepare(&gpu.device, &gpu.queue, &broken, &[stage.instance()]);
        assert!(refused.is_err());
        assert_eq!(mask(&drawn(gpu, &renderer, view.size_px)).count(), 0);
        let empty = View {
            size_px: (0, 0),
            ..view
        };
        let stats = renderer
            .prepare(&gpu.device, &gpu.queue, &empty, &[stage.instance()])
            .unwrap();
        assert_eq!(stats.drawn, 0);
        // Within the model's bounds the hull is drawn whole.
        let inside = Transform::new(1.0, DQuat::IDENTITY, camera.eye * 0.9).unwrap();
        let instance = Instance::new(&stage.loaded, inside);
        let stats = renderer
            .prepare(&gpu.device, &gpu.queue, &view, &[instance])
            .unwrap();
        assert_eq!((stats.drawn, stats.whole), (1, 1));
        let _ = drawn(gpu, &renderer, view.size_px);
        gpu.check().unwrap();
    }
}

/// A device whose textures are no larger than this a side.
fn small_device(gpu: &Gpu, side_px: u32) -> (wgpu::Device, wgpu::Queue) {
    let described = wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits {
            max_texture_dimension_2d: side_px,
            ..wgpu::Limits::downlevel_webgl2_defaults()
        },
        ..Default::default()
    };
    let waiting = gpu.adapter.request_device(&described);
    pollster::block_on(waiting).unwrap()
}

#[test]
fn textures_over_the_limit_are_refused() {
    let Some(stage) = Stage::open() else { return };
    let options = || RendererOptions::new(formats(COLOUR, STENCIL, DepthDirection::Forward, 1));
    let (device, _) = small_device(&stage.gpu, 512);
    let refused = Renderer::new(&device, options()).unwrap_err().to_string();
    assert!(
        refused.contains("512") && refused.contains("1024"),
        "{refused}"
    );
    let (device, queue) = small_device(&stage.gpu, 1024);
    let renderer = Renderer::new(&device, options()).unwrap();
    assert!(renderer.load(&device, &queue, &stage.asset).is_ok());
    let mut large = stage.asset.clone();
    let picture = ColourImage {
        width: 1100,
        height: 2,
        rgba: vec![255; 4 * 1100 * 2],
    };
    for view in &mut large.textures.views {
        view.image = scene::png(&picture);
    }
    let refused = renderer
        .load(&device, &queue, &large)
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("1100") && refused.contains("1024"),
        "{refused}"
    );
    large.textures.views[1].image = stage.asset.textures.views[1].image.clone();
    let refused = renderer
        .load(&device, &queue, &large)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("texture view 1"), "{refused}");
    large.textures.views[0].image.bytes.truncate(20);
    let refused = renderer
        .load(&device, &queue, &large)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("texture 0"), "{refused}");
}

/// Nothing panics on a device that is gone; its owner hears of it.
#[test]
fn a_lost_device_is_no_panic() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let mut renderer = renderer(gpu, |_| {});
    let camera = cameras(1).last().unwrap();
    let view = view_of(&camera, stage.asset.map.radius, DepthDirection::Forward);
    let target = device::target(gpu, COLOUR, SIDE_PX);
    gpu.device.destroy();
    for _ in 0..2 {
        renderer
            .prepare(&gpu.device, &gpu.queue, &view, &[stage.instance()])
            .unwrap();
        let shown = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &shown,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations::default(),
                })],
                ..Default::default()
            });
            renderer.draw(&mut pass);
        }
        gpu.queue.submit([encoder.finish()]);
    }
    let heard = silmap_gpu::wait_for(gpu, None);
    assert!(heard.is_err() || gpu.check().is_err());
}
