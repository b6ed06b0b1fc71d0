//! From results and panics to statuses with a text.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::declarations::{self as c, prismarch_error, prismarch_status};
use crate::embree::{EmbreeError, panic_message};
use crate::image::ImageError;
use crate::prism::MarchError;
use crate::ray::MAX_COORDINATE;
use crate::surface::{InterpolateError, MapError, MeshError, MotionError, SurfaceError};

/// A status other than OK, and what to say.
#[derive(Debug)]
pub struct Failure {
    pub status: prismarch_status,
    pub message: String,
}

impl Failure {
    pub fn argument(message: impl Display) -> Self {
        Self::new(c::prismarch_status_PRISMARCH_ERROR_ARGUMENT, message)
    }

    pub fn data(message: impl Display) -> Self {
        Self::new(c::prismarch_status_PRISMARCH_ERROR_DATA, message)
    }

    pub fn null(what: &str) -> Self {
        let message = format!("{what} is NULL");
        Self::new(c::prismarch_status_PRISMARCH_ERROR_NULL, message)
    }

    pub fn handle(what: &str) -> Self {
        let message = format!("{what} is no live handle; it was released, or never given");
        Self::new(c::prismarch_status_PRISMARCH_ERROR_HANDLE, message)
    }

    pub fn other_kind(what: &str, found: &str) -> Self {
        let message = format!("{what} is the handle of a {found}");
        Self::new(c::prismarch_status_PRISMARCH_ERROR_HANDLE, message)
    }

    pub fn geometry() -> Self {
        Self::new(
            c::prismarch_status_PRISMARCH_ERROR_HANDLE,
            "geometry is not one that prismarch made, or was destroyed",
        )
    }

    pub fn in_flight() -> Self {
        Self::new(
            c::prismarch_status_PRISMARCH_ERROR_IN_FLIGHT,
            "the surface is in use; updates must wait until no ray is in flight, and no commit or other call is under way",
        )
    }

    pub fn memory(what: impl Display, bytes: usize) -> Self {
        Self::new(
            c::prismarch_status_PRISMARCH_ERROR_MEMORY,
            format!("{what} take {bytes} bytes, and there is no memory for them"),
        )
    }

    pub fn too_far(reach: f32) -> Self {
        Self::data(format!(
            "the displaced surface reaches {reach:e} from the origin; Embree takes what is within {MAX_COORDINATE:e}"
        ))
    }

    pub fn embree(message: impl Display) -> Self {
        Self::new(c::prismarch_status_PRISMARCH_ERROR_EMBREE, message)
    }

    fn new(status: prismarch_status, message: impl Display) -> Self {
        Self {
            status,
            message: message.to_string(),
        }
    }
}

macro_rules! failure_from {
    ($($error:ty => $status:ident,)*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::new(c::$status, error)
            }
        }
    )*};
}

failure_from! {
    MeshError => prismarch_status_PRISMARCH_ERROR_DATA,
    MotionError => prismarch_status_PRISMARCH_ERROR_DATA,
    MarchError => prismarch_status_PRISMARCH_ERROR_ARGUMENT,
    InterpolateError => prismarch_status_PRISMARCH_ERROR_ARGUMENT,
    ImageError => prismarch_status_PRISMARCH_ERROR_FILE,
    EmbreeError => prismarch_status_PRISMARCH_ERROR_EMBREE,
}

impl From<SurfaceError> for Failure {
    fn from(error: SurfaceError) -> Self {
        match error {
            SurfaceError::TooHigh { .. } | SurfaceError::TooFine { .. } => Self::data(error),
            _ => Self::argument(error),
        }
    }
}

impl From<MapError> for Failure {
    fn from(error: MapError) -> Self {
        match error {
            MapError::NotFinite { .. } => Self::data(error),
            _ => Self::argument(error),
        }
    }
}

/// Runs a call from C: no panic gets out, and what is wrong is written to `error` where that is not null.
///
/// # Safety
///
/// `error` is null or valid for a write, at any alignment.
pub unsafe fn answer(
    error: *mut prismarch_error,
    call: impl FnOnce() -> Result<(), Failure>,
) -> prismarch_status {
    let outcome = catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| {
        Err(Failure {
            status: c::prismarch_status_PRISMARCH_ERROR_PANIC,
            message: format!("a fault of prismarch: {}", panic_message(&*payload)),
        })
    });
    let (status, message) = match &outcome {
        Ok(()) => (c::prismarch_status_PRISMARCH_OK, ""),
        Err(failure) => (failure.status, failure.message.as_str()),
    };
    if !error.is_null() {
        let mut told = prismarch_error {
            status,
            message: [0; c::PRISMARCH_MESSAGE_SIZE as usize],
        };
        write_text(&mut told.message, message);
        // SAFETY: the caller's promise; no alignment is asked.
        unsafe { error.write_unaligned(told) };
    }
    status
}

/// As much as fits, in whole characters, ended by a zero.
fn write_text(out: &mut [std::ffi::c_char], text: &str) {
    let mut length = text.len().min(out.len() - 1);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    for (out, byte) in out
        .iter_mut()
        .zip(text.as_bytes()[..length].iter().chain(&[0]))
    {
        *out = *byte as std::ffi::c_char; // the same bits
    }
}
