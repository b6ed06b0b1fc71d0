//! Which extensions a file may require.

use super::LoadMeshErrorKind;
use super::document::Document;

/// Extensions that are read.
pub(super) const READ: [&str; 16] = [
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_specular",
    "KHR_materials_clearcoat",
    "KHR_materials_sheen",
];

/// What the names of extensions hold that change a shape: codecs, strips that end inside, shapes without triangles.
const SHAPES: [&str; 4] = [
    "_compression",
    "_primitive_restart",
    "_implicit_",
    "_mesh_linking",
];

/// # Errors
///
/// A required extension that is not read, and without which the shape is another one.
pub(super) fn check(document: &Document) -> Result<(), LoadMeshErrorKind> {
    let mut required = document.extensions_required.iter();
    let shapes = |name: &&String| {
        let shapes = SHAPES.iter().any(|part| name.contains(part));
        shapes && !READ.contains(&name.as_str())
    };
    match required.find(shapes) {
        None => Ok(()),
        Some(name) => Err(LoadMeshErrorKind::Unsupported {
            what: format!("the glTF extension {name}, which the file requires,"),
        }),
    }
}
