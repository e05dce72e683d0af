//! How long work tells its caller how far it is, and how the caller stops it.

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
