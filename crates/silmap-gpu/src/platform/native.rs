//! Blocking waits, for native programs.

use std::time::Duration;

use crate::{Gpu, GpuError};

/// Longest wait for one submission. A frame of ten million triangles takes a software adapter two seconds.
const PATIENCE: Duration = Duration::from_secs(60);

impl Gpu {
    /// Opens the device that the environment chooses, and waits for it.
    ///
    /// # Errors
    /// As [`Gpu::request`].
    pub fn new() -> Result<Self, GpuError> {
        pollster::block_on(Self::request())
    }
}

/// Waits until the device finished what was submitted (`submission`, or everything) and its callbacks ran.
///
/// # Errors
/// When it takes too long, or the device was lost or refused something.
pub fn wait_for(gpu: &Gpu, submission: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
    let waited = gpu.device.poll(wgpu::PollType::Wait {
        submission_index: submission,
        timeout: Some(PATIENCE),
    });
    gpu.check()?;
    waited.map(drop).map_err(|_| GpuError::Timeout {
        seconds: PATIENCE.as_secs(),
    })
}
