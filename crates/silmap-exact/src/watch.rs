//! Progress of long computations, counted in steps.

use silmap_geometry::{Interrupted, Stage, Watch};

/// Building a forest of cones, whose total is twice the mesh's edges.
pub const SEARCH: Stage = Stage("building the search");
/// Fitting a pose, counted in rounds.
pub const FIT: Stage = Stage("fitting outlines");
/// Simplifying, counted in faces looked at and then removed.
pub const SIMPLIFY: Stage = Stage("simplifying");

/// How far a stage is, and how far its caller knows it to be.
#[derive(Debug)]
pub(crate) struct Counter<'w> {
    watch: &'w Watch<'w>,
    stage: Stage,
    total: u64,
    done: u64,
    /// What is done as the caller knows it.
    told: u64,
    steps: u64,
    /// Steps that were taken when the caller last heard.
    heard: u64,
    /// Steps that take some milliseconds.
    patience: u64,
}

impl<'w> Counter<'w> {
    /// Starts a stage. `patience` is how many steps pass before the next report.
    pub(crate) fn start(watch: &'w Watch<'w>, stage: Stage, total: u64, patience: u64) -> Self {
        watch.start(stage, total);
        Self {
            watch,
            stage,
            total,
            done: 0,
            told: 0,
            steps: 0,
            heard: 0,
            patience,
        }
    }

    /// So much more of the total is done.
    pub(crate) fn advance(&mut self, units: u64) {
        self.done += units;
    }

    /// Some steps were taken.
    pub(crate) fn step(&mut self, steps: u64) -> Result<(), Interrupted> {
        self.steps += steps;
        if self.steps - self.heard < self.patience {
            return Ok(());
        }
        self.tell()
    }

    /// Reports to the caller now, and checks whether to stop.
    pub(crate) fn tell(&mut self) -> Result<(), Interrupted> {
        self.heard = self.steps;
        let done = self.done.min(self.total);
        if done > self.told {
            self.watch.advance(self.stage, done - self.told);
            self.told = done;
        }
        self.watch.check()
    }

    /// Sets how much of the total is done in all, and reports it.
    pub(crate) fn tell_done(&mut self, done: u64) -> Result<(), Interrupted> {
        self.done = done;
        self.tell()
    }

    /// Ends the stage.
    pub(crate) fn finish(self) {
        self.watch.finish(self.stage);
    }

    /// All steps that were taken.
    #[cfg(test)]
    pub(crate) fn steps(&self) -> u64 {
        self.steps
    }
}

/// The events that `work` reports, if it is asked to stop after `last` of them.
#[cfg(test)]
pub(crate) fn heard(
    last: usize,
    work: impl FnOnce(&Watch<'_>),
) -> Vec<silmap_geometry::StageEvent> {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, Ordering};

    let (events, stop) = (Mutex::new(Vec::new()), AtomicBool::new(false));
    let listen = |event| {
        let mut events = events.lock().expect("nobody panics with it");
        events.push(event);
        stop.store(events.len() >= last, Ordering::Relaxed);
    };
    work(&Watch::new(&listen, &stop));
    events.into_inner().expect("nobody panics with it")
}
