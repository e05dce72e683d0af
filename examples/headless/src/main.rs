//! From an asset to a picture, on a device of one's own: `example-headless ASSET.glb PICTURE.png`.
//!
//! What the renderer needs of a program is in [`draw`]: a device, a pass, and a camera as a matrix.

mod adapter;
mod options;
mod target;

use std::process::ExitCode;

use anyhow::{Context, ensure};
use clap::Parser;
use glam::DQuat;
use silmap_geometry::Camera;
use silmap_runtime::{Instance, Renderer, Transform, View};

use crate::options::Options;
use crate::target::Target;

fn main() -> ExitCode {
    match draw(&Options::parse()) {
        Ok(adapter) => println!("drawn by {adapter}"),
        Err(error) => {
            eprintln!("example-headless: {error:#}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

fn draw(options: &Options) -> anyhow::Result<String> {
    let (file, side) = (&options.asset, options.size);
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    let asset = silmap_map::asset::read(&bytes).with_context(|| file.display().to_string())?;

    // A device, as any program opens it.
    let described = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let instance = wgpu::Instance::new(described);
    let adapter = pollster::block_on(adapter::find(&instance))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let most = device.limits().max_texture_dimension_2d;
    ensure!(
        (1..=most).contains(&side),
        "a picture has 1 to {most} pixels a side"
    );

    // Once: a renderer for the formats of the pass, and the asset.
    let mut renderer = Renderer::new(&device, options.renderer())?;
    let loaded = renderer.load(&device, &queue, &asset)?;

    // Each frame: a camera and the instances, then a pass.
    let (model, hull) = (loaded.model_bounds(), loaded.bounds());
    let eye = model.center + options.from * model.radius;
    let camera = Camera::fit_sphere(eye, model.center, model.radius, None, (side, side))?;
    let (distance, reach) = (eye.distance(hull.center), 1.01 * hull.radius);
    let near = (distance - reach).max(0.01 * distance);
    let step = (0.5 * camera.right + camera.forward) * model.radius;
    let far = distance + reach + f64::from(options.copies) * model.radius;
    let view = View {
        clip_from_world: camera.clip_from_object(near, far),
        size_px: (side, side),
    };
    let places = (0..options.copies).map(|k| step * f64::from(k));
    let places: Vec<_> = places
        .map(|place| Transform::new(1.0, DQuat::IDENTITY, place))
        .collect::<Result<_, _>>()?;
    let instances: Vec<_> = (places.iter())
        .map(|&place| Instance::new(&loaded, place))
        .collect();
    renderer.prepare(&device, &queue, &view, &instances)?;
    let target = Target::new(&device, &renderer.options().formats, side);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.draw(&mut target.pass(&mut encoder));
    let pixels = target.read(&device, &queue, encoder)?;

    image::RgbaImage::from_raw(side, side, pixels)
        .context("a picture of another size was read back")?
        .save(&options.picture)
        .with_context(|| options.picture.display().to_string())?;
    let info = adapter.get_info();
    Ok(format!("{} ({:?})", info.name, info.backend))
}
