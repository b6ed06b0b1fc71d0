//! Where an output goes: links followed, and refused where nothing can be written.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::{OutputError, temporary};
use crate::files::identity::Identity;

/// Links that are followed, as Linux has it.
const MOST_LINKS: usize = 40;

/// A file to be written.
#[derive(Debug)]
pub struct Target {
    /// As given, for messages.
    path: PathBuf,
    /// Without links at its end.
    pub file: PathBuf,
    folder: PathBuf,
    /// What is there now.
    old: Option<Metadata>,
}

impl Target {
    /// The file that `path` means.
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let (file, old) = follow(path)?;
        let folder = folder(&file).to_owned();
        let target = Self {
            path: path.to_owned(),
            file,
            folder,
            old,
        };
        target.check_folder()?;
        target.check_old()?;
        Ok(target)
    }

    /// An empty file beside it, on the same file system, that is removed when it is dropped.
    pub fn temporary(&self) -> Result<NamedTempFile, OutputError> {
        let name = self.file.file_name().unwrap_or_default();
        let made = temporary::create(&self.folder, name, self.old.as_ref())
            .map_err(|source| self.failed(source))?;
        let ours = made.as_file().metadata().map_err(|e| self.failed(e))?;
        if self.is_stuck(&ours) {
            return Err(self.protected(ErrorKind::PermissionDenied.into()));
        }
        Ok(made)
    }

    /// Gives the file that is to replace the old one its owner and mode.
    #[cfg(unix)]
    pub fn dress(&self, file: &File) -> io::Result<()> {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        let Some(old) = &self.old else { return Ok(()) };
        let new = file.metadata()?;
        if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
            // Few may give files away, more to a group; who may do neither keeps what is written.
            let group = Some(old.gid());
            let _ = fchown(file, Some(old.uid()), group).or_else(|_| fchown(file, None, group));
        }
        file.set_permissions(old.permissions())
    }

    /// Files have no mode.
    #[cfg(not(unix))]
    pub fn dress(&self, _: &File) -> io::Result<()> {
        Ok(())
    }

    /// Makes the new name last.
    #[cfg(unix)]
    pub fn sync_folder(&self) -> io::Result<()> {
        match File::open(&self.folder).and_then(|folder| folder.sync_all()) {
            // A folder that may be written and not read, or a file system that syncs no folders: more cannot be done.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::PermissionDenied | ErrorKind::InvalidInput | ErrorKind::Unsupported
                ) =>
            {
                Ok(())
            }
            synced => synced,
        }
    }

    /// Folders cannot be opened.
    #[cfg(not(unix))]
    pub fn sync_folder(&self) -> io::Result<()> {
        Ok(())
    }

    /// Which file it is.
    pub fn identity(&self) -> Identity {
        let there = self.old.as_ref().and(Identity::of_file(&self.file));
        there.unwrap_or_else(|| Identity::to_come(&self.folder, &self.file))
    }

    /// The error that this went wrong on the way.
    pub fn failed(&self, source: io::Error) -> OutputError {
        let path = self.path.clone();
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                OutputError::DiskFull { path, source }
            }
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                OutputError::NotWritable {
                    path,
                    folder: self.folder.clone(),
                    source,
                }
            }
            _ => OutputError::Failed { path, source },
        }
    }

    fn protected(&self, source: io::Error) -> OutputError {
        OutputError::Protected {
            path: self.path.clone(),
            source,
        }
    }

    fn check_folder(&self) -> Result<(), OutputError> {
        match fs::metadata(&self.folder) {
            Ok(found) if found.is_dir() => Ok(()),
            Err(error) if !is_missing(&error) => Err(self.failed(error)),
            _ => Err(OutputError::FolderMissing {
                path: self.path.clone(),
                folder: self.folder.clone(),
            }),
        }
    }

    /// Renaming asks nothing of the file that it replaces: that it may be written is asked here.
    fn check_old(&self) -> Result<(), OutputError> {
        let Some(old) = &self.old else { return Ok(()) };
        // Of root, whom the system lets write it, too: somebody wanted it kept.
        if old.permissions().readonly() {
            return Err(self.protected(ErrorKind::PermissionDenied.into()));
        }
        match OpenOptions::new().write(true).open(&self.file) {
            Ok(_) => Ok(()),
            Err(error) => Err(self.protected(error)),
        }
    }

    /// Whether the old file is another user's, in a folder like /tmp where each may replace his own only.
    #[cfg(unix)]
    fn is_stuck(&self, ours: &Metadata) -> bool {
        use std::os::unix::fs::MetadataExt as _;
        const STICKY: u32 = 0o1000;
        let (Some(old), Ok(folder)) = (&self.old, fs::metadata(&self.folder)) else {
            return false;
        };
        let owners = [0, old.uid(), folder.uid()];
        folder.mode() & STICKY != 0 && !owners.contains(&ours.uid())
    }

    #[cfg(not(unix))]
    fn is_stuck(&self, _: &Metadata) -> bool {
        false
    }
}

/// The file that `path` leads to, over links, also to where nothing is; and what is there.
fn follow(path: &Path) -> Result<(PathBuf, Option<Metadata>), OutputError> {
    let not_a_file = || OutputError::NotAFile {
        path: path.to_owned(),
    };
    let failed = |source| OutputError::Failed {
        path: path.to_owned(),
        source,
    };
    // Links in /proc lead to what has no path; the system itself is asked first.
    let there = fs::metadata(path).ok();
    if there.as_ref().is_some_and(|found| !found.is_file()) {
        return Err(not_a_file());
    }
    let mut file = path.to_owned();
    for _ in 0..MOST_LINKS {
        if !names_a_file(&file) {
            return Err(not_a_file());
        }
        match fs::symlink_metadata(&file) {
            Ok(link) if link.is_symlink() => {
                let next = fs::read_link(&file).map_err(failed)?;
                file = folder(&file).join(next);
            }
            Ok(found) if found.is_file() => return Ok((file, Some(found))),
            Ok(_) => return Err(not_a_file()),
            Err(error) if is_missing(&error) && there.is_none() => return Ok((file, None)),
            Err(error) if is_missing(&error) => return Err(not_a_file()),
            Err(error) => return Err(failed(error)),
        }
    }
    Err(failed(io::Error::other("too many links")))
}

/// Whether the path ends in a name. `Path` itself drops what stands behind the last one: `a.exr/` and `a.exr/.` are `a.exr` to it.
fn names_a_file(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let end = bytes.rsplit(|&byte| std::path::is_separator(byte.into()));
    !matches!(end.into_iter().next(), None | Some(b"" | b"." | b".."))
}

/// The folder that the file is in.
fn folder(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Nothing there, or a file where a folder would have to be.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory)
}
