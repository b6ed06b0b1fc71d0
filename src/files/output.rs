//! Files that appear complete or not at all.

mod target;
mod temporary;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::identity::Identity;
use target::Target;

/// Why a file could not be written. The old file, if there was one, is untouched.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The folder to write into does not exist.
    #[error("cannot write {path}: there is no folder {folder}")]
    FolderMissing {
        /// The file.
        path: PathBuf,
        /// The missing folder.
        folder: PathBuf,
    },
    /// The path names a folder, a device or nothing.
    #[error("cannot write {path}: it is not the name of a regular file")]
    NotAFile {
        /// The path as given.
        path: PathBuf,
    },
    /// The file that is there is read-only, or another user's.
    #[error("cannot write {path}: the file that is there may not be changed ({source})")]
    Protected {
        /// The file.
        path: PathBuf,
        /// What the system said, or would say.
        source: io::Error,
    },
    /// No permission, or a read-only file system.
    #[error("cannot write {path}: {folder} is not writable ({source})")]
    NotWritable {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is one that the same run reads.
    #[error("cannot write {path} over {input}: this run reads that file")]
    IsInput {
        /// The output as given.
        path: PathBuf,
        /// The input's name.
        input: PathBuf,
    },
    /// The file is another output of the same run.
    #[error("cannot write both {path} and {other}: they are one file")]
    Twice {
        /// One output.
        path: PathBuf,
        /// The other.
        other: PathBuf,
    },
    /// No space left on the disk, or in the user's quota.
    #[error("cannot write {path}: the disk is full ({source})")]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The picture's size does not fit its pixels or the format.
    #[error(
        "cannot write {path}: {found} pixels were given for {width}x{height}, which must be at least 1x1"
    )]
    WrongSize {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: usize,
        /// Pixels up.
        height: usize,
        /// Pixels given.
        found: usize,
    },
    /// Anything else.
    #[error("cannot write {path}: {source}")]
    Failed {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said.
        source: io::Error,
    },
}

impl OutputError {
    /// Whether the outputs were chosen badly, and nothing is wrong with any of them.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::IsInput { .. } | Self::Twice { .. })
    }
}

/// Writes a file through `body`, then gives it its name.
///
/// `body` writes to a temporary file in the folder of `path`, which takes the place of `path` once `body` has succeeded. On any
/// error the temporary file is gone and what was at `path` is as before. If the process is killed on the way the temporary file
/// stays, until the next `write` or [`check`] of the same file removes it.
///
/// File and folder are synced: after a power cut there is the old file or the new one, whole. A symbolic link at `path` is
/// followed, also to where nothing is yet. The new file has the old one's mode, and its owner as far as that is allowed.
///
/// # Errors
///
/// As [`check`], and what the system or `body` says. If the last step alone fails, the sync of the folder, the new file is there.
pub fn write(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), OutputError> {
    stage(path, body)?.commit()
}

/// The first half of [`write()`]: the file is complete and on the disk, but still without its name.
///
/// # Errors
///
/// As [`write()`].
pub fn stage(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<Staged, OutputError> {
    let target = Target::of(path)?;
    let temporary = target.temporary()?;
    let file = temporary.as_file();
    let mut writer = BufWriter::new(file);
    body(&mut writer)
        .and_then(|()| writer.flush())
        .and_then(|()| target.dress(file))
        // Before the name: it must not lead to a file whose bytes are lost in a power cut.
        .and_then(|()| file.sync_all())
        .map_err(|source| target.failed(source))?;
    drop(writer);
    Ok(Staged { temporary, target })
}

/// A complete file that has not got its name yet, and is gone if it never gets it.
#[derive(Debug)]
pub struct Staged {
    temporary: tempfile::NamedTempFile,
    target: Target,
}

impl Staged {
    /// Where its bytes are for now.
    pub fn content(&self) -> &Path {
        self.temporary.path()
    }

    /// Gives the file its name: the second half of [`write()`].
    ///
    /// # Errors
    ///
    /// As [`write()`].
    pub fn commit(self) -> Result<(), OutputError> {
        let Self { temporary, target } = self;
        let named = temporary.persist(&target.file);
        named // the temporary file inside the error is removed with it
            .map_err(|error| error.error)
            .and_then(|_| target.sync_folder())
            .map_err(|source| target.failed(source))
    }
}

/// Fails now if [`write()`] to this path would fail for its name, its folder or permissions.
///
/// Refused are: folders, and names that end as theirs do; devices and pipes, which a rename would replace; what is in no folder;
/// names that the file system does not take; and files that are read-only, which a rename would replace as well.
///
/// # Errors
///
/// Any but [`OutputError::IsInput`] and [`OutputError::Twice`].
pub fn check(path: &Path) -> Result<(), OutputError> {
    checked(path).map(drop)
}

/// As [`check`]; which file it would be.
pub(super) fn checked(path: &Path) -> Result<Identity, OutputError> {
    let target = Target::of(path)?;
    target.temporary()?; // dropped, and removed with that
    Ok(target.identity())
}

#[cfg(test)]
mod tests;
