//! Which format a file is in, by its first bytes.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use super::ImageError;
use crate::files::input;

/// A picture format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG.
    Png,
    /// JPEG.
    Jpeg,
    /// TIFF and BigTIFF.
    Tiff,
    /// OpenEXR.
    Exr,
    /// Radiance RGBE.
    Hdr,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tiff => "TIFF",
            Self::Exr => "OpenEXR",
            Self::Hdr => "Radiance HDR",
        })
    }
}

/// What the longest signature needs.
const SIGNATURE: usize = 8;

impl Format {
    fn of_bytes(start: &[u8]) -> Option<Self> {
        const SIGNATURES: [(&[u8], Format); 9] = [
            (b"\x89PNG\r\n\x1a\n", Format::Png),
            (b"\xff\xd8\xff", Format::Jpeg),
            (b"II*\0", Format::Tiff),
            (b"MM\0*", Format::Tiff),
            (b"II+\0", Format::Tiff),
            (b"MM\0+", Format::Tiff),
            (b"\x76\x2f\x31\x01", Format::Exr),
            (b"#?RADIAN", Format::Hdr),
            (b"#?RGBE", Format::Hdr),
        ];
        SIGNATURES
            .iter()
            .find(|(signature, _)| start.starts_with(signature))
            .map(|&(_, format)| format)
    }
}

/// Opens a picture, rewound to its start.
pub(super) fn open(path: &Path) -> Result<(Format, BufReader<File>), ImageError> {
    let read_error = |source| ImageError::Read {
        path: path.to_owned(),
        source,
    };
    let mut file = input::open(path).map_err(read_error)?;
    let mut start = Vec::with_capacity(SIGNATURE);
    (&mut file)
        .take(SIGNATURE as u64)
        .read_to_end(&mut start)
        .map_err(read_error)?;
    if start.is_empty() {
        return Err(ImageError::EmptyFile {
            path: path.to_owned(),
        });
    }
    let format = Format::of_bytes(&start).ok_or_else(|| ImageError::UnknownFormat {
        path: path.to_owned(),
    })?;
    file.rewind().map_err(read_error)?;
    Ok((format, BufReader::new(file)))
}
