//! Where a library may panic on what a file holds: its unwinding ends here, without a word.
//!
//! Whatever is known to upset a library is checked before it is called; this is for what is not known.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

static QUIET_HOOK: Once = Once::new();

/// Calls into a library; `None` when it panics. Nothing that `call` changes may be used afterwards.
pub(super) fn guarded<T>(call: impl FnOnce() -> T) -> Option<T> {
    // The message of a panic is printed before it unwinds; other threads and other places keep theirs.
    QUIET_HOOK.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                others(info);
            }
        }));
    });
    let was_quiet = IS_QUIET.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(call));
    IS_QUIET.set(was_quiet);
    outcome.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_ends_at_the_border() {
        assert_eq!(guarded(|| 7), Some(7));
        let nothing: Vec<u8> = Vec::new();
        assert_eq!(guarded(|| nothing[std::hint::black_box(3)]), None);
        assert!(!IS_QUIET.get());
        // One inside another.
        assert_eq!(
            guarded(|| guarded(|| panic!("inside")).is_none()),
            Some(true)
        );
    }
}
