//! Progress bars on standard error, one for each stage.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use silmap_geometry::{Stage, StageEvent, Watch};

use crate::interrupt;

/// How often a bar is drawn again though nothing happened.
const TICK: Duration = Duration::from_millis(120);

/// Listens to the stages of long work.
#[derive(Debug)]
pub(crate) struct Progress {
    running: Mutex<BTreeMap<Stage, ProgressBar>>,
    is_shown: bool,
}

impl Progress {
    /// Bars if standard error is a terminal.
    pub(crate) fn new() -> Self {
        Self {
            running: Mutex::default(),
            is_shown: std::io::stderr().is_terminal(),
        }
    }

    /// Does long work under a watch that reports here and stops on ctrl-c.
    pub(crate) fn watch<T>(&self, work: impl FnOnce(&Watch<'_>) -> T) -> T {
        let listen = |event| self.take(event);
        let result = work(&Watch::new(&listen, interrupt::flag()));
        // A stage that failed half-way leaves its bar behind.
        for bar in std::mem::take(&mut *self.lock()).into_values() {
            bar.finish_and_clear();
        }
        result
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<Stage, ProgressBar>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, event: StageEvent) {
        if !self.is_shown {
            return;
        }
        let mut running = self.lock();
        match event {
            StageEvent::Started { stage, total } => {
                running.insert(stage, bar_with(stage, total));
            }
            StageEvent::Advanced { stage, count } => {
                if let Some(bar) = running.get(&stage) {
                    bar.inc(count);
                }
            }
            StageEvent::Finished { stage } => {
                if let Some(bar) = running.remove(&stage) {
                    bar.finish_and_clear();
                }
            }
        }
    }
}

fn bar_with(stage: Stage, total: u64) -> ProgressBar {
    let bar = if total == 0 {
        ProgressBar::new_spinner()
    } else {
        let style = ProgressStyle::with_template("{msg:<22} {bar:32} {pos}/{len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(total).with_style(style)
    };
    bar.set_message(stage.0);
    bar.enable_steady_tick(TICK);
    bar
}
