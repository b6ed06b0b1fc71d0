//! Lights and cameras of mesh files, and what up and unit do.

use super::*;
use crate::surface::Projection as Texcoords;
use serde_json::{Value, json};

/// A pyramid's side at +Z, a point light of 8 cd, two cameras: at (0, 0, 5) along -Z, and orthographic from above.
fn document() -> Value {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0, 1, 2, 3] }],
        "nodes": [
            { "mesh": 0 },
            { "name": "Key", "translation": [2, 1, 4], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "Front", "camera": 0, "translation": [0, 0, 5] },
            { "name": "Top", "camera": 1, "translation": [0, 9, 0], "rotation": [-half, 0, 0, half] },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } },
            { "name": "Lens", "type": "orthographic", "orthographic": { "xmag": 4, "ymag": 2, "znear": 0, "zfar": 9 } },
        ],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 8, "range": 32 }] } },
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0.5] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "m.bin" }],
    })
}

fn put(folder: &TempDir, document: &Value) {
    let corners = [[-1.0_f32, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.5]];
    let bytes: Vec<u8> = corners
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    fs::write(folder.path().join("m.bin"), bytes).unwrap();
    fs::write(folder.path().join("m.gltf"), document.to_string()).unwrap();
}

fn lit() -> TempDir {
    let folder = folder();
    put(&folder, &document());
    folder
}

/// The scene of the file with these keys of the mesh, and whatever comes before it.
fn scene(folder: &TempDir, before: &str, keys: &str) -> Result<Loaded, SceneError> {
    load(
        folder,
        &format!("{before}\n[[mesh]]\nfile = \"m.gltf\"\n{keys}\n"),
    )
}

fn point(loaded: &Loaded) -> (Vec3, Vec3, f32) {
    match loaded.scene.lights[..] {
        [
            Light::Point {
                position,
                intensity,
                range,
            },
        ] => (position, intensity, range),
        ref other => panic!("one point was expected: {other:?}"),
    }
}

#[test]
fn a_file_s_lights_and_first_camera_are_taken_and_said() {
    let folder = lit();
    let loaded = scene(&folder, "", "").unwrap();
    assert_eq!(
        point(&loaded),
        (Vec3::new(2.0, 1.0, 4.0), Vec3::splat(8.0), 32.0)
    );
    let camera = &loaded.scene.camera;
    assert_eq!(
        (camera.position, camera.fov),
        (Vec3::new(0.0, 0.0, 5.0), 0.5)
    );
    // Beside the middle of the mesh, which is a quarter in front of its plane.
    assert_eq!(camera.target, Vec3::new(0.0, 0.0, 0.25));
    // Where it is inside of a solid, its file is to blame.
    let inside = loaded.camera_inside(0).unwrap().to_string();
    assert!(inside.contains("mesh[0].file"), "{inside}");
    let [lights, seen] = &loaded.notes[..] else {
        panic!("{:?}", loaded.notes);
    };
    assert!(lights.contains("m.gltf: 1 light;") && lights.contains("count as 1 "));
    assert!(seen.contains("\"Front\"; camera.from takes another of \"Front\", \"Top\""));
    let [unused] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings);
    };
    assert!(unused.ends_with("m.gltf: no effect: 1 camera"), "{unused}");
}

#[test]
fn the_scene_by_hand_is_the_same() {
    let folder = lit();
    let by_hand = "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0.25]\nfov = 28.64788975654116\n\
        [[light]]\ntype = \"point\"\nposition = [2, 1, 4]\nstrength = 8\nrange = 32\n";
    let file = scene(&folder, "", "").unwrap().scene;
    let hand = scene(&folder, by_hand, "lights = \"ignore\"")
        .unwrap()
        .scene;
    assert_eq!(file.fingerprint(), hand.fingerprint());
    let other = scene(&folder, "", "light_scale = 0.5").unwrap().scene;
    assert_ne!(file.fingerprint(), other.fingerprint());
    let other = scene(&folder, "[camera]\nfrom = 1", "").unwrap().scene;
    assert_ne!(file.fingerprint(), other.fingerprint());
}

#[test]
fn lights_add_to_those_of_the_scene_unless_they_are_ignored() {
    let folder = lit();
    let sky = "[[light]]\ntype = \"sky\"\n";
    let kinds = |before: &str, keys: &str| {
        let lights = scene(&folder, before, keys).unwrap().scene.lights;
        let kind = |light: &Light| match light {
            Light::Point { .. } => 'p',
            Light::Sky { .. } => 'k',
            Light::Sun { .. } => 's',
            _ => '?',
        };
        lights.iter().map(kind).collect::<String>()
    };
    assert_eq!(kinds(sky, ""), "kp");
    assert_eq!(kinds(sky, "lights = \"ignore\""), "k");
    assert_eq!(kinds("", "lights = \"ignore\""), "sk");
    assert_eq!(
        kinds("", "instances = [{}, { translate = [0, 0, 9] }]"),
        "pp"
    );
}

#[test]
fn photometric_lights_count_as_watts() {
    let folder = folder();
    let mut document = document();
    // Blender's 1000 W.
    document["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(54_351.4);
    put(&folder, &document);
    let of = |keys: &str| point(&scene(&folder, "", keys).unwrap()).1.x;
    assert!((of("") - 1000.0 / (4.0 * PI)).abs() < 0.01);
    // Whatever the unit, and the reach goes with lengths.
    let in_centimetres = scene(&folder, "", "unit = \"cm\"").unwrap();
    let (position, intensity, range) = point(&in_centimetres);
    assert!(position.abs_diff_eq(Vec3::new(0.02, 0.01, 0.04), 1e-8));
    assert!((intensity.x * 1e4 / of("") - 1.0).abs() < 1e-5 && (range - 0.32).abs() < 1e-6);
    assert_eq!(of("light_scale = 2"), 2.0 * 54_351.4);
    let told = scene(&folder, "", "light_scale = 1e35")
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("m.gltf: light \"Key\": its intensity"),
        "{told}"
    );
}

#[test]
fn a_camera_is_chosen_by_name_or_number_and_keeps_what_the_scene_adds() {
    let folder = lit();
    let camera = |keys: &str| {
        scene(&folder, &format!("[camera]\n{keys}"), "")
            .unwrap()
            .scene
            .camera
    };
    let top = camera("from = \"Top\"\naperture = 0.5\nshift = [0.25, 0]");
    assert!(
        matches!(top.projection, Projection::Orthographic { height } if (height - 4.0).abs() < 1e-5)
    );
    assert!((top.aspect.unwrap() - 2.0).abs() < 1e-5);
    assert_eq!(
        (top.position, top.shift.x),
        (Vec3::new(0.0, 9.0, 0.0), 0.25)
    );
    assert!(
        (top.target - top.position)
            .normalize()
            .abs_diff_eq(Vec3::NEG_Y, 1e-6)
    );
    assert_eq!(top.lens.unwrap().radius, 0.25);
    for other in ["from = \"Lens\"", "from = 1"] {
        assert_eq!(camera(other).position, top.position, "{other}");
    }
    // What does not place a camera leaves the file's; what does is the scene's own.
    assert_eq!(
        camera("shift = [0.25, 0]").position,
        Vec3::new(0.0, 0.0, 5.0)
    );
    assert_ne!(camera("fov = 30").position, Vec3::new(0.0, 0.0, 5.0));
    for (keys, words) in [
        ("from = \"Side\"", ["camera.from", "\"Front\", \"Top\""]),
        ("from = 2", ["camera.from", "\"Front\", \"Top\""]),
        ("from = 1.5", ["camera.from", "number from 0"]),
        ("from = -1", ["camera.from", "whole number"]),
        ("from = \"Top\"\nfov = 20", ["camera.from", "beside fov"]),
    ] {
        let told = scene(&folder, &format!("[camera]\n{keys}"), "")
            .unwrap_err()
            .to_string();
        assert!(words.iter().all(|word| told.contains(word)), "{told}");
    }
    let none = "[camera]\nfrom = 0\n[[mesh]]\nfile = \"two.obj\"\n";
    let told = load(&folder, none).unwrap_err().to_string();
    assert!(told.contains("they have none"), "{told}");
}

#[test]
fn up_and_unit_are_a_transform_before_the_others() {
    let folder = lit();
    let of = |keys: &str| scene(&folder, "", keys).unwrap().scene;
    let corners = |scene: &Scene| match &scene.objects[0].shape {
        ObjectShape::Plain(mesh) => mesh.positions().to_vec(),
        ObjectShape::Displaced(..) => panic!("it is plain"),
    };
    let stood = of("up = \"z\"\nunit = 0.5\ntransform = { translate = [0, 0, 3] }");
    assert_eq!(corners(&stood)[2], Vec3::new(0.0, 0.25, 2.5));
    let moved = of("transform = { rotate = [-90, 0, 0], scale = 0.5, translate = [0, 0, 3] }");
    for (a, b) in corners(&stood).iter().zip(corners(&moved)) {
        assert!(a.abs_diff_eq(b, 1e-6), "{a} {b}");
    }
    let (a, b) = (stood.camera, moved.camera);
    assert!(a.position.abs_diff_eq(b.position, 1e-5) && a.up.abs_diff_eq(b.up, 1e-6));
    assert!(a.position.abs_diff_eq(Vec3::new(0.0, 2.5, 3.0), 1e-5));
    // Powers of two round nothing.
    let half = of("unit = 0.5").fingerprint();
    assert_eq!(half, of("transform = { scale = 0.5 }").fingerprint());
    assert_eq!(
        of("unit = \"m\"\nup = \"y\"").fingerprint(),
        of("").fingerprint()
    );
    for keys in [
        "up = \"x\"",
        "unit = \"yd\"",
        "unit = 0",
        "unit = -1",
        "unit = 1e12",
    ] {
        let told = scene(&folder, "", keys).unwrap_err().to_string();
        assert!(told.contains(if keys.starts_with("up") {
            "mesh[0].up"
        } else {
            "mesh[0].unit"
        }));
    }
}

#[test]
fn texture_coordinates_are_made_of_what_stands_upright() {
    let folder = lit();
    let mut upright = crate::scene::load::load_mesh(&folder.path().join("m.gltf")).unwrap();
    let lying = Affine3A::from_rotation_x(-0.5 * PI);
    upright.place(&lying).unwrap();
    upright.project(Texcoords::Cylindrical);
    let text = "texcoords = \"cylindrical\"\nup = \"z\"\n[mesh.displacement]\nmap = \"height.png\"\nscale = 0.5\n";
    let loaded = scene(&folder, "", text).unwrap();
    let found = surface(&loaded.scene.objects[0]);
    // The displacement stays in world units.
    assert_eq!(found.range(), (0.0, 0.5));
    let expected = &upright.parts[0].mesh;
    for (p, st) in expected.positions.iter().zip(&expected.texcoords) {
        let close = |q: &Vec3| q.abs_diff_eq(*p, 1e-6);
        let at = found.mesh().positions().iter().position(close).unwrap();
        assert!(found.mesh().texcoords()[at].abs_diff_eq(*st, 1e-5));
    }
}

#[test]
fn absorption_goes_with_the_unit() {
    let folder = folder();
    let mut document = document();
    document["materials"] =
        json!([{ "extensions": { "KHR_materials_volume": { "attenuationDistance": 3 } } }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    put(&folder, &document);
    let distance = |keys| {
        let scene = scene(&folder, "", keys).unwrap().scene;
        scene.materials[scene.objects[0].material].attenuation_distance
    };
    assert_eq!((distance(""), distance("unit = 0.5")), (3.0, 1.5));
}
