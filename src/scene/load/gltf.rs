//! glTF 2.0 and GLB through the gltf crate.
//!
//! All triangles of the default scene, node transforms baked in, Draco streams unpacked. The crate's accessor readers panic on data
//! that is not there, so every accessor is checked against its buffer before it is read.

use std::path::Path;

use ::gltf as crate_gltf;
use crate_gltf::accessor::{Accessor, DataType, Dimensions};
use crate_gltf::json::Index;
use crate_gltf::mesh::Mode;
use crate_gltf::{Document, Gltf, Primitive, Semantic};
use glam::{Affine3A, Mat4, Vec2, Vec3};
use serde::Deserialize as _;

use super::draco::{self, Announced, Compressed};
use super::{FileMaterial, FileTexture, LoadMeshErrorKind, LoadedFile, Parts, beside};
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
            let builder = read_primitive(&primitive, &document, &buffers, &place)?;
            let builder = builder.transformed(&to_world);
            parts.add(name, primitive.material().index(), builder);
        }
    }
    let parts = parts.finish(|index| {
        let material = document.materials().nth(index)?;
        Some(read_material(&document, &material, &buffers, path))
    });
    Ok(LoadedFile {
        parts,
        warnings: Vec::new(),
    })
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
    super::read_regular(&file).map_err(|source| LoadMeshErrorKind::Read {
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

/// The triangles of a primitive in its own space; none for points and lines.
fn read_primitive(
    primitive: &Primitive,
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
        return read_compressed(primitive, &compressed, document, buffers, place);
    }
    let floats = [DataType::F32];
    let attributes = [
        (Semantic::Positions, Dimensions::Vec3, &floats[..]),
        (Semantic::Normals, Dimensions::Vec3, &floats[..]),
        (
            Semantic::TexCoords(0),
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
    let texcoords = reader.read_tex_coords(0).map(|t| t.into_f32());
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
    compressed: &Compressed,
    document: &Document,
    buffers: &[Vec<u8>],
    place: &str,
) -> Result<MeshBuilder, LoadMeshErrorKind> {
    for semantic in [Semantic::Normals, Semantic::TexCoords(0)] {
        let name = semantic.to_string();
        if primitive.get(&semantic).is_some() && !compressed.attributes.contains_key(&name) {
            return Err(LoadMeshErrorKind::Unsupported {
                what: format!("{place}: {name} outside of the primitive's Draco stream"),
            });
        }
    }
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

fn read_material(
    document: &Document,
    material: &crate_gltf::Material,
    buffers: &[Vec<u8>],
    path: &Path,
) -> FileMaterial {
    let pbr = material.pbr_metallic_roughness();
    let [r, g, b, _] = pbr.base_color_factor();
    FileMaterial {
        name: material.name().unwrap_or("").to_owned(),
        base_color: Vec3::new(r, g, b),
        base_color_texture: pbr.base_color_texture().and_then(|info| {
            let image = info.texture().source().index();
            read_image(document, image, buffers, path)
        }),
        metallic: Some(pbr.metallic_factor()),
        roughness: Some(pbr.roughness_factor()),
        displacement: None,
    }
}

/// The picture, from the plain JSON: the crate's own accessor panics on an image without a source.
fn read_image(
    document: &Document,
    image: usize,
    buffers: &[Vec<u8>],
    path: &Path,
) -> Option<FileTexture> {
    let image = document.as_json().images.get(image)?;
    if let Some(uri) = &image.uri {
        return match uri.strip_prefix("data:") {
            Some(data) => Some(FileTexture::Embedded(base64(
                data.split_once(";base64,")?.1,
            )?)),
            None => Some(FileTexture::Path(beside(path, &percent_decoded(uri)))),
        };
    }
    let bytes = view_bytes(document, image.buffer_view?.value(), buffers)?;
    Some(FileTexture::Embedded(bytes.to_vec()))
}

#[cfg(test)]
mod tests {
    use super::super::draco::tests::{SHEET, sheet};
    use super::super::tests::load_bytes;
    use super::super::{LoadMeshError, load_mesh};
    use super::*;
    use crate::surface::NormalMode;
    use serde_json::{Value, json};

    const FLOAT: u32 = 5126;
    const U16: u32 = 5123;

    /// A square of 4 positions (bytes 0..48), 4 normalised u16 texture coordinates (48..64), 6 u16 indices (64..76).
    fn binary() -> Vec<u8> {
        let mut bytes = Vec::new();
        let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for [x, y] in corners {
            bytes.extend([x, y, 0.0].iter().flat_map(|f| f.to_le_bytes()));
        }
        for [x, y] in corners {
            let texcoord = [x, y].map(|c| (c * 65535.0) as u16);
            bytes.extend(texcoord.iter().flat_map(|i| i.to_le_bytes()));
        }
        let indices = [0_u16, 1, 2, 0, 2, 3];
        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        bytes
    }

    fn document() -> Value {
        let view = |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
        json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [
                {"name": "parent", "translation": [0.0, 0.0, 5.0], "children": [1]},
                {"name": "child", "scale": [-2.0, 1.0, 1.0], "mesh": 0},
            ],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0,
            }]}],
            "materials": [{"name": "clay", "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 0.125, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.75,
                "baseColorTexture": {"index": 0},
            }}],
            "textures": [{"source": 0}],
            "images": [{"uri": "my%20color.png"}],
            "accessors": [
                {"bufferView": 0, "componentType": FLOAT, "count": 4, "type": "VEC3",
                 "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0]},
                {"bufferView": 1, "componentType": U16, "count": 4, "type": "VEC2", "normalized": true},
                {"bufferView": 2, "componentType": U16, "count": 6, "type": "SCALAR"},
            ],
            "bufferViews": [view(0, 48), view(48, 16), view(64, 12)],
            "buffers": [{"byteLength": 76}],
        })
    }

    fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + binary.len();
        let mut bytes = b"glTF".to_vec();
        bytes.extend(2_u32.to_le_bytes());
        bytes.extend((total as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    fn load(document: &Value) -> Result<LoadedFile, LoadMeshError> {
        load_bytes("m.glb", &glb(document, &binary()))
    }

    /// The document with the value at `pointer` replaced.
    fn with(pointer: &str, value: Value) -> Value {
        let mut document = document();
        *document.pointer_mut(pointer).unwrap() = value;
        document
    }

    #[test]
    fn node_transforms_are_baked_and_v_points_up() {
        let mut file = load(&document()).unwrap();
        let part = file.parts.remove(0);
        assert_eq!(part.name, "child");
        assert_eq!(part.mesh.positions[2], Vec3::new(-2.0, 1.0, 5.0));
        assert_eq!(part.mesh.texcoords[0], Vec2::new(0.0, 1.0));
        assert_eq!(part.mesh.texcoords[2], Vec2::new(1.0, 0.0));
        let material = part.material.unwrap();
        assert_eq!(material.name, "clay");
        assert_eq!(material.base_color, Vec3::new(0.5, 0.25, 0.125));
        assert_eq!(
            (material.metallic, material.roughness),
            (Some(0.0), Some(0.75))
        );
        assert!(
            matches!(material.base_color_texture, Some(FileTexture::Path(p)) if p.ends_with("my color.png"))
        );
        // The node mirrors; outside is still outside.
        let (mesh, _) = part.mesh.build(NormalMode::File).unwrap();
        assert_eq!(mesh.normals(), [Vec3::Z; 4]);
    }

    #[test]
    fn strips_and_fans_turn_the_same_way_as_lists() {
        for mode in [5, 6] {
            let mut document = document();
            document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
            let file = load(&document).unwrap();
            // Indices 0 1 2 0 2 3 as a strip or fan: four triangles, some without an area.
            let mesh = &file.parts[0].mesh;
            assert_eq!(mesh.triangles.len(), 4);
        }
        let strip = triangles(Mode::TriangleStrip, &[0, 1, 2, 3], "").unwrap();
        assert_eq!(strip, [[0, 1, 2], [1, 3, 2]]);
        let fan = triangles(Mode::TriangleFan, &[0, 1, 2, 3], "").unwrap();
        assert_eq!(fan, [[1, 2, 0], [2, 3, 0]]);
        assert!(triangles(Mode::Triangles, &[0, 1, 2, 3], "").is_err());
    }

    #[test]
    fn buffers_may_be_files_or_data_uris() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.gltf");
        let mut document = document();
        document["buffers"][0]["uri"] = json!("the%20data.bin");
        std::fs::write(&path, document.to_string()).unwrap();
        let missing = load_mesh(&path).unwrap_err();
        assert!(missing.to_string().contains("the data.bin"), "{missing}");
        std::fs::write(folder.path().join("the data.bin"), binary()).unwrap();
        assert_eq!(load_mesh(&path).unwrap().parts[0].mesh.triangles.len(), 2);

        assert_eq!(base64("aGVsbG8=").unwrap(), b"hello");
        assert_eq!(base64("+/8").unwrap(), [0xfb, 0xff]);
        assert!(base64("a b").is_none());
    }

    #[test]
    fn a_file_cut_off_anywhere_is_refused() {
        let whole = glb(&document(), &binary());
        for length in (0..whole.len()).step_by(7).chain(0..40) {
            assert!(load_bytes("m.glb", &whole[..length]).is_err(), "{length}");
        }
        let mut lying = whole;
        lying[8..12].copy_from_slice(&3_u32.to_le_bytes());
        assert!(load_bytes("m.glb", &lying).is_err());
    }

    #[test]
    fn accessors_outside_their_buffer_are_refused() {
        for (pointer, value) in [
            ("/accessors/0/count", json!(5)),
            ("/accessors/0/count", json!(u64::MAX)),
            ("/accessors/2/count", json!(0)),
            ("/accessors/0/bufferView", json!(9)),
            ("/accessors/1/componentType", json!(5125)),
            ("/accessors/1/type", json!("VEC3")),
            ("/bufferViews/2/byteOffset", json!(70)),
            ("/bufferViews/2/byteOffset", json!(u64::MAX)),
            ("/buffers/0/byteLength", json!(77)),
            ("/meshes/0/primitives/0/material", json!(3)),
            ("/meshes/0/primitives/0/attributes", json!({"NORMAL": 0})),
            ("/meshes/0/primitives/0/indices", json!(0)),
            ("/nodes/1/mesh", json!(1)),
            ("/images/0", json!({})),
        ] {
            let result = load(&with(pointer, value.clone()));
            // An image without a source costs the texture, not the mesh.
            if pointer == "/images/0" {
                let material = result.unwrap().parts.remove(0).material.unwrap();
                assert!(material.base_color_texture.is_none());
            } else {
                assert!(result.is_err(), "{pointer} = {value}");
            }
        }
    }

    #[test]
    fn an_index_beyond_the_vertices_is_refused() {
        let mut bytes = binary();
        bytes[64..66].copy_from_slice(&4_u16.to_le_bytes());
        let error = load_bytes("m.glb", &glb(&document(), &bytes)).unwrap_err();
        assert!(matches!(
            error.kind,
            LoadMeshErrorKind::IndexOutOfRange {
                index: 4,
                count: 4,
                ..
            }
        ));
    }

    #[test]
    fn a_node_that_is_its_own_ancestor_is_refused() {
        let error = load(&with("/nodes/0/children", json!([0]))).unwrap_err();
        assert!(error.to_string().contains("node 0"), "{error}");
        assert!(load(&with("/scenes/0/nodes", json!([0, 1]))).is_err());
    }

    #[test]
    fn a_required_extension_is_refused_unless_it_leaves_the_shape_alone() {
        let mut document = document();
        document["extensionsRequired"] = json!(["KHR_materials_unlit"]);
        assert!(load(&document).is_ok());
        document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
        let error = load(&document).unwrap_err();
        assert!(
            error.to_string().contains("EXT_meshopt_compression"),
            "{error}"
        );
    }

    /// The document over a Draco stream: its accessors have no buffer views.
    fn compressed_document(stream: &[u8]) -> Value {
        let mut document = document();
        document["extensionsUsed"] = json!([draco::EXTENSION]);
        document["extensionsRequired"] = json!([draco::EXTENSION]);
        document["meshes"][0]["primitives"][0]["extensions"] = json!({draco::EXTENSION: {
            "bufferView": 0, "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
        }});
        let accessors = document["accessors"].as_array_mut().unwrap();
        let counts = [SHEET.vertices, SHEET.vertices, 3 * SHEET.triangles];
        accessors[0]["max"] = json!([3.0, 2.0, 1.0]);
        for (accessor, count) in accessors.iter_mut().zip(counts) {
            accessor.as_object_mut().unwrap().remove("bufferView");
            accessor["count"] = json!(count);
        }
        document["bufferViews"] = json!([{"buffer": 0, "byteLength": stream.len()}]);
        document["buffers"] = json!([{"byteLength": stream.len()}]);
        document
    }

    #[test]
    fn a_compressed_primitive_is_unpacked_with_v_up() {
        let stream = sheet(7);
        let document = compressed_document(&stream);
        let mut file = load_bytes("m.glb", &glb(&document, &stream)).unwrap();
        let mesh = file.parts.remove(0).mesh;
        assert_eq!(mesh.triangles.len(), SHEET.triangles);
        for (p, st) in mesh.positions.iter().zip(&mesh.texcoords) {
            // The sheet is at y = 2 v with v down.
            assert!((p.y - 2.0 * (1.0 - st.y)).abs() < 1e-3, "{p} at {st}");
        }
    }

    #[test]
    fn broken_compressed_primitives_are_refused() {
        let stream = sheet(7);
        let extension = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
        for (pointer, value) in [
            ("", json!(1)),
            ("/bufferView", json!(1)),
            ("/bufferView", json!(-1)),
            ("/attributes", json!({"NORMAL": 1, "TEXCOORD_0": 2})),
            ("/attributes/POSITION", json!(7)),
            ("/attributes", json!({"POSITION": 0})),
        ] {
            let mut document = compressed_document(&stream);
            let pointer = format!("{extension}{pointer}");
            *document.pointer_mut(&pointer).unwrap() = value.clone();
            let result = load_bytes("m.glb", &glb(&document, &stream));
            assert!(result.is_err(), "{pointer} = {value}");
        }
        // Announced counts, and accessors that stand without the extension.
        let mut few = compressed_document(&stream);
        few["accessors"][2]["count"] = json!(3);
        assert!(load_bytes("m.glb", &glb(&few, &stream)).is_err());
        let mut beyond = compressed_document(&stream);
        beyond["accessors"][0]["max"] = json!([2.0, 2.0, 1.0]);
        let error = load_bytes("m.glb", &glb(&beyond, &stream)).unwrap_err();
        assert!(error.to_string().contains("outside"), "{error}");
        let mut bare = compressed_document(&stream);
        bare["meshes"][0]["primitives"][0]["extensions"] = json!({});
        assert!(load_bytes("m.glb", &glb(&bare, &stream)).is_err());
        for length in (0..stream.len()).step_by(11) {
            let document = compressed_document(&stream[..length]);
            let error = load_bytes("m.glb", &glb(&document, &stream[..length])).unwrap_err();
            assert!(error.to_string().contains("Draco"), "{error}");
        }
    }

    #[test]
    fn a_scene_without_meshes_has_no_faces() {
        let error = load(&with("/scenes/0/nodes", json!([]))).unwrap_err();
        assert!(matches!(error.kind, LoadMeshErrorKind::NoFaces));
    }
}
