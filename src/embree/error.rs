//! What can go wrong with Embree.

use std::fmt;

use glam::Vec3;
use thiserror::Error;

use super::sys;
use crate::ray::MAX_COORDINATE;
use crate::trace::{TransformError, WorldError};

/// Embree's error codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorCode {
    /// Something else, also codes of later versions.
    Unknown,
    /// An argument is out of its range, or the configuration cannot be read.
    InvalidArgument,
    /// Not allowed in this state.
    InvalidOperation,
    /// No memory left.
    OutOfMemory,
    /// The processor lacks SSE2 or what the library was built for.
    UnsupportedCpu,
    /// Stopped by a monitor.
    Cancelled,
}

impl ErrorCode {
    pub(super) fn from_raw(code: i32) -> Self {
        match u32::try_from(code) {
            Ok(sys::PM_ERROR_INVALID_ARGUMENT) => Self::InvalidArgument,
            Ok(sys::PM_ERROR_INVALID_OPERATION) => Self::InvalidOperation,
            Ok(sys::PM_ERROR_OUT_OF_MEMORY) => Self::OutOfMemory,
            Ok(sys::PM_ERROR_UNSUPPORTED_CPU) => Self::UnsupportedCpu,
            Ok(sys::PM_ERROR_CANCELLED) => Self::Cancelled,
            _ => Self::Unknown,
        }
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "unknown error",
            Self::InvalidArgument => "invalid argument",
            Self::InvalidOperation => "invalid operation",
            Self::OutOfMemory => "out of memory",
            Self::UnsupportedCpu => "unsupported processor",
            Self::Cancelled => "cancelled",
        })
    }
}

/// Why Embree, or what it called, failed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EmbreeError {
    /// Embree says so.
    #[error("Embree: {code}: {message}")]
    Library {
        /// Embree's code.
        code: ErrorCode,
        /// Embree's words.
        message: String,
    },
    /// The device's byte limit was reached.
    #[error("Embree needs more memory than its limit of {limit} bytes")]
    MemoryLimit {
        /// [`DeviceOptions::memory_limit`](super::DeviceOptions::memory_limit).
        limit: usize,
    },
    /// The library was built without something that is needed.
    #[error(
        "this Embree ({version}) was built without {what}; use Debian's libembree-dev or another build"
    )]
    Unsupported {
        /// Version of the library.
        version: String,
        /// What it lacks.
        what: &'static str,
    },
    /// A hit test or a filter panicked; its rays saw a miss.
    #[error("a hit test panicked: {message}")]
    HitTestPanicked {
        /// The panic's message.
        message: String,
    },
    /// A device of another major version than the headers that this was built with.
    #[error("the device is of Embree {found}; this was built for Embree {expected}")]
    WrongVersion {
        /// Major version of the device.
        found: u32,
        /// Major version of the headers.
        expected: u32,
    },
    /// A hit test with no time step at all.
    #[error("a hit test has 0 time steps; expected at least 1")]
    NoTimeSteps,
    /// A box that is NaN, inverted or too large: Embree would drop the primitive silently.
    #[error(
        "the bounds of primitive {prim} are {:?} .. {:?}; expected ordered numbers within +-{MAX_COORDINATE:e}",
        min.to_array(), max.to_array()
    )]
    InvalidBounds {
        /// The primitive.
        prim: u32,
        /// Smallest corner found.
        min: Vec3,
        /// Largest corner found.
        max: Vec3,
    },
    /// More primitives, vertices or geometries than 32-bit ids can count.
    #[error("{found} {what}; Embree counts at most {max}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many were given.
        found: usize,
        /// Largest number.
        max: usize,
    },
    /// A triangle or grid that reads beyond the vertices, or a grid that is too small or too large.
    #[error("{what} {index} does not fit its {vertices} vertices")]
    BadElement {
        /// Of what kind.
        what: &'static str,
        /// Its number.
        index: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A transform of an instance without an inverse, or one that is too extreme.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// A world that no backend can trace.
    #[error("object {}: {source}", source.object())]
    World {
        /// Why.
        #[from]
        source: WorldError,
    },
    /// A scene that itself has instances cannot be instanced.
    #[error("a scene with instances cannot be instanced: hits hold one instance level")]
    NestedInstances,
    /// No such geometry or prototype, or one of another kind.
    #[error("there is no {what} {id} in this scene")]
    NotInScene {
        /// What was looked for.
        what: &'static str,
        /// Its id.
        id: u32,
    },
}
