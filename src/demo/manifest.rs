//! What demos wrote into a folder, so that they replace that and nothing else.

use std::collections::BTreeSet;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use twox_hash::xxhash3_128::Hasher;

use crate::files::input;
use crate::files::output::{self, OutputError};

/// The file that keeps it.
const FILE: &str = ".prismarch-demo";
const HEAD: &str =
    "# Files that prismarch demo made, with their XXH3-128: while they are so, it replaces them.\n";
/// Far more than all demos have: what is longer is no manifest.
const LONGEST: u64 = 1 << 16;

/// Names of files in one folder, and the contents they were given.
#[derive(Debug, Default)]
pub struct Manifest {
    made: BTreeSet<(String, String)>,
}

impl Manifest {
    /// That of the folder; an empty one if there is none.
    pub fn read(folder: &Path) -> Self {
        let text = text(&folder.join(FILE)).unwrap_or_default();
        let lines = text.strip_prefix(HEAD).unwrap_or_default().lines();
        let entries = lines.filter_map(|line| line.split_once("  "));
        Self {
            made: entries
                .map(|(digest, name)| (name.to_owned(), digest.to_owned()))
                .collect(),
        }
    }

    /// Those of the files `names` of the folder that are there and not as a demo left them, the manifest too.
    pub fn foreign<'a>(
        &self,
        folder: &Path,
        names: impl IntoIterator<Item = &'a str>,
    ) -> Vec<PathBuf> {
        let paths = names.into_iter().map(|name| (name, folder.join(name)));
        let foreign = paths.filter(|(name, path)| {
            let known = |digest| self.made.contains(&((*name).to_owned(), digest));
            path.symlink_metadata().is_ok() && !digest(path).is_ok_and(known)
        });
        let manifest = folder.join(FILE);
        let strange = manifest.symlink_metadata().is_ok()
            && !text(&manifest).is_ok_and(|text| text.starts_with(HEAD));
        foreign
            .map(|(_, path)| path)
            .chain(strange.then_some(manifest))
            .collect()
    }

    /// Notes that the file may have this content, as well as those it had.
    pub fn add(&mut self, name: &str, digest: &str) {
        self.made.insert((name.to_owned(), digest.to_owned()));
    }

    /// Notes that the file has this content and no other.
    pub fn set(&mut self, name: &str, digest: &str) {
        self.made.retain(|(known, _)| known != name);
        self.add(name, digest);
    }

    /// Puts it into the folder.
    pub fn write(&self, folder: &Path) -> Result<(), OutputError> {
        output::write(&folder.join(FILE), |out| {
            out.write_all(HEAD.as_bytes())?;
            for (name, digest) in &self.made {
                writeln!(out, "{digest}  {name}")?;
            }
            Ok(())
        })
    }
}

fn text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    input::open(path)?.take(LONGEST).read_to_string(&mut text)?;
    Ok(text)
}

/// What tells a file's content from any other.
pub fn digest(path: &Path) -> io::Result<String> {
    let mut file = BufReader::with_capacity(1 << 16, input::open(path)?);
    let mut hasher = Hasher::new();
    loop {
        let bytes = file.fill_buf()?;
        if bytes.is_empty() {
            return Ok(format!("{:032x}", hasher.finish_128()));
        }
        hasher.write(bytes);
        let read = bytes.len();
        file.consume(read);
    }
}
