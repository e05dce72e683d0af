//! Outlines that are used for more than one eye: how far off they are, measured along walks, and that they cost nothing.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DQuat, DVec3};
use silmap_exact::Outliner;
use silmap_geometry::{Camera, CoverageRule, TriangleMesh};
use silmap_gpu::{Gpu, wgpu};
use silmap_map::Asset;
use silmap_measure::{Deviation, deviation};
use silmap_models as models;
use silmap_preprocess::simplify_contour::add_levels;
use silmap_runtime::{DepthDirection, Instance, LoadedAsset, Renderer, RendererOptions, Transform};
use silmap_tests::dense_maps::dense;
use silmap_tests::pass::{COLOUR, formats, view_of};
use silmap_tests::{device, scene};

/// Degrees from one frame to the next.
const STEP: f64 = 0.5;

/// How much worse an outline that is used anew may be at its worst. Where the hole of a torus opens, 30 radii away, where fresh outlines are
/// off by 4.5 pixels, it is 0.59; elsewhere less than half a pixel.
const WORST_PX: f64 = 0.6;

/// And on average.
const MEAN_PX: f64 = 0.07;

/// What is drawn, and the device.
struct Stage {
    gpu: Gpu,
    loaded: LoadedAsset,
    mesh: TriangleMesh,
}

impl Stage {
    /// An asset whose outlines are those of a model; only they matter here.
    fn open(mesh: TriangleMesh) -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mut asset: Asset = scene::asset(&gpu);
        (asset.map, _) = dense(&mesh, 128, 256, 0.5, CoverageRule::Center);
        add_levels(&mut asset.map);
        let loaded = renderer(&gpu, 0.25)
            .load(&gpu.device, &gpu.queue, &asset)
            .unwrap();
        Some(Self { gpu, loaded, mesh })
    }

    /// Cameras of a walk, in which the sphere about the model has so large a radius.
    fn walk(&self, frames: u32, distance_rel: f64, radius_px: f64) -> Vec<Camera> {
        let sphere = self.loaded.model_bounds();
        let side = (2.04 * radius_px).ceil() as u32;
        (0..frames)
            .map(|k| {
                let t = (f64::from(k) * STEP).to_radians();
                let direction = DVec3::new(t.cos(), 0.3 + 0.2 * (0.7 * t).sin(), t.sin());
                let eye =
                    sphere.center + direction.normalize_or_zero() * (sphere.radius * distance_rel);
                Camera::fit_sphere(eye, sphere.center, sphere.radius, None, (side, side)).unwrap()
            })
            .collect()
    }
}

fn renderer(gpu: &Gpu, reuse_error_px: f64) -> Renderer {
    let stencil = wgpu::TextureFormat::Depth24PlusStencil8;
    let options = RendererOptions {
        reuse_error_px,
        ..RendererOptions::new(formats(COLOUR, stencil, DepthDirection::Forward, 1))
    };
    Renderer::new(&gpu.device, options).unwrap()
}

/// What a walk came to.
#[derive(Debug)]
struct Walk {
    /// How far each outline is from the exact one, where each is interpolated, and where some are kept.
    fresh: Vec<Deviation>,
    kept: Vec<Deviation>,
    /// How far the two are apart.
    apart: Vec<Deviation>,
    /// How many outlines were interpolated where some are kept.
    made: usize,
}

fn along(stage: &Stage, cameras: &[Camera], reuse_error_px: f64) -> Walk {
    let mut renderers = [0.0, reuse_error_px].map(|error| renderer(&stage.gpu, error));
    let mut outliner = Outliner::new(&stage.mesh.positions);
    let mut walk = Walk {
        fresh: Vec::new(),
        kept: Vec::new(),
        apart: Vec::new(),
        made: 0,
    };
    let radius = stage.loaded.model_bounds().radius;
    for camera in cameras {
        let edges = silmap_exact::silhouette_edges(&stage.mesh, camera.eye);
        let exact = outliner.outline(&edges, camera).unwrap();
        let view = view_of(camera, radius, DepthDirection::Forward);
        let instance = Instance::new(&stage.loaded, Transform::IDENTITY);
        let [fresh, kept] = renderers.each_mut().map(|renderer| {
            let stats = renderer.plan(&view, &[instance]).unwrap();
            (renderer.outline_px(0).unwrap(), stats.interpolated)
        });
        walk.made += kept.1;
        walk.fresh.push(deviation(&fresh.0, &exact, view.size_px));
        walk.kept.push(deviation(&kept.0, &exact, view.size_px));
        walk.apart.push(deviation(&fresh.0, &kept.0, view.size_px));
    }
    walk
}

fn mean(deviations: &[Deviation]) -> f64 {
    deviations.iter().map(|d| d.mean_px).sum::<f64>() / deviations.len() as f64
}

fn thickest(deviations: &[Deviation]) -> f64 {
    deviations.iter().map(|d| d.thickest_px).fold(0.0, f64::max)
}

#[test]
fn reuse_adds_half_a_pixel_at_most() {
    for mesh in [models::torus(4096), models::trefoil_knot(4096)] {
        let Some(stage) = Stage::open(mesh) else {
            return;
        };
        for (distance_rel, radius_px) in [(3.0, 64.0), (30.0, 64.0), (6.0, 12.0), (3.0, 150.0)] {
            let cameras = stage.walk(60, distance_rel, radius_px);
            let walk = along(&stage, &cameras, 0.25);
            let worse = thickest(&walk.kept) - thickest(&walk.fresh);
            let on_average = mean(&walk.kept) - mean(&walk.fresh);
            println!(
                "{distance_rel} radii, {radius_px} px: {} of 60 made; mean {:.3} + {on_average:.4}, thickest {:.2} + {worse:.3}; \
                 apart {:.3}, thickest {:.3}",
                walk.made,
                mean(&walk.fresh),
                thickest(&walk.fresh),
                mean(&walk.apart),
                thickest(&walk.apart),
            );
            assert!(
                worse <= WORST_PX && on_average <= MEAN_PX,
                "{worse}, {on_average}"
            );
            assert!(walk.made < cameras.len(), "nothing is kept");
        }
        // The measure notices outlines that are kept for too long.
        let cameras = stage.walk(60, 3.0, 64.0);
        let walk = along(&stage, &cameras, 25.0);
        let worse = thickest(&walk.kept) - thickest(&walk.fresh);
        let on_average = mean(&walk.kept) - mean(&walk.fresh);
        assert!(
            worse > WORST_PX || on_average > MEAN_PX,
            "{worse}, {on_average}"
        );
        assert!(walk.made < 20, "{}", walk.made);
    }
}

/// The same picture is made of the same outlines, whatever was drawn before.
#[test]
fn outlines_do_not_depend_on_the_way() {
    let Some(stage) = Stage::open(models::torus(1024)) else {
        return;
    };
    let cameras = stage.walk(60, 4.0, 60.0);
    let radius = stage.loaded.model_bounds().radius;
    let instance = Instance::new(&stage.loaded, Transform::IDENTITY);
    let mut there = renderer(&stage.gpu, 0.25);
    let outline = |renderer: &mut Renderer, camera: &Camera| {
        let view = view_of(camera, radius, DepthDirection::Forward);
        // Twice: the first time an outline that is due may wait.
        renderer.plan(&view, &[instance]).unwrap();
        renderer.plan(&view, &[instance]).unwrap();
        renderer.outline_px(0).unwrap()
    };
    let forth: Vec<_> = cameras.iter().map(|c| outline(&mut there, c)).collect();
    for (camera, forth) in cameras.iter().zip(&forth).rev() {
        let mut fresh = renderer(&stage.gpu, 0.25);
        assert_eq!(&outline(&mut fresh, camera), forth);
    }
}

/// Off the polytope outlines are put together from ones that many eyes share, whose memory may be short: they are the same.
#[test]
fn outlines_do_not_depend_on_the_memory_there_is() {
    let Some(stage) = Stage::open(models::torus(1024)) else {
        return;
    };
    let radius = stage.loaded.model_bounds().radius;
    let instance = Instance::new(&stage.loaded, Transform::IDENTITY);
    let outlines = |polytope_bytes: u64, reuse_error_px: f64| {
        let stencil = wgpu::TextureFormat::Depth24PlusStencil8;
        let options = RendererOptions {
            polytope_bytes,
            reuse_error_px,
            ..RendererOptions::new(formats(COLOUR, stencil, DepthDirection::Forward, 1))
        };
        let mut renderer = Renderer::new(&stage.gpu.device, options).unwrap();
        let cameras = stage.walk(30, 12.0, 64.0).into_iter();
        cameras
            .map(|camera| {
                let view = view_of(&camera, radius, DepthDirection::Forward);
                renderer.plan(&view, &[instance]).unwrap();
                renderer.outline_px(0).unwrap()
            })
            .collect::<Vec<_>>()
    };
    let wanted = outlines(16 << 20, 0.25);
    for bytes in [0, 1024, 16 << 10] {
        assert_eq!(outlines(bytes, 0.25), wanted, "{bytes} bytes");
    }
    // It is not for want of sharing: each from its own points is another outline.
    assert_ne!(outlines(0, 0.0), wanted);
}

/// A thousand instances, a camera that walks: once all is warm, planning a frame allocates nothing.
#[test]
fn a_warm_frame_allocates_nothing() {
    let Some(stage) = Stage::open(models::torus(1024)) else {
        return;
    };
    let radius = stage.loaded.model_bounds().radius;
    let instances: Vec<Instance<'_>> = (0..1000)
        .map(|k| {
            let (row, column) = (f64::from(k / 32), f64::from(k % 32));
            let place = DVec3::new(column - 16.0, 0.0, row - 16.0) * (1.7 * radius);
            let turn = DQuat::from_rotation_y(f64::from(k));
            Instance::new(&stage.loaded, Transform::new(1.0, turn, place).unwrap())
        })
        .collect();
    let camera = |k: u32| {
        let t = f64::from(k) * 0.01;
        let eye = DVec3::new(t.cos(), 0.6, t.sin()) * (40.0 * radius);
        Camera::fit_sphere(eye, DVec3::ZERO, 25.0 * radius, None, (1024, 1024)).unwrap()
    };
    for clip in [
        silmap_runtime::ClipBy::Stencil,
        silmap_runtime::ClipBy::Coverage,
    ] {
        let stencil = wgpu::TextureFormat::Depth24PlusStencil8;
        let mut renderer = Renderer::new(
            &stage.gpu.device,
            RendererOptions {
                clip,
                ..RendererOptions::new(formats(COLOUR, stencil, DepthDirection::Forward, 1))
            },
        )
        .unwrap();
        let walk = |renderer: &mut Renderer| {
            for k in 0..40 {
                let view = view_of(&camera(k), 25.0 * radius, DepthDirection::Forward);
                let stats = renderer.plan(&view, &instances).unwrap();
                assert!(stats.drawn > 500, "{stats:?}");
            }
        };
        // One thread: what a pool of threads keeps for itself is its own.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let cold = pool.install(|| allocation_counter::measure(|| walk(&mut renderer)).count_total);
        assert!(cold > 0, "the counter does not count");
        (0..3).for_each(|_| pool.install(|| walk(&mut renderer)));
        let warm = pool.install(|| allocation_counter::measure(|| walk(&mut renderer)).count_total);
        assert_eq!(warm, 0, "{clip:?}: {warm} allocations, {cold} when cold");
    }
}
