//! The window of the desktop.

use eframe::NativeOptions;
use silmap_gpu::Gpu;
use thiserror::Error;

use crate::app::App;
use crate::start::Start;

/// What the window's file of settings is called after.
const NAME: &str = "silmap";

/// Why there is no window.
#[derive(Debug, Error)]
#[error("no window can be opened: {reason}")]
pub struct WindowError {
    /// What the window system or the graphics driver says.
    pub reason: String,
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// When there is no display, or no graphics adapter that draws to it.
pub fn open(start: Start) -> Result<(), WindowError> {
    let title = match &start.file {
        Some(file) => format!("{} – silmap", file.path.display()),
        None => "silmap".to_owned(),
    };
    let viewport = egui::ViewportBuilder::default()
        .with_title(title)
        .with_inner_size([1180.0, 800.0])
        .with_min_inner_size([320.0, 240.0]);
    let mut options = NativeOptions {
        viewport,
        ..NativeOptions::default()
    };
    if let egui_wgpu::WgpuSetup::CreateNew(setup) = &mut options.wgpu_options.wgpu_setup {
        setup.device_descriptor = std::sync::Arc::new(|adapter| wgpu::DeviceDescriptor {
            label: Some("silmap viewer"),
            required_limits: Gpu::required_limits(adapter),
            ..Default::default()
        });
    }
    let made = eframe::run_native(
        NAME,
        options,
        Box::new(|context| Ok(Box::new(App::new(context, start)))),
    );
    made.map_err(|error| WindowError {
        reason: error.to_string(),
    })
}
