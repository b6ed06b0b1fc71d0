//! The laws that every demo obeys, for its tests: `laws::check(&DEMO, map_size)`.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::shape::position_key;
use super::{Demo, DemoFiles, Part};
use crate::surface::MeshBuilder;

/// Asserts all laws on the demo made with a map of `map_size`.
pub fn check(demo: &Demo, map_size: usize) {
    let files = (demo.make)(map_size);
    sizes(demo, &files, map_size);
    for piece in pieces(&files) {
        mesh_is_sound(piece.mesh);
        normals_face_outward(piece.mesh);
        heights_agree_over_seams(&piece);
    }
    same_bytes_again(&files, &(demo.make)(map_size));
}

/// A displaced mesh of the demo.
struct Piece<'a> {
    mesh: &'a MeshBuilder,
    heights: &'a [u16],
    map_size: usize,
    clamped: bool,
}

fn pieces(files: &DemoFiles) -> Vec<Piece<'_>> {
    let clamped = files.scene.contains("wrap = \"clamp\"");
    let parts = files
        .parts
        .iter()
        .map(|part| (&part.mesh, &part.heights, part.map_size));
    std::iter::once((&files.mesh, &files.heights, files.map_size))
        .chain(parts)
        .map(|(mesh, heights, map_size)| Piece {
            mesh,
            heights,
            map_size,
            clamped,
        })
        .collect()
}

fn sizes(demo: &Demo, files: &DemoFiles, map_size: usize) {
    let pieces = pieces(files);
    let triangles = pieces.iter().map(|piece| piece.mesh.triangles.len());
    assert_eq!(triangles.sum::<usize>(), demo.triangles);
    assert_eq!(files.map_size, map_size);
    for piece in &pieces {
        assert_eq!(piece.heights.len(), piece.map_size * piece.map_size);
        assert_eq!(piece.heights.iter().min(), Some(&0));
        assert_eq!(piece.heights.iter().max(), Some(&u16::MAX));
    }
    assert_eq!(files.colors.len(), files.color_size * files.color_size);
    for file in [".obj", "_height.png", "_color.png"] {
        assert!(files.scene.contains(&format!("\"{}{file}\"", demo.name)));
    }
    for Part { name, .. } in &files.parts {
        for ending in [".obj", "_height.png"] {
            assert!(files.scene.contains(&format!("\"{name}{ending}\"")));
        }
    }
    toml::from_str::<toml::Table>(&files.scene).expect("the scene is TOML");
}

fn mesh_is_sound(mesh: &MeshBuilder) {
    assert_eq!(mesh.positions.len(), mesh.normals.len());
    assert_eq!(mesh.positions.len(), mesh.texcoords.len());
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    let unit_square = |st: &Vec2| st.cmpge(Vec2::ZERO).all() && st.cmple(Vec2::ONE).all();
    assert!(mesh.texcoords.iter().all(unit_square));
    for t in &mesh.triangles {
        let p = t.map(|i| mesh.positions[i as usize]);
        let st = t.map(|i| mesh.texcoords[i as usize]);
        assert!((p[1] - p[0]).cross(p[2] - p[0]).length() > 1e-7, "{t:?}");
        assert!((st[1] - st[0]).perp_dot(st[2] - st[0]) > 0.0, "{t:?}");
    }
}

fn normals_face_outward(mesh: &MeshBuilder) {
    for t in &mesh.triangles {
        let p = t.map(|i| mesh.positions[i as usize]);
        let ng = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        for i in t {
            let n = mesh.normals[*i as usize];
            assert!(n.dot(ng) > 0.1, "{t:?}: {n} against {ng}");
        }
    }
}

/// Wherever two triangles share an edge in space, both sides have the same normals there, and the map the
/// same heights to 1/500 of its range.
fn heights_agree_over_seams(piece: &Piece<'_>) {
    let mesh = piece.mesh;
    let mut sides: HashMap<[[u32; 3]; 2], [usize; 2]> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let edge = [t[k] as usize, t[(k + 1) % 3] as usize];
            sides.insert(edge.map(|i| position_key(mesh.positions[i])), edge);
        }
    }
    for (key, edge) in &sides {
        let Some(&[b, a]) = sides.get(&[key[1], key[0]]) else {
            continue;
        };
        let other = [a, b];
        for k in 0..2 {
            assert_eq!(mesh.normals[edge[k]], mesh.normals[other[k]]);
        }
        let height = |edge: [usize; 2], x: f32| {
            sample(
                piece,
                mesh.texcoords[edge[0]].lerp(mesh.texcoords[edge[1]], x),
            )
        };
        for step in 0..=16 {
            let x = step as f32 / 16.0;
            let (here, there) = (height(*edge, x), height(other, x));
            assert!((here - there).abs() < 0.002, "{here} against {there}");
        }
    }
}

/// Bilinear, repeating unless the scene clamps: what the tracer reads.
fn sample(piece: &Piece<'_>, st: Vec2) -> f32 {
    let size = piece.map_size as i32;
    let at = |x: f32, y: f32| {
        let wrap = |i: f32| {
            if piece.clamped {
                (i as i32).clamp(0, size - 1)
            } else {
                (i as i32).rem_euclid(size)
            }
        };
        f32::from(piece.heights[(wrap(y) * size + wrap(x)) as usize]) / 65535.0
    };
    let q = st * size as f32 - 0.5;
    let (i, f) = (q.floor(), q - q.floor());
    let row = |y: f32| at(i.x, y) * (1.0 - f.x) + at(i.x + 1.0, y) * f.x;
    row(i.y) * (1.0 - f.y) + row(i.y + 1.0) * f.y
}

fn same_bytes_again(a: &DemoFiles, b: &DemoFiles) {
    let bits = |v: &[Vec3]| v.iter().map(|&p| position_key(p)).collect::<Vec<_>>();
    for (a, b) in pieces(a).iter().zip(pieces(b)) {
        assert_eq!(bits(&a.mesh.positions), bits(&b.mesh.positions));
        assert_eq!(bits(&a.mesh.normals), bits(&b.mesh.normals));
        assert_eq!(a.mesh.texcoords, b.mesh.texcoords);
        assert!(a.heights == b.heights);
    }
    assert!(a.colors == b.colors);
    assert_eq!(a.scene, b.scene);
}
