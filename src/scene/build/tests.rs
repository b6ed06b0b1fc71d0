use std::fs;
use std::sync::Arc;

use glam::Vec3;
use tempfile::TempDir;

use super::*;
use crate::image::{write_png_gray16, write_png_rgb8};
use crate::prism::PrismOptions;
use crate::scene::{Color, Detail, Projection, Scalar};
use crate::surface::Wrap;

/// Two squares of two materials, the first displaced and coloured by its MTL.
const OBJ: &str = "\
mtllib two.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl rough
f 1/1 2/2 3/3\nf 1/1 3/3 4/4
usemtl smooth
f 1/1 3/3 2/2
";
const MTL: &str = "newmtl rough\nKd 1 1 1\nmap_Kd color.png\ndisp height.png\nnewmtl smooth\nKd 0.25 0.5 0.75\ndisp height.png\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("two.obj"), OBJ).unwrap();
    fs::write(path("two.mtl"), MTL).unwrap();
    write_png_gray16(&path("height.png"), 2, 2, &[0, 65535, 65535, 0]).unwrap();
    write_png_rgb8(&path("color.png"), 1, 1, &[[255, 0, 0]], &[]).unwrap();
    folder
}

fn load(folder: &TempDir, scene: &str) -> Result<Loaded, SceneError> {
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).unwrap();
    Loaded::from_file(&path)
}

fn surface(object: &SceneObject) -> &DisplacedSurface {
    match &object.shape {
        ObjectShape::Displaced(surface, _) => surface,
        ObjectShape::Plain(_) => panic!("{} is not displaced", object.name),
    }
}

#[test]
fn parts_become_objects_with_the_materials_and_maps_of_their_file() {
    let loaded = load(
        &folder(),
        "[[mesh]]\nfile = \"two.obj\"\n[mesh.displacement]\nscale = 0.5\n",
    )
    .unwrap();
    let scene = &loaded.scene;
    assert_eq!(scene.objects.len(), 2);
    assert!(scene.objects.iter().all(|o| o.name.starts_with("two.")));
    let [first, second] = [0, 1].map(|i| surface(&scene.objects[i]));
    assert!(Arc::ptr_eq(first.map(), second.map()));
    assert_eq!(loaded.maps.len(), 1);
    assert_eq!(first.range(), (0.0, 0.5));
    let material = |object: usize| &scene.materials[scene.objects[object].material];
    assert!(matches!(material(0).base_color, Color::Texture(_)));
    match material(1).base_color {
        Color::Constant(c) => assert_eq!(c, Vec3::new(0.25, 0.5, 0.75)),
        Color::Texture(_) => panic!("smooth has no texture"),
    }
}

#[test]
fn a_named_material_and_a_named_map_win() {
    let scene = "[[mesh]]\nfile = \"two.obj\"\nmaterial = \"red\"\n[mesh.displacement]\nscale = -1\nmidlevel = 0.5\nmap = \"../x/../height.png\"\n[[material]]\nname = \"red\"\nbase_color = { file = \"color.png\" }\n";
    let folder = folder();
    let scene = scene.replace("../x/../", "./");
    let loaded = load(&folder, &scene).unwrap();
    assert!(loaded.scene.objects.iter().all(|o| o.material == 0));
    assert_eq!(surface(&loaded.scene.objects[0]).range(), (-0.5, 0.5));
}

#[test]
fn meshes_are_moved_before_they_are_displaced() {
    let scene = "[[mesh]]\nfile = \"two.obj\"\ntransform = { scale = 10, translate = [5, 0, 0] }\n[mesh.displacement]\nscale = 0.5\n";
    let loaded = load(&folder(), scene).unwrap();
    let surface = surface(&loaded.scene.objects[0]);
    let bounds = surface.mesh().bounds();
    assert_eq!(
        (bounds.min, bounds.max),
        (Vec3::new(5.0, 0.0, 0.0), Vec3::new(15.0, 10.0, 0.0))
    );
    assert_eq!(surface.range(), (0.0, 0.5));
}

#[test]
fn the_default_camera_sees_every_corner() {
    let scene = "[[mesh]]\nfile = \"two.obj\"\ninstances = [ {}, { translate = [7, -3, 2], rotate = [10, 20, 30] } ]\n";
    let loaded = load(&folder(), scene).unwrap();
    let camera = loaded.scene.camera;
    let view = (camera.target - camera.position).normalize();
    for object in &loaded.scene.objects {
        let ObjectShape::Plain(mesh) = &object.shape else {
            panic!("no displacement was asked for");
        };
        for transform in &object.instances {
            for &p in mesh.positions() {
                let to = transform.transform_point3(p) - camera.position;
                let angle = to.angle_between(view);
                assert!(angle < 0.5 * camera.fov, "{p} at {angle}");
            }
        }
    }
}

#[test]
fn a_camera_must_look_somewhere() {
    let mesh = "[[mesh]]\nfile = \"two.obj\"\n";
    let same = load(
        &folder(),
        &format!("[camera]\nposition = [1, 2, 3]\ntarget = [1, 2, 3]\n{mesh}"),
    );
    assert!(
        same.unwrap_err()
            .to_string()
            .contains("two different points")
    );
    let upright = load(
        &folder(),
        &format!("[camera]\nposition = [0, 9, 0]\ntarget = [0, 0, 0]\n{mesh}"),
    );
    assert!(upright.unwrap_err().to_string().contains("camera.up"));
}

#[test]
fn a_scene_without_lights_has_sun_and_sky() {
    let loaded = load(&folder(), "[[mesh]]\nfile = \"two.obj\"\n").unwrap();
    assert!(matches!(
        loaded.scene.lights[..],
        [Light::Sun { .. }, Light::Sky { .. }]
    ));
}

#[test]
fn a_sky_stands_around_the_sun_of_the_file() {
    let scene = "[[light]]\ntype = \"sky\"\n[[light]]\ntype = \"sun\"\nelevation = 90\n[[mesh]]\nfile = \"two.obj\"\n";
    let loaded = load(&folder(), scene).unwrap();
    match loaded.scene.lights[0] {
        Light::Sky { sun_direction, .. } => assert!((sun_direction - Vec3::Y).length() < 1e-6),
        _ => panic!("the sky stands first"),
    }
}

#[test]
fn the_world_keeps_the_order_of_objects() {
    let scene = "[[mesh]]\nfile = \"two.obj\"\nmask = 5\n[mesh.displacement]\nscale = 0.5\n[[mesh]]\nfile = \"two.obj\"\ninstances = [ {}, {} ]\n";
    let world = load(&folder(), scene).unwrap().scene.world().unwrap();
    let masks: Vec<_> = world.objects().iter().map(|o| o.mask).collect();
    assert_eq!(masks, [5, 5, u32::MAX, u32::MAX]);
    assert_eq!(world.top_level().len(), 2 + 4);
}

#[test]
fn texture_coordinates_are_made_on_demand() {
    let folder = folder();
    let bare: String = OBJ
        .lines()
        .filter(|line| !line.starts_with("vt"))
        .map(|line| line.replace("/1", "").replace("/2", "") + "\n")
        .collect();
    let bare = bare.replace("/3", "").replace("/4", "");
    fs::write(folder.path().join("two.obj"), bare).unwrap();
    let scene = |texcoords: &str| {
        format!(
            "[[mesh]]\nfile = \"two.obj\"\ntransform = {{ scale = 4 }}\n{texcoords}\n[mesh.displacement]\nscale = 1\n"
        )
    };
    let missing = load(&folder, &scene("")).unwrap_err().to_string();
    for known in ["box", "spherical", "cylindrical", "planar", "--texcoords"] {
        assert!(missing.contains(known), "{missing}");
    }
    let unknown = load(&folder, &scene("texcoords = \"cubic\"")).unwrap_err();
    assert!(unknown.to_string().contains("planar"), "{unknown}");
    let loaded = load(&folder, &scene("texcoords = \"planar\"")).unwrap();
    for object in &loaded.scene.objects {
        let mesh = surface(object).mesh();
        for (p, st) in mesh.positions().iter().zip(mesh.texcoords()) {
            assert_eq!(*st, p.truncate() / 4.0);
        }
    }
}

#[test]
fn seams_close_on_demand_and_only_for_the_exact_march() {
    let folder = folder();
    let load = |keys: &str| {
        let mesh = "[[mesh]]\nfile = \"two.obj\"\n[mesh.displacement]\nscale = 0.5\n";
        load(&folder, &format!("{mesh}{keys}\n"))
    };
    let walls = |keys: &str| surface(&load(keys).unwrap().scene.objects[0]).walls().len();
    assert_eq!(walls(""), 0);
    assert_eq!(walls("seams = \"open\""), 0);
    // The border of a square.
    assert_eq!(walls("seams = \"closed\""), 4);
    assert_eq!(walls("march = \"exact\"\nseams = \"closed\""), 4);
    assert_eq!(walls("march = \"uniform\"\nseams = \"open\""), 0);
    for march in ["march = \"uniform\"", "dt = 2", "jitter = true"] {
        let message = load(&format!("{march}\nseams = \"closed\""))
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("displacement.seams") && message.contains("exact"),
            "{message}"
        );
    }
    let step = load("march = \"exact\"\ndt = 2").unwrap_err().to_string();
    assert!(
        step.contains("displacement.dt") && step.contains("uniform"),
        "{step}"
    );
}

#[test]
fn all_parameters_of_a_material_arrive() {
    let scene = "[[mesh]]\nfile = \"two.obj\"\nmaterial = \"m\"\n[[material]]\nname = \"m\"\nior = 1.3\npriority = 7\ntransmission = 1\nattenuation_color = [0.5, 1, 1]\nroughness = { file = \"height.png\", factor = 0.5 }\nopacity = { file = \"height.png\" }\nopacity_cutoff = 0.25\nemission = { file = \"color.png\" }\nbump = { file = \"height.png\", scale = 0.25 }\n";
    let loaded = load(&folder(), scene).unwrap();
    let material = &loaded.scene.materials[0];
    assert_eq!((material.ior, material.priority), (1.3, 7));
    assert_eq!(material.attenuation_distance, 1.0);
    assert!(material.is_transmissive() && material.is_emissive());
    assert!(material.opacity_cutoff == Some(0.25) && material.has_holes());
    let (Scalar::Texture(roughness), Scalar::Texture(opacity)) =
        (&material.roughness, &material.opacity)
    else {
        panic!("textures were written");
    };
    assert!(Arc::ptr_eq(&roughness.image, &opacity.image));
    assert_eq!((roughness.factor, opacity.factor), (0.5, 1.0));
    assert!(matches!(&material.detail, Some(Detail::Bump(b)) if b.factor == 0.25));
    // Scalars are no displacement maps, and an emissive scene needs no sun.
    assert!(loaded.maps.is_empty() && loaded.scene.lights.is_empty());
    assert_eq!(material.pictures().len(), 4);
}

#[test]
fn glass_is_closed_and_stone_is_open() {
    let scene = |transmission: u32| {
        format!(
            "[[mesh]]\nfile = \"two.obj\"\nmaterial = \"m\"\n[mesh.displacement]\nscale = 1\n[[material]]\nname = \"m\"\ntransmission = {transmission}\n"
        )
    };
    for (transmission, walls) in [(0, 0), (1, 4)] {
        let loaded = load(&folder(), &scene(transmission)).unwrap();
        assert_eq!(surface(&loaded.scene.objects[0]).walls().len(), walls);
    }
}

#[test]
fn missing_and_broken_pictures_are_named_where_they_are_asked_for() {
    let folder = folder();
    let with = |rest: &str| load(&folder, &format!("[[mesh]]\nfile = \"two.obj\"\n{rest}\n"));
    for (rest, key) in [
        (
            "[[material]]\nname = \"m\"\nroughness = { file = \"none.png\" }",
            "material[0].roughness.file",
        ),
        (
            "[[material]]\nname = \"m\"\nnormal_map = { file = \"none.png\" }",
            "material[0].normal_map.file",
        ),
        (
            "[[material]]\nname = \"m\"\nemission = { file = \"two.obj\" }",
            "material[0].emission.file",
        ),
        (
            "[[light]]\ntype = \"environment\"\nfile = \"none.exr\"",
            "light[0].file",
        ),
        (
            "[[light]]\ntype = \"environment\"\nfile = \"color.png\"",
            "light[0].file",
        ),
    ] {
        let message = with(rest).unwrap_err().to_string();
        assert!(
            message.contains("scene.toml:") && message.contains(key),
            "{rest}: {message}"
        );
    }
}

#[test]
fn pictures_that_a_mesh_file_names_in_vain_are_marked_and_warned_of_once() {
    let folder = folder();
    let mtl = "newmtl rough\nKd 0.5 1 1\nmap_Kd none.png\nPr 0.25\nmap_Pr two.obj\nnorm none.png\nnewmtl smooth\nKd 1 1 1\n";
    fs::write(folder.path().join("two.mtl"), mtl).unwrap();
    let mesh = "[[mesh]]\nfile = \"two.obj\"\n";
    let loaded = load(&folder, &format!("{mesh}{mesh}")).unwrap();
    let material = &loaded.scene.materials[0];
    let Color::Texture(checker) = &material.base_color else {
        panic!("the picture has a stand-in");
    };
    let [first, second] = [0, 16].map(|x| checker.image.pixel(x, 0));
    assert_eq!([first, second], [Vec3::new(1.0, 0.0, 1.0), Vec3::ZERO]);
    assert!(matches!(material.roughness, Scalar::Constant(0.25)));
    assert!(material.detail.is_none());
    assert_eq!(loaded.warnings.len(), 3, "{:?}", loaded.warnings);
    for (picture, key) in [
        ("none.png", "base_color"),
        ("two.obj", "roughness"),
        ("none.png", "normal_map"),
    ] {
        let named = |line: &&String| {
            ["two.obj: ", "\"rough\"", key, picture]
                .iter()
                .all(|word| line.contains(word))
        };
        assert!(
            loaded.warnings.iter().any(|line| named(&line)),
            "{key}: {:?}",
            loaded.warnings
        );
    }
}

#[test]
fn a_displacement_map_must_be_there_whoever_names_it() {
    let folder = folder();
    let displaced = "[[mesh]]\nfile = \"two.obj\"\n[mesh.displacement]\nscale = 1\n";
    fs::remove_file(folder.path().join("height.png")).unwrap();
    let message = load(&folder, displaced).unwrap_err().to_string();
    assert!(message.contains("height.png"), "{message}");
}

/// A triangle whose material reads its colour and its mask from a picture that the file holds.
fn masked(folder: &TempDir, picture: &str) -> Result<Loaded, SceneError> {
    let bytes = fs::read(folder.path().join(picture)).unwrap();
    let floats = |values: &[f32]| {
        values
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let positions = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let texcoords = floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let view = |offset: usize, length: usize| serde_json::json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor = |view: u32, kind: &str| serde_json::json!({ "bufferView": view, "componentType": 5126, "count": 3, "type": kind, "min": [0, 0, 0], "max": [1, 1, 0] });
    let mut document = serde_json::json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
        "materials": [{ "name": "leaf", "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }], "images": [{ "bufferView": 2, "mimeType": "image/png", "name": "veins" }],
        "accessors": [accessor(0, "VEC3"), accessor(1, "VEC2")],
        "bufferViews": [view(0, 36), view(36, 24), view(60, bytes.len())],
        "buffers": [{ "byteLength": 60 + bytes.len(), "uri": "leaf.bin" }],
    });
    for bound in ["min", "max"] {
        document["accessors"][1]
            .as_object_mut()
            .unwrap()
            .remove(bound);
    }
    fs::write(folder.path().join("leaf.gltf"), document.to_string()).unwrap();
    fs::write(
        folder.path().join("leaf.bin"),
        [positions, texcoords, bytes].concat(),
    )
    .unwrap();
    load(folder, "[[mesh]]\nfile = \"leaf.gltf\"\n")
}

#[test]
fn the_alpha_of_a_picture_without_is_one() {
    let folder = folder();
    let loaded = masked(&folder, "color.png").unwrap();
    let material = &loaded.scene.materials[0];
    assert!(matches!(material.base_color, Color::Texture(_)));
    assert!(matches!(material.opacity, Scalar::Constant(1.0)));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn a_broken_picture_inside_of_a_mesh_file_is_named() {
    let folder = folder();
    let whole = fs::read(folder.path().join("color.png")).unwrap();
    fs::write(folder.path().join("cut.png"), &whole[..whole.len() - 20]).unwrap();
    let loaded = masked(&folder, "cut.png").unwrap();
    let warnings = loaded.warnings.join("\n");
    for word in [
        "leaf.gltf",
        "\"leaf\"",
        "base_color",
        "image 0 \"veins\"",
        "PNG",
    ] {
        assert!(warnings.contains(word), "{word}: {warnings}");
    }
}

#[test]
fn an_environment_with_a_nan_is_refused_at_its_light() {
    let folder = folder();
    let pixel = |x: usize, _| (x as f32, 1.0, if x == 1 { f32::NAN } else { 0.0 });
    exr::prelude::write_rgb_file(folder.path().join("nan.exr"), 2, 1, pixel).unwrap();
    let scene =
        "[[mesh]]\nfile = \"two.obj\"\n[[light]]\ntype = \"environment\"\nfile = \"nan.exr\"\n";
    let message = load(&folder, scene).unwrap_err().to_string();
    assert!(
        message.contains("light[0].file") && message.contains("NaN"),
        "{message}"
    );
}

#[test]
fn cameras_of_all_kinds_arrive() {
    let camera = |keys: &str| {
        let text = format!(
            "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 1]\nfov = 90\n{keys}\n[[mesh]]\nfile = \"two.obj\"\n"
        );
        load(&folder(), &text).unwrap().scene.camera
    };
    let Projection::Orthographic { height } = camera("type = \"orthographic\"").projection else {
        panic!("parallel rays were asked for");
    };
    // As high as a field of view of 90 degrees shows at a distance of 4.
    assert!((height - 8.0).abs() < 1e-5);
    let lens = camera("aperture = 0.5\nblades = 6").lens.unwrap();
    assert_eq!((lens.radius, lens.focus, lens.blades), (0.25, 4.0, 6));
    assert_eq!(camera("aperture = 0").lens, None);
    assert_eq!(
        camera("type = \"panorama\"").projection,
        Projection::Panorama
    );
}

#[test]
fn corners_that_differ_by_rounding_are_joined_and_told() {
    let folder = folder();
    let ridge = "v -1 -1 -1\nv 0 0 -1\nv 0 0 1\nv -1 -1 1\nv 0 1e-17 -1\nv 1 -1 -1\nv 1 -1 1\nv 0 1e-17 1\nf 1 4 3 2\nf 5 8 7 6\n";
    fs::write(folder.path().join("ridge.obj"), ridge).unwrap();
    let load = |keys: &str| {
        load(
            &folder,
            &format!("[[mesh]]\nfile = \"ridge.obj\"\n{keys}\n"),
        )
    };
    let tips = |loaded: &Loaded| match &loaded.scene.objects[0].shape {
        ObjectShape::Plain(mesh) => {
            let top = mesh.positions().iter().zip(mesh.normals());
            let top = top.filter(|(p, _)| p.x == 0.0);
            top.map(|(p, n)| (p.y, (n.y * 1000.0).round()))
                .collect::<Vec<_>>()
        }
        ObjectShape::Displaced(..) => panic!("no map was named"),
    };
    let joined = load("").unwrap();
    // Up, where both sides meet.
    assert_eq!(tips(&joined), [(0.0, 1000.0); 4]);
    let [warning] = &joined.warnings[..] else {
        panic!("{:?}", joined.warnings);
    };
    for word in ["ridge.obj", "2 vertices", "1.0e-17", "join = 0"] {
        assert!(warning.contains(word), "{warning}");
    }
    let apart = load("join = 0").unwrap();
    assert!(apart.warnings.is_empty());
    assert!(tips(&apart).iter().all(|tip| tip.1 == 707.0));
    let refusal = load("join = -1").unwrap_err().to_string();
    assert!(
        refusal.contains("join") && refusal.contains("at least 0"),
        "{refusal}"
    );
}

#[test]
fn a_bump_map_of_a_mesh_file_shades_where_it_does_not_displace() {
    let folder = folder();
    let library = "newmtl rough\nmap_Bump height.png -bm 0.25\nnewmtl smooth\nKd 1 1 1\n";
    fs::write(folder.path().join("two.mtl"), library).unwrap();
    let plain = "[[mesh]]\nfile = \"two.obj\"\n";
    let own =
        format!("{plain}[mesh.displacement]\nscale = 1\nmap = \"color.png\"\nchannel = \"r\"\n");
    for scene in [plain, &own] {
        let loaded = load(&folder, scene).unwrap().scene;
        let material = &loaded.materials[loaded.objects[0].material];
        match &material.detail {
            Some(Detail::Bump(heights)) => assert_eq!(heights.factor, 0.25),
            other => panic!("{other:?}"),
        }
    }
    // The other material names no map, so only the first part is asked for.
    let obj = OBJ.replace("usemtl smooth", "usemtl rough");
    fs::write(folder.path().join("two.obj"), obj).unwrap();
    let displaced = format!("{plain}[mesh.displacement]\n");
    let loaded = load(&folder, &displaced).unwrap().scene;
    assert!(loaded.materials.iter().all(|m| m.detail.is_none()));
    assert_eq!(surface(&loaded.objects[0]).range(), (0.0, 0.25));
    fs::remove_file(folder.path().join("height.png")).unwrap();
    let error = load(&folder, &displaced).unwrap_err().to_string();
    assert!(
        error.contains("map_Bump of material \"rough\" in two.mtl"),
        "{error}"
    );
}

/// A square of a metre with a texture 2 x 2 that its coordinates, from 0 to 1.5, go beyond.
fn wrapped(folder: &TempDir, wrap: [u32; 2], node: &str) {
    let floats = |numbers: &[f32]| -> String {
        let bytes = numbers.iter().flat_map(|n| n.to_le_bytes());
        bytes.map(|b| format!("%{b:02x}")).collect()
    };
    let data = floats(&[
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, // positions
        0.0, 0.0, 1.5, 0.0, 0.0, 1.5, // texture coordinates
        0.0, 0.0, 0.0, 4.0, 0.0, 0.0, // instances
    ]);
    let [s, t] = wrap;
    let document = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0{node} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1 }}, "material": 0 }}] }}],
        "materials": [{{ "normalTexture": {{ "index": 0 }}, "pbrMetallicRoughness": {{
            "baseColorTexture": {{ "index": 0 }}, "metallicRoughnessTexture": {{ "index": 0 }} }} }}],
        "textures": [{{ "source": 0, "sampler": 0 }}], "samplers": [{{ "wrapS": {s}, "wrapT": {t} }}],
        "images": [{{ "uri": "four.png" }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
            {{ "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" }},
            {{ "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" }} ],
        "bufferViews": [
            {{ "buffer": 0, "byteLength": 36 }},
            {{ "buffer": 0, "byteOffset": 36, "byteLength": 24 }},
            {{ "buffer": 0, "byteOffset": 60, "byteLength": 24 }} ],
        "buffers": [{{ "byteLength": 84, "uri": "data:,{data}" }}] }}"#
    );
    fs::write(folder.path().join("m.gltf"), document).unwrap();
    let pixels = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    write_png_rgb8(&folder.path().join("four.png"), 2, 2, &pixels, &[]).unwrap();
}

#[test]
fn wrap_modes_of_both_axes_reach_every_pixel() {
    const REPEAT: u32 = 10_497;
    const CLAMP: u32 = 33_071;
    let folder = folder();
    // Right of the picture and below it, glTF's v down: what repeats starts again, what is clamped stays at the edge.
    let texcoord = glam::Vec2::new(1.25, 1.0 - 1.25);
    let point = crate::surface::SurfacePoint {
        position: Vec3::ZERO,
        base_position: Vec3::ZERO,
        base_normal: Vec3::Z,
        geometric_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        texcoord,
        tolerance: 0.0,
        displacement: 0.0,
    };
    for (wrap, expected) in [
        ([REPEAT, REPEAT], Vec3::Z),
        ([REPEAT, CLAMP], Vec3::X),
        ([CLAMP, REPEAT], Vec3::ONE),
        ([CLAMP, CLAMP], Vec3::Y),
    ] {
        wrapped(&folder, wrap, "");
        let loaded = load(&folder, "[[mesh]]\nfile = \"m.gltf\"\n").unwrap();
        let material = &loaded.scene.materials[0];
        assert_eq!(material.base_color.at(&point), expected);
        // Green and blue.
        assert_eq!(material.roughness.at(&point), expected.y);
        assert_eq!(material.metallic.at(&point), expected.z);
        let Some(Detail::NormalMap { texture, .. }) = &material.detail else {
            panic!("a normal map was written");
        };
        assert_eq!(texture.sample(&point), expected);
    }
    // The same by a scene's own textures.
    let scene = "[[mesh]]\nfile = \"two.obj\"\nmaterial = \"m\"\n[[material]]\nname = \"m\"\nbase_color = { file = \"four.png\", wrap = [\"repeat\", \"clamp\"] }\nroughness = { file = \"four.png\", channel = \"r\", wrap = [\"repeat\", \"clamp\"] }\nmetallic = { file = \"four.png\", channel = \"g\", wrap = \"clamp\" }\n";
    let loaded = load(&folder, scene).unwrap();
    let material = &loaded.scene.materials[0];
    assert_eq!(material.base_color.at(&point), Vec3::X);
    assert_eq!(material.roughness.at(&point), 1.0);
    assert_eq!(material.metallic.at(&point), 1.0);
    for (key, table) in [
        ("wrap = [\"repeat\", \"clamp\"]", "displacement"),
        ("wrap = [\"repeat\"]", "base_color"),
        ("wrap = [\"repeat\", \"tile\"]", "base_color"),
    ] {
        let scene = match table {
            "displacement" => {
                format!("[[mesh]]\nfile = \"two.obj\"\n[mesh.displacement]\nscale = 1\n{key}\n")
            }
            _ => format!(
                "[[mesh]]\nfile = \"two.obj\"\n[[material]]\nname = \"m\"\nbase_color = {{ file = \"four.png\", {key} }}\n"
            ),
        };
        let error = load(&folder, &scene).unwrap_err().to_string();
        assert!(error.contains(&format!("{table}.wrap")), "{error}");
    }
}

#[test]
fn instances_of_a_mesh_file_are_placed_by_those_of_the_scene() {
    let folder = folder();
    let instancing =
        r#", "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 2 } } }"#;
    wrapped(&folder, [10_497; 2], instancing);
    let scene = |keys: &str| {
        let text = format!(
            "[[mesh]]\nfile = \"m.gltf\"\n{keys}\n[mesh.displacement]\nmap = \"height.png\"\nscale = 0.5\n"
        );
        load(&folder, &text).unwrap().scene
    };
    let corners = |scene: &Scene| -> Vec<Vec3> {
        let object = &scene.objects[0];
        let corner = surface(object).mesh().positions()[1];
        let instances = object.instances.iter();
        instances.map(|t| t.transform_point3(corner)).collect()
    };
    let plain = scene("");
    assert_eq!(plain.objects.len(), 1);
    assert_eq!(corners(&plain), [Vec3::X, 5.0 * Vec3::X]);
    // The transform scales what the file places, distances too; the displacement stays in world units.
    let scaled = scene("transform = { scale = 2, translate = [0, 0, 1] }");
    assert_eq!(
        corners(&scaled),
        [Vec3::new(2.0, 0.0, 1.0), Vec3::new(10.0, 0.0, 1.0)]
    );
    assert_eq!(surface(&scaled.objects[0]).range(), (0.0, 0.5));
    let twice = scene("instances = [ {}, { translate = [0, 7, 0] } ]");
    let up = Vec3::new(0.0, 7.0, 0.0);
    assert_eq!(
        corners(&twice),
        [Vec3::X, 5.0 * Vec3::X, Vec3::X + up, 5.0 * Vec3::X + up]
    );
    // On the command line, too.
    let loaded = Loaded::from_mesh_and_map(&MeshAndMap {
        mesh: folder.path().join("m.gltf"),
        texcoords: None,
        map: folder.path().join("height.png"),
        channel: Channel::default(),
        wrap: Wrap::Repeat,
        nodata: None,
        displacement: Displacement {
            scale: 0.5,
            midlevel: 0.0,
            uv: Default::default(),
        },
        prisms: PrismOptions::default(),
        options: LoadOptions::default(),
    });
    assert_eq!(corners(&loaded.unwrap().scene), [Vec3::X, 5.0 * Vec3::X]);
}

#[test]
fn materials_without_a_name_stay_apart() {
    let folder = folder();
    wrapped(&folder, [10_497; 2], "");
    let text = fs::read_to_string(folder.path().join("m.gltf")).unwrap();
    let text = text
        .replace(
            "\"materials\": [",
            "\"materials\": [{ \"pbrMetallicRoughness\": { \"metallicFactor\": 0.25 } }, ",
        )
        .replace(
            "\"material\": 0 }]",
            "\"material\": 0 }, { \"attributes\": { \"POSITION\": 0 }, \"material\": 1 }]",
        );
    fs::write(folder.path().join("m.gltf"), text).unwrap();
    let scene = load(&folder, "[[mesh]]\nfile = \"m.gltf\"\n")
        .unwrap()
        .scene;
    let metallic = |object: usize| &scene.materials[scene.objects[object].material].metallic;
    assert!(metallic(0).is(0.25) && !metallic(1).is(0.25));
}

mod lights;
