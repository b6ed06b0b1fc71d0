//! Where vertices come to lie: sparse and quantised accessors, morph targets, skins, instances.

use std::f32::consts::FRAC_1_SQRT_2;

use super::*;

const CORNERS: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// One node with a mesh of one primitive.
fn scene(primitive: Value, node: Value) -> Value {
    let mut node = node;
    node["mesh"] = json!(0);
    json!({ "nodes": [node], "meshes": [{ "primitives": [primitive] }] })
}

fn positions(data: &Data, rest: Value) -> Vec<Vec3> {
    data.load(rest).unwrap().parts.remove(0).mesh.positions
}

/// Sparse corners: these indices and places, over the corners or over nothing.
fn sparse(indices: [u8; 2], over_corners: bool, count: usize) -> Result<LoadedFile, LoadMeshError> {
    let mut data = Data::default();
    data.floats(&CORNERS);
    let indices = data.view(indices);
    let places = [[5.0_f32, 6.0, 7.0], [8.0, 9.0, 10.0]];
    let values = data.view(places.as_flattened().iter().flat_map(|f| f.to_le_bytes()));
    let mut accessor = json!({
        "componentType": FLOAT, "count": count, "type": "VEC3",
        "sparse": {
            "count": 2,
            "indices": { "bufferView": indices, "componentType": 5121 },
            "values": { "bufferView": values },
        },
    });
    if over_corners {
        accessor["bufferView"] = json!(0);
    }
    let accessor = data.accessor(accessor);
    data.load(scene(
        json!({ "attributes": { "POSITION": accessor } }),
        json!({}),
    ))
}

#[test]
fn sparse_elements_replace_those_of_the_base_or_zeros() {
    let (first, second) = (Vec3::new(5.0, 6.0, 7.0), Vec3::new(8.0, 9.0, 10.0));
    let places = |indices, over| {
        sparse(indices, over, 3)
            .unwrap()
            .parts
            .remove(0)
            .mesh
            .positions
    };
    assert_eq!(places([1, 2], true), [Vec3::ZERO, first, second]);
    assert_eq!(places([0, 2], true), [first, Vec3::X, second]);
    assert_eq!(places([0, 2], false), [first, Vec3::ZERO, second]);
    for broken in [[2, 1], [1, 1], [1, 3]] {
        assert!(sparse(broken, true, 3).is_err(), "{broken:?}");
    }
    let error = sparse([0, 2], false, 3 << 22).unwrap_err();
    assert!(error.to_string().contains("without bytes"), "{error}");
}

#[test]
fn integers_are_numbers_or_fractions() {
    // Type, normalised, what stands for (1, 0, 0), and what becomes of it.
    let bytes = |n: i64, size: usize| n.to_le_bytes()[..size].to_vec();
    for (kind, size, normalized, number, expected) in [
        (5120, 1, false, -3, -3.0),
        (5120, 1, true, -127, -1.0),
        (5120, 1, true, -128, -1.0),
        (5121, 1, false, 200, 200.0),
        (5121, 1, true, 51, 0.2),
        (5122, 2, false, -300, -300.0),
        (5122, 2, true, 32767, 1.0),
        (5123, 2, false, 60_000, 60_000.0),
        (5123, 2, true, 65535, 1.0),
    ] {
        let mut data = Data::default();
        // Three components, padded to a stride of 4 or 8 bytes.
        let stride = 4 * size;
        let corners = [[0, 0, 0, 9], [number, 0, 0, 9], [0, number, 0, 9]];
        let corners = corners.as_flattened().iter();
        let view = data.view(corners.flat_map(|&n| bytes(n, size)));
        data.views[view]["byteStride"] = json!(stride);
        let accessor = data.accessor(json!({
            "bufferView": view, "componentType": kind, "count": 3, "type": "VEC3", "normalized": normalized,
        }));
        let mut rest = scene(
            json!({ "attributes": { "POSITION": accessor } }),
            json!({ "scale": [2, 2, 2] }),
        );
        rest["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        rest["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let places = positions(&data, rest);
        let error = (places[1] - Vec3::new(2.0 * expected, 0.0, 0.0)).length();
        assert!(error < 1e-6, "{kind} {normalized}: {}", places[1]);
    }
}

#[test]
fn quantised_coordinates_take_in_the_transform_that_their_textures_share() {
    let mut data = Data::default();
    let positions = data.floats(&CORNERS);
    let codes = [[0_u16, 0], [4095, 0], [0, 4095]];
    let codes = codes.as_flattened().iter().flat_map(|n| n.to_le_bytes());
    let texcoords = data.numbers(U16, "VEC2", 3, codes.collect());
    let load = |used: Value| {
        let mut rest = scene(
            json!({ "attributes": { "POSITION": positions, "TEXCOORD_0": texcoords }, "material": 0 }),
            json!({}),
        );
        let scale = 65535.0 / 4095.0;
        let transform = json!({ "KHR_texture_transform": { "scale": [scale, scale] } });
        let texture = json!({ "index": 0, "extensions": transform });
        rest["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": texture } }]);
        rest["textures"] = json!([{ "source": 0 }]);
        rest["images"] = json!([{ "uri": "a.png" }]);
        rest["extensionsUsed"] = used;
        let part = data.load(rest).unwrap().parts.remove(0);
        let uv = part.material.unwrap().base_color.texture.unwrap().uv;
        (part.mesh.texcoords, uv)
    };
    let (quantised, uv) = load(json!(["KHR_mesh_quantization"]));
    assert_eq!(uv, Default::default());
    assert!(
        (quantised[2] - Vec2::new(0.0, 0.0)).length() < 1e-5,
        "{quantised:?}"
    );
    assert!(
        (quantised[1] - Vec2::new(1.0, 1.0)).length() < 1e-5,
        "{quantised:?}"
    );
    // As they are where they are the author's own, and the texture lies at the same place.
    let (plain, transform) = load(json!([]));
    for (plain, quantised) in plain.iter().zip(quantised) {
        assert!((transform.apply(*plain) - quantised).length() < 1e-5);
    }
}

#[test]
fn primitives_may_share_their_vertices() {
    let mut data = Data::default();
    let corners: Vec<[f32; 3]> = (0..100).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let shared = data.floats(&corners);
    let primitives: Vec<Value> = (0..98_u8)
        .map(|i| {
            let indices = data.numbers(5121, "SCALAR", 3, vec![i + 2, i, i + 1]);
            json!({ "attributes": { "POSITION": shared }, "indices": indices })
        })
        .collect();
    let rest = json!({ "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": primitives }] });
    let mesh = data.load(rest).unwrap().parts.remove(0).mesh;
    // Three each, and not a hundred.
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (98, 3 * 98));
    for (i, t) in mesh.triangles.iter().enumerate() {
        let xs = t.map(|v| mesh.positions[v as usize].x as usize);
        assert_eq!(xs, [i + 2, i, i + 1]);
    }
}

#[test]
fn morph_targets_are_added_by_the_weights_of_node_or_mesh() {
    let mut data = Data::default();
    let base = data.floats(&CORNERS);
    let normals = data.floats(&[[0.0, 0.0, 1.0]; 3]);
    let up = data.floats(&[[0.0, 0.0, 2.0]; 3]);
    let tilt = data.floats(&[[1.0, 0.0, 0.0]; 3]);
    let aside = data.floats(&[[4.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
    let primitive = json!({
        "attributes": { "POSITION": base, "NORMAL": normals },
        "targets": [{ "POSITION": up, "NORMAL": tilt }, { "POSITION": aside }],
    });
    let load = |of_mesh: Value, of_node: Value| {
        let mut node = json!({ "mesh": 0 });
        if !of_node.is_null() {
            node["weights"] = of_node;
        }
        let mut mesh = json!({ "primitives": [primitive] });
        if !of_mesh.is_null() {
            mesh["weights"] = of_mesh;
        }
        let file = data.load(json!({ "nodes": [node], "meshes": [mesh] }));
        file.map(|mut file| file.parts.remove(0).mesh)
    };
    let none = load(Value::Null, Value::Null).unwrap();
    assert_eq!(none.positions[0], Vec3::ZERO);
    let of_mesh = load(json!([1.0, 0.5]), Value::Null).unwrap();
    assert_eq!(
        of_mesh.positions,
        [[2.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]].map(Vec3::from)
    );
    let normal = Vec3::new(FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2);
    assert!((of_mesh.normals[0] - normal).length() < 1e-6);
    let of_node = load(json!([1.0, 0.5]), json!([-0.5, 0.0])).unwrap();
    assert_eq!(of_node.positions[1], Vec3::new(1.0, 0.0, -1.0));
    let error = load(Value::Null, json!([1.0])).unwrap_err();
    assert!(error.to_string().contains("1 weights for 2"), "{error}");
}

/// A triangle on two joints; its own node is moved, which must not matter.
fn skinned(
    joints: [[u8; 4]; 3],
    weights: [[f32; 4]; 3],
    second: Value,
) -> Result<LoadedFile, LoadMeshError> {
    let mut data = Data::default();
    let base = data.floats(&CORNERS);
    let normals = data.floats(&[[0.0, 0.0, 1.0]; 3]);
    let joints = data.numbers(5121, "VEC4", 3, joints.as_flattened().to_vec());
    let weights = data.floats(&weights);
    // The second joint stands at (10, 0, 0) in the bind pose.
    let mut matrices = [
        Affine3A::IDENTITY,
        Affine3A::from_translation(Vec3::new(-10.0, 0.0, 0.0)),
    ];
    matrices[0].translation.z = 1.0;
    let matrices = matrices.map(|m| glam::Mat4::from(m).to_cols_array());
    let matrices = data.floats(&matrices);
    data.load(json!({
        "nodes": [
            { "children": [1, 2], "translation": [0, 0, 100] },
            { "mesh": 0, "skin": 0, "scale": [7, 7, 7], "translation": [1, 2, 3] },
            { "translation": [0, 5, -1], "children": [3] },
            second,
        ],
        "meshes": [{ "primitives": [{ "attributes": {
            "POSITION": base, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights,
        } }] }],
        "skins": [{ "joints": [2, 3], "inverseBindMatrices": matrices, "skeleton": 2 }],
    }))
}

#[test]
fn joints_move_vertices_and_their_node_does_not() {
    let quarter =
        json!({ "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2], "translation": [20, 0, 0] });
    let weights = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0, 0.0],
        [0.5, 0.5, 0.0, 0.0],
    ];
    let joints = [[0, 0, 0, 0], [9, 1, 0, 200], [0, 1, 0, 0]];
    let mesh = skinned(joints, weights, quarter.clone())
        .unwrap()
        .parts
        .remove(0)
        .mesh;
    let first = |p: Vec3| p + Vec3::new(0.0, 5.0, 100.0);
    // Out of the bind pose, a quarter turn about z, and to where the joint is.
    let second = |p: Vec3| Vec3::new(-p.y, p.x - 10.0, p.z) + Vec3::new(20.0, 5.0, 99.0);
    let corners = CORNERS.map(Vec3::from);
    let expected = [
        first(corners[0]),
        second(corners[1]),
        0.5 * (first(corners[2]) + second(corners[2])),
    ];
    for (found, expected) in mesh.positions.iter().zip(expected) {
        assert!((found - expected).length() < 1e-4, "{found} {expected}");
    }
    assert!((mesh.normals[1] - Vec3::Z).length() < 1e-6);

    let beyond = skinned([[2, 0, 0, 0]; 3], weights, quarter.clone()).unwrap_err();
    assert!(beyond.to_string().contains("joint 2"), "{beyond}");
    for wrong in [-1.0, f32::NAN] {
        assert!(skinned(joints, [[wrong, 0.0, 0.0, 0.0]; 3], quarter.clone()).is_err());
    }
    let unweighted = skinned([[0; 4]; 3], [[0.0; 4]; 3], quarter).unwrap();
    assert_eq!(unweighted.parts[0].mesh.positions[1], first(Vec3::X));
}

#[test]
fn joints_that_mirror_leave_outside_outside() {
    let weights = [[0.0, 1.0, 0.0, 0.0]; 3];
    let mirror = json!({ "scale": [-1, 1, 1], "translation": [10, 0, 0] });
    let mesh = skinned([[0, 1, 0, 0]; 3], weights, mirror)
        .unwrap()
        .parts
        .remove(0)
        .mesh;
    let (mesh, _) = mesh
        .build(NormalMode::Smooth { crease_angle: 3.2 })
        .unwrap();
    assert!(
        mesh.normals().iter().all(|n| n.z > 0.999),
        "{:?}",
        mesh.normals()
    );
}

#[test]
fn a_second_set_of_joints_counts_too() {
    let mut data = Data::default();
    let base = data.floats(&CORNERS);
    let joints = data.numbers(5121, "VEC4", 3, vec![0; 12]);
    let others = data.numbers(5121, "VEC4", 3, vec![1; 12]);
    data.accessors[others]["normalized"] = json!(true);
    let weights = data.floats(&[[0.25, 0.0, 0.0, 0.0]; 3]);
    let more = data.floats(&[[0.75, 0.0, 0.0, 0.0]; 3]);
    let attributes = |sets: usize| {
        let mut attributes = json!({ "POSITION": base, "JOINTS_0": joints, "WEIGHTS_0": weights });
        if sets > 1 {
            attributes["JOINTS_1"] = json!(others);
        }
        if sets > 2 {
            attributes["WEIGHTS_1"] = json!(more);
        }
        json!({
            "nodes": [{ "mesh": 0, "skin": 0, "children": [1] }, { "translation": [8, 0, 0] }],
            "meshes": [{ "primitives": [{ "attributes": attributes }] }],
            "skins": [{ "joints": [0, 1] }],
        })
    };
    assert_eq!(positions(&data, attributes(1))[0], Vec3::ZERO);
    assert!(data.load(attributes(2)).is_err());
    assert_eq!(positions(&data, attributes(3))[0], Vec3::new(6.0, 0.0, 0.0));
}

/// A triangle at a node that is moved and scaled, with these attributes of instances.
fn instanced(data: &mut Data, attributes: Value) -> Result<LoadedFile, LoadMeshError> {
    let base = data.floats(&CORNERS);
    let node = json!({
        "translation": [0, 0, 3], "scale": [2, 2, 2],
        "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } },
    });
    data.load(scene(json!({ "attributes": { "POSITION": base } }), node))
}

#[test]
fn instances_place_one_mesh_many_times() {
    let mut data = Data::default();
    let translations = data.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 5.0, 0.0]]);
    let scales = data.floats(&[[1.0; 3], [3.0; 3], [0.0; 3]]);
    let turn = [0_i16, 0, 23170, 23170];
    let turns = [[0_i16, 0, 0, 32767], turn, turn];
    let turns = turns.as_flattened().iter().flat_map(|n| n.to_le_bytes());
    let rotations = data.numbers(5122, "VEC4", 3, turns.collect());
    data.accessors[rotations]["normalized"] = json!(true);
    let file = instanced(
        &mut data,
        json!({ "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales }),
    );
    let part = file.unwrap().parts.remove(0);
    // Where it stands without the extension.
    assert_eq!(part.mesh.positions[1], Vec3::new(2.0, 0.0, 3.0));
    assert_eq!(part.mesh.triangles.len(), 1);
    // What is scaled to nothing is not there.
    assert_eq!(part.instances.len(), 2);
    let placed =
        |i: usize, corner: usize| part.instances[i].transform_point3(part.mesh.positions[corner]);
    assert!((placed(0, 1) - part.mesh.positions[1]).length() < 1e-5);
    // A quarter turn, three times as large, one aside; then the node.
    assert!(
        (placed(1, 1) - Vec3::new(2.0, 6.0, 3.0)).length() < 1e-4,
        "{}",
        placed(1, 1)
    );
    assert!(
        (placed(1, 0) - Vec3::new(2.0, 0.0, 3.0)).length() < 1e-4,
        "{}",
        placed(1, 0)
    );
}

#[test]
fn broken_instances_are_refused() {
    let mut data = Data::default();
    let two = data.floats(&[[0.0; 3]; 2]);
    let three = data.floats(&[[1.0; 3]; 3]);
    let wild = data.floats(&[[f32::INFINITY; 3]; 2]);
    for attributes in [
        json!({}),
        json!({ "_COLOR": two }),
        json!({ "TRANSLATION": two, "SCALE": three }),
        json!({ "TRANSLATION": wild }),
        json!({ "SCALE": wild }),
        json!({ "ROTATION": two }),
    ] {
        let result = instanced(&mut data, attributes.clone());
        assert!(result.is_err(), "{attributes}");
    }
    // Nothing is left to see.
    let nothing = data.floats(&[[0.0; 3]; 2]);
    let error = instanced(&mut data, json!({ "SCALE": nothing })).unwrap_err();
    assert!(matches!(error.kind, LoadMeshErrorKind::NoFaces), "{error}");
}

#[test]
fn nodes_that_are_not_visible_hide_what_is_below() {
    let mut data = Data::default();
    let base = data.floats(&CORNERS);
    let load = |visible: bool| {
        data.load(json!({
            "nodes": [
                { "children": [1, 2] },
                { "mesh": 0 },
                { "children": [3], "extensions": { "KHR_node_visibility": { "visible": visible } } },
                { "mesh": 0 },
            ],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": base } }] }],
        }))
    };
    let triangles = |visible| load(visible).unwrap().parts[0].mesh.triangles.len();
    assert_eq!((triangles(true), triangles(false)), (2, 1));
}

#[test]
fn a_tree_of_a_hundred_thousand_generations_is_walked() {
    let mut data = Data::default();
    let base = data.floats(&CORNERS);
    let depth = 100_000;
    let mut nodes: Vec<Value> = (1..=depth)
        .map(|child| json!({ "children": [child], "translation": [0, 0, 1] }))
        .collect();
    nodes.push(json!({ "mesh": 0 }));
    let rest = json!({ "nodes": nodes, "meshes": [{ "primitives": [{ "attributes": { "POSITION": base } }] }] });
    assert_eq!(positions(&data, rest)[0].z, depth as f32);
}
