//! The renderer in a pass of the caller's: stencil against coverage function against a fill on the processor, in the formats and cameras
//! that callers have.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DMat4, DVec2, DVec3};
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, ColourImage, CoverageRule, Loop, Mask};
use silmap_gpu::{Gpu, wgpu};
use silmap_map::{Asset, MapReader, Method};
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, Instance, LoadedAsset, Outline, Renderer, RendererOptions,
    Transform, View,
};
use silmap_tests::dense_maps::dense;
use silmap_tests::pass::{COLOUR, drawn, formats};
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

/// A view from a camera.
fn view_of(camera: &Camera, radius: f64, direction: DepthDirection) -> View {
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
