//! The renderer in a pass of the caller's: stencil against coverage function against a fill on the processor, in the formats and cameras
//! that callers have.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DMat4, DQuat, DVec2, DVec3};
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Loop, Mask};
use silmap_gpu::wgpu;
use silmap_runtime::{
    DepthDirection, Instance, Outline, RendererOptions, SpaceLoops, Transform, View,
};
use silmap_tests::instances::{
    SIDE_PX, STENCIL, Stage, by_coverage, cameras, draw, mask, outliers, renderer,
};
use silmap_tests::pass::{COLOUR, formats, view_of};
use silmap_tests::{scene, tolerance};

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
