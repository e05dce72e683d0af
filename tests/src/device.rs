//! The graphics device of a test.

use silmap_gpu::Gpu;

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
