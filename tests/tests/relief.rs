//! Relief: the model's surface within the hull is nearer to the model than the hull is, in colour and in depth, however it is clipped.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::OnceLock;

use silmap_geometry::{Camera, ClosedMesh, Watch};
use silmap_gpu::Gpu;
use silmap_map::Asset;
use silmap_measure::{TextureErrorParams, colour_errors, depth_errors};
use silmap_models as models;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::pipeline::{BuildParams, build};
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, Instance, LoadedAsset, Paint, ReliefQuality, Renderer,
    Transform,
};
use silmap_tests::instances::{STENCIL, by_coverage, draw, outliers, renderer};
use silmap_tests::pass::{COLOUR, formats, view_of};
use silmap_tests::{device, tolerance};

/// Side of the pictures.
const SIDE_PX: u32 = 192;

/// A creature with arms before its body, and its asset.
fn creature() -> &'static (ClosedMesh, Asset) {
    static CREATURE: OnceLock<(ClosedMesh, Asset)> = OnceLock::new();
    CREATURE.get_or_init(|| {
        let mesh = ClosedMesh::try_from(models::organic(6000)).unwrap();
        let mut params = BuildParams {
            views: 96,
            resolution_px: 128,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        params.map.keep = 48;
        params.hull.target_faces = 300;
        params.textures.size_px = 192;
        params.textures.relief_px = 192;
        params.textures.candidates = 60;
        let (asset, _) = build(&mesh, "creature", &params, &Watch::silent()).unwrap();
        (mesh, asset)
    })
}

fn camera(asset: &Asset, k: u32) -> Camera {
    let t = f64::from(k);
    let direction = glam::DVec3::new((2.3 * t).cos(), 0.4 * (1.7 * t).sin(), (2.3 * t).sin());
    let eye = asset.map.center + direction.normalize_or_zero() * 3.0 * asset.map.radius;
    let size = (SIDE_PX, SIDE_PX);
    Camera::fit_sphere(eye, asset.map.center, asset.map.radius, None, size).unwrap()
}

/// What is wrong with depths that belong to other views.
fn with_depths_of_other_views(asset: &Asset) -> Asset {
    let mut wrong = asset.clone();
    wrong.textures.relief.as_mut().unwrap().views.rotate_left(1);
    wrong
}

#[test]
fn colours_are_nearer_to_the_model_than_those_on_the_hull() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (mesh, asset) = creature();
    let params = TextureErrorParams {
        viewpoints: 5,
        seed: 3,
        size_px: SIDE_PX,
    };
    let errors =
        |asset: &Asset| colour_errors(&gpu, asset, mesh.mesh(), &params, &Watch::silent()).unwrap();
    let right = errors(asset);
    let (relief, hull) = (right["relief"], right["blended"]);
    eprintln!("relief {relief:?}, hull {hull:?}");
    assert!(relief.largest_channel < 0.75 * hull.largest_channel);
    let wrong = errors(&with_depths_of_other_views(asset))["relief"];
    assert!(
        wrong.largest_channel > 1.5 * relief.largest_channel,
        "{wrong:?}"
    );
}

#[test]
fn depths_are_those_of_the_model() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (mesh, asset) = creature();
    let errors = |asset: &Asset, paint| {
        let params = (paint, 5, 3, SIDE_PX);
        depth_errors(&gpu, asset, mesh.mesh(), params, &Watch::silent()).unwrap()
    };
    let relief = errors(asset, Paint::Relief);
    let hull = errors(asset, Paint::Blended);
    eprintln!("relief {relief:?}, hull {hull:?}");
    assert!(relief.mean < 0.5 * hull.mean && relief.off < 0.5 * hull.off);
    // What lies a twentieth of a radius deeper is found there.
    let mut deeper = asset.clone();
    for view in &mut deeper.textures.relief.as_mut().unwrap().views {
        view.near += 0.05 * asset.map.radius;
        view.far += 0.05 * asset.map.radius;
    }
    let deeper = errors(&deeper, Paint::Relief);
    assert!(deeper.off > 0.8 && deeper.mean > 0.04, "{deeper:?}");
}

/// Renderers of all kinds that show relief, with the samples of their target.
fn renderers(gpu: &Gpu) -> Vec<Renderer> {
    let of_samples = |samples, direction, clip| {
        renderer(gpu, |options| {
            options.formats = formats(COLOUR, STENCIL, direction, samples);
            options.clip = clip;
        })
    };
    let mut all = Vec::new();
    for direction in [DepthDirection::Forward, DepthDirection::Reversed] {
        for samples in [1, 4] {
            for clip in [ClipBy::Stencil, ClipBy::Coverage] {
                all.push(of_samples(samples, direction, clip));
            }
        }
    }
    all.push(renderer(gpu, |options| {
        by_coverage(options);
        options.antialias = Antialias::Soft;
    }));
    all
}

#[test]
fn all_ways_of_clipping_show_the_same_relief() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = creature();
    let mut renderers = renderers(&gpu);
    let loaded: LoadedAsset = renderers[0].load(&gpu.device, &gpu.queue, asset).unwrap();
    let show = |renderer: &mut Renderer, k, paint| {
        let depth = renderer.options().formats.depth.unwrap();
        let view = view_of(&camera(asset, k), 1.1 * asset.map.radius, depth.direction);
        let instance = Instance {
            paint,
            ..Instance::new(&loaded, Transform::IDENTITY)
        };
        draw(&gpu, renderer, &view, &[instance])
    };
    // Pixels of four samples and of soft borders differ along the outline.
    let along_outline = (8 * SIDE_PX) as usize;
    for k in 0..4 {
        let (first, rest) = renderers.split_first_mut().unwrap();
        let wanted = show(first, k, Paint::Relief);
        for (which, renderer) in rest.iter_mut().enumerate() {
            let samples = renderer.options().formats.samples;
            let is_soft = renderer.options().antialias == Antialias::Soft;
            let most = if samples == 1 && !is_soft {
                // Depth has other steps where it is reversed.
                4 * tolerance::STENCIL_FILL.max_outliers() as usize
            } else {
                along_outline
            };
            let apart = outliers(&wanted, &show(renderer, k, Paint::Relief), 4);
            assert!(apart <= most, "{apart} pixels differ in way {which}");
        }
        // A control: the hull's own surface is something else.
        let hull = show(first, k, Paint::Blended);
        assert!(outliers(&wanted, &hull, 4) > 2 * tolerance::STENCIL_FILL.max_outliers() as usize);
    }
}

#[test]
fn without_relief_it_is_the_hull() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = creature();
    let mut plain = asset.clone();
    plain.textures.relief = None;
    let mut on = renderer(&gpu, |_| {});
    let mut off = renderer(&gpu, |options| options.relief = ReliefQuality::Off);
    let mut low = renderer(&gpu, |options| options.relief = ReliefQuality::Low);
    let load = |asset: &Asset| on.load(&gpu.device, &gpu.queue, asset).unwrap();
    let (loaded, plain) = (load(asset), load(&plain));
    let view = view_of(
        &camera(asset, 1),
        1.1 * asset.map.radius,
        DepthDirection::Forward,
    );
    let show = |renderer: &mut Renderer, asset, paint| {
        let instance = Instance {
            paint,
            ..Instance::new(asset, Transform::IDENTITY)
        };
        draw(&gpu, renderer, &view, &[instance])
    };
    let hull = show(&mut on, &loaded, Paint::Blended);
    assert!(show(&mut on, &plain, Paint::Relief).rgba == hull.rgba);
    assert!(show(&mut off, &loaded, Paint::Relief).rgba == hull.rgba);
    let (high, low) = (
        show(&mut on, &loaded, Paint::Relief),
        show(&mut low, &loaded, Paint::Relief),
    );
    assert!(outliers(&high, &low, 4) > 0, "quality makes no difference");
    assert!(outliers(&high, &low, 32) < outliers(&high, &hull, 32));
}
