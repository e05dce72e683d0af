//! What long work reports to its caller, and how the caller stops it.
//!
//! Every function of the workspace that may take long takes a [`Watch`]. It reports progress as [`StageEvent`]s, and ends
//! with [`Interrupted`] soon after the caller asked for that.

use std::sync::atomic::{AtomicBool, Ordering};

use thiserror::Error;

/// A stage of long work, by the description shown to users: `"growing the hull"`. Each crate names its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stage(pub &'static str);

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.0)
    }
}

/// One step of progress. Stages may overlap; each starts and ends once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageEvent {
    /// A stage begins and will count up to `total`.
    Started {
        /// Which.
        stage: Stage,
        /// Units of work ahead; an estimate.
        total: u64,
    },
    /// `count` more units are done.
    Advanced {
        /// Which.
        stage: Stage,
        /// How many.
        count: u64,
    },
    /// The stage ended. It does not when it was interrupted or failed.
    Finished {
        /// Which.
        stage: Stage,
    },
}

/// The caller asked to stop.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("interrupted")]
pub struct Interrupted;

/// The line between long work and its caller: progress out, a request to stop in.
///
/// ```
/// use std::sync::atomic::AtomicBool;
/// use silmap_geometry::{Stage, StageEvent, Watch};
///
/// let stop = AtomicBool::new(false);
/// let listen = |event| if let StageEvent::Started { stage, .. } = event {
///     eprintln!("{stage}");
/// };
/// let watch = Watch::new(&listen, &stop);
/// watch.start(Stage("counting sheep"), 3);
/// assert!(watch.check().is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    on_event: &'a (dyn Fn(StageEvent) + Sync),
    stop: &'a AtomicBool,
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl std::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch")
            .field("stop", self.stop)
            .finish_non_exhaustive()
    }
}

impl<'a> Watch<'a> {
    /// Reports to `on_event`, which may be called from any thread, and stops soon after `stop` becomes true.
    #[must_use]
    pub fn new(on_event: &'a (dyn Fn(StageEvent) + Sync), stop: &'a AtomicBool) -> Self {
        Self { on_event, stop }
    }

    /// Discards reports and never stops.
    #[must_use]
    pub fn silent() -> Watch<'static> {
        Watch {
            on_event: &|_| {},
            stop: &NEVER,
        }
    }

    /// Stops when this one does, but discards reports.
    #[must_use]
    pub fn quiet(&self) -> Self {
        Self {
            on_event: &|_| {},
            stop: self.stop,
        }
    }

    /// Reports the start of a stage.
    pub fn start(&self, stage: Stage, total: u64) {
        (self.on_event)(StageEvent::Started { stage, total });
    }

    /// Reports `count` finished units.
    pub fn advance(&self, stage: Stage, count: u64) {
        (self.on_event)(StageEvent::Advanced { stage, count });
    }

    /// Reports the end of a stage.
    pub fn finish(&self, stage: Stage) {
        (self.on_event)(StageEvent::Finished { stage });
    }

    /// To be called every few milliseconds of work.
    ///
    /// # Errors
    /// When the caller asked to stop.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.stop.load(Ordering::Relaxed) {
            Err(Interrupted)
        } else {
            Ok(())
        }
    }
}
