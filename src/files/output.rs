//! Files that appear complete or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

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

/// Writes a file through `body`, then gives it its name.
///
/// `body` writes to a temporary file in the folder of `path`, which is flushed and renamed over `path` once `body`
/// has succeeded. On any error the temporary file is gone and what was at `path` is as before. A symbolic link at
/// `path` is followed. Nothing is synced: after a power cut the file may be lost.
pub fn write(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), OutputError> {
    let (target, folder) = resolve(path)?;
    let failed = |source| classify(path, &folder, source);
    let temporary = temporary_file(&target, &folder).map_err(failed)?;
    let mut writer = BufWriter::new(temporary.as_file());
    body(&mut writer).map_err(failed)?;
    writer.flush().map_err(failed)?;
    drop(writer);
    match temporary.persist(&target) {
        Ok(_) => Ok(()),
        Err(error) => Err(failed(error.error)), // the temporary file inside the error is removed with it
    }
}

/// Fails now if [`write()`] to this path would fail for its name, its folder or permissions.
pub fn check(path: &Path) -> Result<(), OutputError> {
    let (target, folder) = resolve(path)?;
    match temporary_file(&target, &folder) {
        Ok(_) => Ok(()), // dropped, and removed with that
        Err(source) => Err(classify(path, &folder, source)),
    }
}

/// The file that is meant, links followed, and its folder.
fn resolve(path: &Path) -> Result<(PathBuf, PathBuf), OutputError> {
    let not_a_file = || OutputError::NotAFile {
        path: path.to_owned(),
    };
    let target = match fs::canonicalize(path) {
        Ok(existing) => existing,
        Err(_) => path.to_owned(),
    };
    // Renaming over a device or a pipe would replace it.
    if fs::metadata(&target).is_ok_and(|found| !found.is_file()) || target.file_name().is_none() {
        return Err(not_a_file());
    }
    let folder = match target.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    match fs::metadata(&folder) {
        Ok(found) if found.is_dir() => Ok((target, folder)),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => {
            Err(classify(path, &folder, error))
        }
        _ => Err(OutputError::FolderMissing {
            path: path.to_owned(),
            folder,
        }),
    }
}

fn temporary_file(target: &Path, folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut prefix = OsString::from(".");
    prefix.push(target.file_name().unwrap_or_default());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    // Temporary files are private by default; an output is to be as readable as the umask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn classify(path: &Path, folder: &Path, source: io::Error) -> OutputError {
    let (path, folder) = (path.to_owned(), folder.to_owned());
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => OutputError::DiskFull { path, source },
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => OutputError::NotWritable {
            path,
            folder,
            source,
        },
        _ => OutputError::Failed { path, source },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_complete_file_replaces_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        write(&path, |file| file.write_all(b"old")).unwrap();
        write(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["out.txt"]);
    }

    #[test]
    fn a_failure_half_way_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        let half = |file: &mut BufWriter<&File>| {
            file.write_all(&[0; 100_000])?;
            Err(io::Error::from(ErrorKind::StorageFull))
        };
        assert!(matches!(
            write(&path, half),
            Err(OutputError::DiskFull { .. })
        ));
        assert!(names(folder.path()).is_empty());
        fs::write(&path, b"old").unwrap();
        assert!(write(&path, half).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["out.txt"]);
    }

    /// /dev/full accepts a file's opening and refuses its bytes, but no file can be made in its folder as a test;
    /// what can be tested everywhere is that an error of the last flush is not lost.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_error_that_shows_only_when_flushed_is_reported() {
        let full = fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        let result = write(&path, |_| {
            let mut writer = BufWriter::new(&full);
            writer.write_all(b"fits the buffer")?;
            writer.flush()
        });
        assert!(
            matches!(result, Err(OutputError::DiskFull { .. })),
            "{result:?}"
        );
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/out.png");
        match write(&path, |_| Ok(())) {
            Err(OutputError::FolderMissing { folder: named, .. }) => {
                assert_eq!(named, folder.path().join("no/such"));
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn folders_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        for path in [
            folder.path(),
            Path::new("/dev/null"),
            Path::new("/"),
            Path::new(""),
        ] {
            let result = write(path, |_| Ok(()));
            assert!(
                matches!(result, Err(OutputError::NotAFile { .. })),
                "{path:?}: {result:?}"
            );
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write(&link, |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }
}
