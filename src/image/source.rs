//! Where a picture's bytes are: in a file, or in memory.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use super::{Format, ImageError};
use crate::files::input;

/// A picture to be read.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a> {
    /// A file.
    File(&'a Path),
    /// Bytes in memory, like those of a picture inside of a mesh file.
    Memory {
        /// What messages call it; its ending tells a TGA, which no first bytes do.
        name: &'a Path,
        /// The picture.
        bytes: &'a [u8],
    },
}

impl<'a> From<&'a Path> for Source<'a> {
    fn from(path: &'a Path) -> Self {
        Self::File(path)
    }
}

impl<'a> From<&'a PathBuf> for Source<'a> {
    fn from(path: &'a PathBuf) -> Self {
        Self::File(path)
    }
}

/// What every decoder reads from.
pub(super) trait Bytes: BufRead + Seek {}

impl<R: BufRead + Seek> Bytes for R {}

/// A picture whose format is known, at its start.
pub(super) struct Input<'a> {
    /// What messages call it.
    pub path: &'a Path,
    pub format: Format,
    /// Bytes there are.
    pub length: u64,
    pub bytes: Box<dyn Bytes + 'a>,
}

impl<'a> Source<'a> {
    /// What messages call it.
    pub(super) fn path(self) -> &'a Path {
        match self {
            Self::File(path) | Self::Memory { name: path, .. } => path,
        }
    }

    pub(super) fn open(self) -> Result<Input<'a>, ImageError> {
        let path = self.path();
        let read_error = |source| ImageError::read(path, source);
        let (length, mut bytes): (u64, Box<dyn Bytes + 'a>) = match self {
            Self::File(path) => {
                let file: File = input::open(path).map_err(read_error)?;
                let length = file.metadata().map_err(read_error)?.len();
                (length, Box::new(BufReader::new(file)))
            }
            Self::Memory { bytes, .. } => (bytes.len() as u64, Box::new(Cursor::new(bytes))),
        };
        let mut start = Vec::with_capacity(Format::SIGNATURE);
        (&mut bytes)
            .take(Format::SIGNATURE as u64)
            .read_to_end(&mut start)
            .map_err(read_error)?;
        bytes.rewind().map_err(read_error)?;
        if start.is_empty() {
            return Err(ImageError::EmptyFile {
                path: path.to_owned(),
            });
        }
        let format = Format::of(&start, path).ok_or_else(|| ImageError::UnknownFormat {
            path: path.to_owned(),
        })?;
        Ok(Input {
            path,
            format,
            length,
            bytes,
        })
    }
}

impl Input<'_> {
    /// The decoder gave up.
    pub fn failed(&self, reason: impl ToString) -> ImageError {
        ImageError::decode(self.path, self.format, reason)
    }

    /// All bytes of it.
    pub fn read_all(&mut self) -> Result<Vec<u8>, ImageError> {
        let read_error = |source| ImageError::read(self.path, source);
        let mut all = Vec::new();
        let length = usize::try_from(self.length).unwrap_or(usize::MAX);
        all.try_reserve_exact(length)
            .map_err(|_| read_error(std::io::ErrorKind::OutOfMemory.into()))?;
        self.bytes.read_to_end(&mut all).map_err(read_error)?;
        Ok(all)
    }
}

/// Room in `samples` for `more` of the `total` there may be. Memory is taken as samples come, never on the word of a header.
pub(super) fn make_room<T>(
    samples: &mut Vec<T>,
    more: usize,
    total: usize,
    path: &Path,
) -> Result<(), ImageError> {
    let needed = samples.len().saturating_add(more);
    if needed <= samples.capacity() {
        return Ok(());
    }
    let wanted = needed.max(samples.capacity().saturating_mul(2).min(total));
    samples
        .try_reserve_exact(wanted - samples.len())
        .map_err(|_| ImageError::read(path, std::io::ErrorKind::OutOfMemory.into()))
}
