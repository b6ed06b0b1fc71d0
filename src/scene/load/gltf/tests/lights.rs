//! Lights and cameras, and what has no effect.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use super::*;
use crate::scene::load::{FileCamera, FileLight, FileLightKind, FileProjection};

const PUNCTUAL: &str = "KHR_lights_punctual";

/// The document with these lights and cameras, the first of each at its child node, which is turned by a quarter about x.
fn lit(light: Value, camera: Value) -> Value {
    let mut document = document();
    document["nodes"][1] = json!({
        "name": "child", "mesh": 0, "camera": 0, "translation": [0, 7, 0], "scale": [2, 2, 2],
        "rotation": [-FRAC_PI_4.sin(), 0.0, 0.0, FRAC_PI_4.cos()],
        "extensions": { PUNCTUAL: { "light": 0 } },
    });
    document["extensionsUsed"] = json!([PUNCTUAL]);
    document["extensions"] = json!({ PUNCTUAL: { "lights": [light] } });
    document["cameras"] = json!([camera]);
    document
}

fn perspective() -> Value {
    json!({ "type": "perspective", "name": "Cam", "perspective": { "yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1 } })
}

fn only_light(light: Value) -> FileLight {
    let file = load(&lit(light, perspective())).unwrap();
    assert!(file.unused.is_empty(), "{}", file.unused);
    file.lights.into_iter().next().unwrap()
}

/// What the child's -Z becomes.
fn is_down(direction: Vec3) -> bool {
    direction.abs_diff_eq(Vec3::NEG_Y, 1e-6)
}

#[test]
fn lights_stand_where_their_nodes_do_and_take_no_scale_of_them() {
    let at = Vec3::new(0.0, 7.0, 5.0);
    let light = only_light(json!({ "type": "directional", "intensity": 3, "color": [1, 0.5, 0] }));
    assert_eq!(light.intensity, Vec3::new(3.0, 1.5, 0.0));
    assert_eq!(light.name, "child");
    assert!(matches!(light.kind, FileLightKind::Directional { direction } if is_down(direction)));
    let light = only_light(json!({ "type": "point" }));
    let point = FileLightKind::Point {
        position: at,
        range: f32::INFINITY,
    };
    assert_eq!((light.kind, light.intensity), (point, Vec3::ONE));
    let light =
        only_light(json!({ "type": "spot", "range": 4, "spot": { "innerConeAngle": 0.25 } }));
    let FileLightKind::Spot {
        position,
        direction,
        range,
        outer,
        inner,
    } = light.kind
    else {
        panic!("{light:?}");
    };
    assert!(is_down(direction));
    assert_eq!((position, range), (at, 4.0));
    assert_eq!((outer, inner), (FRAC_PI_4, 0.25));
    // Exporters round the right angle.
    let wide = json!({ "type": "spot", "spot": { "outerConeAngle": 1.570_797 } });
    assert!(
        matches!(only_light(wide).kind, FileLightKind::Spot { outer, .. } if outer == FRAC_PI_2)
    );
}

#[test]
fn moved_lights_are_as_bright_on_what_moves_along() {
    let light = only_light(json!({ "type": "point", "range": 4 }));
    let moved = Affine3A::from_scale_rotation_translation(
        Vec3::splat(0.01),
        glam::Quat::from_rotation_y(1.0),
        Vec3::X,
    );
    let placed = light.placed(&moved).unwrap();
    let at = Vec3::new(3.0, 1.0, 2.0);
    let (before, after) = (
        light.illuminance(at, 0.0),
        placed.illuminance(moved.transform_point3(at), 0.0),
    );
    assert!((after / before - 1.0).abs() < 1e-5, "{before} {after}");
    assert!(
        matches!(placed.kind, FileLightKind::Point { range, .. } if (range - 0.04).abs() < 1e-8)
    );
    let far = Affine3A::from_translation(Vec3::splat(1e19));
    assert!(light.placed(&far).is_err());
}

#[test]
fn cameras_look_along_their_nodes() {
    let camera = |camera: Value| -> FileCamera {
        let file = load(&lit(json!({ "type": "point" }), camera)).unwrap();
        file.cameras.into_iter().next().unwrap()
    };
    let found = camera(perspective());
    assert_eq!(found.names, ["child", "Cam"]);
    assert_eq!(found.position, Vec3::new(0.0, 7.0, 5.0));
    assert!(is_down(found.forward) && found.up.abs_diff_eq(Vec3::NEG_Z, 1e-6));
    let expected = FileProjection::Perspective {
        fov: 0.5,
        aspect: Some(1.5),
    };
    assert_eq!(found.projection, expected);
    // The node makes all that it sees half as large.
    let parallel = json!({ "type": "orthographic", "orthographic": { "xmag": -3, "ymag": 2, "znear": 0, "zfar": 9 } });
    let FileProjection::Orthographic { width, height } = camera(parallel).projection else {
        panic!("it is orthographic");
    };
    assert!((width - 12.0).abs() < 1e-5 && (height - 8.0).abs() < 1e-5);
}

#[test]
fn numbers_that_no_light_or_camera_has_are_refused() {
    let point = |key: &str, value: Value| {
        let mut light = json!({ "type": "point" });
        light[key] = value;
        light
    };
    let spot = |inner: f32, outer: f32| json!({ "type": "spot", "spot": { "innerConeAngle": inner, "outerConeAngle": outer } });
    for light in [
        point("intensity", json!(-1)),
        point("intensity", json!(1e39)),
        point("intensity", json!("bright")),
        point("color", json!([1, -1, 1])),
        point("color", json!([1e39, 1, 1])),
        point("color", json!([1, 1])),
        point("range", json!(0)),
        point("range", json!(-2)),
        point("type", json!("area")),
        point("type", Value::Null),
        spot(0.5, 0.5),
        spot(0.6, 0.5),
        spot(-0.1, 0.5),
        spot(0.0, 1.6),
        spot(0.0, 0.0),
    ] {
        let error = load(&lit(light.clone(), perspective())).unwrap_err();
        let told = error.to_string();
        assert!(
            told.contains("light 0") || told.contains("line 1"),
            "{light}: {told}"
        );
    }
    let with = |kind: &str, key: &str, value: Value| {
        let mut camera = json!({
            "perspective": { "yfov": 1, "znear": 1 }, "orthographic": { "xmag": 1, "ymag": 1 },
        });
        camera["type"] = json!(kind);
        camera[kind][key] = value;
        camera
    };
    for camera in [
        with("perspective", "yfov", json!(0)),
        with("perspective", "yfov", json!(-1)),
        with("perspective", "yfov", json!(3.2)),
        with("perspective", "yfov", json!(1e39)),
        with("perspective", "aspectRatio", json!(0)),
        with("perspective", "aspectRatio", json!(-1.5)),
        with("perspective", "aspectRatio", json!(1e39)),
        with("orthographic", "xmag", json!(0)),
        with("orthographic", "ymag", json!(1e39)),
        with("orthographic", "ymag", json!(1e-30)),
        with("panorama", "yfov", json!(1)),
        json!({ "type": "perspective" }),
    ] {
        let error = load(&lit(json!({ "type": "point" }), camera.clone())).unwrap_err();
        let told = error.to_string();
        let named = ["camera 0", "camera \"child\""];
        assert!(named.iter().any(|n| told.contains(n)), "{camera}: {told}");
    }
    // Nodes that leave no direction, or no place.
    for (key, value, light) in [
        ("scale", json!([1, 1, 0]), "spot"),
        ("scale", json!([0, 0, 0]), "directional"),
        ("translation", json!([1e19, 0, 0]), "point"),
    ] {
        let mut document = lit(json!({ "type": light }), perspective());
        document["nodes"][1][key] = value;
        document["nodes"][1]
            .as_object_mut()
            .unwrap()
            .remove("camera");
        let told = load(&document).unwrap_err().to_string();
        assert!(told.contains("light \"child\""), "{told}");
    }
    let mut document = lit(json!({ "type": "point" }), perspective());
    document["nodes"][1]["scale"] = json!([1, 1, 0]);
    let told = load(&document).unwrap_err().to_string();
    assert!(told.contains("camera \"child\""), "{told}");
}

#[test]
fn what_nobody_sees_brings_no_light() {
    let mut document = lit(json!({ "type": "point" }), perspective());
    let nodes = document["nodes"].as_array_mut().unwrap();
    let mut hidden = nodes[1].clone();
    hidden["extensions"]["KHR_node_visibility"] = json!({ "visible": false });
    nodes.push(hidden);
    document["scenes"][0]["nodes"] = json!([0, 2]);
    let file = load(&document).unwrap();
    assert_eq!((file.lights.len(), file.cameras.len()), (1, 1));
}

#[test]
fn what_has_no_effect_is_told_once() {
    let mut document = document();
    document["scenes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "nodes": [] }));
    document["animations"] = json!([{}, {}]);
    let primitive = &mut document["meshes"][0]["primitives"][0];
    for name in ["COLOR_0", "TANGENT", "JOINTS_0", "TEXCOORD_1", "_MOOD"] {
        primitive["attributes"][name] = json!(0);
    }
    primitive["targets"] = json!([{ "POSITION": 0 }]);
    let lines = json!({ "attributes": { "POSITION": 0 }, "mode": 1 });
    document["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap()
        .push(lines);
    document["materials"][0]["occlusionTexture"] = json!({ "index": 0 });
    document["materials"][0]["extensions"] = json!({
        "KHR_materials_unlit": {}, "KHR_materials_ior": {}, "KHR_materials_clearcoat": { "clearcoatNormalTexture": { "index": 0 } },
    });
    document["samplers"] = json!([{ "magFilter": 9728 }, { "magFilter": 9729 }]);
    document["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_materials_ior", "ACME_sound"]);
    let file = load(&document).unwrap();
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    assert_eq!(
        file.unused.to_string(),
        "no effect: 1 scene besides the one shown, 2 animations, COLOR_0 of 1 mesh, JOINTS_0 of 1 mesh, TANGENT of 1 mesh, \
         TEXCOORD_1 of 1 mesh, _MOOD of 1 mesh, 1 mesh with morph targets of weight 0, 1 primitive of points or lines, \
         KHR_materials_unlit of 1 material, clearcoatNormalTexture of 1 material, occlusionTexture of 1 material, \
         NEAREST of 1 sampler, ACME_sound"
    );
}
