//! The graphics device of a test, and what it draws to.

use silmap_gpu::{Gpu, wgpu};

use crate::outside;

/// A fresh device, or nothing when the environment says `SILMAP_GPU=skip`, which is the only way to do without one.
///
/// # Panics
/// When there is no device and skipping was not requested.
#[must_use]
pub fn open_or_skip() -> Option<Gpu> {
    if std::env::var_os("SILMAP_GPU").is_some_and(|v| v == "skip") {
        outside::skip("tests on a graphics adapter: SILMAP_GPU=skip");
        return None;
    }
    match Gpu::new() {
        Ok(gpu) => {
            eprintln!("adapter: {}", gpu.adapter_name());
            Some(gpu)
        }
        Err(reason) => panic!("{reason} (SILMAP_GPU=skip skips the tests that need one)"),
    }
}

/// A square texture to draw to and to copy from.
#[must_use]
pub fn target(gpu: &Gpu, format: wgpu::TextureFormat, side_px: u32) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: side_px,
            height: side_px,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
