//! glTF 2.0 and GLB.
//!
//! All visible triangles, lights and cameras of the default scene, in the pose that the file shows, node transforms baked in, compressed data unpacked.
//! Nothing that a file says is trusted: its indices are checked when the document is parsed (`document`), its bytes when they are
//! asked for (`buffers`, `accessor`), so that no reader behind those can be led astray.

mod accessor;
mod buffers;
mod cameras;
mod container;
mod document;
mod extensions;
mod instances;
mod lights;
mod material;
mod meshopt;
mod nodes;
mod primitive;
mod skin;
mod unused;
mod uri;

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use glam::Affine3A;

use super::{LoadMeshErrorKind, LoadOptions, LoadedFile, Parts};
use accessor::Accessors;
#[cfg(test)]
pub(super) use accessor::FLOATS;
pub(super) use accessor::Kind;
use buffers::Buffers;
use document::{Document, Node};
use primitive::Pose;
use skin::Joints;
use uri::Uris;

/// Reads the bytes of the file at `path`.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    options: LoadOptions,
) -> Result<LoadedFile, LoadMeshErrorKind> {
    let container = container::open(bytes)?;
    let document = Document::parse(container.json)?;
    extensions::check(&document)?;
    let uris = Uris {
        path,
        allow_external: options.allow_external,
    };
    let buffers = Buffers::read(&document, &container, uris)?;
    let accessors = Accessors::new(&document, &buffers);
    let materials = material::Reader::new(&document, &buffers, uris)?;
    let worlds = nodes::world_transforms(&document)?;
    let roots = document
        .roots()
        .ok_or_else(|| malformed("glTF document", "it has no scene"))?;
    let mut meshes = Meshes {
        document: &document,
        accessors: &accessors,
        materials: &materials,
        worlds: &worlds,
        joints: HashMap::new(),
        texcoords: TexcoordChoice::default(),
        parts: Parts::default(),
    };
    let visible = nodes::visible(&document, roots)?;
    check_repetition(&document, &visible, buffers.len())?;
    for &index in &visible {
        meshes.add(index)?;
    }
    let lights = lights::read(&document, &visible, &worlds)?;
    let cameras = cameras::read(&document, &visible, &worlds)?;
    let texcoords = meshes.texcoords;
    let set = |material| texcoords.known(material);
    let unused = unused::of(&document, &visible, set, materials.missing());
    let parts = meshes.parts.finish(|index| materials.material(index));
    Ok(LoadedFile {
        parts,
        lights,
        cameras,
        warnings: texcoords.warnings,
        unused,
        files: buffers.files,
        ..LoadedFile::default()
    })
}

/// Refuses a scene that would be out of all proportion to its bytes: a few of them can repeat a mesh any number of times.
fn check_repetition(
    document: &Document,
    visible: &[usize],
    bytes: usize,
) -> Result<(), LoadMeshErrorKind> {
    /// Vertices and instances that any file may have, and how many for each of its bytes.
    const FREE: usize = 1 << 25;
    const PER_BYTE: usize = 4;
    let most = bytes.saturating_mul(PER_BYTE).saturating_add(FREE);
    let count = |accessor: usize| document.accessors[accessor].count;
    let of_primitive = |primitive: &document::Primitive| {
        let vertices = primitive
            .attributes
            .get("POSITION")
            .map_or(0, |&a| count(a));
        // No more are kept than are used.
        primitive
            .indices
            .map_or(vertices, |i| vertices.min(count(i)))
    };
    let meshes = document.meshes.iter();
    let meshes: Vec<usize> = meshes
        .map(|mesh| {
            mesh.primitives
                .iter()
                .map(of_primitive)
                .fold(0, usize::saturating_add)
        })
        .collect();
    let mut total = 0_usize;
    for node in visible.iter().map(|&index| &document.nodes[index]) {
        let instances = node
            .instancing()
            .into_iter()
            .flat_map(|i| i.attributes.values());
        let instances = instances.map(|&a| count(a)).max().unwrap_or(0);
        let vertices = node.mesh.map_or(0, |mesh| meshes[mesh as usize]);
        total = total.saturating_add(vertices).saturating_add(instances);
    }
    if total > most {
        let problem = format!(
            "its nodes lay out {total} vertices and instances, of {bytes} bytes; at most {most} are read"
        );
        return Err(malformed("glTF document", problem));
    }
    Ok(())
}

/// Collects the meshes of nodes.
struct Meshes<'a> {
    document: &'a Document,
    accessors: &'a Accessors<'a>,
    materials: &'a material::Reader<'a>,
    /// Per node.
    worlds: &'a [Affine3A],
    /// Per skin that was needed.
    joints: HashMap<u32, Rc<Joints>>,
    texcoords: TexcoordChoice,
    parts: Parts,
}

impl Meshes<'_> {
    /// The mesh of node number `index`, if it has one.
    fn add(&mut self, index: usize) -> Result<(), LoadMeshErrorKind> {
        let node = &self.document.nodes[index];
        let Some(mesh_index) = node.mesh else {
            return Ok(());
        };
        let mesh = &self.document.meshes[mesh_index as usize];
        let place = format!("node {index}");
        let placed = self.instances(node, &self.worlds[index], &place)?;
        if placed.as_ref().is_some_and(Vec::is_empty) {
            return Ok(());
        }
        let joints = match node.skin {
            Some(skin) => Some(self.joints(skin)?),
            None => None,
        };
        let pose = Pose {
            weights: node.weights.as_ref().unwrap_or(&mesh.weights),
            joints: joints.as_deref(),
        };
        let reader = primitive::Reader {
            document: self.document,
            accessors: self.accessors,
        };
        let name = node
            .name
            .as_ref()
            .or(mesh.name.as_ref())
            .map_or("", |name| name);
        // A skin's joints have moved the mesh to where it stands.
        let world = if joints.is_some() {
            Affine3A::IDENTITY
        } else {
            self.worlds[index]
        };
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {mesh_index} primitive {number}");
            let set = self.texcoords.of(self.materials, primitive.material);
            let builder = reader.read(primitive, set, &pose, &place)?;
            let mut builder = builder.transformed(&world);
            let dequantization = primitive
                .material
                .and_then(|m| self.materials.dequantization(m));
            if let Some(uv) = dequantization {
                let uv = uv.to_affine();
                for st in &mut builder.texcoords {
                    *st = uv.transform_point2(*st);
                }
            }
            let placed = placed.as_ref().map(|placed| (index, &placed[..]));
            self.parts.add(name, primitive.material, builder, placed);
        }
        Ok(())
    }

    /// Where the node places its mesh, if that is more than once.
    fn instances(
        &self,
        node: &Node,
        world: &Affine3A,
        place: &str,
    ) -> Result<Option<Vec<Affine3A>>, LoadMeshErrorKind> {
        let Some(instancing) = node.instancing() else {
            return Ok(None);
        };
        if node.skin.is_some() {
            return Err(LoadMeshErrorKind::Unsupported {
                what: format!("{place}: EXT_mesh_gpu_instancing of a mesh with a skin"),
            });
        }
        instances::read(instancing, world, self.accessors, place).map(Some)
    }

    fn joints(&mut self, skin: u32) -> Result<Rc<Joints>, LoadMeshErrorKind> {
        if let Some(joints) = self.joints.get(&skin) {
            return Ok(joints.clone());
        }
        let joints = Joints::read(self.document, skin as usize, self.worlds, self.accessors)?;
        Ok(self.joints.entry(skin).or_insert(Rc::new(joints)).clone())
    }
}

/// Which of its sets of texture coordinates a mesh keeps: it has one here.
#[derive(Default)]
struct TexcoordChoice {
    by_material: HashMap<usize, u32>,
    warnings: Vec<String>,
}

impl TexcoordChoice {
    /// The set that was chosen for the material.
    fn known(&self, material: Option<usize>) -> u32 {
        let chosen = material.and_then(|index| self.by_material.get(&index));
        chosen.copied().unwrap_or(0)
    }

    /// The set that the material's textures are read by. If they are read by several, the first, with a warning.
    fn of(&mut self, reader: &material::Reader, material: Option<usize>) -> u32 {
        // The default material has no textures.
        let Some(index) = material else {
            return 0;
        };
        *self.by_material.entry(index).or_insert_with(|| {
            let sets = reader.texcoord_sets(index);
            let first = sets.first().copied().unwrap_or(0);
            if sets.len() > 1 {
                let names: Vec<String> = sets.iter().map(u32::to_string).collect();
                self.warnings.push(format!(
                    "material {:?} reads its textures by the texture coordinates {}; a mesh has one set here, and all are read by {first}",
                    reader.name(index),
                    names.join(" and "),
                ));
            }
            first
        })
    }
}

fn malformed(what: &str, problem: impl Into<String>) -> LoadMeshErrorKind {
    LoadMeshErrorKind::Malformed {
        what: what.to_owned(),
        problem: problem.into(),
    }
}

#[cfg(test)]
mod tests;
