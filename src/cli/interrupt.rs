//! Ctrl-C and SIGTERM: the first asks the run to end in good order, the second ends it at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::error::CliError;

/// A shell's exit code for a program that a signal ended, less the signal.
pub const EXIT_BASE: i32 = 128;

/// Remembers a signal.
pub struct Interrupt(Arc<AtomicUsize>);

impl Interrupt {
    /// From here on signals are caught.
    pub fn catch() -> Result<Self, CliError> {
        let caught = Arc::new(AtomicUsize::new(0));
        let again = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds `again` still false.
            flag::register_conditional_shutdown(signal, EXIT_BASE + signal, again.clone())
                .and_then(|_| flag::register(signal, again.clone()))
                .and_then(|_| flag::register_usize(signal, caught.clone(), signal as usize))
                .map_err(CliError::Signals)?;
        }
        Ok(Self(caught))
    }

    /// The signal that came, if any.
    pub fn signal(&self) -> Option<i32> {
        // Only the numbers registered above are stored.
        Some(self.0.load(Ordering::Relaxed) as i32).filter(|&signal| signal != 0)
    }
}
