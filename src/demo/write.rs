//! A demo's files: base meshes, floor, maps and scene, ready to be rendered and edited.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Demo, DemoFiles};
use crate::files::output::{self, OutputError};
use crate::image::{write_png_gray16, write_png_rgb8};
use crate::surface::MeshBuilder;

/// Half the side of the floor, a square at y = 0 around the origin.
const FLOOR: f32 = 50.0;

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
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] OutputError),
}

impl Demo {
    /// Makes the demo with maps of `map_size` x `map_size` and writes its files into `folder`, which is made if it is
    /// missing. Returns the scene file, which is written last.
    ///
    /// # Errors
    ///
    /// [`WriteDemoError`], which names the file or folder. Files written before it stay.
    pub fn write(&self, folder: &Path, map_size: usize) -> Result<PathBuf, WriteDemoError> {
        std::fs::create_dir_all(folder).map_err(|source| WriteDemoError::Folder {
            folder: folder.to_owned(),
            source,
        })?;
        let file = |ending: &str| folder.join(format!("{}{ending}", self.name));
        let scene = file(".toml");
        // Making the maps takes a while: an unwritable folder is found before.
        output::check(&scene)?;
        let files: DemoFiles = (self.make)(map_size);
        write_obj(&file(".obj"), &files.mesh)?;
        let size = files.map_size;
        write_png_gray16(&file("_height.png"), size, size, &files.heights)?;
        if !files.colors.is_empty() {
            let size = files.color_size;
            write_png_rgb8(&file("_color.png"), size, size, &files.colors, &[])?;
        }
        for part in &files.parts {
            write_obj(&folder.join(format!("{}.obj", part.name)), &part.mesh)?;
            let map = folder.join(format!("{}_height.png", part.name));
            write_png_gray16(&map, part.map_size, part.map_size, &part.heights)?;
        }
        if files.scene.contains("floor.obj") {
            write_obj(&folder.join("floor.obj"), &floor())?;
        }
        output::write(&scene, |out| out.write_all(files.scene.as_bytes()))?;
        Ok(scene)
    }
}

/// A square that faces up.
fn floor() -> MeshBuilder {
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    MeshBuilder {
        positions: corners
            .map(|(x, z)| glam::Vec3::new(FLOOR * x, 0.0, FLOOR * z))
            .to_vec(),
        normals: vec![glam::Vec3::Y; 4],
        texcoords: corners
            .map(|(x, z)| glam::Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Writes a mesh as Wavefront OBJ: one `v`, `vt` and `vn` per vertex with one index for all three.
fn write_obj(path: &Path, mesh: &MeshBuilder) -> Result<(), OutputError> {
    output::write(path, |out| {
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
