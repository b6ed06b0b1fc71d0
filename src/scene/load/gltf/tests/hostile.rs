//! Files that are broken, or mean harm: an error, never a panic, and no memory on the word of a few bytes.

use super::*;

/// A document with at least one of everything.
fn full() -> (Value, Vec<u8>) {
    let mut data = Data::default();
    let corners = data.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let texcoords = data.floats(&[[0.0; 2], [1.0, 0.0], [0.0, 1.0]]);
    let indices = data.numbers(U16, "SCALAR", 3, vec![0, 0, 1, 0, 2, 0]);
    data.accessors[indices]["normalized"] = json!(false);
    let joints = data.numbers(5121, "VEC4", 3, vec![0; 12]);
    let weights = data.floats(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    let matrices =
        data.floats(&[Affine3A::IDENTITY; 1].map(|m| glam::Mat4::from(m).to_cols_array()));
    let moved = data.floats(&[[0.0; 3]; 2]);
    let picture = data.view(*b"not a picture");
    let sparse = data.accessor(json!({
        "bufferView": 0, "componentType": FLOAT, "count": 3, "type": "VEC3",
        "sparse": {
            "count": 1,
            "indices": { "bufferView": 2, "componentType": 5121 },
            "values": { "bufferView": 0 },
        },
    }));
    let packed = data.view(super::super::meshopt::tests::GRID_0.iter().copied());
    let stream = json!({
        "buffer": 0, "byteOffset": data.views[packed]["byteOffset"], "byteLength": data.views[packed]["byteLength"],
        "byteStride": 8, "count": 40, "mode": "ATTRIBUTES",
    });
    data.views[packed]["extensions"] = json!({ "EXT_meshopt_compression": stream });
    let grid = data.accessor(
        json!({ "bufferView": packed, "componentType": U16, "count": 39, "type": "VEC3" }),
    );
    let texture = json!({ "index": 0 });
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "children": [1, 2, 3, 4], "camera": 0, "translation": [0, 0, 1] },
            { "mesh": 0, "skin": 0, "rotation": [0, 0, 0, 1] },
            { "mesh": 1, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moved } } } },
            { "mesh": 2, "weights": [0.5] },
            { "scale": [1, 2, 3], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point" }] } },
        "meshes": [
            { "primitives": [{
                "attributes": { "POSITION": corners, "TEXCOORD_0": texcoords, "JOINTS_0": joints, "WEIGHTS_0": weights },
                "indices": indices, "material": 0,
            }] },
            { "primitives": [{ "attributes": { "POSITION": sparse }, "mode": 5 }] },
            { "primitives": [
                { "attributes": { "POSITION": corners }, "targets": [{ "POSITION": corners }] },
                { "attributes": { "POSITION": grid }, "targets": [{}] },
            ] },
        ],
        "skins": [{ "joints": [4], "skeleton": 4, "inverseBindMatrices": matrices }],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorTexture": texture },
            "extensions": { "KHR_materials_sheen": { "sheenColorTexture": texture } },
        }],
        "textures": [{ "source": 0, "sampler": 0, "extensions": { "KHR_texture_basisu": { "source": 0 } } }],
        "samplers": [{ "wrapS": 33071 }],
        "images": [{ "bufferView": picture }],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 4, "path": "translation" } }],
            "samplers": [{ "input": weights, "output": corners }],
        }],
        "accessors": data.accessors,
        "bufferViews": data.views,
        "buffers": [{ "byteLength": data.bytes.len() }],
    });
    (document, data.bytes)
}

/// Members whose number, or numbers, are indices.
const INDICES: [&str; 27] = [
    "light",
    "scene",
    "nodes",
    "children",
    "mesh",
    "skin",
    "camera",
    "joints",
    "skeleton",
    "inverseBindMatrices",
    "indices",
    "material",
    "bufferView",
    "buffer",
    "sampler",
    "source",
    "index",
    "input",
    "output",
    "node",
    "POSITION",
    "NORMAL",
    "TEXCOORD_0",
    "JOINTS_0",
    "WEIGHTS_0",
    "TRANSLATION",
    "SCALE",
];

/// The pointers to all indices of a document.
fn indices(value: &Value, at: &str, is_index: bool, found: &mut Vec<String>) {
    match value {
        Value::Number(_) if is_index => found.push(at.to_owned()),
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                indices(item, &format!("{at}/{i}"), is_index, found);
            }
        }
        Value::Object(members) => {
            for (key, member) in members {
                indices(
                    member,
                    &format!("{at}/{key}"),
                    INDICES.contains(&&key[..]),
                    found,
                );
            }
        }
        _ => {}
    }
}

#[test]
fn an_index_that_leads_nowhere_is_refused_wherever_it_is() {
    let (document, bytes) = full();
    let whole = load_bytes("m.glb", &glb(&document, &bytes)).unwrap();
    assert_eq!(whole.parts.len(), 3);
    let mut pointers = Vec::new();
    indices(&document, "", false, &mut pointers);
    assert!(pointers.len() > 50, "{}", pointers.len());
    for pointer in pointers {
        for index in [
            json!(99),
            json!(u32::MAX),
            json!(u64::MAX),
            json!(-1),
            json!(0.5),
            json!("a"),
        ] {
            let mut document = document.clone();
            *document.pointer_mut(&pointer).unwrap() = index.clone();
            let result = load_bytes("m.glb", &glb(&document, &bytes));
            assert!(result.is_err(), "{pointer} = {index}");
        }
    }
}

#[test]
fn nodes_that_go_round_in_a_circle_are_refused() {
    let (document, bytes) = full();
    for (pointer, value) in [
        ("/nodes/4", json!({ "children": [0] })),
        ("/nodes/4", json!({ "children": [4] })),
        ("/nodes/4", json!({ "children": [3] })),
        ("/nodes/0/children", json!([1, 1])),
        ("/scenes/0/nodes", json!([0, 0])),
        ("/scenes/0/nodes", json!([1])),
        ("/nodes/0/children", json!([])),
    ] {
        let mut document = document.clone();
        *document.pointer_mut(pointer).unwrap() = value.clone();
        let error = load_bytes("m.glb", &glb(&document, &bytes)).unwrap_err();
        let expected = if value == json!([]) {
            "no faces"
        } else {
            "node"
        };
        assert!(
            error.to_string().contains(expected),
            "{pointer} = {value}: {error}"
        );
    }
    // Joints that no scene shows.
    let mut hidden = document;
    hidden["nodes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "children": [5] }));
    hidden["skins"][0]["joints"] = json!([5]);
    assert!(load_bytes("m.glb", &glb(&hidden, &bytes)).is_err());
}

#[test]
fn counts_beyond_the_bytes_are_refused() {
    let (document, bytes) = full();
    let accessors = document["accessors"].as_array().unwrap().len();
    for accessor in 0..accessors {
        for count in [1_u64 << 31, u64::MAX, 4000] {
            // Zeros need no bytes, within reason.
            for view in [true, false].into_iter().filter(|v| *v || count > 4000) {
                let mut document = document.clone();
                document["accessors"][accessor]["count"] = json!(count);
                if !view {
                    document["accessors"][accessor]
                        .as_object_mut()
                        .unwrap()
                        .remove("bufferView");
                }
                let result = load_bytes("m.glb", &glb(&document, &bytes));
                assert!(
                    result.is_err(),
                    "accessor {accessor}, count {count}, view {view}"
                );
            }
        }
    }
}

#[test]
fn a_mesh_repeated_without_end_is_refused() {
    let mut data = Data::default();
    let corners: Vec<[f32; 3]> = (0..3000)
        .map(|i| [i as f32, (i % 7) as f32, (i % 5) as f32])
        .collect();
    let corners = data.floats(&corners);
    let primitive = json!({ "attributes": { "POSITION": corners } });
    let nodes: Vec<Value> = (0..300).map(|_| json!({ "mesh": 0 })).collect();
    let roots: Vec<usize> = (0..300).collect();
    let rest = |primitives: usize| json!({ "scenes": [{ "nodes": roots }], "nodes": nodes, "meshes": [{ "primitives": vec![primitive.clone(); primitives] }] });
    assert_eq!(
        data.load(rest(1)).unwrap().parts[0].mesh.positions.len(),
        300 * 3000
    );
}

#[test]
fn containers_are_sound_or_refused() {
    let bytes = binary();
    let text = document().to_string();
    let chunk =
        |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
    let file = |chunks: &[Vec<u8>]| {
        let chunks = chunks.concat();
        let length = (12 + chunks.len()) as u32;
        [
            b"glTF",
            &2_u32.to_le_bytes()[..],
            &length.to_le_bytes(),
            &chunks,
        ]
        .concat()
    };
    let json_chunk = chunk(b"JSON", text.as_bytes());
    let bin = chunk(b"BIN\0", &bytes);
    let good = [
        file(&[json_chunk.clone(), bin.clone()]),
        file(&[
            json_chunk.clone(),
            chunk(b"ODD!", b"1234"),
            bin.clone(),
            chunk(b"BIN\0", b""),
        ]),
        file(&[json_chunk.clone(), bin.clone(), vec![0; 3]]),
        [file(&[json_chunk.clone(), bin.clone()]), b"more".to_vec()].concat(),
        file(&[
            chunk(b"JSON", format!("\u{feff}{text}\0\0").as_bytes()),
            bin.clone(),
        ]),
    ];
    for (i, good) in good.iter().enumerate() {
        assert!(
            load_bytes("m.glb", good).is_ok(),
            "{i}: {:?}",
            load_bytes("m.glb", good)
        );
    }
    let bad = [
        file(&[bin.clone(), json_chunk.clone()]),
        file(std::slice::from_ref(&json_chunk)),
        file(&[]),
        file(&[json_chunk.clone(), bin[..bin.len() - 1].to_vec()]),
        file(&[chunk(b"JSON", &text.as_bytes()[..100]), bin.clone()]),
        file(&[chunk(b"JSON", b""), bin.clone()]),
        b"glTF".to_vec(),
    ];
    for (i, bad) in bad.iter().enumerate() {
        assert!(load_bytes("m.glb", bad).is_err(), "{i}");
    }
    let mut old = good[0].clone();
    old[4] = 1;
    let error = load_bytes("m.glb", &old).unwrap_err().to_string();
    assert!(error.contains("version 1"), "{error}");
    // All data in the text, and in either container.
    let hex: String = bytes.iter().map(|b| format!("%{b:02X}")).collect();
    let mut alone = document();
    alone["buffers"][0]["uri"] = json!(format!("data:application/octet-stream,{hex}"));
    let alone = alone.to_string();
    assert!(load_bytes("m.glb", &file(&[chunk(b"JSON", alone.as_bytes())])).is_ok());
    assert!(load_bytes("m.gltf", format!("\u{feff}{alone}").as_bytes()).is_ok());
    for version in ["1.0", "3.0", "", "x"] {
        let mut other = document();
        other["asset"]["version"] = json!(version);
        let error = load(&other).unwrap_err().to_string();
        assert!(error.contains("of glTF"), "{error}");
    }
}

#[test]
fn a_file_that_many_buffers_name_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.gltf");
    std::fs::write(folder.path().join("data.bin"), binary()).unwrap();
    let mut document = document();
    let buffer = |i: usize| {
        let uri = ["data.bin", "./data.bin", "%64ata.bin"][i % 3];
        json!({ "byteLength": 76 - i % 5, "uri": uri })
    };
    let buffers: Vec<Value> = (0..1000).map(buffer).collect();
    document["buffers"] = json!(buffers);
    for (view, buffer) in [(0, 7), (1, 998), (2, 0)] {
        document["bufferViews"][view]["buffer"] = json!(buffer);
    }
    std::fs::write(&path, document.to_string()).unwrap();
    let file = load_mesh(&path).unwrap();
    assert_eq!(file.files.len(), 2, "{:?}", file.files);
    assert_eq!(file.parts[0].mesh.positions[2], Vec3::new(-2.0, 1.0, 5.0));
    // Longer than the file is.
    document["buffers"][500]["byteLength"] = json!(u64::MAX);
    std::fs::write(&path, document.to_string()).unwrap();
    let error = load_mesh(&path).unwrap_err();
    assert!(error.to_string().contains("buffer 500"), "{error}");
}

#[test]
fn files_outside_of_the_folder_need_leave() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), binary()).unwrap();
    let inner = folder.path().join("model");
    std::fs::create_dir(&inner).unwrap();
    let path = inner.join("m.gltf");
    let allowed = LoadOptions {
        allow_external: true,
        ..LoadOptions::default()
    };
    let absolute = folder.path().join("data.bin").display().to_string();
    for uri in [
        "../data.bin",
        "%2e%2e/data.bin",
        &absolute,
        &format!("file://{absolute}"),
    ] {
        let mut document = document();
        document["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, document.to_string()).unwrap();
        let error = load_mesh(&path).unwrap_err();
        assert!(
            matches!(error.kind, LoadMeshErrorKind::External { .. }),
            "{error}"
        );
        assert!(load_mesh_with(&path, allowed).is_ok(), "{uri}");
    }
    let mut pictured = document();
    pictured["images"][0]["uri"] = json!("/etc/secret.png");
    let error = load(&pictured).unwrap_err();
    assert!(error.to_string().contains("image 0"), "{error}");
}
