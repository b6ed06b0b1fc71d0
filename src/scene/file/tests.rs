use std::path::Path;

use glam::{Vec2, Vec3};

use super::*;
use crate::prism::{EditBounds, March, PrismOptions, Step};
use crate::surface::Wrap;

fn parse(text: &str) -> Result<SceneFile, SceneError> {
    SceneFile::parse_with(Path::new("folder/scene.toml"), text, &[])
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

/// The TOML blocks of the reference.
fn documented() -> Vec<&'static str> {
    let page = include_str!("../../../docs/scene.md");
    let blocks = page.split("```toml\n").skip(1);
    blocks
        .map(|block| block.split("```").next().unwrap())
        .collect()
}

#[test]
fn the_documented_scenes_are_scenes() {
    for block in documented() {
        parse(block).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn the_documented_defaults_are_the_defaults() {
    let bare =
        parse("[[mesh]]\nfile = \"a.obj\"\n[mesh.displacement]\n[[material]]\nname = \"m\"\n")
            .unwrap();
    assert_eq!(bare.film, Film::default());
    assert_eq!(
        (bare.film.width, bare.film.height, bare.film.spp),
        (640, 480, 16)
    );
    assert_eq!(bare.camera.fov, 40f32.to_radians());
    let mesh = &bare.meshes[0];
    assert_eq!(mesh.file.value, Path::new("folder/a.obj"));
    assert_eq!((mesh.mask, mesh.instances.len()), (u32::MAX, 0));
    let displacement = mesh.displacement.as_ref().unwrap();
    assert_eq!(displacement.prisms, PrismOptions::default());
    assert_eq!(displacement.prisms.march, March::Exact);
    assert_eq!(displacement.seams, None);
    let material = &bare.materials[0];
    assert!(material.metallic.is_none() && material.roughness.is_none());
    let plain = &material.plain;
    assert!(plain.metallic.is(0.0) && plain.roughness.is(1.0) && plain.specular.is(0.5));
    assert_eq!((plain.ior, plain.priority), (1.5, 0));
    assert_eq!(bare.integrator, Integrator::Beauty);
}

#[test]
fn every_value_arrives() {
    let file = parse(documented()[1]).unwrap();
    let mesh = &file.meshes[0];
    assert_eq!(mesh.instances.len(), 2);
    // A quarter turn about y takes +z to +x.
    let turned = mesh.instances[1].transform_point3(Vec3::Z);
    assert!(
        (turned - Vec3::new(3.0, 0.0, 0.0)).length() < 1e-6,
        "{turned}"
    );
    let displacement = mesh.displacement.as_ref().unwrap();
    assert_eq!(displacement.scale, Some(0.2));
    assert_eq!(displacement.wrap, Some(Wrap::Repeat));
    let Some(ColorTable::Texture(texture)) = &file.materials[1].base_color else {
        panic!("a texture was written");
    };
    assert_eq!(texture.uv.scale, Vec2::splat(2.0));
    let LightTable::Sun { direction, .. } = file.lights[0] else {
        panic!("a sun was written");
    };
    assert!((direction.y - 35f32.to_radians().sin()).abs() < 1e-6);
    assert!((direction.length() - 1.0).abs() < 1e-6);
}

#[test]
fn a_step_or_its_jitter_choose_the_uniform_march() {
    let uniform = |step, jitter| March::Uniform { step, jitter };
    for (keys, march) in [
        ("", March::Exact),
        ("march = \"exact\"", March::Exact),
        ("march = \"uniform\"", uniform(Step::Texels(1.0), false)),
        ("dt = 0.5", uniform(Step::Texels(0.5), false)),
        ("dt_world = 0.25", uniform(Step::World(0.25), false)),
        ("jitter = true", uniform(Step::Texels(1.0), true)),
        (
            "march = \"uniform\"\ndt = 2\njitter = true",
            uniform(Step::Texels(2.0), true),
        ),
    ] {
        for (words, edit_bounds) in [
            ("", EditBounds::Tight),
            ("edit_bounds = \"tight\"", EditBounds::Tight),
            ("edit_bounds = \"range\"", EditBounds::Range),
        ] {
            let text =
                format!("[[mesh]]\nfile = \"a.obj\"\n[mesh.displacement]\n{keys}\n{words}\n");
            let file = parse(&text).unwrap();
            let found = file.meshes[0].displacement.as_ref().unwrap().prisms;
            let expected = PrismOptions {
                march,
                edit_bounds,
                ..PrismOptions::default()
            };
            assert_eq!(found, expected, "{keys}");
        }
    }
}

#[test]
fn rotations_go_about_x_then_y_then_z() {
    let text = "[[mesh]]\nfile = \"a.obj\"\ntransform = { rotate = [90, 90, 0], scale = [1, 2, 3], translate = [0, 0, 7] }";
    let transform = parse(text).unwrap().meshes[0].transform;
    // Scaled to 2 y, which a quarter about x turns to 2 z, and a quarter about y to 2 x.
    let found = transform.transform_point3(Vec3::Y);
    assert!(
        (found - Vec3::new(2.0, 0.0, 7.0)).length() < 1e-6,
        "{found}"
    );
}

#[test]
fn messages_show_place_key_and_line() {
    let message = refusal("[[mesh]]\nfile = \"a.obj\"\n  mask = -1 # all\n");
    let shown = "folder/scene.toml:3:10: mesh[0].mask: found -1; expected a whole number from 0 to 4294967295";
    assert!(message.starts_with(shown), "{message}");
    assert!(
        message.ends_with("\n   |\n 3 |   mask = -1 # all\n   |          ^"),
        "{message}"
    );
}

#[test]
fn messages_stay_on_one_screen() {
    let long = format!(
        "[[mesh]]\nfile = \"{}\"\nmask = {:?}",
        "x".repeat(10_000),
        "y".repeat(10_000)
    );
    assert!(
        refusal(&long)
            .lines()
            .all(|line| line.chars().count() < 250)
    );
    let column = format!("{}[[mesh", " ".repeat(5_000));
    assert!(
        refusal(&column)
            .lines()
            .all(|line| line.chars().count() < 250)
    );
}

#[test]
fn odd_texts_are_refused_with_a_place() {
    for text in [
        "[",
        "a = \"\u{e4}",
        "\u{fffd}\0",
        "mesh = 3",
        "mesh = [1]",
        "film = 1",
        "[[film]]",
        "mesh = []",
        "\r\n\r",
    ] {
        let message = refusal(text);
        assert!(
            message.starts_with("folder/scene.toml:"),
            "{text:?}: {message}"
        );
    }
}

#[test]
fn values_that_no_material_light_or_camera_has_are_refused() {
    let with = |text: &str| refusal(&format!("[[mesh]]\nfile = \"a.obj\"\n{text}\n"));
    let material = |key: &str| with(&format!("[[material]]\nname = \"m\"\n{key}"));
    for (key, word) in [
        ("roughness = 1.5", "from 0 to 1"),
        ("metallic = -0.1", "from 0 to 1"),
        ("ior = 0.9", "from 1 to 3"),
        ("opacity_cutoff = 1.5", "from 0 to 1"),
        ("base_color = [2, 0, 0]", "from 0 to 1"),
        ("emission = [-1, 0, 0]", "at least 0"),
        ("emission = [nan, 0, 0]", "at least 0"),
        ("attenuation_distance = 0", "above 0"),
        ("priority = -1", "whole number"),
        ("bump = { file = \"b.png\" }", "scale"),
        (
            "bump = { file = \"b.png\", scale = 1 }\nnormal_map = { file = \"n.png\" }",
            "only one",
        ),
        ("base_color = { file = \"c.png\", size = 2 }", "triplanar"),
    ] {
        let message = material(key);
        assert!(
            message.contains("material[0].") && message.contains(word),
            "{key}: {message}"
        );
    }
    for (light, word) in [
        (
            "type = \"sphere\"\nposition = [0, 0, 0]\nradius = 0",
            "above 0",
        ),
        ("type = \"sphere\"\nradius = 1", "position"),
        (
            "type = \"disk\"\nposition = [0, 0, 0]\ntarget = [0, 0, 0]\nradius = 1",
            "other than",
        ),
        (
            "type = \"rectangle\"\ncorner = [0, 0, 0]\nedges = [[1, 0, 0], [2, 0, 0]]",
            "span an area",
        ),
        (
            "type = \"rectangle\"\ncorner = [0, 0, 0]\nedges = [[1, 0, 0]]",
            "span an area",
        ),
        ("type = \"directional\"\ndirection = [0, 0, 0]", "not zero"),
        (
            "type = \"point\"\nposition = [0, 0, 0]\nstrength = -1",
            "at least 0",
        ),
    ] {
        let message = with(&format!("[[light]]\n{light}"));
        assert!(
            message.contains("light[0]") && message.contains(word),
            "{light}: {message}"
        );
    }
    for (camera, word) in [
        ("blades = 2", "3 to 64"),
        ("height = 2", "orthographic"),
        ("focus_distance = 0", "above 0"),
        ("type = \"fisheye\"", "panorama"),
    ] {
        let message = with(&format!("[camera]\n{camera}"));
        assert!(
            message.contains("camera.") && message.contains(word),
            "{camera}: {message}"
        );
    }
    let message = with("[integrator]\ntype = \"whitted\"");
    assert!(
        message.contains("integrator.type") && message.contains("\"path\""),
        "{message}"
    );
}

#[test]
fn names_of_materials_are_unique() {
    let message = refusal(
        "[[mesh]]\nfile = \"a.obj\"\n[[material]]\nname = \"m\"\n[[material]]\nname = \"m\"\n",
    );
    assert!(message.contains("material[1].name"), "{message}");
}
