//! Why a picture could not be read.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Format, MAX_PIXELS};
use crate::surface::MapError;

/// Why a picture could not be read. Each names the file.
#[derive(Debug, Error)]
pub enum ImageError {
    /// No such file, no permission, a folder.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Zero bytes.
    #[error("{path} is empty; a picture is expected")]
    EmptyFile {
        /// The file.
        path: PathBuf,
    },
    /// The first bytes are those of no format that is read.
    #[error(
        "{path} is not a picture that is read: PNG, JPEG, TIFF, OpenEXR, Radiance HDR, WebP, BMP, TGA, PNM and PFM are"
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Broken, truncated, or a variant of the format that is not supported.
    #[error("cannot decode {path} as {format}: {reason}")]
    Decode {
        /// The file.
        path: PathBuf,
        /// What its first bytes say it is.
        format: Format,
        /// What the decoder met.
        reason: String,
    },
    /// Zero pixels across or up.
    #[error("{path} is {width}x{height} pixels; at least 1x1 is needed")]
    NoPixels {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: u64,
        /// Pixels up.
        height: u64,
    },
    /// More than [`MAX_PIXELS`].
    #[error("{path} claims {width}x{height} pixels; at most {MAX_PIXELS} pixels are read")]
    TooManyPixels {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: u64,
        /// Pixels up.
        height: u64,
    },
    /// Samples, colours or compression of a kind that is not read.
    #[error("{path} holds {found}, which is not supported; {expected}")]
    UnsupportedSamples {
        /// The file.
        path: PathBuf,
        /// The kind of samples.
        found: String,
        /// What to convert it to.
        expected: &'static str,
    },
    /// The wanted channel is not in the file.
    #[error("{path} has no channel {wanted}; its channels are {found}")]
    NoSuchChannel {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// All channels of the file.
        found: String,
    },
    /// A channel's short name fits several channels.
    #[error("channel {wanted} of {path} could be any of {found}; give the full name")]
    AmbiguousChannel {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// The channels that fit.
        found: String,
    },
    /// A colour picture was to be read as one channel, but its channels differ.
    #[error(
        "the channels {channels} of {path} differ, first at pixel ({x}, {y}) from the bottom left; choose one of them"
    )]
    ChannelsDisagree {
        /// The file.
        path: PathBuf,
        /// The channels that were compared.
        channels: String,
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
    },
    /// A map that cannot be a displacement map.
    #[error("{path}: {source}")]
    Map {
        /// The file.
        path: PathBuf,
        /// Why.
        source: MapError,
    },
    /// A texel without data, by what the file declares.
    #[error(
        "texel ({x}, {y}) of {path} (from the bottom left) is {value}, which the file declares to mean no data; \
         nodata = HEIGHT in a scene, or --nodata HEIGHT, says what to put there"
    )]
    NoData {
        /// The file.
        path: PathBuf,
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
        /// The value as the file declares it.
        value: String,
    },
    /// A file that declares to mean "no data" what is no number.
    #[error("{path} declares {value:?} to mean no data; a number is expected (tag 42113)")]
    BadNoData {
        /// The file.
        path: PathBuf,
        /// What it declares.
        value: String,
    },
    /// A NaN, infinite or enormous height.
    #[error(
        "texel ({x}, {y}) of {path} (from the bottom left) is {value:e}; a height is a finite number below 1e18, and \
         nodata = HEIGHT in a scene, or --nodata HEIGHT, says what to put there"
    )]
    NoHeight {
        /// The file.
        path: PathBuf,
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
        /// What was found.
        value: f32,
    },
    /// A NaN or infinite pixel.
    #[error("pixel ({x}, {y}) from the top left of {path} is {value}; pixels must be finite")]
    BadPixel {
        /// The file.
        path: PathBuf,
        /// Column from the left.
        x: usize,
        /// Row from the top.
        y: usize,
        /// The first bad component.
        value: f32,
    },
    /// A picture of low dynamic range where radiance is needed.
    #[error("{path} is a {format} picture; an environment needs OpenEXR or Radiance HDR")]
    NotRadiance {
        /// The file.
        path: PathBuf,
        /// What it is.
        format: Format,
    },
}

impl ImageError {
    /// The system would not give the bytes of `path`.
    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    /// The decoder of `format` gave up on `path`.
    pub(super) fn decode(path: &Path, format: Format, reason: impl ToString) -> Self {
        Self::Decode {
            path: path.to_owned(),
            format,
            reason: reason.to_string(),
        }
    }
}

/// Refuses a header's claim before any memory is taken for it.
pub(super) fn check_size(path: &Path, width: u64, height: u64) -> Result<(), ImageError> {
    let path = || path.to_owned();
    if width == 0 || height == 0 {
        return Err(ImageError::NoPixels {
            path: path(),
            width,
            height,
        });
    }
    if width.saturating_mul(height) > MAX_PIXELS {
        return Err(ImageError::TooManyPixels {
            path: path(),
            width,
            height,
        });
    }
    Ok(())
}
