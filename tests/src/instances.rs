//! The renderer of instances as a caller has it: a device, a hand-made asset with depths, cameras around it, and pictures.

use glam::DVec3;
use silmap_geometry::{Bounds, Camera, ColourImage, CoverageRule, Loop, Mask};
use silmap_gpu::{Gpu, wgpu};
use silmap_map::{Asset, MapReader, Method};
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, Instance, LoadedAsset, Renderer, RendererOptions, Transform,
    View,
};

use crate::dense_maps::dense;
use crate::pass::{COLOUR, drawn, formats};
use crate::{device, scene};

/// Side of the pictures.
pub const SIDE_PX: u32 = 160;
/// Depth with a stencil.
pub const STENCIL: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;
/// Depth without.
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The hand-made asset, with depths.
fn asset(gpu: &Gpu) -> Asset {
    let mut asset = scene::asset(gpu);
    (asset.map, _) = dense(&scene::model(), 96, 256, 0.5, CoverageRule::Center);
    asset
}

/// A renderer of fresh outlines in the stencil, for a target of one sample, or for what `change` makes of that.
///
/// # Panics
/// When the options contradict each other.
#[must_use]
pub fn renderer(gpu: &Gpu, change: impl FnOnce(&mut RendererOptions)) -> Renderer {
    let target = formats(COLOUR, STENCIL, DepthDirection::Forward, 1);
    let mut options = RendererOptions {
        antialias: Antialias::Samples,
        reuse_error_px: 0.0,
        ..RendererOptions::new(target)
    };
    change(&mut options);
    Renderer::new(&gpu.device, options).unwrap()
}

/// Makes options clip by the coverage function, over a depth buffer without a stencil.
pub fn by_coverage(options: &mut RendererOptions) {
    options.clip = ClipBy::Coverage;
    if let Some(depth) = &mut options.formats.depth {
        depth.format = DEPTH;
    }
}

/// Prepares and draws instances over nothing.
///
/// # Panics
/// When the camera is none or the device fails.
#[must_use]
pub fn draw(
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

/// Pixels that a picture covers by half.
#[must_use]
pub fn mask(picture: &ColourImage) -> Mask {
    let mut mask = Mask::new(picture.width, picture.height);
    for (i, pixel) in (0..).zip(picture.rgba.chunks_exact(4)) {
        mask.set(i % picture.width, i / picture.width, pixel[3] > 127);
    }
    mask
}

/// Pixels that differ in some channel by more than the tolerance.
#[must_use]
pub fn outliers(one: &ColourImage, two: &ColourImage, allowed: u8) -> usize {
    let pixels = one.rgba.chunks_exact(4).zip(two.rgba.chunks_exact(4));
    let differs = |(p, q): &(&[u8], &[u8])| (0..4).any(|c| p[c].abs_diff(q[c]) > allowed);
    pixels.filter(differs).count()
}

/// Eyes around the model, near and far.
pub fn cameras(count: u32) -> impl Iterator<Item = Camera> {
    let bounds = scene::model().bounds();
    (0..count).map(move |k| {
        let t = f64::from(k);
        let direction = DVec3::new((2.4 * t).cos(), (1.3 * t).sin(), (2.4 * t).sin());
        let distance = 1.7 + 0.9 * t % 7.0;
        let roomy = Bounds {
            radius: bounds.radius * 1.15,
            ..bounds
        };
        scene::camera(&roomy, direction, distance, SIDE_PX)
    })
}

/// A device, and an asset on it.
#[derive(Debug)]
pub struct Stage {
    /// The device.
    pub gpu: Gpu,
    /// The asset.
    pub asset: Asset,
    /// The same on the device.
    pub loaded: LoadedAsset,
}

impl Stage {
    /// Opens both; nothing where tests on an adapter are skipped.
    ///
    /// # Panics
    /// When there is no adapter, or the asset cannot be loaded.
    #[must_use]
    pub fn open() -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let asset = asset(&gpu);
        let loaded = renderer(&gpu, |_| {})
            .load(&gpu.device, &gpu.queue, &asset)
            .unwrap();
        Some(Self { gpu, asset, loaded })
    }

    /// The asset where it is, clipped by its own outline.
    #[must_use]
    pub fn instance(&self) -> Instance<'_> {
        Instance::new(&self.loaded, Transform::IDENTITY)
    }

    /// The outline that the asset has for a camera.
    ///
    /// # Panics
    /// When the eye is in the model's bounding sphere.
    #[must_use]
    pub fn outline(&self, camera: &Camera) -> Vec<Loop> {
        let mut reader = MapReader::new(&self.asset.map).unwrap();
        reader
            .interpolate(&self.asset.map, camera, Method::Tight.into())
            .unwrap();
        reader.simple_loops().to_loops()
    }
}
