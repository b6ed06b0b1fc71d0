//! Which file a path means, whatever it is called there.

use std::fs::Metadata;
use std::path::{Path, PathBuf};

/// A file, or the place where one is to be. Two names of one file are equal by one of the fields: hard links share a number,
/// and a file system that gives none still has one path without links and `..` to each file.
#[derive(Clone, Debug)]
pub struct Identity {
    number: Option<Number>,
    place: Option<PathBuf>,
}

/// Device and inode.
type Number = (u64, u64);

impl Identity {
    /// The regular file at `path`, links followed; `None` if there is none.
    pub fn of_file(path: &Path) -> Option<Self> {
        let found = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        Some(Self {
            number: number(&found),
            place: path.canonicalize().ok(),
        })
    }

    /// The file that is to be made under this name, which is no link.
    pub fn to_come(folder: &Path, path: &Path) -> Self {
        let place = folder.canonicalize().ok().zip(path.file_name());
        Self {
            number: None,
            place: place.map(|(folder, name)| folder.join(name)),
        }
    }

    /// The regular file that a stream of this process leads to; `None` for terminals, pipes and devices.
    #[cfg(unix)]
    pub fn of_stream(stream: impl std::os::fd::AsFd) -> Option<Self> {
        let stream = stream.as_fd().try_clone_to_owned().ok()?;
        let found = std::fs::File::from(stream).metadata().ok();
        let found = found.filter(Metadata::is_file)?;
        Some(Self {
            number: number(&found),
            place: None,
        })
    }

    /// The system does not tell.
    #[cfg(not(unix))]
    pub fn of_stream<T>(_: T) -> Option<Self> {
        None
    }

    /// Whether both are one file.
    pub fn is(&self, other: &Self) -> bool {
        (self.number.is_some() && self.number == other.number)
            || (self.place.is_some() && self.place == other.place)
    }
}

#[cfg(unix)]
fn number(found: &Metadata) -> Option<Number> {
    use std::os::unix::fs::MetadataExt as _;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> Option<Number> {
    None
}
