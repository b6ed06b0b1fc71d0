//! Why a file is no part of a picture.

use std::path::PathBuf;

use thiserror::Error;

use super::info::Part;
use crate::image::ImageError;

/// Why a file cannot be gone on with, or merged. Each names the file.
#[derive(Debug, Error)]
pub enum FrameError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It lacks what EXR files of this program have.
    #[error("{path} was not rendered by prismarch: it has no {missing}")]
    NotAFrame {
        /// The file.
        path: PathBuf,
        /// The first thing that is missing.
        missing: String,
    },
    /// An attribute has a value that it cannot have.
    #[error("{path}: attribute {name}: found {found}; expected {expected}")]
    Attribute {
        /// The file.
        path: PathBuf,
        /// Its attribute.
        name: String,
        /// What it says.
        found: String,
        /// What it could say.
        expected: String,
    },
    /// A count that is none.
    #[error(
        "{path}: channel {channel}, pixel ({x}, {y}): found {found}; expected a whole number of samples"
    )]
    Count {
        /// The file.
        path: PathBuf,
        /// The channel.
        channel: String,
        /// Column, from the left of the whole picture.
        x: u32,
        /// Row, from its top.
        y: u32,
        /// What is there.
        found: f32,
    },
    /// Two files are of different pictures.
    #[error("{path} does not belong to {other}: {what}: found {found}; expected {expected}")]
    Differs {
        /// The file.
        path: PathBuf,
        /// What it is compared with.
        other: PathBuf,
        /// What differs.
        what: String,
        /// What the file has.
        found: String,
        /// What the other has.
        expected: String,
    },
    /// Two files hold the same samples.
    #[error("{path} and {other} both hold the samples {}..{} of the pixels {}", part.samples.start, part.samples.end, part.window)]
    Twice {
        /// One file.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// What both hold.
        part: Part,
    },
    /// The file is of an interrupted run.
    #[error("{path} is partial: its run was interrupted; finish it first (render --resume)")]
    Partial {
        /// The file.
        path: PathBuf,
    },
}
