//! Interrupts: the first ctrl-c stops at the next check, the second at once.

use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use silmap_geometry::Interrupted;

static STOP: AtomicBool = AtomicBool::new(false);

/// Makes ctrl-c set the flag that long work looks at; the second one ends the program with `exit_code`.
///
/// # Errors
/// When the system does not let a handler be set.
pub(crate) fn install_handler(exit_code: u8) -> anyhow::Result<()> {
    ctrlc::set_handler(move || {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(exit_code));
        }
    })
    .context("ctrl-c cannot be handled")
}

/// The flag, for a [`silmap_geometry::Watch`].
pub(crate) fn flag() -> &'static AtomicBool {
    &STOP
}

/// Whether the user asked to stop.
pub(crate) fn is_requested() -> bool {
    STOP.load(Ordering::SeqCst)
}

/// Stops here when the user asked to.
///
/// # Errors
/// When the user asked to stop.
pub(crate) fn check() -> Result<(), Interrupted> {
    if is_requested() {
        Err(Interrupted)
    } else {
        Ok(())
    }
}

/// How often a thread that waits for another one checks the flag.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// As much as a main thread has.
const STACK_BYTES: usize = 8 << 20;

/// Does work that may wait for the world outside, such as for the other end of a pipe, on a thread of its own. When the user asks to
/// stop, the thread is left behind; the end of the program takes it along.
///
/// # Errors
/// When the user asked to stop, or the thread cannot be started.
pub(crate) fn unless_stopped<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> anyhow::Result<T> {
    let (result, wait) = mpsc::channel();
    let worker = thread::Builder::new()
        .stack_size(STACK_BYTES)
        .spawn(move || {
            // The receiver is gone when the user asked to stop.
            let _ = result.send(work());
        })
        .context("a thread cannot be started")?;
    loop {
        match wait.recv_timeout(LOOK_EVERY) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => check()?,
            // It sends nothing only when it panics.
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Ok(()) => anyhow::bail!("a thread ended without a result"),
                Err(payload) => panic::resume_unwind(payload),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_on_a_thread_gives_its_result_or_its_panic() {
        assert_eq!(unless_stopped(|| 6 * 7).unwrap(), 42);
        let caught = panic::catch_unwind(|| unless_stopped(|| panic!("a fault")));
        assert_eq!(caught.unwrap_err().downcast_ref::<&str>(), Some(&"a fault"));
    }
}
