//! What goes wrong where Embree calls Rust and nothing can be returned.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

use super::EmbreeError;

/// The first fault since one last asked.
#[derive(Debug, Default)]
pub struct Faults(Mutex<Option<EmbreeError>>);

impl Faults {
    /// Keeps a fault, unless there is one already.
    pub(super) fn record(&self, error: EmbreeError) {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert(error);
    }

    /// Keeps a caught panic as a fault.
    pub(super) fn record_panic(&self, payload: &(dyn Any + Send)) {
        self.record(EmbreeError::HitTestPanicked {
            message: panic_message(payload),
        });
    }

    /// The fault that is kept, which is then forgotten.
    pub fn take(&self) -> Result<(), EmbreeError> {
        let mut fault = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        fault.take().map_or(Ok(()), Err)
    }
}

/// What a panic said.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_string())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "(no message)".to_string())
}
