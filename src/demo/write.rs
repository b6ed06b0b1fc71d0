//! A demo's files: base meshes, maps and scene, ready to be rendered and edited.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::manifest::{Manifest, digest};
use super::{Demo, DemoFiles};
use crate::files::output::{self, OutputError, Staged};
use crate::image::{stage_png_gray16, stage_png_rgb8};
use crate::surface::MeshBuilder;

/// Why a demo could not be written.
#[derive(Debug, Error)]
pub enum WriteDemoError {
    /// The folder cannot be made.
    #[error("cannot make the folder {}: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Files have the names of the demo's, and are not as a demo left them.
    #[error(
        "{}: found what prismarch demo did not leave there; --force replaces it",
        list(files)
    )]
    Foreign {
        /// The files.
        files: Vec<PathBuf>,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] OutputError),
}

fn list(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    names.join(", ")
}

/// How a demo is written.
#[derive(Clone, Copy, Debug)]
pub struct WriteOptions {
    /// Texels across and up of its largest map.
    pub map_size: usize,
    /// Replace whatever has the names of its files.
    pub force: bool,
    /// The picture `NAME.png` will be written, too.
    pub picture: bool,
}

impl Demo {
    /// Makes the demo and writes its files into `folder`, which is made if it is missing. Returns the scene file.
    ///
    /// A hidden file in the folder keeps what they contain, so that the next run knows them.
    ///
    /// # Errors
    ///
    /// [`WriteDemoError`], which names the files or the folder; [`WriteDemoError::Foreign`] unless `force` is set. Up to the last
    /// moment no file has been replaced; then each is replaced by itself.
    pub fn write(&self, folder: &Path, options: WriteOptions) -> Result<PathBuf, WriteDemoError> {
        std::fs::create_dir_all(folder).map_err(|source| WriteDemoError::Folder {
            folder: folder.to_owned(),
            source,
        })?;
        let scene = folder.join(format!("{}.toml", self.name));
        // Making the maps takes a while: an unwritable folder is found before.
        output::check(&scene)?;
        let files = self.stage(folder, &(self.make)(options.map_size))?;
        let mut manifest = Manifest::read(folder);
        if !options.force {
            let picture = options.picture.then(|| self.picture());
            let names = files.iter().map(|file| &file.name[..]);
            let foreign = manifest.foreign(folder, names.chain(picture.as_deref()));
            if !foreign.is_empty() {
                return Err(WriteDemoError::Foreign { files: foreign });
            }
        }
        // Before the files: a run that is killed between them leaves none, old or new, that the next does not know.
        for file in &files {
            manifest.add(&file.name, &file.digest);
        }
        manifest.write(folder)?;
        for file in files {
            file.staged.commit()?;
            manifest.set(&file.name, &file.digest);
        }
        manifest.write(folder)?;
        Ok(scene)
    }

    /// What the picture of the demo is called.
    pub fn picture(&self) -> String {
        format!("{}.png", self.name)
    }

    /// Notes that the picture in `folder` is one of the demo's files.
    ///
    /// # Errors
    ///
    /// [`WriteDemoError::File`].
    pub fn keep_picture(&self, folder: &Path) -> Result<(), WriteDemoError> {
        let name = self.picture();
        let digest = digest(&folder.join(&name)).map_err(|source| OutputError::Failed {
            path: folder.join(&name),
            source,
        })?;
        let mut manifest = Manifest::read(folder);
        manifest.set(&name, &digest);
        Ok(manifest.write(folder)?)
    }

    /// All files, complete and without their names; the scene is the last.
    fn stage(&self, folder: &Path, files: &DemoFiles) -> Result<Vec<Made>, OutputError> {
        let mut stage = Stage {
            folder,
            made: Vec::new(),
        };
        stage.mesh(self.name, &files.mesh)?;
        stage.map(self.name, files.map_size, &files.heights)?;
        if !files.colors.is_empty() {
            let size = files.color_size;
            stage.add(format!("{}_color.png", self.name), |path| {
                stage_png_rgb8(path, size, size, &files.colors, &[])
            })?;
        }
        for part in &files.parts {
            stage.mesh(part.name, &part.mesh)?;
            stage.map(part.name, part.map_size, &part.heights)?;
        }
        stage.add(format!("{}.toml", self.name), |path| {
            output::stage(path, |out| out.write_all(files.scene.as_bytes()))
        })?;
        Ok(stage.made)
    }
}

/// A file of the demo on its way.
struct Made {
    name: String,
    digest: String,
    staged: Staged,
}

/// Where they gather.
struct Stage<'a> {
    folder: &'a Path,
    made: Vec<Made>,
}

impl Stage<'_> {
    fn add(
        &mut self,
        name: String,
        stage: impl FnOnce(&Path) -> Result<Staged, OutputError>,
    ) -> Result<(), OutputError> {
        let path = self.folder.join(&name);
        let staged = stage(&path)?;
        let digest =
            digest(staged.content()).map_err(|source| OutputError::Failed { path, source })?;
        self.made.push(Made {
            name,
            digest,
            staged,
        });
        Ok(())
    }

    fn mesh(&mut self, name: &str, mesh: &MeshBuilder) -> Result<(), OutputError> {
        self.add(format!("{name}.obj"), |path| stage_obj(path, mesh))
    }

    fn map(&mut self, name: &str, size: usize, heights: &[u16]) -> Result<(), OutputError> {
        self.add(format!("{name}_height.png"), |path| {
            stage_png_gray16(path, size, size, heights)
        })
    }
}

/// Writes a mesh as Wavefront OBJ: one `v`, `vt` and `vn` per vertex with one index for all three.
fn stage_obj(path: &Path, mesh: &MeshBuilder) -> Result<Staged, OutputError> {
    output::stage(path, |out| {
        for p in &mesh.positions {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for st in &mesh.texcoords {
            writeln!(out, "vt {} {}", st.x, st.y)?;
        }
        for n in &mesh.normals {
            writeln!(out, "vn {} {} {}", n.x, n.y, n.z)?;
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| corner(mesh, vertex));
            writeln!(out, "f {a} {b} {c}")?;
        }
        Ok(())
    })
}

/// A vertex as faces name it; OBJ counts from 1.
fn corner(mesh: &MeshBuilder, vertex: u32) -> String {
    let index = vertex + 1;
    match (mesh.texcoords.is_empty(), mesh.normals.is_empty()) {
        (false, false) => format!("{index}/{index}/{index}"),
        (false, true) => format!("{index}/{index}"),
        (true, false) => format!("{index}//{index}"),
        (true, true) => index.to_string(),
    }
}
