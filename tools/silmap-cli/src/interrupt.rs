//! Stopping on request: the first ctrl-c asks, the second does not.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use silmap_preprocess::Interrupted;

use crate::exit::ExitClass;

static STOP: AtomicBool = AtomicBool::new(false);

/// Makes ctrl-c set the flag that long work looks at.
///
/// # Errors
/// When the system does not let a handler be set.
pub(crate) fn install_handler() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(ExitClass::Interrupted.code()));
        }
    })
    .context("ctrl-c cannot be handled")
}

/// The flag, for a [`silmap_preprocess::Monitor`].
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
