//! Files on their way to a name. What a killed run leaves is known by its name, and by its lock being free.

use std::ffi::OsStr;
use std::fs::{self, DirEntry, Metadata, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

use tempfile::{Builder, NamedTempFile};
use twox_hash::xxhash3_128::Hasher;

const SUFFIX: &str = ".part";
/// Random letters, so that runs which write the same file at once do not meet.
const RANDOM: usize = 6;
/// A fresh file may be taken for a leftover between being made and being locked. That is rare: once more helps.
const TRIES: usize = 16;

/// An empty file in `folder` that is to be `name`. Leftovers of the same name are removed.
///
/// Others may read it if they may read `old`, or if there is none and the umask lets them.
pub fn create(folder: &Path, name: &OsStr, old: Option<&Metadata>) -> io::Result<NamedTempFile> {
    let prefix = prefix(name);
    sweep(folder, &prefix);
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    #[cfg(unix)]
    builder.permissions(mode(old));
    #[cfg(not(unix))]
    let _ = old;
    for _ in 0..TRIES {
        let file = builder.tempfile_in(folder)?;
        match file.as_file().try_lock() {
            Err(TryLockError::WouldBlock) => {}
            // Where there are no locks nobody will take it for a leftover.
            Ok(()) | Err(TryLockError::Error(_)) => {
                if file.path().exists() {
                    return Ok(file);
                }
            }
        }
    }
    Err(io::Error::other("temporary files do not last"))
}

#[cfg(unix)]
fn mode(old: Option<&Metadata>) -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt as _;
    const ANYBODY: u32 = 0o666;
    const OURSELVES: u32 = 0o600; // or the next run could not remove it
    let old = old.map_or(ANYBODY, |old| old.permissions().mode());
    fs::Permissions::from_mode(old & ANYBODY | OURSELVES)
}

/// What the temporary files of `name` begin with: always of the same length, so that a name may be as long as any.
fn prefix(name: &OsStr) -> String {
    let mut hasher = Hasher::new();
    hasher.write(name.as_encoded_bytes());
    format!(".prismarch-{:016x}-", hasher.finish_128() as u64)
}

/// Removes what killed runs have left. Who is alive holds the lock of his file. What cannot be removed stays.
fn sweep(folder: &Path, prefix: &str) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| is_temporary(entry, prefix)) {
        let Ok(file) = OpenOptions::new().write(true).open(entry.path()) else {
            continue;
        };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_temporary(entry: &DirEntry, prefix: &str) -> bool {
    let name = entry.file_name();
    let name = name.to_str().unwrap_or_default();
    let letters = name
        .strip_prefix(prefix)
        .and_then(|rest| rest.strip_suffix(SUFFIX));
    letters.is_some_and(|letters| letters.len() == RANDOM)
        && entry.file_type().is_ok_and(|kind| kind.is_file())
}
