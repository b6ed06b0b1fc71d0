//! Decoders of other houses: where one panics on a damaged file, that is a reason to refuse the file.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, catch_unwind};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// What `decode` gives, in this thread. What it has changed when it panics must not be used any more.
///
/// # Errors
///
/// A sentence for the user, where it panics.
pub fn guarded<T>(decode: impl FnOnce() -> T) -> Result<T, String> {
    let before = GUARDED.replace(true);
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    GUARDED.set(before);
    decoded.map_err(|_| "the decoder stumbled over it; is it damaged?".to_owned())
}

/// Whether this thread is in a decoder whose panics are caught: for panic hooks.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// For programs: panics in decoders, which are caught and become errors, leave no trace on the standard error stream, all others do as before.
pub fn keep_caught_panics_quiet() {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        if !is_guarded() {
            usual(info);
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_reason() {
        assert_eq!(guarded(|| 3), Ok(3));
        let hollow: Result<(), String> = guarded(|| panic!("inside a test"));
        assert!(hollow.unwrap_err().contains("stumbled"));
        assert!(!is_guarded());
    }
}
