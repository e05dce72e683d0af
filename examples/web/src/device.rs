//! A device of the browser's.

use std::sync::{Arc, Mutex, PoisonError};

use wasm_bindgen::prelude::*;

use crate::Backend;

/// A device, and what it refused.
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    adapter: wgpu::Adapter,
    refusal: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    pub(crate) async fn open(backend: Backend) -> Result<Self, JsError> {
        let (backends, name) = match backend {
            Backend::WebGpu => (wgpu::Backends::BROWSER_WEBGPU, "WebGPU"),
            Backend::WebGl2 => (wgpu::Backends::GL, "WebGL2"),
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let missing = |_| JsError::new(&format!("this browser offers no {name}"));
        // WebGL2 is a property of a canvas. This one stays empty: what is drawn goes to a texture.
        let surface = match backend {
            Backend::WebGpu => None,
            Backend::WebGl2 => {
                let canvas = web_sys::OffscreenCanvas::new(1, 1);
                let canvas = canvas.map_err(|_| JsError::new("no canvas can be made"))?;
                let target = wgpu::SurfaceTarget::OffscreenCanvas(canvas);
                Some(instance.create_surface(target).map_err(|_| missing(()))?)
            }
        };
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                compatible_surface: surface.as_ref(),
                ..Default::default()
            })
            .await
            .map_err(|_| missing(()))?;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                required_limits: wgpu::Limits::downlevel_webgl2_defaults()
                    .using_resolution(adapter.limits())
                    .using_alignment(adapter.limits()),
                ..Default::default()
            })
            .await?;
        let refusal = Arc::new(Mutex::new(None));
        let refused = Arc::clone(&refusal);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut first = refused.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert_with(|| error.to_string());
        }));
        Ok(Self {
            device,
            queue,
            adapter,
            refusal,
        })
    }

    /// Its name, and how it is driven.
    pub(crate) fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        let name = if info.name.is_empty() {
            "an adapter without a name"
        } else {
            &info.name
        };
        format!("{name} ({:?})", info.backend)
    }

    /// Fails where the device refused something.
    pub(crate) fn check(&self) -> Result<(), JsError> {
        let mut first = self.refusal.lock().unwrap_or_else(PoisonError::into_inner);
        first
            .take()
            .map_or(Ok(()), |reason| Err(JsError::new(&reason)))
    }
}
