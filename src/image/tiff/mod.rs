//! TIFF and BigTIFF: the first page of full resolution, in the type of its samples.
//!
//! The container is read here: directories (TIFF 6.0, section 2; BigTIFF), strips and tiles, packed samples, predictors
//! (section 14; Adobe Photoshop TIFF technical note 3), palettes. Compression is left to crates. A header is believed
//! only as far as there are bytes: a strip is decompressed no further than its pixels go, and memory for pixels is taken
//! when all strips or tiles of the next rows are there.

mod channels;
mod codec;
mod directory;
mod jpeg;
mod layout;
mod orientation;
mod palette;
mod pixels;
mod predictor;

use std::io::{self, BufRead, Seek};
use std::path::Path;

use super::raster::{Raster, channel_names};
use super::samples::{NoData, Number, Samples, map_each};
use super::{Format, ImageError};
use directory::Source;
use layout::{Layout, Photometric};

/// Decodes the picture of a TIFF file.
pub(super) fn decode(path: &Path, source: impl BufRead + Seek) -> Result<Raster, ImageError> {
    read(path, source).map_err(|fault| match fault {
        Fault::Image(error) => error,
        Fault::Broken(reason) => ImageError::decode(path, Format::Tiff, reason),
        Fault::Unsupported(found, expected) => ImageError::UnsupportedSamples {
            path: path.to_owned(),
            found,
            expected,
        },
        Fault::Read(source) => ImageError::Read {
            path: path.to_owned(),
            source,
        },
    })
}

fn read(path: &Path, reader: impl BufRead + Seek) -> Result<Raster, Fault> {
    let (mut source, first) = Source::open(reader)?;
    let page = directory::page(&mut source, first)?;
    let layout = Layout::read(path, &page, &mut source)?;
    let rows = (layout.width, layout.height);
    let samples = pixels::read(&mut source, &layout)?;
    let samples = map_each!(samples, s => layout.orientation.apply(s, rows)?);
    let (width, height) = layout.orientation.size(rows);
    if let Photometric::Palette(colors) = &layout.photometric {
        return Ok(Raster {
            width,
            height,
            channels: channel_names(3),
            samples: palette::apply(colors, samples)?,
            // It would be an index, and no height.
            nodata: None,
        });
    }
    let nodata = layout.nodata.clone().map(|text| NoData {
        number: Number::parse(&text).map(|number| pixels::as_read(&layout, number)),
        text,
    });
    Ok(Raster {
        width,
        height,
        channels: layout.channels,
        samples,
        nodata,
    })
}

/// Why a TIFF file is not read; its name is added at the end.
#[derive(Debug)]
enum Fault {
    /// Damaged, or no TIFF at all: what is wrong.
    Broken(String),
    /// Sound, but of a kind that is not read: what it holds, and what to write instead.
    Unsupported(String, &'static str),
    /// What the system said.
    Read(io::Error),
    /// Said already.
    Image(ImageError),
}

impl Fault {
    fn broken(reason: impl ToString) -> Self {
        Self::Broken(reason.to_string())
    }
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::broken("the end of the file is missing"),
            _ => Self::Read(error),
        }
    }
}

impl From<ImageError> for Fault {
    fn from(error: ImageError) -> Self {
        Self::Image(error)
    }
}

#[cfg(test)]
mod tests;
