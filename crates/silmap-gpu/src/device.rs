//! Finding an adapter and opening a device on it.
//!
//! The environment chooses as for every wgpu program: `WGPU_BACKEND`, `WGPU_ADAPTER_NAME` and `WGPU_POWER_PREF`. Errors
//! that the device reports outside a call are kept and returned by [`Gpu::check`]; nothing panics because a driver does
//! not like us.

use std::sync::{Arc, Mutex, PoisonError};

use thiserror::Error;

/// What the adapter can do. Algorithms branch on this and on nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tier {
    /// What WebGL2 has: no storage buffers, no compute.
    Limited,
    /// Everything WebGPU promises.
    Full,
}

/// Why there is no device, or why it stopped working.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum GpuError {
    /// The machine offers no adapter at all.
    #[error(
        "no graphics adapter was found: install a driver, or the software adapter of mesa-vulkan-drivers (Debian and Ubuntu)"
    )]
    NoAdapter,
    /// `WGPU_ADAPTER_NAME` names none of the adapters.
    #[error("WGPU_ADAPTER_NAME asks for \"{wanted}\", but the graphics adapters are: {found}")]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// The adapters there are.
        found: String,
    },
    /// The adapter refused to open a device.
    #[error("the graphics adapter {adapter} cannot be used: {reason}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// The device is gone; a new [`Gpu`] is needed.
    #[error("the graphics device was lost: {reason}")]
    DeviceLost {
        /// What the driver said.
        reason: String,
    },
    /// The device ran out of memory.
    #[error("the graphics adapter ran out of memory: {reason}")]
    OutOfMemory {
        /// What the driver said.
        reason: String,
    },
    /// The device refused a call: a defect of this program or of the driver.
    #[error("the graphics device refused a command: {reason}")]
    Refused {
        /// What the driver said.
        reason: String,
    },
    /// The device did not finish in time.
    #[error("the graphics device did not answer within {seconds} seconds")]
    Timeout {
        /// How long it was waited for.
        seconds: u64,
    },
    /// This platform cannot wait for the device.
    #[error("a web page cannot wait for the graphics device: use the asynchronous call")]
    CannotBlock,
    /// Bytes of a texture cannot be read back.
    #[error("an image of {width} × {height} pixels of {format:?} cannot be read back")]
    NotReadable {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Its format.
        format: wgpu::TextureFormat,
    },
}

/// The first error reported outside a call, shared with the device's callbacks.
#[derive(Clone, Debug, Default)]
struct ErrorSlot(Arc<Mutex<Option<GpuError>>>);

impl ErrorSlot {
    fn record(&self, error: GpuError) {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A lost device follows from, or causes, everything else: it is the news that counts.
        let lost = matches!(error, GpuError::DeviceLost { .. });
        if slot.is_none() || lost {
            *slot = Some(error);
        }
    }

    /// What is there; only a lost device is there again the next time.
    fn take(&self) -> Option<GpuError> {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*slot {
            Some(lost @ GpuError::DeviceLost { .. }) => Some(lost.clone()),
            _ => slot.take(),
        }
    }

    fn get(&self) -> Option<GpuError> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

/// A device and what it was made from.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The entry point to the platform's graphics.
    pub instance: wgpu::Instance,
    /// The adapter in use.
    pub adapter: wgpu::Adapter,
    /// The open device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What it can do.
    pub tier: Tier,
    errors: ErrorSlot,
}

/// Features used where they are there: exact timings, and coverage of every touched pixel.
const OPTIONAL_FEATURES: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::CONSERVATIVE_RASTERIZATION);

impl Gpu {
    /// Opens the device that the environment chooses.
    ///
    /// # Errors
    /// When there is no adapter, none of the name asked for, or it cannot be opened.
    pub async fn request() -> Result<Self, GpuError> {
        let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        let instance = wgpu::util::new_instance_with_webgpu_detection(descriptor).await;
        Self::request_for_surface(instance, None).await
    }

    /// Opens a device of `instance` that can draw to `surface`.
    ///
    /// # Errors
    /// As [`Gpu::request`].
    pub async fn request_for_surface(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, GpuError> {
        let adapter = choose_adapter(&instance, surface).await?;
        let info = adapter.get_info();
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("silmap"),
                required_features: adapter.features() & OPTIONAL_FEATURES,
                required_limits: Self::required_limits(&adapter),
                ..Default::default()
            })
            .await
            .map_err(|refusal| GpuError::NoDevice {
                adapter: info.name,
                reason: refusal.to_string(),
            })?;
        Ok(Self::of_host(instance, adapter, device, queue))
    }

    /// A device that a host program has opened, with [`Gpu::required_limits`] at least. What it refuses outside a call is kept here from
    /// now on, in place of what the host did with it.
    #[must_use]
    pub fn of_host(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Self {
        let tier = if adapter.get_downlevel_capabilities().is_webgpu_compliant() {
            Tier::Full
        } else {
            Tier::Limited
        };
        let errors = ErrorSlot::default();
        let slot = errors.clone();
        device.on_uncaptured_error(Arc::new(move |error| slot.record(GpuError::from(error))));
        let slot = errors.clone();
        device.set_device_lost_callback(move |_, reason| {
            slot.record(GpuError::DeviceLost { reason });
        });
        Self {
            instance,
            adapter,
            device,
            queue,
            tier,
            errors,
        }
    }

    /// What every device is asked for: WebGL2's limits with the adapter's image sizes and alignments.
    #[must_use]
    pub fn required_limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
        let offered = adapter.limits();
        wgpu::Limits::downlevel_webgl2_defaults()
            .using_resolution(offered.clone())
            .using_alignment(offered)
    }

    /// The adapter's name and the interface it is driven through, as "llvmpipe (Vulkan)".
    #[must_use]
    pub fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({:?})", info.name, info.backend)
    }

    /// Whether the adapter runs on the processor.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Fails once the device was lost or refused something.
    ///
    /// # Errors
    /// The first error that the device reported outside a call, again at each later check.
    pub fn check(&self) -> Result<(), GpuError> {
        self.errors.get().map_or(Ok(()), Err)
    }

    /// As [`Gpu::check`] for a program that goes on with what the device still does: what it refused is said once.
    ///
    /// # Errors
    /// The first error since the last call; that the device is lost at each call.
    pub fn check_once(&self) -> Result<(), GpuError> {
        self.errors.take().map_or(Ok(()), Err)
    }
}

impl From<wgpu::Error> for GpuError {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { source } => Self::OutOfMemory {
                reason: source.to_string(),
            },
            wgpu::Error::Validation { description, .. }
            | wgpu::Error::Internal { description, .. } => Self::Refused {
                reason: description,
            },
        }
    }
}

/// The adapter named by the environment, or else the platform's first choice, or else any that is there.
async fn choose_adapter(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter, GpuError> {
    if let Some(wanted) = std::env::var_os("WGPU_ADAPTER_NAME") {
        let wanted = wanted.to_string_lossy().to_lowercase();
        let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
        let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        return adapters
            .into_iter()
            .filter(|a| surface.is_none_or(|s| a.is_surface_supported(s)))
            .find(|a| a.get_info().name.to_lowercase().contains(&wanted))
            .ok_or(if names.is_empty() {
                GpuError::NoAdapter
            } else {
                GpuError::NoSuchAdapter {
                    wanted,
                    found: names.join(", "),
                }
            });
    }
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::from_env()
            .unwrap_or(wgpu::PowerPreference::HighPerformance),
        compatible_surface: surface,
        ..Default::default()
    };
    instance
        .request_adapter(&options)
        .await
        .map_err(|_| GpuError::NoAdapter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_error_is_kept_until_the_device_is_lost() {
        let slot = ErrorSlot::default();
        let refused = |text: &str| GpuError::Refused {
            reason: text.to_owned(),
        };
        let lost = GpuError::DeviceLost {
            reason: "unplugged".to_owned(),
        };
        assert_eq!(slot.get(), None);
        slot.record(refused("a"));
        slot.record(refused("b"));
        assert_eq!(slot.get(), Some(refused("a")));
        assert_eq!(slot.take(), Some(refused("a")));
        assert_eq!(slot.take(), None);
        slot.record(lost.clone());
        slot.record(refused("c"));
        assert_eq!(slot.take(), Some(lost.clone()));
        assert_eq!(slot.get(), Some(lost));
    }

    #[test]
    fn no_adapter_says_what_to_install() {
        assert!(
            GpuError::NoAdapter
                .to_string()
                .contains("mesa-vulkan-drivers")
        );
    }
}
