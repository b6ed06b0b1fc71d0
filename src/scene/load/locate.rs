//! Where the files are that a mesh file names: names come from other systems and other folders.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::text;

/// Looks for named files, and remembers the folders it has looked into.
#[derive(Default)]
pub(super) struct Locator {
    /// Per folder the names in it by their lower case.
    folders: HashMap<PathBuf, HashMap<String, OsString>>,
}

/// What a name stands for.
#[derive(Debug, PartialEq)]
pub(super) struct Located {
    /// Where nothing is, the path as the name has it.
    pub(super) path: PathBuf,
    /// Whether there is a file.
    pub(super) exists: bool,
    /// What to tell the user: it has another name, or is elsewhere.
    pub(super) note: Option<String>,
}

impl Locator {
    /// The file that the file at `from` calls `name`: these bytes as the system's name; or as text with either slash; or that
    /// with letters of another case; or its last part alone, since an absolute path is one of the exporter's machine.
    pub(super) fn locate(&mut self, from: &Path, name: &[u8]) -> Located {
        let folder = from.parent().unwrap_or(Path::new(""));
        let found = |path| Located {
            path,
            exists: true,
            note: None,
        };
        if let Some(raw) = as_system_path(name).map(|raw| folder.join(raw))
            && is_there(&raw)
        {
            return found(raw);
        }
        let text = text::decoded(name).replace('\\', "/");
        let path = folder.join(&text);
        if is_there(&path) {
            return found(path);
        }
        let last = text.rsplit('/').next().unwrap_or("");
        let other = self
            .ignoring_case(folder, &text)
            .or_else(|| Some(folder.join(last)).filter(|p| is_there(p)))
            .or_else(|| self.ignoring_case(folder, last));
        match other {
            Some(path) => Located {
                note: Some(format!(
                    "{:?} is not there; {} is taken",
                    text::decoded(name),
                    path.display()
                )),
                ..found(path)
            },
            None => Located {
                path,
                exists: false,
                note: None,
            },
        }
    }

    /// A relative path whose parts may differ in the case of letters.
    fn ignoring_case(&mut self, folder: &Path, relative: &str) -> Option<PathBuf> {
        let mut path = folder.to_owned();
        for part in relative.split('/').filter(|part| !part.is_empty()) {
            let next = path.join(part);
            if next.exists() {
                path = next;
                continue;
            }
            let alike = self.entries(&path).get(&part.to_lowercase());
            path.push(alike?);
        }
        is_there(&path).then_some(path)
    }

    /// None if the folder cannot be read; of names that are alike the first in order, so that all systems choose alike.
    fn entries(&mut self, folder: &Path) -> &HashMap<String, OsString> {
        self.folders.entry(folder.to_owned()).or_insert_with(|| {
            let unnamed = folder.as_os_str().is_empty();
            let folder = if unnamed { Path::new(".") } else { folder };
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let mut names: Vec<_> = entries.map(|entry| entry.file_name()).collect();
            names.sort_unstable_by(|a, b| b.cmp(a));
            names
                .into_iter()
                .map(|name| (name.to_string_lossy().to_lowercase(), name))
                .collect()
        })
    }
}

/// A pipe or a device counts too: it will be refused by its name.
fn is_there(path: &Path) -> bool {
    path.exists() && !path.is_dir()
}

#[cfg(unix)]
fn as_system_path(name: &[u8]) -> Option<&Path> {
    use std::os::unix::ffi::OsStrExt as _;
    Some(Path::new(std::ffi::OsStr::from_bytes(name)))
}

#[cfg(not(unix))]
fn as_system_path(name: &[u8]) -> Option<&Path> {
    std::str::from_utf8(name).ok().map(Path::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "x").unwrap();
        }
        let from = folder.path().join("m.mtl");
        (folder, from)
    }

    #[test]
    fn names_of_this_system_are_taken_without_a_word() {
        let (folder, from) = folder(&["a b.png", "sub/c.png", "é.png"]);
        for (name, file) in [
            (&b"a b.png"[..], "a b.png"),
            (b"sub/c.png", "sub/c.png"),
            (b"sub\\c.png", "sub/c.png"),
            (b"\xe9.png", "é.png"),
        ] {
            let located = Locator::default().locate(&from, name);
            assert_eq!(
                located,
                Located {
                    path: folder.path().join(file),
                    exists: true,
                    note: None
                }
            );
        }
    }

    #[test]
    fn names_of_other_systems_are_found_and_told() {
        let (folder, from) = folder(&["wood.png", "Tex/Stone.PNG"]);
        for (name, file) in [
            ("C:\\art\\wood.png", "wood.png"),
            ("/home/artist/wood.png", "wood.png"),
            ("..\\maps\\WOOD.PNG", "wood.png"),
            ("tex/stone.png", "Tex/Stone.PNG"),
        ] {
            let located = Locator::default().locate(&from, name.as_bytes());
            assert_eq!(
                (located.path, located.exists),
                (folder.path().join(file), true)
            );
            assert!(located.note.unwrap().contains(file), "{name}");
        }
    }

    #[test]
    fn what_is_nowhere_keeps_its_name() {
        let (folder, from) = folder(&["sub/x"]);
        for name in ["none.png", "sub", "", "a/b/none.png"] {
            let located = Locator::default().locate(&from, name.as_bytes());
            assert_eq!(
                located,
                Located {
                    path: folder.path().join(name),
                    exists: false,
                    note: None
                }
            );
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_name_may_be_any_bytes() {
        use std::os::unix::ffi::OsStrExt as _;
        let (folder, from) = folder(&[]);
        // Shift-JIS, whose second byte is a backslash.
        let name = b"\x83\x5c.png";
        let path = folder.path().join(std::ffi::OsStr::from_bytes(name));
        std::fs::write(&path, "x").unwrap();
        assert_eq!(Locator::default().locate(&from, name).path, path);
    }
}
