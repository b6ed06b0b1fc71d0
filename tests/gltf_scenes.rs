//! Mesh files that bring their own camera and lights.

mod program;

use program::{Folder, INPUT, done, pixels, refused, stderr};

/// A square of side 2 at z = 0, lit by a spot, a point and parallel light, seen from (0, 0, 4) by a camera of half its width either side.
fn document() -> String {
    r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0, 1, 2, 3, 4] }],
    "nodes": [
        { "mesh": 0 },
        { "name": "Eye", "camera": 0, "translation": [0, 0, 4] },
        { "name": "Spot", "translation": [0, 0, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "name": "Lamp", "translation": [1, 1, 1], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        { "name": "Sun", "extensions": { "KHR_lights_punctual": { "light": 2 } } } ],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 5 }] }],
    "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "aspectRatio": 1, "znear": 0.1 } }],
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": { "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 4, "color": [1, 0.5, 0.25], "spot": { "outerConeAngle": 0.5 } },
        { "type": "point", "intensity": 2, "range": 8 },
        { "type": "directional", "intensity": 0.5 } ] } },
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }],
    "bufferViews": [{ "buffer": 0, "byteLength": 48 }],
    "buffers": [{ "byteLength": 48, "uri": "square.bin" }] }"#
        .to_owned()
}

const FILM: &str = "[film]\nwidth = 16\nheight = 16\nspp = 4\n";

fn folder() -> Folder {
    let folder = Folder::empty();
    let corners = [-1_f32, -1., 0., 1., -1., 0., -1., 1., 0., 1., 1., 0.];
    let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.put("square.bin", bytes);
    folder.put("square.gltf", document());
    folder.put(
        "scene.toml",
        format!("{FILM}[[mesh]]\nfile = \"square.gltf\"\n"),
    );
    folder
}

#[test]
fn a_file_with_camera_and_lights_needs_no_more() {
    let folder = folder();
    let output = done(&folder, "render scene.toml -o own.exr");
    let told = stderr(&output);
    assert!(
        told.contains("square.gltf: seen by its camera \"Eye\""),
        "{told}"
    );
    assert!(told.contains("square.gltf: 3 lights;"), "{told}");
    assert!(!told.contains("warning"), "{told}");
    let (_, own) = pixels(&folder, "own.exr");
    let mean = own["G"]
        .iter()
        .map(|&bits| f32::from_bits(bits))
        .sum::<f32>()
        / 256.0;
    assert!((0.05..5.0).contains(&mean), "{mean}");
    // Nothing is said that was not asked for.
    let quiet = done(&folder, "render scene.toml -o own.exr --quiet");
    assert_eq!(stderr(&quiet), "");

    folder.put(
        "hand.toml",
        format!(
            "{FILM}[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov = 28.64788975654116\n\
            [[mesh]]\nfile = \"square.gltf\"\nlights = \"ignore\"\n\
            [[light]]\ntype = \"spot\"\nposition = [0, 0, 2]\ntarget = [0, 0, 0]\nangle = 57.29577951308232\nsoftness = 1\n\
            color = [1, 0.5, 0.25]\nstrength = 4\n\
            [[light]]\ntype = \"point\"\nposition = [1, 1, 1]\nstrength = 2\nrange = 8\n\
            [[light]]\ntype = \"directional\"\ndirection = [0, 0, -1]\nstrength = 0.5\n"
        ),
    );
    let output = done(&folder, "render hand.toml -o hand.exr");
    assert!(stderr(&output).contains("square.gltf: no effect: 1 camera"));
    assert!(pixels(&folder, "hand.exr") == pixels(&folder, "own.exr"));
}

/// A film narrower than the camera's picture shows all of it, and more above and below.
#[test]
fn what_the_camera_shows_is_in_the_picture() {
    let folder = folder();
    done(
        &folder,
        "render scene.toml -o square.exr --integrator depth",
    );
    done(
        &folder,
        "render scene.toml -o wide.exr --size 32x16 --integrator depth",
    );
    done(
        &folder,
        "render scene.toml -o high.exr --size 16x32 --integrator depth",
    );
    let row = |name: &str, row: usize, columns: std::ops::Range<usize>, width: usize| {
        let (_, channels) = pixels(&folder, name);
        channels["Z"][row * width..][columns].to_vec()
    };
    assert_eq!(row("square.exr", 8, 0..16, 16).len(), 16);
    let middle = |bits: Vec<u32>| f32::from_bits(bits[0]);
    let at = [
        middle(row("square.exr", 8, 0..1, 16)),
        middle(row("wide.exr", 8, 8..9, 32)),
        middle(row("high.exr", 16, 0..1, 16)),
    ];
    assert!(at.iter().all(|z| (z - at[0]).abs() < 0.02), "{at:?}");
}

#[test]
fn numbers_that_no_light_has_are_refused_with_their_place() {
    let folder = folder();
    for (from, to, words) in [
        (
            "\"intensity\": 2",
            "\"intensity\": -2",
            ["square.gltf: light 1", "at least 0"],
        ),
        (
            "\"yfov\": 0.5",
            "\"yfov\": 0",
            ["square.gltf: camera 0", "yfov is 0"],
        ),
        (
            "\"light\": 2",
            "\"light\": 3",
            ["node 4", "light 3 is out of range"],
        ),
        (
            "\"outerConeAngle\": 0.5",
            "\"outerConeAngle\": 2",
            ["light 0", "outerConeAngle"],
        ),
        (
            "[1, 1, 1]",
            "[1e30, 1, 1]",
            ["light \"Lamp\"", "within +-1.8e18"],
        ),
    ] {
        folder.put("square.gltf", document().replace(from, to));
        let words = [&["scene.toml:6:8", "mesh[0].file"], &words[..]].concat();
        refused(&folder, &["render", "scene.toml"], INPUT, &words);
    }
}
