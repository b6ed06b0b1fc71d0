mod hostile;
mod lights;
mod pictures;
mod pose;

use super::super::draco::tests::{SHEET, sheet};
use super::super::tests::load_bytes;
use super::super::{LoadMeshError, load_mesh, load_mesh_with};
use super::*;
use crate::scene::load::{FileDetail, FileScalar, FileTexture};
use crate::surface::NormalMode;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

const DRACO: &str = "KHR_draco_mesh_compression";

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

/// Binary data, and the accessors over it.
#[derive(Default)]
struct Data {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Data {
    /// A view of these bytes.
    fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        let view = json!({ "buffer": 0, "byteOffset": start, "byteLength": length });
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// An accessor of elements whose numbers are these bytes.
    fn numbers(&mut self, kind: u32, shape: &str, count: usize, bytes: Vec<u8>) -> usize {
        let view = self.view(bytes);
        self.accessor(json!({
            "bufferView": view, "componentType": kind, "count": count, "type": shape, "normalized": kind == U16,
        }))
    }

    fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let shape = match N {
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        let bytes = elements.as_flattened().iter().flat_map(|f| f.to_le_bytes());
        self.numbers(FLOAT, shape, elements.len(), bytes.collect())
    }

    /// A GLB of one scene with the first node as root, and whatever `rest` says.
    fn glb(&self, rest: Value) -> Vec<u8> {
        let mut document = json!({
            "asset": { "version": "2.0" },
            "scenes": [{ "nodes": [0] }],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len() }],
        });
        let members = document.as_object_mut().unwrap();
        members.extend(rest.as_object().unwrap().clone());
        glb(&document, &self.bytes)
    }

    fn load(&self, rest: Value) -> Result<LoadedFile, LoadMeshError> {
        load_bytes("m.glb", &self.glb(rest))
    }
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
    assert_eq!(material.base_color.factor, Vec3::new(0.5, 0.25, 0.125));
    assert_eq!(
        (material.metallic.factor, material.roughness.factor),
        (0.0, 0.75)
    );
    assert!(
        matches!(material.base_color.texture.unwrap().source, FileTexture::Path(p) if p.ends_with("my color.png"))
    );
    // The node mirrors; outside is still outside.
    let (mesh, _) = part.mesh.build(NormalMode::File).unwrap();
    assert_eq!(mesh.normals(), [Vec3::Z; 4]);
}

#[test]
fn strips_and_fans_have_more_triangles() {
    for mode in [5, 6] {
        let mut document = document();
        document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        let file = load(&document).unwrap();
        // Indices 0 1 2 0 2 3 as a strip or fan: four triangles, some without an area.
        let mesh = &file.parts[0].mesh;
        assert_eq!(mesh.triangles.len(), 4);
    }
}

#[test]
fn buffers_may_be_files_or_data_uris() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.gltf");
    let mut document = document();
    document["buffers"][0]["uri"] = json!("the%20data.bin");
    std::fs::write(&path, document.to_string()).unwrap();
    let load = || load_mesh(&path);
    let missing = load().unwrap_err();
    assert!(missing.to_string().contains("the data.bin"), "{missing}");
    std::fs::write(folder.path().join("the data.bin"), binary()).unwrap();
    let file = load().unwrap();
    assert_eq!(file.parts[0].mesh.triangles.len(), 2);
    assert!(file.files.contains(&folder.path().join("the data.bin")));
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
        ("/accessors/2/count", json!(1u64 << 31)),
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
            assert!(material.base_color.texture.is_none());
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
    document["extensionsRequired"] = json!(["KHR_texture_transform"]);
    assert!(load(&document).unwrap().unused.is_empty());
    document["extensionsRequired"] = json!(["KHR_materials_unlit", "ACME_feelings"]);
    let unused = load(&document).unwrap().unused.to_string();
    assert_eq!(unused, "no effect: ACME_feelings, KHR_materials_unlit");
    for shape in ["ACME_mesh_compression", "EXT_mesh_primitive_restart"] {
        document["extensionsRequired"] = json!([shape]);
        let error = load(&document).unwrap_err();
        assert!(error.to_string().contains(shape), "{error}");
    }
}

/// The document over a Draco stream: its accessors have no buffer views.
fn compressed_document(stream: &[u8]) -> Value {
    let mut document = document();
    document["extensionsUsed"] = json!([DRACO]);
    document["extensionsRequired"] = json!([DRACO]);
    document["meshes"][0]["primitives"][0]["extensions"] = json!({DRACO: {
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
    // The same as a second set, which the material names.
    let mut second = document.clone();
    let primitive = &mut second["meshes"][0]["primitives"][0];
    primitive["attributes"] = json!({"POSITION": 0, "TEXCOORD_1": 1});
    primitive["extensions"][DRACO]["attributes"] =
        json!({"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2});
    second["materials"][0] = json!({ "emissiveTexture": { "index": 0, "texCoord": 1 } });
    for document in [document, second] {
        let mut file = load_bytes("m.glb", &glb(&document, &stream)).unwrap();
        let mesh = file.parts.remove(0).mesh;
        assert_eq!(mesh.triangles.len(), SHEET.triangles);
        for (p, st) in mesh.positions.iter().zip(&mesh.texcoords) {
            // The sheet is at y = 2 v with v down.
            assert!((p.y - 2.0 * (1.0 - st.y)).abs() < 1e-3, "{p} at {st}");
        }
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

#[test]
fn extensions_of_materials_are_read() {
    let mut document = document();
    let texture = json!({ "index": 0 });
    document["materials"][0] = json!({
        "name": "gem",
        "emissiveFactor": [1.0, 0.5, 0.0],
        "alphaMode": "MASK",
        "normalTexture": { "index": 0, "scale": 0.5 },
        "pbrMetallicRoughness": {
            "baseColorFactor": [1.0, 1.0, 1.0, 0.75],
            "metallicRoughnessTexture": texture,
        },
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 4.0 },
            "KHR_materials_ior": { "ior": 1.8 },
            "KHR_materials_transmission": { "transmissionFactor": 0.9, "transmissionTexture": texture },
            "KHR_materials_volume": { "attenuationDistance": 0.25, "attenuationColor": [0.1, 0.2, 0.3] },
            "KHR_materials_specular": { "specularFactor": 0.5 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.25 },
            "KHR_materials_sheen": { "sheenColorFactor": [0.5, 0.5, 0.5], "sheenRoughnessFactor": 0.75 },
        },
    });
    let material = load(&document).unwrap().parts.remove(0).material.unwrap();
    assert_eq!(material.emission.factor, Vec3::new(4.0, 2.0, 0.0));
    assert_eq!((material.ior, material.attenuation_distance), (1.8, 0.25));
    assert_eq!(material.attenuation_color, Vec3::new(0.1, 0.2, 0.3));
    let channel = |scalar: &FileScalar| scalar.texture.as_ref().map(|t| t.1);
    assert_eq!(
        (
            material.transmission.factor,
            channel(&material.transmission)
        ),
        (0.9, Some("r"))
    );
    assert_eq!(
        (channel(&material.roughness), channel(&material.metallic)),
        (Some("g"), Some("b"))
    );
    assert_eq!(
        (material.specular.factor, material.opacity.factor),
        (0.25, 0.75)
    );
    assert_eq!(
        (material.coat.factor, material.coat_roughness.factor),
        (1.0, 0.25)
    );
    assert_eq!(material.sheen_color.factor, Vec3::splat(0.5));
    assert_eq!(material.sheen_roughness.factor, 0.75);
    assert!(matches!(
        material.detail,
        Some(FileDetail::NormalMap { strength: 0.5, .. })
    ));
}

#[test]
fn masks_have_a_cutoff_and_blends_have_none() {
    let cutoff = |material: Value| {
        let document = with("/materials/0", material);
        let part = load(&document).unwrap().parts.remove(0);
        part.material.unwrap().opacity_cutoff
    };
    let mask = |cutoff: f32| json!({ "alphaMode": "MASK", "alphaCutoff": cutoff });
    assert_eq!(cutoff(json!({ "alphaMode": "MASK" })), Some(0.5));
    assert_eq!(cutoff(mask(0.25)), Some(0.25));
    assert_eq!(cutoff(mask(-1.0)), Some(0.0));
    for other in ["BLEND", "OPAQUE"] {
        let material = json!({ "alphaMode": other, "alphaCutoff": 0.25 });
        assert_eq!(cutoff(material), None);
    }
}

#[test]
fn textures_may_name_another_set_of_texture_coordinates() {
    // A second set: the first with u and v swapped, behind all other data.
    let mut bytes = binary();
    let swapped: Vec<u8> = bytes[48..64]
        .chunks(4)
        .flat_map(|uv| [uv[2], uv[3], uv[0], uv[1]])
        .collect();
    bytes.extend(swapped);
    let read = |material: Value| {
        let mut document = document();
        document["buffers"][0]["byteLength"] = json!(92);
        let view = json!({"buffer": 0, "byteOffset": 76, "byteLength": 16});
        document["bufferViews"].as_array_mut().unwrap().push(view);
        let accessor = json!({"bufferView": 3, "componentType": U16, "count": 4, "type": "VEC2", "normalized": true});
        document["accessors"].as_array_mut().unwrap().push(accessor);
        document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(3);
        document["materials"][0] = material;
        let file = load_bytes("m.glb", &glb(&document, &bytes)).unwrap();
        // Corner 1 is at (1, 0) in the first set, v down.
        (file.parts[0].mesh.texcoords[1], file.warnings)
    };
    let (first, second) = (Vec2::new(1.0, 1.0), Vec2::new(0.0, 0.0));
    let base = |texture: Value| json!({ "pbrMetallicRoughness": { "baseColorTexture": texture } });
    assert_eq!(read(base(json!({ "index": 0 }))), (first, vec![]));
    assert_eq!(
        read(base(json!({ "index": 0, "texCoord": 1 }))),
        (second, vec![])
    );
    let moved = json!({ "KHR_texture_transform": { "texCoord": 1 } });
    assert_eq!(
        read(base(json!({ "index": 0, "extensions": moved }))),
        (second, vec![])
    );
    // Occlusion is not read, so its set does not matter.
    let mut occluded = base(json!({ "index": 0 }));
    occluded["occlusionTexture"] = json!({ "index": 0, "texCoord": 1 });
    assert_eq!(read(occluded), (first, vec![]));
    let mut both = base(json!({ "index": 0, "texCoord": 1 }));
    both["name"] = json!("paint");
    both["emissiveTexture"] = json!({ "index": 0 });
    let (texcoord, warnings) = read(both);
    assert_eq!((texcoord, warnings.len()), (first, 1));
    assert!(warnings[0].contains("\"paint\"") && warnings[0].contains("0 and 1"));
}
