//! Instances among what else a caller draws, and among each other: depth meets depth, in any order.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DQuat, DVec3};
use silmap_gpu::{Gpu, wgpu};
use silmap_runtime::{
    Antialias, DepthDirection, Instance, RendererOptions, TargetFormats, Transform,
};
use silmap_tests::instances::{
    STENCIL, Stage, by_coverage, cameras, draw, mask, outliers, renderer,
};
use silmap_tests::pass::{COLOUR, drawn, formats, picture, view_of};

/// A plane of the scene that cuts through the hull, drawn by the caller.
struct Plane {
    pipeline: wgpu::RenderPipeline,
}

impl Plane {
    /// At one depth, everywhere on the picture.
    fn new(gpu: &Gpu, target: &TargetFormats, depth: f64) -> Self {
        let text = format!(
            "@vertex fn vs_main(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
                return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), {depth:?}, 1.0);
            }}
            @fragment fn fs_main() -> @location(0) vec4f {{ return vec4f(0.0, 0.0, 1.0, 1.0); }}"
        );
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
        let own = target.depth.unwrap();
        let pipeline = gpu
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: None,
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: None,
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: own.format,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(match own.direction {
                        DepthDirection::Forward => wgpu::CompareFunction::Less,
                        DepthDirection::Reversed => wgpu::CompareFunction::Greater,
                    }),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: target.samples,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: None,
                    compilation_options: Default::default(),
                    targets: &[Some(target.colour.unwrap().into())],
                }),
                multiview_mask: None,
                cache: None,
            });
        Self { pipeline }
    }
}

/// A plane through the middle covers what is behind it and nothing before it, drawn before the instances or after them.
#[test]
fn depth_meets_that_of_the_scene() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    for direction in [DepthDirection::Forward, DepthDirection::Reversed] {
        for is_stencil in [true, false] {
            let target = formats(COLOUR, STENCIL, direction, 1);
            let mut renderer = renderer(gpu, |options| {
                options.formats = target;
                if !is_stencil {
                    by_coverage(options);
                    options.formats.depth = target.depth;
                }
            });
            let camera = cameras(4).last().unwrap();
            let view = view_of(&camera, radius, direction);
            // The middle's depth.
            let middle = view.clip_from_world.project_point3(DVec3::ZERO);
            let plane = Plane::new(gpu, &target, middle.z);
            let near = camera.eye.normalize_or_zero() * (1.3 * radius);
            let place = |p: DVec3| Transform::new(0.5, DQuat::IDENTITY, p).unwrap();
            let instance = |transform| Instance::new(&stage.loaded, transform);
            let clear = wgpu::Color::TRANSPARENT;
            let mut seen = |instances: &[Instance<'_>], is_first: bool| {
                renderer
                    .prepare(&gpu.device, &gpu.queue, &view, instances)
                    .unwrap();
                let picture = picture(gpu, &target, view.size_px, clear, |pass| {
                    if is_first {
                        pass.set_pipeline(&plane.pipeline);
                        pass.draw(0..3, 0..1);
                    }
                    renderer.draw(pass);
                    if !is_first {
                        pass.set_pipeline(&plane.pipeline);
                        pass.draw(0..3, 0..1);
                    }
                });
                gpu.check().unwrap();
                let pixels = picture.rgba.chunks_exact(4);
                let own = pixels.filter(|p| *p != [0, 0, 255, 255]).count();
                (picture, own)
            };
            let (front, n_front) = seen(&[instance(place(near))], true);
            let (_, n_behind) = seen(&[instance(place(-near))], true);
            let (cut, n_cut) = seen(&[instance(Transform::IDENTITY)], true);
            assert!(n_front > 200 && n_behind == 0, "{n_front}, {n_behind}");
            let (after, _) = seen(&[instance(Transform::IDENTITY)], false);
            assert!(
                outliers(&cut, &after, 0) <= 2,
                "the order makes a difference"
            );
            let (front_after, _) = seen(&[instance(place(near))], false);
            assert!(outliers(&front, &front_after, 0) <= 2);
            // Half of it, more or less.
            renderer
                .prepare(&gpu.device, &gpu.queue, &view, &[stage.instance()])
                .unwrap();
            let all = mask(&drawn(gpu, &renderer, view.size_px)).count() as usize;
            assert!(n_cut > all / 10 && n_cut < all * 9 / 10, "{n_cut} of {all}");
        }
    }
}

/// The near one of two hides the far one, in whatever order they are given.
#[test]
fn instances_hide_each_other_as_they_stand() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    let camera = cameras(1).last().unwrap();
    let view = view_of(&camera, radius, DepthDirection::Forward);
    let towards = camera.eye.normalize_or_zero() * (0.9 * radius);
    let aside = camera.right * (0.3 * radius);
    let at = |p: DVec3| Transform::new(0.6, DQuat::IDENTITY, p).unwrap();
    let near = Instance {
        paint: silmap_runtime::Paint::Lit,
        ..Instance::new(&stage.loaded, at(towards - aside))
    };
    let far = Instance::new(&stage.loaded, at(-towards + aside));
    for change in [(|_| {}) as fn(&mut RendererOptions), by_coverage, |o| {
        by_coverage(o);
        o.antialias = Antialias::Soft;
    }] {
        let mut renderer = renderer(gpu, change);
        let alone = draw(gpu, &mut renderer, &view, &[near]);
        let both = [[near, far], [far, near]].map(|i| draw(gpu, &mut renderer, &view, &i));
        assert_eq!(outliers(&both[0], &both[1], 0), 0);
        // Where the near one is, it is what is seen.
        let pixels = alone.rgba.chunks_exact(4).zip(both[0].rgba.chunks_exact(4));
        let hidden = pixels.filter(|(a, b)| a[3] == 255 && a != b).count();
        assert_eq!(hidden, 0);
        assert!(mask(&both[0]).count() > mask(&alone).count() + 100);
    }
}
