//! How long frames take.

use std::sync::{Arc, Mutex, PoisonError};

use web_time::Instant;

/// Frames that the averages are over.
const FRAMES: usize = 30;

/// Times of the frames that were drawn last, seconds.
#[derive(Debug, Default)]
pub(crate) struct Timing {
    /// On this processor: outline, upload and encoding.
    processor: Vec<f64>,
    /// From the submission until the device was done.
    device: Arc<Mutex<Vec<f64>>>,
    /// Frames since the beginning.
    count: u64,
}

fn mean(times: &[f64]) -> Option<f64> {
    (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
}

fn push(times: &mut Vec<f64>, seconds: f64) {
    if times.len() >= FRAMES {
        times.remove(0);
    }
    times.push(seconds);
}

impl Timing {
    /// Notes a frame that was begun at `since` and has been submitted just now.
    pub(crate) fn submitted(&mut self, since: Instant, queue: &wgpu::Queue) {
        self.count += 1;
        push(&mut self.processor, since.elapsed().as_secs_f64());
        let device = Arc::clone(&self.device);
        let submitted = Instant::now();
        queue.on_submitted_work_done(move || {
            let seconds = submitted.elapsed().as_secs_f64();
            push(
                &mut device.lock().unwrap_or_else(PoisonError::into_inner),
                seconds,
            );
        });
    }

    /// Forgets what was, where something else is drawn.
    pub(crate) fn clear(&mut self) {
        self.processor.clear();
        (self.device.lock().unwrap_or_else(PoisonError::into_inner)).clear();
    }

    /// Frames since the beginning.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Means in seconds: of the processor, and of the device, where there are any.
    pub(crate) fn means(&self) -> (Option<f64>, Option<f64>) {
        let device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        (mean(&self.processor), mean(&device))
    }
}
