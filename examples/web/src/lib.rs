//! Draws an asset on a web page, by WebGPU or WebGL2, and returns the pixels.
//!
//! The page is `index.html`; `cargo xtask example-web` builds both into a folder.
#![cfg(target_arch = "wasm32")]

mod device;
mod frame;

use glam::{DQuat, DVec3};
use silmap_geometry::Camera;
use silmap_runtime::{
    Antialias, DepthDirection, DepthTarget, Instance, Renderer, RendererOptions, TargetFormats,
    Transform, View,
};
use wasm_bindgen::prelude::*;

use crate::device::Gpu;
use crate::frame::Frame;

const MOST_COPIES: u32 = 10_000;

/// What draws.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// WebGPU
    WebGpu,
    /// WebGL2
    WebGl2,
}

/// What clips the hull.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clip {
    /// The stencil buffer
    Stencil,
    /// A function in the fragment shader, for passes without a stencil
    Coverage,
}

/// What smooths the outline.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Nothing
    Hard,
    /// Four samples a pixel
    Samples,
    /// Blending, where the fragment shader clips
    Soft,
}

/// How to draw, and from where.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// What draws
    pub backend: Backend,
    /// What clips
    pub clip: Clip,
    /// What smooths
    pub edges: Edges,
    /// How many of them, one behind the other
    pub copies: u32,
    /// Pixels a side
    pub size: u32,
    /// The eye, seen from the model's middle, in radii of the sphere about it
    pub x: f64,
    /// Upwards
    pub y: f64,
    /// Towards the front
    pub z: f64,
}

#[wasm_bindgen]
impl Options {
    /// For a backend, the same as those of `example-headless`.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new(backend: Backend) -> Self {
        Self {
            backend,
            clip: Clip::Stencil,
            edges: Edges::Samples,
            copies: 1,
            size: 512,
            x: 1.5,
            y: 1.0,
            z: 3.0,
        }
    }
}

impl Options {
    fn renderer(&self) -> RendererOptions {
        let formats = TargetFormats {
            colour: Some(wgpu::TextureFormat::Rgba8UnormSrgb),
            depth: Some(DepthTarget {
                format: match self.clip {
                    Clip::Stencil => wgpu::TextureFormat::Depth24PlusStencil8,
                    Clip::Coverage => wgpu::TextureFormat::Depth32Float,
                },
                direction: DepthDirection::Forward,
            }),
            samples: if self.edges == Edges::Samples { 4 } else { 1 },
        };
        RendererOptions {
            antialias: match self.edges {
                Edges::Soft => Antialias::Soft,
                Edges::Hard | Edges::Samples => Antialias::Samples,
            },
            // One instance needs little: pages have less memory than programs.
            outline_bytes: 4 << 20,
            polytope_bytes: 4 << 20,
            ..RendererOptions::new(formats)
        }
    }
}

/// A picture, and what drew it.
#[wasm_bindgen]
#[derive(Clone, Debug)]
pub struct Picture {
    adapter: String,
    rgba: Vec<u8>,
}

#[wasm_bindgen]
impl Picture {
    /// Name of the graphics adapter, and its interface
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn adapter(&self) -> String {
        self.adapter.clone()
    }

    /// Four bytes a pixel, row by row
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn rgba(&self) -> Vec<u8> {
        self.rgba.clone()
    }
}

/// Draws an asset, given as the bytes of its file.
///
/// # Errors
/// When the browser has no such backend, the file is no asset, or the device refuses something.
#[wasm_bindgen]
pub async fn draw(asset: Vec<u8>, options: Options) -> Result<Picture, JsError> {
    std::panic::set_hook(Box::new(|panic| {
        web_sys::console::error_1(&panic.to_string().into());
    }));
    let asset = silmap_map::asset::read(&asset)?;
    let gpu = Gpu::open(options.backend).await?;
    let most = gpu.device.limits().max_texture_dimension_2d;
    if !(1..=most).contains(&options.size) {
        let refusal = format!("a picture has 1 to {most} pixels a side");
        return Err(JsError::new(&refusal));
    }
    if options.copies > MOST_COPIES {
        return Err(JsError::new("there are too many copies"));
    }
    let mut renderer = Renderer::new(&gpu.device, options.renderer())?;
    let loaded = renderer.load(&gpu.device, &gpu.queue, &asset)?;
    let (model, hull) = (loaded.model_bounds(), loaded.bounds());
    let eye = model.center + DVec3::new(options.x, options.y, options.z) * model.radius;
    let size_px = (options.size, options.size);
    let camera = Camera::fit_sphere(eye, model.center, model.radius, None, size_px)?;
    let (distance, reach) = (eye.distance(hull.center), 1.01 * hull.radius);
    let near = (distance - reach).max(0.01 * distance);
    let step = (0.5 * camera.right + camera.forward) * model.radius;
    let far = distance + reach + f64::from(options.copies) * model.radius;
    let view = View {
        clip_from_world: camera.clip_from_object(near, far),
        size_px,
    };
    let places = (0..options.copies).map(|k| step * f64::from(k));
    let places: Vec<_> = places
        .map(|place| Transform::new(1.0, DQuat::IDENTITY, place))
        .collect::<Result<_, _>>()?;
    let instances: Vec<_> = (places.iter())
        .map(|&place| Instance::new(&loaded, place))
        .collect();
    renderer.prepare(&gpu.device, &gpu.queue, &view, &instances)?;
    let frame = Frame::new(&gpu.device, &renderer.options().formats, options.size);
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.draw(&mut frame.pass(&mut encoder));
    let rgba = frame.read(&gpu, encoder).await?;
    Ok(Picture {
        adapter: gpu.adapter_name(),
        rgba,
    })
}
