//! Finding a graphics adapter.

use anyhow::{Context, anyhow};

/// The adapter that the environment names by `WGPU_ADAPTER_NAME`, or the platform's first choice, that draws to a surface.
pub(crate) async fn find(
    instance: &wgpu::Instance,
    surface: &wgpu::Surface<'_>,
) -> anyhow::Result<wgpu::Adapter> {
    if let Ok(wanted) = std::env::var("WGPU_ADAPTER_NAME") {
        let wanted = wanted.to_lowercase();
        let all = instance.enumerate_adapters(wgpu::Backends::all()).await;
        return (all.into_iter())
            .filter(|a| a.is_surface_supported(surface))
            .find(|a| a.get_info().name.to_lowercase().contains(&wanted))
            .context("no graphics adapter that draws to this display has the name that WGPU_ADAPTER_NAME asks for");
    }
    let found = instance.request_adapter(&wgpu::RequestAdapterOptions {
        compatible_surface: Some(surface),
        ..Default::default()
    });
    found.await.map_err(|_| {
        anyhow!("no graphics adapter that draws to this display was found: install a driver, or Mesa's software driver")
    })
}
