//! The material libraries of an OBJ file: each file is read once, and of its materials those that faces use.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::super::locate::Locator;
use super::super::{FileMaterial, Unused, text};
use super::Reader;
use crate::files::input;

/// Warnings of libraries beyond these are only counted.
const MOST_WARNINGS: usize = 20;

/// The libraries that were asked for.
pub(in super::super) struct Libraries<'a> {
    obj: &'a Path,
    wanted: &'a BTreeSet<String>,
    locator: Locator,
    /// As the system knows them, however they are named.
    known: HashSet<PathBuf>,
    libraries: Vec<Library>,
    /// The materials that are wanted and found; of two with one name the later.
    materials: Vec<Place>,
    by_name: HashMap<String, usize>,
    warnings: Vec<String>,
}

struct Library {
    path: PathBuf,
    text: Vec<u8>,
}

/// The statements of a material.
struct Place {
    library: usize,
    bytes: Range<usize>,
    /// Of the first one, from 1.
    line: usize,
}

impl<'a> Libraries<'a> {
    /// For the OBJ file at `obj`, whose faces use the materials `wanted`.
    pub(in super::super) fn new(obj: &'a Path, wanted: &'a BTreeSet<String>) -> Self {
        Self {
            obj,
            wanted,
            locator: Locator::default(),
            known: HashSet::new(),
            libraries: Vec::new(),
            materials: Vec::new(),
            by_name: HashMap::new(),
            warnings: Vec::new(),
        }
    }

    /// `names` is one file whose name may hold spaces, or several files.
    pub(in super::super) fn open(&mut self, names: &[u8]) {
        let whole = self.locator.locate(self.obj, text::unquoted(names));
        let words: Vec<_> = text::words(names).collect();
        let located = match &words[..] {
            [_, _, ..] if !whole.exists => words
                .into_iter()
                .map(|name| self.locator.locate(self.obj, text::unquoted(name)))
                .collect(),
            _ => vec![whole],
        };
        for located in located {
            self.warnings.extend(located.note);
            if let Err(e) = self.read(&located.path) {
                let shown = located.path.display();
                self.warnings
                    .push(format!("cannot read the material library {shown}: {e}"));
            }
        }
    }

    fn read(&mut self, path: &Path) -> std::io::Result<()> {
        let same = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if !self.known.insert(same) {
            return Ok(());
        }
        let bytes = input::read(path)?;
        let text = text::plain(&bytes).map_err(|line| {
            let problem = format!("line {line} holds a NUL byte, which no text has");
            std::io::Error::new(std::io::ErrorKind::InvalidData, problem)
        })?;
        let text = text.into_owned();
        self.index_materials(&text);
        self.libraries.push(Library {
            path: path.to_owned(),
            text,
        });
        Ok(())
    }

    /// Notes where the materials that are wanted stand in the next library.
    fn index_materials(&mut self, text: &[u8]) {
        let mut open = None;
        let mut close = |open: Option<(String, usize, usize)>, end: usize| {
            let Some((name, start, line)) = open else {
                return;
            };
            let place = Place {
                library: self.libraries.len(),
                bytes: start..end,
                line,
            };
            match self.by_name.get(&name) {
                Some(&index) => self.materials[index] = place,
                None => {
                    self.by_name.insert(name, self.materials.len());
                    self.materials.push(place);
                }
            }
        };
        for (number, (start, line)) in text::lines(text).enumerate() {
            let (word, rest) = text::split_word(text::uncommented(line));
            if word.eq_ignore_ascii_case(b"newmtl") {
                close(open.take(), start);
                let name = text::decoded(text::unquoted(rest));
                let wanted = self.wanted.contains(&name);
                open = wanted.then(|| (name, start + line.len(), number + 1));
            }
        }
        close(open, text.len());
    }

    /// The number of a material, for [`Self::finish`].
    pub(in super::super) fn index(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// The materials, the files that were read, and the warnings; what has no effect is added to `unused`.
    pub(in super::super) fn finish(
        mut self,
        unused: &mut Unused,
    ) -> (Vec<FileMaterial>, Vec<PathBuf>, Vec<String>) {
        // Where no library could be read, that has been told.
        if !self.libraries.is_empty() {
            let missing = self
                .wanted
                .iter()
                .filter(|&name| !self.by_name.contains_key(name));
            let missing =
                missing.map(|name| format!("material {name:?} is in no material library"));
            self.warnings.extend(missing);
        }
        let mut names = vec![String::new(); self.materials.len()];
        for (name, index) in self.by_name {
            names[index] = name;
        }
        let mut materials = Vec::new();
        let mut others = BTreeMap::new();
        for (name, place) in names.into_iter().zip(&self.materials) {
            let library = &self.libraries[place.library];
            let mut reader = Reader {
                library: &library.path,
                locator: &mut self.locator,
                warnings: &mut self.warnings,
                others: &mut others,
            };
            materials.push(reader.material(name, &library.text[place.bytes.clone()], place.line));
        }
        for (keyword, &count) in &others {
            unused.add_of(&text::shown(keyword), count, "material");
        }
        let files = self.libraries.into_iter().map(|library| library.path);
        (materials, files.collect(), shortened(self.warnings))
    }
}

/// A broken library has a fault on every line.
fn shortened(mut warnings: Vec<String>) -> Vec<String> {
    let more = warnings.len().saturating_sub(MOST_WARNINGS);
    warnings.truncate(MOST_WARNINGS);
    if more > 0 {
        warnings.push(format!("and {more} more of the material libraries"));
    }
    warnings
}
