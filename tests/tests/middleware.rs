//! The renderer in a pass of the caller's: stencil against coverage function against a fill on the processor, in the formats and cameras
//! that callers have.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DMat4, DQuat, DVec2, DVec3};
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, ColourImage, CoverageRule, Loop, Mask};
use silmap_gpu::{Gpu, wgpu};
use silmap_map::{Asset, MapReader, Method};
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, Instance, LoadedAsset, Outline, Renderer, RendererOptions,
    SpaceLoops, Transform, View,
};
use silmap_tests::dense_maps::dense;
use silmap_tests::pass::{COLOUR, drawn, formats, picture, view_of};
use silmap_tests::{device, scene, tolerance};

const SIDE_PX: u32 = 160;
const STENCIL: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The hand-made asset, with depths.
fn asset(gpu: &Gpu) -> Asset {
    let mut asset = scene::asset(gpu);
    (asset.map, _) = dense(&scene::model(), 96, 256, 0.5, CoverageRule::Center);
    asset
}

fn renderer(gpu: &Gpu, change: impl FnOnce(&mut RendererOptions)) -> Renderer {
    let target = formats(COLOUR, STENCIL, DepthDirection::Forward, 1);
    let mut options = RendererOptions {
        antialias: Antialias::Samples,
        reuse_error_px: 0.0,
        ..RendererOptions::new(target)
    };
    change(&mut options);
    Renderer::new(&gpu.device, options).unwrap()
}

fn by_coverage(options: &mut RendererOptions) {
    options.clip = ClipBy::Coverage;
    if let Some(depth) = &mut options.formats.depth {
        depth.format = DEPTH;
    }
}

fn draw(
    gpu: &Gpu,
    renderer: &mut Renderer,
    view: &View,
    instances: &[Instance<'_>],
) -> ColourImage {
    renderer
        .prepare(&gpu.device, &gpu.queue, view, instances)
        .unwrap();
    let picture = drawn(gpu, renderer, view.size_px);
    gpu.check().unwrap();
    picture
}

fn mask(picture: &ColourImage) -> Mask {
    let mut mask = Mask::new(picture.width, picture.height);
    for (i, pixel) in (0..).zip(picture.rgba.chunks_exact(4)) {
        mask.set(i % picture.width, i / picture.width, pixel[3] > 127);
    }
    mask
}

/// Pixels that differ in some channel by more than the tolerance.
fn outliers(one: &ColourImage, two: &ColourImage, allowed: u8) -> usize {
    let pixels = one.rgba.chunks_exact(4).zip(two.rgba.chunks_exact(4));
    let differs = |(p, q): &(&[u8], &[u8])| (0..4).any(|c| p[c].abs_diff(q[c]) > allowed);
    pixels.filter(differs).count()
}

/// Eyes around the model, near and far.
fn cameras(count: u32) -> impl Iterator<Item = Camera> {
    let bounds = scene::model().bounds();
    (0..count).map(move |k| {
        let t = f64::from(k);
        let direction = DVec3::new((2.4 * t).cos(), (1.3 * t).sin(), (2.4 * t).sin());
        let distance = 1.7 + 0.9 * t % 7.0;
        let roomy = silmap_geometry::Bounds {
            radius: bounds.radius * 1.15,
            ..bounds
        };
        scene::camera(&roomy, direction, distance, SIDE_PX)
    })
}

struct Stage {
    gpu: Gpu,
    asset: Asset,
    loaded: LoadedAsset,
}

impl Stage {
    fn open() -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let asset = asset(&gpu);
        let loaded = renderer(&gpu, |_| {})
            .load(&gpu.device, &gpu.queue, &asset)
            .unwrap();
        Some(Self { gpu, asset, loaded })
    }

    fn instance(&self) -> Instance<'_> {
        Instance::new(&self.loaded, Transform::IDENTITY)
    }

    /// The outline that the asset has for a camera.
    fn outline(&self, camera: &Camera) -> Vec<Loop> {
        let mut reader = MapReader::new(&self.asset.map).unwrap();
        reader
            .interpolate(&self.asset.map, camera, Method::Tight.into())
            .unwrap();
        reader.simple_loops().to_loops()
    }
}

#[test]
fn stencil_and_coverage_fill_what_the_processor_fills() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let mut stencil = renderer(gpu, |_| {});
    let mut coverage = renderer(gpu, by_coverage);
    let mut worst_shift = usize::MAX;
    for camera in cameras(50) {
        let view = view_of(&camera, stage.asset.map.radius, DepthDirection::Forward);
        let whole = Instance {
            outline: Outline::Whole,
            ..stage.instance()
        };
        let hull = mask(&draw(gpu, &mut stencil, &view, &[whole]));
        let mut wanted = Mask::new(SIDE_PX, SIDE_PX);
        let outline = stage.outline(&camera);
        fill_even_odd(&outline, &mut wanted);
        wanted.intersect(&hull);
        let most = u64::from(tolerance::STENCIL_FILL.max_outliers());
        let by_stencil = draw(gpu, &mut stencil, &view, &[stage.instance()]);
        let by_coverage = draw(gpu, &mut coverage, &view, &[stage.instance()]);
        for picture in [&by_stencil, &by_coverage] {
            let off = mask(picture).count_different(&wanted);
            assert!(off <= most, "{off} pixels differ from {}", camera.eye);
        }
        let apart = outliers(&by_stencil, &by_coverage, 2);
        assert!(
            apart as u64 <= most,
            "{apart} pixels differ between the two"
        );
        // A quarter of a pixel aside, as a control.
        let shifted = outline
            .iter()
            .map(|l| l.iter().map(|p| p + DVec2::new(0.25, 0.0)).collect());
        let shifted: Vec<Loop> = shifted.collect();
        let mut moved = Mask::new(SIDE_PX, SIDE_PX);
        fill_even_odd(&shifted, &mut moved);
        moved.intersect(&hull);
        worst_shift = worst_shift.min(moved.count_different(&wanted) as usize);
    }
    assert!(
        worst_shift > tolerance::STENCIL_FILL.max_outliers() as usize,
        "a quarter of a pixel changes {worst_shift} pixels"
    );
}

/// What a target is made of, and how it is drawn to.
const TARGETS: &[(
    wgpu::TextureFormat,
    wgpu::TextureFormat,
    DepthDirection,
    u32,
)] = &[
    (COLOUR, STENCIL, DepthDirection::Forward, 1),
    (COLOUR, STENCIL, DepthDirection::Reversed, 1),
    (COLOUR, STENCIL, DepthDirection::Forward, 4),
    (COLOUR, STENCIL, DepthDirection::Reversed, 4),
    (
        wgpu::TextureFormat::Rgba8Unorm,
        STENCIL,
        DepthDirection::Forward,
        1,
    ),
    (
        wgpu::TextureFormat::Rgba8Unorm,
        STENCIL,
        DepthDirection::Reversed,
        4,
    ),
];

/// Instances that overlap, of different sizes, turned, one before the other.
fn crowd<'a>(stage: &'a Stage, radius: f64) -> Vec<Instance<'a>> {
    (0..12)
        .map(|k| {
            let t = f64::from(k);
            let turn = DQuat::from_euler(glam::EulerRot::YXZ, 1.1 * t, 0.7 * t, 0.2 * t);
            let place = DVec3::new((1.7 * t).sin(), (2.3 * t).cos(), (0.9 * t).sin());
            let scale = 0.25 + 0.03 * t;
            let transform = Transform::new(scale, turn, place * (0.8 * radius)).unwrap();
            Instance::new(&stage.loaded, transform)
        })
        .collect()
}

#[test]
fn stencil_and_coverage_draw_the_same_scene_on_every_target() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    let instances = crowd(&stage, radius);
    let mut backwards = instances.clone();
    backwards.reverse();
    for &(colour, depth, direction, samples) in TARGETS {
        let target = formats(colour, depth, direction, samples);
        let mut stencil = renderer(gpu, |options| options.formats = target);
        let mut coverage = renderer(gpu, |options| {
            options.formats = target;
            by_coverage(options);
        });
        for camera in cameras(3) {
            let view = view_of(&camera, radius, direction);
            let by_stencil = draw(gpu, &mut stencil, &view, &instances);
            let by_coverage = draw(gpu, &mut coverage, &view, &instances);
            let apart = outliers(&by_stencil, &by_coverage, 2);
            let most = 3 * tolerance::STENCIL_FILL.max_outliers() as usize;
            assert!(apart <= most, "{apart} pixels of {target:?}");
            // In any order.
            let reversed = draw(gpu, &mut stencil, &view, &backwards);
            assert_eq!(outliers(&reversed, &by_stencil, 2), 0, "{target:?}");
            assert!(mask(&by_stencil).count() > 500);
        }
    }
}

/// The picture of a target is the same in either encoding, and whichever way depth goes.
#[test]
fn formats_show_the_same() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    let instances = crowd(&stage, radius);
    let camera = cameras(2).last().unwrap();
    let draw_on = |colour, direction| {
        let target = formats(colour, STENCIL, direction, 1);
        let mut renderer = renderer(gpu, |options| options.formats = target);
        let view = view_of(&camera, radius, direction);
        draw(gpu, &mut renderer, &view, &instances)
    };
    let srgb = draw_on(COLOUR, DepthDirection::Forward);
    let reversed = draw_on(COLOUR, DepthDirection::Reversed);
    assert!(outliers(&srgb, &reversed, 1) <= 4);
    let linear = draw_on(wgpu::TextureFormat::Rgba8Unorm, DepthDirection::Forward);
    let encoded = |byte: u8| {
        let linear = f32::from(byte) / 255.0;
        (255.0 * silmap_geometry::lighting::srgb_from_linear(linear)).round() as u8
    };
    let same = linear.rgba.chunks_exact(4).zip(srgb.rgba.chunks_exact(4));
    let off = same
        .flat_map(|(l, s)| (0..3).map(|c| encoded(l[c]).abs_diff(s[c])))
        .filter(|&off| off > 14)
        .count();
    assert!(off <= 4, "{off} values differ");
}

/// A plane of the scene that cuts through the hull, drawn by the caller.
struct Plane {
    pipeline: wgpu::RenderPipeline,
}

impl Plane {
    /// At one depth, everywhere on the picture.
    fn new(gpu: &Gpu, target: &silmap_runtime::TargetFormats, depth: f64) -> Self {
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

/// Loops that are given are what clips: with a hole, in several pieces, overlapping.
#[test]
fn given_loops_clip() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let camera = cameras(1).last().unwrap();
    let map = &stage.asset.map;
    let view = view_of(&camera, map.radius, DepthDirection::Forward);
    let depth = camera.depth(map.center);
    let square = |x: f64, y: f64, half: f64, is_hole: bool| -> Loop {
        let mut corners: Loop = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(u, v)| DVec2::new(x + u * half, y + v * half))
            .to_vec();
        if is_hole {
            corners.reverse();
        }
        corners
    };
    let loops = [
        square(60.3, 70.2, 31.4, false),
        square(60.3, 70.2, 12.1, true),
        square(110.7, 90.4, 22.3, false),
        square(96.2, 97.6, 17.4, false),
    ];
    let space = SpaceLoops {
        loops: loops
            .iter()
            .map(|l| {
                l.iter()
                    .map(|&p| camera.object_from_image(p, depth))
                    .collect()
            })
            .collect(),
    };
    let mut wanted = Mask::new(SIDE_PX, SIDE_PX);
    for l in [0, 2, 3] {
        let mut one = Mask::new(SIDE_PX, SIDE_PX);
        fill_even_odd(if l == 0 { &loops[..2] } else { &loops[l..=l] }, &mut one);
        for (x, y) in (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y))) {
            if one.get(x.into(), y.into()) {
                wanted.set(x, y, true);
            }
        }
    }
    for change in [(|_| {}) as fn(&mut RendererOptions), by_coverage] {
        let mut renderer = renderer(gpu, change);
        let whole = Instance {
            outline: Outline::Whole,
            ..stage.instance()
        };
        let hull = mask(&draw(gpu, &mut renderer, &view, &[whole]));
        let mut wanted = wanted.clone();
        wanted.intersect(&hull);
        let given = Instance {
            outline: Outline::Given(&space),
            ..stage.instance()
        };
        let found = mask(&draw(gpu, &mut renderer, &view, &[given]));
        let off = found.count_different(&wanted);
        assert!(off <= 6, "{off} pixels");
        assert!(wanted.count() > 800);
    }
}

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

/// Parallel projection: the outline is that of an eye far away.
#[test]
fn a_parallel_view_sees_the_outline_of_a_far_eye() {
    let Some(stage) = Stage::open() else { return };
    let gpu = &stage.gpu;
    let radius = stage.asset.map.radius;
    let bounds = silmap_geometry::Bounds {
        radius: radius * 1.15,
        ..scene::model().bounds()
    };
    let far = scene::camera(&bounds, DVec3::new(0.5, 0.8, 1.0), 5e3, SIDE_PX);
    let across = 1.02 * 1.15 * radius;
    let axes = DMat4::from_cols(
        (far.right / across).extend(0.0),
        (far.up / across).extend(0.0),
        (far.forward / (4.0 * radius)).extend(0.0),
        DVec3::ZERO.extend(1.0),
    )
    .transpose();
    let view = View {
        clip_from_world: DMat4::from_translation(DVec3::new(0.0, 0.0, 0.5)) * axes,
        size_px: (SIDE_PX, SIDE_PX),
    };
    for change in [(|_| {}) as fn(&mut RendererOptions), by_coverage] {
        let mut renderer = renderer(gpu, change);
        let found = mask(&draw(gpu, &mut renderer, &view, &[stage.instance()]));
        let whole = Instance {
            outline: Outline::Whole,
            ..stage.instance()
        };
        let hull = mask(&draw(gpu, &mut renderer, &view, &[whole]));
        let mut wanted = Mask::new(SIDE_PX, SIDE_PX);
        fill_even_odd(stage.outline(&far), &mut wanted);
        wanted.intersect(&hull);
        let off = found.count_different(&wanted);
        assert!(off <= 60, "{off} of {} pixels", wanted.count());
        assert!(wanted.count() > 4000);
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
