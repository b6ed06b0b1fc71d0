//! What a glTF file may name.

mod program;

use program::{Folder, INPUT, SCENE, refused, stderr};

/// A glTF triangle whose buffer has this URI.
fn triangle_at(uri: &str) -> String {
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1 }} }}] }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
            {{ "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" }} ],
        "bufferViews": [
            {{ "buffer": 0, "byteLength": 36 }}, {{ "buffer": 0, "byteOffset": 36, "byteLength": 24 }} ],
        "buffers": [{{ "byteLength": 60, "uri": "{uri}" }}] }}"#
    )
}

#[test]
fn files_outside_of_a_gltf_file_s_folder_need_leave() {
    let folder = Folder::with_quad();
    let numbers = [
        0_f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 1.,
    ];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    folder.put("data.bin", bytes);
    std::fs::create_dir(folder.path("model")).unwrap();
    folder.put("model/m.gltf", triangle_at("../data.bin"));
    folder.put("scene.toml", SCENE.replace("quad.obj", "model/m.gltf"));
    let query = [
        "query",
        "--mesh",
        "model/m.gltf",
        "--map",
        "flat.png",
        "--scale",
        "1",
        "--rays",
        "rays.csv",
    ];
    folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n0.2,0.2,9,0,0,-1\n");
    for arguments in [
        &["info", "scene.toml"][..],
        &["query", "scene.toml", "--rays", "rays.csv"],
        &query,
        &["render", "scene.toml", "--size", "4x4"],
    ] {
        refused(
            &folder,
            arguments,
            INPUT,
            &["m.gltf", "buffer 0", "../data.bin", "--allow-external"],
        );
        let allowed = [arguments, &["--allow-external"]].concat();
        let output = folder.run(&allowed);
        assert!(output.status.success(), "{allowed:?}: {}", stderr(&output));
    }
}

#[test]
fn nothing_is_fetched_for_a_gltf_file() {
    let folder = Folder::with_quad();
    folder.put("m.gltf", triangle_at("https://example.org/data.bin"));
    folder.put("scene.toml", SCENE.replace("quad.obj", "m.gltf"));
    for leave in [&[][..], &["--allow-external"]] {
        let arguments = [&["info", "scene.toml"], leave].concat();
        refused(
            &folder,
            &arguments,
            INPUT,
            &["m.gltf", "buffer 0", "https", "fetched"],
        );
    }
}
