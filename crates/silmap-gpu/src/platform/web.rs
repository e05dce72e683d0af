//! Waiting without blocking, for web pages: the browser calls back when the device is done.

use crate::{Gpu, GpuError};

/// Always fails here: a page that waits stops the very loop that would end the wait.
///
/// # Errors
/// Always [`GpuError::CannotBlock`].
pub fn wait_for(_gpu: &Gpu, _submission: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
    Err(GpuError::CannotBlock)
}
