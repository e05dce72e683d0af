//! Progress of long computations, and stopping them.

use thiserror::Error;

/// How far long work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Advance {
    /// Units of work done.
    pub done: u64,
    /// Units of work in all; an estimate.
    pub total: u64,
}

/// Called every few milliseconds of work; the work ends with an error soon after it says `false`.
pub type Watch<'a> = dyn FnMut(Advance) -> bool + 'a;

/// The caller ended the work.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("interrupted")]
pub struct Stopped;

/// Work that is counted in steps, of which its caller hears now and then.
pub(crate) struct Counter<'a, 'w> {
    watch: &'a mut Watch<'w>,
    done: u64,
    total: u64,
    steps: u64,
    /// Steps that were taken when the caller last heard.
    heard: u64,
    /// Steps that take some milliseconds.
    patience: u64,
}

impl<'a, 'w> Counter<'a, 'w> {
    /// `patience` is how many steps pass before the caller hears again.
    pub(crate) fn new(watch: &'a mut Watch<'w>, total: u64, patience: u64) -> Self {
        Self {
            watch,
            done: 0,
            total,
            steps: 0,
            heard: 0,
            patience,
        }
    }

    /// So much of the total is done.
    pub(crate) fn advance(&mut self, units: u64) {
        self.done += units;
    }

    /// Some steps were taken.
    pub(crate) fn step(&mut self, steps: u64) -> Result<(), Stopped> {
        self.steps += steps;
        if self.steps - self.heard < self.patience {
            return Ok(());
        }
        self.tell()
    }

    /// Lets the caller hear now.
    pub(crate) fn tell(&mut self) -> Result<(), Stopped> {
        self.heard = self.steps;
        let advance = Advance {
            done: self.done.min(self.total),
            total: self.total,
        };
        if (self.watch)(advance) {
            Ok(())
        } else {
            Err(Stopped)
        }
    }

    /// All steps that were taken.
    #[cfg(test)]
    pub(crate) fn steps(&self) -> u64 {
        self.steps
    }
}

/// A watch for work that nobody stops.
pub(crate) fn unwatched(_: Advance) -> bool {
    true
}
