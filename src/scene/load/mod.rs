//! Mesh files: OBJ with MTL, glTF and GLB, PLY.
//!
//! One file gives one [`Part`] per material (and one more where only some faces of a material have texture
//! coordinates). Within a part the faces stand in file order, so an OBJ of triangles with one material is
//! one part whose triangle k is the file's face k. Larger polygons are cut into triangles (polygon.rs).
//! Texture coordinates come out with v up, whatever the format's habit.

mod camera;
mod draco;
mod gltf;
mod light;
mod locate;
mod material;
mod mtl;
mod obj;
mod placing;
mod ply;
pub(super) mod polygon;
mod shape;
mod text;
mod unused;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{Affine3A, DAffine3, Vec2, Vec3};
use thiserror::Error;

use crate::files::input;
use crate::ray::Aabb;
use crate::surface::{MeshBuilder, Projection};
pub use camera::{FileCamera, FileProjection};
pub use light::{FileLight, FileLightKind};
pub use material::{
    FileColor, FileDetail, FileDisplacement, FileMaterial, FileScalar, FileTexture, FileTextureUse,
};
pub use placing::Broken;
pub(super) use shape::Shape;
pub use unused::Unused;
pub(super) use unused::counted;

/// Endings of the files that [`load_mesh`] reads.
pub const MESH_EXTENSIONS: [&str; 4] = ["obj", "gltf", "glb", "ply"];

/// Why a mesh file was refused.
#[derive(Debug, Error)]
#[error("{}: {kind}", path.display())]
pub struct LoadMeshError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What is wrong with it; part of the message.
    pub kind: LoadMeshErrorKind,
}

/// What is wrong with a mesh file.
#[derive(Debug, Error)]
pub enum LoadMeshErrorKind {
    /// The file, or one it names, cannot be read.
    #[error("cannot read {what}: {source}")]
    Read {
        /// `the file`, or the name of the file it needs.
        what: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No byte in it.
    #[error("the file is empty")]
    Empty,
    /// Not a format that is read.
    #[error("unknown mesh format {found:?}; supported are .obj, .gltf, .glb and .ply")]
    UnknownExtension {
        /// The ending, without the dot.
        found: String,
    },
    /// A text file with bytes that are no text.
    #[error("line {line} holds a NUL byte, which no text has; is this an OBJ file?")]
    NotText {
        /// From 1.
        line: usize,
    },
    /// The text does not follow the format.
    #[error("line {line}: found {found:?}; expected {expected}")]
    Syntax {
        /// From 1.
        line: usize,
        /// The offending statement or word.
        found: String,
        /// What should stand there.
        expected: &'static str,
    },
    /// A face refers to something that is not there.
    #[error("{place}: {what} {index} is out of range; there are {count}{counted}")]
    IndexOutOfRange {
        /// Line, face or primitive.
        place: String,
        /// Vertex, texture coordinate or normal.
        what: &'static str,
        /// The index as the file has it.
        index: i64,
        /// How many there are.
        count: usize,
        /// How the format counts.
        counted: &'static str,
    },
    /// Broken structure of a glTF or PLY file.
    #[error("{what}: {problem}")]
    Malformed {
        /// The element: header, accessor, line ...
        what: String,
        /// What is wrong.
        problem: String,
    },
    /// A glTF file that names a file outside of its folder, without leave.
    #[error(
        "{what}: its URI {uri:?} leads out of the file's folder; with --allow-external such files are read"
    )]
    External {
        /// What the file is for.
        what: String,
        /// As it is written.
        uri: String,
    },
    /// Sound, but beyond this reader.
    #[error("{what} is not supported")]
    Unsupported {
        /// The feature.
        what: String,
    },
    /// Nothing to trace.
    #[error("the file holds no faces")]
    NoFaces,
}

/// What a mesh file may do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Whether a glTF file may name buffers and pictures outside of its own folder.
    pub allow_external: bool,
    /// Whether polygons come as fans around their first corner, concave ones too, with [`Part::fans`] to tell them by: to be subdivided.
    pub keep_polygons: bool,
}

/// A mesh file as read: not yet validated, nothing computed.
#[derive(Debug, Default)]
pub struct LoadedFile {
    /// At least one, each with at least one triangle.
    pub parts: Vec<Part>,
    /// What stays sharp when the file is subdivided.
    pub sharpness: FileSharpness,
    /// In the file's order.
    pub lights: Vec<FileLight>,
    /// In the file's order.
    pub cameras: Vec<FileCamera>,
    /// What was mended and how, one line each, for the user.
    pub warnings: Vec<String>,
    /// What has no effect.
    pub unused: Unused,
    /// Every file that was read: the mesh file and what it names, pictures excepted.
    pub files: Vec<PathBuf>,
}

/// The faces of one material.
#[derive(Debug)]
pub struct Part {
    /// Name of its first object or group, or the file's stem.
    pub name: String,
    /// The faces, in file order.
    pub mesh: MeshBuilder,
    /// How many triangles each polygon has, one after the other, if they are kept; empty: each triangle is a face.
    pub fans: Vec<u32>,
    /// The file's material, if it gives one.
    pub material: Option<FileMaterial>,
    /// Empty: stands once as it is. Else where the file places it (EXT_mesh_gpu_instancing), as transforms of the mesh as it is.
    pub instances: Vec<Affine3A>,
}

/// Creases and corners for subdivision, by position as the file has it; sharpness is the number of refinements for which they last, from 10 on for ever.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileSharpness {
    /// Edges by their ends.
    pub creases: Vec<([Vec3; 2], f32)>,
    /// Vertices.
    pub corners: Vec<(Vec3, f32)>,
}

/// Reads a mesh file; the format goes by the ending.
///
/// # Errors
///
/// [`LoadMeshError`], which names the file. Numbers that are NaN or infinite are left to
/// [`MeshBuilder::build`], which names the vertex.
pub fn load_mesh(path: &Path) -> Result<LoadedFile, LoadMeshError> {
    load_mesh_with(path, LoadOptions::default())
}

/// The same with leave to do more.
///
/// # Errors
///
/// As [`load_mesh`].
pub fn load_mesh_with(path: &Path, options: LoadOptions) -> Result<LoadedFile, LoadMeshError> {
    read(path, options).map_err(|kind| LoadMeshError {
        path: path.to_owned(),
        kind,
    })
}

impl LoadedFile {
    /// Moves everything by `transform`, whose scale is the same along all axes and not 0: parts, what places them, lights, cameras, and
    /// lengths of materials.
    ///
    /// # Errors
    ///
    /// A light or a camera that comes to lie beyond what is traced; the message names it.
    pub fn place(&mut self, transform: &Affine3A) -> Result<(), LoadMeshErrorKind> {
        if *transform == Affine3A::IDENTITY {
            return Ok(());
        }
        let scale = placing::scale(transform) as f32;
        for part in &mut self.parts {
            part.mesh = std::mem::take(&mut part.mesh).transformed(transform);
            let instances = std::mem::take(&mut part.instances);
            part.instances = conjugated(instances, transform).unwrap_or_default();
            if let Some(material) = &mut part.material {
                let distance = material.attenuation_distance * scale;
                material.attenuation_distance = distance.max(f32::MIN_POSITIVE);
            }
        }
        for light in &mut self.lights {
            *light = light
                .placed(transform)
                .map_err(|e| misplaced("light", &light.name, e))?;
        }
        for camera in &mut self.cameras {
            *camera = camera
                .placed(transform)
                .map_err(|e| misplaced("camera", camera.name(), e))?;
        }
        Ok(())
    }

    /// The box around all parts as they are.
    pub fn bounds(&self) -> Aabb {
        let corners = |mesh: &MeshBuilder| {
            let indices = mesh.triangles.as_flattened().iter();
            let positions = indices.filter_map(|&i| mesh.positions.get(i as usize));
            positions.fold(Aabb::EMPTY, |b, &p| b.including(p))
        };
        let parts = self.parts.iter().map(|part| corners(&part.mesh));
        parts.fold(Aabb::EMPTY, Aabb::union)
    }

    /// Replaces all texture coordinates by those of a projection around the whole file.
    pub fn project(&mut self, projection: Projection) {
        let bounds = self.bounds();
        for part in &mut self.parts {
            part.mesh.project(projection, bounds);
        }
    }

    /// Takes out the parts that the file places itself.
    pub fn take_placed(&mut self) -> Vec<Part> {
        let parts = std::mem::take(&mut self.parts).into_iter();
        let (placed, single) = parts.partition(|part| !part.instances.is_empty());
        self.parts = single;
        placed
    }

    /// All parts as one mesh, part after part; the materials are dropped, and so is where the file places a part.
    pub fn into_single_mesh(self) -> MeshBuilder {
        let mut whole = MeshBuilder::default();
        for part in self.parts {
            whole.append(part.mesh);
        }
        whole
    }
}

fn read(path: &Path, options: LoadOptions) -> Result<LoadedFile, LoadMeshErrorKind> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    if !MESH_EXTENSIONS.contains(&extension.as_str()) {
        return Err(LoadMeshErrorKind::UnknownExtension { found: extension });
    }
    let bytes = input::read(path).map_err(|source| LoadMeshErrorKind::Read {
        what: "the file".into(),
        source,
    })?;
    if bytes.is_empty() {
        return Err(LoadMeshErrorKind::Empty);
    }
    let mut file = match extension.as_str() {
        "obj" => obj::read(&bytes, path, options)?,
        "ply" => ply::read(&bytes, path, options)?,
        _ => gltf::read(&bytes, path, options)?,
    };
    if file.parts.is_empty() {
        return Err(LoadMeshErrorKind::NoFaces);
    }
    file.files.push(path.to_owned());
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    for part in file.parts.iter_mut().filter(|p| p.name.is_empty()) {
        part.name = stem.clone().into_owned();
    }
    Ok(file)
}

/// The error that a light or a camera stands where it cannot be used.
pub(super) fn misplaced(what: &str, name: &str, broken: Broken) -> LoadMeshErrorKind {
    LoadMeshErrorKind::Malformed {
        what: format!("{what} {name:?}"),
        problem: broken.0,
    }
}

/// Transforms of a mesh in its own space as transforms of the mesh as `moved` has it, so that one that stands still is moved as the
/// mesh is and no more; `None` if `moved` leaves nothing to stand.
pub(super) fn conjugated(
    transforms: impl IntoIterator<Item = Affine3A>,
    moved: &Affine3A,
) -> Option<Vec<Affine3A>> {
    let moved = in_double(moved);
    let back = moved.inverse();
    back.is_finite().then(|| {
        let transforms = transforms.into_iter().map(|t| moved * in_double(&t) * back);
        transforms.map(|t| t.as_affine3a()).collect()
    })
}

fn in_double(t: &Affine3A) -> DAffine3 {
    let [x, y, z] = [t.matrix3.x_axis, t.matrix3.y_axis, t.matrix3.z_axis].map(|c| c.as_dvec3());
    DAffine3::from_cols(x, y, z, t.translation.as_dvec3())
}

/// Sorts meshes into parts by material, by whether they have texture coordinates, and by who instances them.
#[derive(Default)]
struct Parts {
    parts: Vec<Part>,
    /// Per part, the material's index in the file.
    materials: Vec<Option<usize>>,
    by_key: HashMap<PartKey, usize>,
}

/// Material, whether there are no texture coordinates, and the node that instances.
type PartKey = (Option<usize>, bool, Option<usize>);

impl Parts {
    /// Adds faces, perhaps those that the node of a number places many times; a mesh without faces is forgotten.
    fn add(
        &mut self,
        name: &str,
        material: Option<usize>,
        mesh: MeshBuilder,
        placed: Option<(usize, &[Affine3A])>,
    ) {
        if mesh.triangles.is_empty() {
            return;
        }
        let index = self.open(name, material, !mesh.texcoords.is_empty(), placed);
        self.parts[index].mesh.append(mesh);
    }

    /// The number of the part for such faces; if it is new, it has none yet.
    fn open(
        &mut self,
        name: &str,
        material: Option<usize>,
        textured: bool,
        placed: Option<(usize, &[Affine3A])>,
    ) -> usize {
        let key = (material, textured, placed.map(|p| p.0));
        let index = *self.by_key.entry(key).or_insert(self.parts.len());
        if index == self.parts.len() {
            self.materials.push(material);
            self.parts.push(Part {
                name: name.to_owned(),
                mesh: MeshBuilder::default(),
                fans: Vec::new(),
                material: None,
                instances: placed.map_or_else(Vec::new, |p| p.1.to_vec()),
            });
        }
        index
    }

    /// Adds a vertex to a part, and returns its number there; its texture coordinate goes by what the part is opened for.
    fn push_vertex(
        &mut self,
        part: usize,
        position: Vec3,
        normal: Option<Vec3>,
        texcoord: Option<Vec2>,
    ) -> u32 {
        let mesh = &mut self.parts[part].mesh;
        // A mesh too large for 32 bits wraps here and is refused by `build`.
        let number = mesh.positions.len() as u32;
        if normal.is_some() && mesh.normals.is_empty() {
            mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
        }
        let with_normals = normal.is_some() || !mesh.normals.is_empty();
        if with_normals {
            // Zero stands for one that is missing.
            mesh.normals.push(normal.unwrap_or(Vec3::ZERO));
        }
        mesh.positions.push(position);
        mesh.texcoords.extend(texcoord);
        number
    }

    /// The parts, each with its material looked up.
    fn finish(self, material: impl Fn(usize) -> Option<FileMaterial>) -> Vec<Part> {
        let mut parts = self.parts;
        for (part, index) in parts.iter_mut().zip(self.materials) {
            part.material = index.and_then(&material);
        }
        parts
    }
}

/// A relative path as asset files write it (either slash), next to the file that names it.
fn beside(file: &Path, name: &str) -> PathBuf {
    let name = name.replace('\\', "/");
    file.parent().unwrap_or(Path::new("")).join(name)
}

/// The triangles of a polygon, from its first corner.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    corners
        .windows(2)
        .skip(1)
        .map(|pair| [corners[0], pair[0], pair[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes `bytes` to a file of that name in a fresh folder and loads it.
    pub(super) fn load_bytes(name: &str, bytes: &[u8]) -> Result<LoadedFile, LoadMeshError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let result = load_mesh(&path);
        if let Err(e) = &result {
            assert!(e.to_string().contains(name), "{e} does not name the file");
        }
        result
    }

    #[test]
    fn an_unknown_ending_lists_the_known_ones() {
        for name in ["mesh.fbx", "mesh"] {
            let message = load_bytes(name, b"x").unwrap_err().to_string();
            for known in MESH_EXTENSIONS {
                assert!(message.contains(known), "{message}");
            }
        }
    }

    #[test]
    fn missing_and_empty_files_are_refused() {
        let missing = load_mesh(Path::new("no/such/mesh.obj")).unwrap_err();
        assert!(matches!(missing.kind, LoadMeshErrorKind::Read { .. }));
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("mesh.obj");
        std::fs::create_dir(&folder).unwrap();
        let refused = load_mesh(&folder).unwrap_err();
        assert!(matches!(refused.kind, LoadMeshErrorKind::Read { .. }));
        for known in MESH_EXTENSIONS {
            let empty = load_bytes(&format!("mesh.{known}"), b"").unwrap_err();
            assert!(matches!(empty.kind, LoadMeshErrorKind::Empty));
        }
    }

    #[test]
    fn the_ending_may_be_in_capitals() {
        let file = load_bytes("MESH.OBJ", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        assert_eq!(file.parts[0].name, "MESH");
    }

    #[test]
    fn a_projection_goes_across_the_parts_of_a_file() {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 4 0 0\nv 4 2 0\nvt 9 9\nf 1/1 2/1 3/1\nf 2 4 5\n";
        let mut file = load_bytes("two.obj", text).unwrap();
        assert_eq!(file.parts.len(), 2);
        file.project(Projection::Planar);
        let whole = file.into_single_mesh();
        assert_eq!(whole.texcoords.len(), whole.positions.len());
        for (p, st) in whole.positions.iter().zip(&whole.texcoords) {
            assert_eq!(*st, p.truncate() / 4.0);
        }
    }

    #[test]
    fn fans_cover_a_polygon() {
        let cut: Vec<_> = fan(&[7, 8, 9, 4, 5]).collect();
        assert_eq!(cut, [[7, 8, 9], [7, 9, 4], [7, 4, 5]]);
        assert_eq!(fan(&[1, 2]).count(), 0);
    }
}
