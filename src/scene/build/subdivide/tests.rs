use std::collections::HashMap;
use std::fs;

use glam::Vec3;

use super::super::{Loaded, SceneError};
use crate::scene::ObjectShape;
use crate::surface::Scheme;

/// A cube of quads of two materials, each side with its own square of the map.
fn cube(tags: &str) -> String {
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
    let mut text = String::from("mtllib m.mtl\n");
    for z in ["1", "-1"] {
        for (x, y) in corners {
            text += &format!("v {} {} {z}\n", 2 * x - 1, 2 * y - 1);
        }
    }
    for side in 0..6 {
        for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
            text += &format!("vt {} {v}\n", side * 2 + u);
        }
    }
    let sides = [
        [1, 2, 4, 3],
        [6, 5, 7, 8],
        [5, 6, 2, 1],
        [3, 4, 8, 7],
        [5, 1, 3, 7],
        [2, 6, 8, 4],
    ];
    for (side, corners) in sides.iter().enumerate() {
        text += if side % 2 == 0 {
            "usemtl a\nf"
        } else {
            "usemtl b\nf"
        };
        for (i, corner) in corners.iter().enumerate() {
            text += &format!(" {corner}/{}", 4 * side + i + 1);
        }
        text += "\n";
    }
    text + tags
}

fn load(name: &str, mesh: &str, keys: &str) -> Result<Loaded, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path(name), mesh).unwrap();
    fs::write(path("m.mtl"), "newmtl a\nnewmtl b\n").unwrap();
    let scene = format!("[[mesh]]\nfile = \"{name}\"\n{keys}\n");
    fs::write(path("scene.toml"), scene).unwrap();
    Loaded::from_file(&path("scene.toml"))
}

/// Positions, normals and triangles of all objects.
fn triangles(loaded: &Loaded) -> Vec<[(Vec3, Vec3); 3]> {
    let mut all = Vec::new();
    for object in &loaded.scene.objects {
        let ObjectShape::Plain(mesh) = &object.shape else {
            panic!("no displacement was asked for");
        };
        let vertex = |i: u32| (mesh.positions()[i as usize], mesh.normals()[i as usize]);
        all.extend(mesh.triangles().iter().map(|t| t.map(vertex)));
    }
    all
}

/// Edges whose triangles do not go both ways.
fn open_edges(triangles: &[[(Vec3, Vec3); 3]]) -> usize {
    let mut edges: HashMap<_, i32> = HashMap::new();
    for t in triangles {
        for k in 0..3 {
            let [a, b] = [t[k].0, t[(k + 1) % 3].0].map(|p| p.to_array().map(f32::to_bits));
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    edges.values().filter(|&&n| n != 0).count()
}

#[test]
fn the_materials_of_a_file_share_one_surface() {
    for transform in ["", "transform = { scale = [1, 1, -1] }"] {
        let loaded = load("m.obj", &cube(""), &format!("subdivide = 2\n{transform}")).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        assert_eq!(loaded.scene.objects.len(), 2);
        for (number, subdivided) in loaded.subdivided.iter().enumerate() {
            assert_eq!((subdivided.object, subdivided.faces), (number, 3));
            assert_eq!(
                (subdivided.scheme, subdivided.levels),
                (Scheme::CatmullClark, 2)
            );
        }
        let triangles = triangles(&loaded);
        assert_eq!(triangles.len(), 6 * 16 * 2);
        assert_eq!(open_edges(&triangles), 0);
        let mut normals = HashMap::new();
        for t in &triangles {
            let face = (t[1].0 - t[0].0).cross(t[2].0 - t[0].0);
            for (p, n) in t {
                assert!(face.dot(*n) > 0.0 && p.dot(*n) > 0.0, "{p} {n}");
                let key = p.to_array().map(f32::to_bits);
                assert_eq!(*normals.entry(key).or_insert(*n), *n);
            }
        }
    }
}

#[test]
fn faces_say_which_scheme_is_meant() {
    let triangles = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let quads = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    for (name, mesh, keys, scheme, count) in [
        ("m.obj", triangles, "subdivide = 1", Scheme::Loop, 16),
        (
            "m.obj",
            triangles,
            "subdivide = 1\nsubdivision = \"catmull-clark\"",
            Scheme::CatmullClark,
            24,
        ),
        ("m.ply", quads, "subdivide = 2", Scheme::CatmullClark, 32),
        (
            "m.ply",
            quads,
            "subdivide = 2\nsubdivision = \"loop\"",
            Scheme::Loop,
            32,
        ),
    ] {
        let loaded = load(name, mesh, keys).unwrap();
        assert_eq!(loaded.subdivided[0].scheme, scheme, "{keys}");
        assert_eq!(super::tests::triangles(&loaded).len(), count, "{keys}");
    }
    let as_it_is = load("m.ply", quads, "subdivide = 0").unwrap();
    assert!(as_it_is.subdivided.is_empty());
    assert_eq!(super::tests::triangles(&as_it_is).len(), 2);
}

#[test]
fn tags_and_the_crease_angle_keep_edges_sharp() {
    // Around the side z = 1, for ever; its corners stay corners.
    let tags =
        "t crease 5/1/0 0 1 3 2 0 10\nt corner 4/4/0 0 1 2 3 10 10 10 10\nt unknown 1/0/0 3\n";
    let loaded = load("m.obj", &cube(tags), "subdivide = 2").unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let front = |(p, _): &(Vec3, Vec3)| p.z == 1.0;
    let flat = triangles(&loaded)
        .iter()
        .filter(|t| t.iter().all(front))
        .count();
    assert_eq!(flat, 32);
    // By scale and angle all of the cube.
    let keys = "subdivide = 2\ncrease_angle = 60\ntransform = { scale = 3, translate = [1, 0, 0] }";
    for t in triangles(&load("m.obj", &cube(""), keys).unwrap()) {
        for (p, n) in t {
            assert_eq!((p - Vec3::X).dot(n), 3.0, "{p} {n}");
        }
    }
    let odd = load(
        "m.obj",
        &cube("t crease 2/1/0 0 99 1\nt corner 1/1/0 x 1\n"),
        "subdivide = 1",
    );
    let warnings = odd.unwrap().warnings;
    let [warning] = &warnings[..] else {
        panic!("{warnings:?}");
    };
    assert!(warning.contains("2 lines, the first at line"), "{warning}");
}

#[test]
fn what_cannot_be_refined_is_refused_with_a_sentence() {
    let refused = |keys| load("m.obj", &cube(""), keys).unwrap_err().to_string();
    let large = refused("subdivide = 12");
    assert!(
        large.contains("of 6 faces; at most 16777216 are made"),
        "{large}"
    );
    let lone = refused("subdivision = \"loop\"");
    assert!(lone.contains("expected subdivide = N beside it"), "{lone}");
    let many = refused("subdivide = 13");
    assert!(many.contains("a whole number from 0 to 12"), "{many}");
    let word = refused("subdivide = 1\nsubdivision = \"bilinear\"");
    assert!(word.contains("catmull-clark"), "{word}");
}
