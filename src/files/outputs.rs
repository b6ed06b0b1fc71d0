//! The outputs of one run, held against each other and against what the run reads.

use std::io;
use std::path::{Path, PathBuf};

use super::identity::Identity;
use super::output::{self, OutputError};

/// Where a run writes. Files are compared, not paths: a file is found under any of its names.
#[derive(Clone, Debug, Default)]
pub struct Outputs(Vec<Named>);

#[derive(Clone, Debug)]
struct Named {
    name: PathBuf,
    identity: Identity,
}

impl Outputs {
    /// Standard output, where that leads to a file: the shell has opened it, and what is printed goes there.
    pub fn new() -> Self {
        let stdout = Identity::of_stream(io::stdout());
        let stdout = stdout.map(|identity| Named {
            name: "standard output".into(),
            identity,
        });
        Self(stdout.into_iter().collect())
    }

    /// One more output.
    ///
    /// # Errors
    ///
    /// That of [`output::check`]; [`OutputError::Twice`] if another output is the same file.
    pub fn add(&mut self, path: &Path) -> Result<(), OutputError> {
        let identity = output::checked(path)?;
        if let Some(other) = self.0.iter().find(|other| other.identity.is(&identity)) {
            return Err(OutputError::Twice {
                path: path.to_owned(),
                other: other.name.clone(),
            });
        }
        self.0.push(Named {
            name: path.to_owned(),
            identity,
        });
        Ok(())
    }

    /// Fails if an output is one of the files that the run reads. Files that are not there are left to who reads them.
    ///
    /// # Errors
    ///
    /// [`OutputError::IsInput`].
    pub fn spare(
        &self,
        inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    ) -> Result<(), OutputError> {
        for input in inputs {
            let input = input.as_ref();
            if let Some(identity) = Identity::of_file(input) {
                self.spare_one(&identity, input)?;
            }
        }
        Ok(())
    }

    /// The same for standard input, where that is a file.
    ///
    /// # Errors
    ///
    /// [`OutputError::IsInput`].
    pub fn spare_stdin(&self) -> Result<(), OutputError> {
        match Identity::of_stream(io::stdin()) {
            Some(identity) => self.spare_one(&identity, Path::new("standard input")),
            None => Ok(()),
        }
    }

    fn spare_one(&self, input: &Identity, name: &Path) -> Result<(), OutputError> {
        match self.0.iter().find(|output| output.identity.is(input)) {
            Some(output) => Err(OutputError::IsInput {
                path: output.name.clone(),
                input: name.to_owned(),
            }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("map.png"), "map").unwrap();
        std::fs::write(folder.path().join("old.png"), "old").unwrap();
        std::fs::create_dir(folder.path().join("inner")).unwrap();
        folder
    }

    #[test]
    fn a_file_is_known_by_every_name_it_has() {
        let folder = folder();
        let path = |name: &str| folder.path().join(name);
        let mut names = vec![path("map.png"), path("inner/../map.png")];
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            std::fs::hard_link(path("map.png"), path("hard.png")).unwrap();
            symlink("map.png", path("soft.png")).unwrap();
            symlink("inner/../soft.png", path("softer.png")).unwrap();
            symlink(".", path("here")).unwrap();
            let more = ["hard.png", "soft.png", "softer.png", "here/hard.png"];
            names.extend(more.map(path));
        }
        for output in &names {
            let mut outputs = Outputs::default();
            outputs.add(output).unwrap();
            outputs.spare([path("old.png"), path("none.png")]).unwrap();
            for input in &names {
                let error = outputs.spare([path("old.png"), input.clone()]).unwrap_err();
                assert!(error.is_usage());
                let message = error.to_string();
                for name in [output, input] {
                    assert!(message.contains(name.to_str().unwrap()), "{message}");
                }
            }
            for other in &names {
                let twice = outputs.clone().add(other).unwrap_err();
                assert!(matches!(twice, OutputError::Twice { .. }), "{twice}");
            }
            outputs.add(&path("old.png")).unwrap();
        }
    }

    #[cfg(unix)]
    #[test]
    fn outputs_that_are_not_there_yet_are_one_by_their_place() {
        use std::os::unix::fs::symlink;
        let folder = folder();
        let path = |name: &str| folder.path().join(name);
        symlink("new.exr", path("dangling.exr")).unwrap();
        symlink(".", path("here")).unwrap();
        let names = [
            "new.exr",
            "inner/../new.exr",
            "dangling.exr",
            "here/new.exr",
        ];
        for first in names {
            let mut outputs = Outputs::default();
            outputs.add(&path(first)).unwrap();
            for second in names {
                let twice = outputs.clone().add(&path(second)).unwrap_err();
                assert!(matches!(twice, OutputError::Twice { .. }), "{twice}");
            }
            outputs.add(&path("inner/new.exr")).unwrap();
            outputs.spare([path("new.exr"), path("map.png")]).unwrap();
        }
    }
}
