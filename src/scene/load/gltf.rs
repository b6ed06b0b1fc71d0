//! glTF 2.0 and GLB through the gltf crate.
//!
//! All triangles of the default scene, node transforms baked in, Draco streams unpacked. The crate's accessor readers panic on data
//! that is not there, so every accessor is checked against its buffer before it is read.

mod material;

use std::collections::HashMap;
use std::path::Path;

use ::gltf as crate_gltf;
use crate_gltf::accessor::{Accessor, DataType, Dimensions};
use crate_gltf::json::Index;
use crate_gltf::mesh::Mode;
use crate_gltf::{Document, Gltf, Material, Primitive, Semantic};
use glam::{Affine3A, Mat4, Vec2, Vec3};
use serde::Deserialize as _;

use super::draco::{self, Announced, Compressed};
use super::{LoadMeshErrorKind, LoadedFile, Parts, beside};
use crate::files::input;
use crate::surface::MeshBuilder;

/// Required extensions that may be ignored: without them a texture or a light is lost, but no shape.
const HARMLESS_EXTENSIONS: [&str; 2] = ["KHR_lights_punctual", "KHR_texture_transform"];

/// Reads the bytes of the file at `path`.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<LoadedFile, LoadMeshErrorKind> {
    check_glb_header(bytes)?;
    let Gltf { document, blob } =
        Gltf::from_slice_without_validation(bytes).map_err(|e| bad_document(&e))?;
    let document = validated(document)?;
    let buffers = read_buffers(&document, blob, path)?;
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next())
        .ok_or_else(|| malformed("glTF document", "it has no scene"))?;
    let reader = material::Reader {
        document: &document,
        buffers: &buffers,
        path,
    };
    let mut texcoords = TexcoordChoice::default();
    let mut parts = Parts::default();
    let mut seen = vec![false; document.nodes().len()];
    let mut pending: Vec<_> = scene.nodes().map(|n| (n, Affine3A::IDENTITY)).collect();
    // The last in is taken first: reversed, nodes come in file order.
    pending.reverse();
    while let Some((node, parent)) = pending.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            let what = format!("node {}", node.index());
            return Err(malformed(
                &what,
                "it has two parents or is its own ancestor",
            ));
        }
        let local = Affine3A::from_mat4(Mat4::from_cols_array_2d(&node.transform().matrix()));
        let to_world = parent * local;
        let first_child = pending.len();
        pending.extend(node.children().map(|child| (child, to_world)));
        pending[first_child..].reverse();
        let Some(mesh) = node.mesh() else { continue };
        let name = node.name().or(mesh.name()).unwrap_or("");
        for primitive in mesh.primitives() {
            let place = format!("mesh {} primitive {}", mesh.index(), primitive.index());
            let set = texcoords.of(&reader, &primitive.material());
            let builder = read_primitive(&primitive, set, &document, &buffers, &place)?;
            let builder = builder.transformed(&to_world);
            parts.add(name, primitive.material().index(), builder);
        }
    }
    let parts = parts.finish(|index| reader.material(index));
    Ok(LoadedFile {
        parts,
        warnings: texcoords.warnings,
        files: Vec::new(),
    })
}

/// Which of its sets of texture coordinates a mesh keeps: it has one here.
#[derive(Default)]
struct TexcoordChoice {
    by_material: HashMap<usize, u32>,
    warnings: Vec<String>,
}

impl TexcoordChoice {
    /// The set that the material's textures are read by. If they are read by several, the first, with a warning.
    fn of(&mut self, reader: &material::Reader, material: &Material) -> u32 {
        // The default material has no textures.
        let Some(index) = material.index() else {
            return 0;
        };
        *self.by_material.entry(index).or_insert_with(|| {
            let sets = reader.texcoord_sets(index);
            let first = sets.first().copied().unwrap_or(0);
            if sets.len() > 1 {
                let names: Vec<String> = sets.iter().map(u32::to_string).collect();
                self.warnings.push(format!(
                    "material {:?} reads its textures by the texture coordinates {}; a mesh has one set here, and all are read by {first}",
                    material.name().unwrap_or(""),
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

fn bad_document(error: &crate_gltf::Error) -> LoadMeshErrorKind {
    malformed("glTF document", error.to_string())
}

/// Checked by the crate, after extensions that we know, or that leave the shape alone, are struck off the
/// required ones.
///
/// The crate does not know that an accessor may have no buffer view (those of a compressed primitive have
/// none): such get one for the time of the check.
fn validated(document: Document) -> Result<Document, LoadMeshErrorKind> {
    let mut root = document.into_json();
    root.extensions_required.retain(|name| {
        !name.starts_with("KHR_materials_")
            && !HARMLESS_EXTENSIONS.contains(&name.as_str())
            && name != draco::EXTENSION
    });
    if let Some(name) = root.extensions_required.first() {
        return Err(LoadMeshErrorKind::Unsupported {
            what: format!("the glTF extension {name}, which the file requires,"),
        });
    }
    let mut lent = vec![false; root.accessors.len()];
    for (accessor, lent) in root.accessors.iter_mut().zip(&mut lent) {
        *lent = accessor.buffer_view.is_none() && accessor.sparse.is_none();
        if *lent {
            accessor.buffer_view = Some(Index::new(0));
        }
    }
    let mut root = Document::from_json(root)
        .map_err(|e| bad_document(&e))?
        .into_json();
    for (accessor, _) in root.accessors.iter_mut().zip(lent).filter(|(_, l)| *l) {
        accessor.buffer_view = None;
    }
    Ok(Document::from_json_without_validation(root))
}

/// The crate trusts the length in the header not to be less than the header itself.
fn check_glb_header(bytes: &[u8]) -> Result<(), LoadMeshErrorKind> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let length = bytes
        .get(8..12)
        .and_then(|b| b.try_into().ok())
        .map(u32::from_le_bytes);
    match length {
        Some(length) if length >= 12 && length as usize <= bytes.len() => Ok(()),
        Some(length) => Err(malformed(
            "GLB header",
            format!(
                "it promises {length} bytes, but the file has {}; is it cut off?",
                bytes.len()
            ),
        )),
        None => Err(malformed("GLB header", "the file ends inside it")),
    }
}

/// The bytes of every buffer, each at least as long as the document says.
fn read_buffers(
    document: &Document,
    mut blob: Option<Vec<u8>>,
    path: &Path,
) -> Result<Vec<Vec<u8>>, LoadMeshErrorKind> {
    document
        .buffers()
        .map(|buffer| {
            let what = format!("buffer {}", buffer.index());
            let data = match buffer.source() {
                crate_gltf::buffer::Source::Bin => blob
                    .take()
                    .ok_or_else(|| malformed(&what, "the file has no binary chunk left for it"))?,
                crate_gltf::buffer::Source::Uri(uri) => read_uri(uri, path, &what)?,
            };
            if data.len() < buffer.length() {
                let (found, wanted) = (data.len(), buffer.length());
                let problem = format!("{found} bytes found, {wanted} expected");
                return Err(malformed(&what, problem));
            }
            Ok(data)
        })
        .collect()
}

fn read_uri(uri: &str, path: &Path, what: &str) -> Result<Vec<u8>, LoadMeshErrorKind> {
    if let Some(data) = uri.strip_prefix("data:") {
        return data
            .split_once(";base64,")
            .and_then(|(_, text)| base64(text))
            .ok_or_else(|| malformed(what, "its data URI is not valid base64"));
    }
    let file = beside(path, &percent_decoded(uri));
    input::read(&file).map_err(|source| LoadMeshErrorKind::Read {
        what: format!("{what}, {}", file.display()),
        source,
    })
}

/// RFC 4648, with or without padding.
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Some(bytes)
}

fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = (*first == b'%')
            .then(|| tail.first_chunk::<2>())
            .flatten()
            .and_then(|pair| std::str::from_utf8(pair).ok())
            .and_then(|pair| u8::from_str_radix(pair, 16).ok());
        bytes.push(hex.unwrap_or(*first));
        rest = &tail[if hex.is_some() { 2 } else { 0 }..];
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The triangles of a primitive in its own space, with this set of its texture coordinates; none for points and lines.
fn read_primitive(
    primitive: &Primitive,
    set: u32,
    document: &Document,
    buffers: &[Vec<u8>],
    place: &str,
) -> Result<MeshBuilder, LoadMeshErrorKind> {
    if !matches!(
        primitive.mode(),
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
    ) {
        return Ok(MeshBuilder::default());
    }
    if let Some(extension) = primitive.extension_value(draco::EXTENSION) {
        let compressed = Compressed::deserialize(extension)
            .map_err(|e| malformed(&format!("{place} {}", draco::EXTENSION), e.to_string()))?;
        return read_compressed(primitive, set, compressed, document, buffers, place);
    }
    let floats = [DataType::F32];
    let attributes = [
        (Semantic::Positions, Dimensions::Vec3, &floats[..]),
        (Semantic::Normals, Dimensions::Vec3, &floats[..]),
        (
            Semantic::TexCoords(set),
            Dimensions::Vec2,
            &[DataType::F32, DataType::U8, DataType::U16][..],
        ),
    ];
    for (semantic, dimensions, types) in attributes {
        if let Some(accessor) = primitive.get(&semantic) {
            let what = format!("{place} {}", semantic.to_string());
            check_accessor(&accessor, buffers, dimensions, types, &what)?;
        }
    }
    if let Some(accessor) = primitive.indices() {
        let types = [DataType::U8, DataType::U16, DataType::U32];
        let what = format!("{place} indices");
        check_accessor(&accessor, buffers, Dimensions::Scalar, &types, &what)?;
    }
    let reader = primitive.reader(|b| buffers.get(b.index()).map(Vec::as_slice));
    let positions: Vec<Vec3> = reader
        .read_positions()
        .ok_or_else(|| malformed(place, "it has no POSITION accessor"))?
        .map(Vec3::from)
        .collect();
    let normals = reader.read_normals().into_iter().flatten();
    let texcoords = reader.read_tex_coords(set).map(|t| t.into_f32());
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..positions.len() as u32).collect(),
    };
    check_indices(&indices, positions.len(), place)?;
    Ok(MeshBuilder {
        normals: normals.map(Vec3::from).collect(),
        texcoords: texcoords
            .into_iter()
            .flatten()
            .map(|st| v_up(st.into()))
            .collect(),
        triangles: triangles(primitive.mode(), &indices, place)?,
        positions,
    })
}

/// glTF's v points down.
fn v_up(st: Vec2) -> Vec2 {
    Vec2::new(st.x, 1.0 - st.y)
}

/// A primitive whose triangles are in a Draco stream. Whatever its mode, the stream holds single triangles.
fn read_compressed(
    primitive: &Primitive,
    set: u32,
    mut compressed: Compressed,
    document: &Document,
    buffers: &[Vec<u8>],
    place: &str,
) -> Result<MeshBuilder, LoadMeshErrorKind> {
    for semantic in [Semantic::Normals, Semantic::TexCoords(set)] {
        let name = semantic.to_string();
        if primitive.get(&semantic).is_some() && !compressed.attributes.contains_key(&name) {
            return Err(LoadMeshErrorKind::Unsupported {
                what: format!("{place}: {name} outside of the primitive's Draco stream"),
            });
        }
    }
    // The decoder knows one set, the first.
    let chosen = Semantic::TexCoords(set).to_string();
    let first = compressed.attributes.remove(&chosen);
    compressed
        .attributes
        .retain(|name, _| !name.starts_with("TEXCOORD_"));
    compressed
        .attributes
        .extend(first.map(|id| ("TEXCOORD_0".to_owned(), id)));
    let what = format!("{place} Draco stream");
    let stream = view_bytes(document, compressed.buffer_view, buffers)
        .ok_or_else(|| malformed(&what, "its buffer view lies outside of the buffer"))?;
    let count = |accessor: Option<Accessor>| accessor.map_or(0, |a| a.count());
    let announced = Announced {
        vertices: count(primitive.get(&Semantic::Positions)),
        triangles: count(primitive.indices()) / 3,
    };
    let decoded = draco::decode(stream, &compressed.attributes, announced)
        .map_err(|problem| malformed(&what, problem))?;
    check_indices(
        decoded.triangles.as_flattened(),
        decoded.positions.len(),
        place,
    )?;
    if let Some(accessor) = primitive.get(&Semantic::Positions) {
        check_bounds(&decoded.positions, &accessor, &what)?;
    }
    Ok(MeshBuilder {
        positions: decoded.positions,
        normals: decoded.normals,
        texcoords: decoded.texcoords.into_iter().map(v_up).collect(),
        triangles: decoded.triangles,
    })
}

/// A Draco stream has no checksum, and many a damaged one unpacks to a wild mesh: the box that the accessor
/// must give tells.
fn check_bounds(
    positions: &[Vec3],
    accessor: &Accessor,
    what: &str,
) -> Result<(), LoadMeshErrorKind> {
    /// Of the longest side: more than any useful quantisation moves a vertex.
    const SLACK: f32 = 0.05;
    let corner = |value| serde_json::from_value(value).ok().map(Vec3::from_array);
    let box_of_file = accessor
        .min()
        .and_then(corner)
        .zip(accessor.max().and_then(corner));
    let Some((min, max)) = box_of_file else {
        return Ok(());
    };
    let slack = SLACK * (max - min).max_element();
    let inside = |p: &&Vec3| p.cmpge(min - slack).all() && p.cmple(max + slack).all();
    match positions.iter().find(|p| !inside(p)) {
        Some(p) => Err(malformed(
            what,
            format!(
                "it holds the position {p}, outside of {min} to {max} that the file gives; is it damaged?"
            ),
        )),
        None => Ok(()),
    }
}

fn view_bytes<'a>(document: &Document, view: usize, buffers: &'a [Vec<u8>]) -> Option<&'a [u8]> {
    let view = document.views().nth(view)?;
    let end = view.offset().checked_add(view.length())?;
    buffers.get(view.buffer().index())?.get(view.offset()..end)
}

fn check_indices(indices: &[u32], vertices: usize, place: &str) -> Result<(), LoadMeshErrorKind> {
    match indices.iter().find(|&&i| i as usize >= vertices) {
        Some(&index) => Err(LoadMeshErrorKind::IndexOutOfRange {
            place: place.to_owned(),
            what: "vertex",
            index: index.into(),
            count: vertices,
            counted: " (counted from 0)",
        }),
        None => Ok(()),
    }
}

/// The triangles of a list, strip or fan, with the winding that the specification gives (section 3.7.2.1).
fn triangles(mode: Mode, indices: &[u32], place: &str) -> Result<Vec<[u32; 3]>, LoadMeshErrorKind> {
    let windows = indices.windows(3);
    Ok(match mode {
        Mode::TriangleStrip => windows
            .enumerate()
            .map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]])
            .collect(),
        Mode::TriangleFan => super::fan(indices)
            .map(|[first, a, b]| [a, b, first])
            .collect(),
        _ => {
            let (list, rest) = indices.as_chunks();
            if !rest.is_empty() {
                let found = indices.len();
                let problem = format!("{found} indices; a list of triangles needs a multiple of 3");
                return Err(malformed(place, problem));
            }
            list.to_vec()
        }
    })
}

/// Whether the accessor is of an expected type and lies inside its buffer, so that the crate's reader may
/// be let loose on it.
fn check_accessor(
    accessor: &Accessor,
    buffers: &[Vec<u8>],
    dimensions: Dimensions,
    types: &[DataType],
    what: &str,
) -> Result<(), LoadMeshErrorKind> {
    if accessor.dimensions() != dimensions || !types.contains(&accessor.data_type()) {
        let (found, kind) = (accessor.data_type(), accessor.dimensions());
        return Err(malformed(
            what,
            format!("found {kind:?} of {found:?}; expected {dimensions:?} of {types:?}"),
        ));
    }
    if accessor.sparse().is_some() {
        return Err(LoadMeshErrorKind::Unsupported {
            what: format!("{what}: a sparse accessor"),
        });
    }
    let inside = accessor.view().is_some_and(|view| {
        let stride = view.stride().unwrap_or(accessor.size());
        let used = accessor
            .count()
            .checked_sub(1)
            .and_then(|last| last.checked_mul(stride))
            .and_then(|n| n.checked_add(accessor.size()))
            .and_then(|n| n.checked_add(accessor.offset()));
        let view_end = view.offset().checked_add(view.length());
        let buffer = buffers.get(view.buffer().index()).map_or(0, Vec::len);
        stride >= accessor.size()
            && used.is_some_and(|n| n <= view.length())
            && view_end.is_some_and(|n| n <= buffer)
    });
    if !inside {
        let count = accessor.count();
        return Err(malformed(
            what,
            format!("its {count} elements do not lie inside the buffer"),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
