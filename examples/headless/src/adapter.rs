//! Finding a graphics adapter.

use anyhow::{Context, anyhow};

/// The adapter that the environment names by `WGPU_ADAPTER_NAME`, or the platform's first choice.
pub(crate) async fn find(instance: &wgpu::Instance) -> anyhow::Result<wgpu::Adapter> {
    if let Ok(wanted) = std::env::var("WGPU_ADAPTER_NAME") {
        let wanted = wanted.to_lowercase();
        let all = instance.enumerate_adapters(wgpu::Backends::all()).await;
        return (all.into_iter())
            .find(|a| a.get_info().name.to_lowercase().contains(&wanted))
            .context("no graphics adapter has the name that WGPU_ADAPTER_NAME asks for");
    }
    let found = instance.request_adapter(&wgpu::RequestAdapterOptions::default());
    found.await.map_err(|_| {
        anyhow!("no graphics adapter was found: install a driver, or Mesa's software driver")
    })
}
