use glam::{Vec2, vec2, vec3};

use super::*;
use crate::surface::NormalMode;

/// Triangles whose corners stand alone.
fn soup(corners: &[Vec3]) -> MeshBuilder {
    MeshBuilder {
        positions: corners.to_vec(),
        triangles: (0..corners.len() as u32 / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
        ..MeshBuilder::default()
    }
}

/// Two triangles over an edge along y, folded, whose second copy is off by `off`.
fn folded(off: Vec3) -> MeshBuilder {
    soup(&[
        vec3(0.0, 0.0, 0.0),
        vec3(0.0, 1.0, 0.0),
        vec3(-1.0, 0.5, -0.5),
        vec3(0.0, 1.0, 0.0) + off,
        vec3(0.0, 0.0, 0.0) + off,
        vec3(1.0, 0.5, -0.5),
    ])
}

fn bits(v: Vec3) -> [u32; 3] {
    v.to_array().map(f32::to_bits)
}

#[test]
fn an_edge_that_was_written_twice_is_one_edge() {
    for off in [Vec3::Z * 1e-17, vec3(1e-6, -1e-6, 1e-6)] {
        let mut mesh = folded(off);
        let joined = mesh.join(mesh.rounding()).unwrap();
        assert_eq!(joined.positions, 2);
        assert!((joined.farthest - off.length()).abs() <= 0.1 * off.length());
        let (mesh, report) = mesh.build(NormalMode::File).unwrap();
        assert_eq!(report.degenerate_dropped, 0);
        let ([a, b], [c, d]) = ([0, 1], [4, 3]);
        for (one, other) in [(a, c), (b, d)] {
            assert_eq!(
                bits(mesh.positions()[one]),
                bits(mesh.positions()[other] + Vec3::ZERO)
            );
            assert_eq!(bits(mesh.normals()[one]), bits(mesh.normals()[other]));
            assert!((mesh.normals()[one] - Vec3::Z).length() < 1e-5);
        }
    }
}

#[test]
fn what_is_farther_or_not_to_be_joined_stays() {
    let off = Vec3::Z * 1e-3;
    let mut mesh = folded(off);
    assert_eq!(mesh.join(mesh.rounding()).unwrap(), Joined::default());
    assert_eq!(mesh.positions, folded(off).positions);
    let mut mesh = folded(Vec3::Z * 1e-17);
    assert_eq!(mesh.join(0.0).unwrap(), Joined::default());
    assert_eq!(mesh.join(f32::NAN).unwrap(), Joined::default());
    assert_eq!(folded(off).join(1.1e-3).unwrap().positions, 2);
    assert_eq!(MeshBuilder::default().rounding(), 0.0);
}

#[test]
fn both_sides_of_a_thin_solid_stay_apart() {
    // A box, closed bit for bit, a thousandth of the tolerance thin.
    let mut mesh = MeshBuilder::default();
    let thin = 0.01;
    for i in 0..8u32 {
        let of = |bit: u32| (i >> bit & 1) as f32;
        mesh.positions.push(vec3(of(0), of(1), thin * of(2)));
    }
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    for tolerance in [0.001, 0.1, 10.0] {
        assert_eq!(mesh.join(tolerance).unwrap(), Joined::default());
    }
}

#[test]
fn small_triangles_keep_their_shape() {
    // A strip of ever smaller triangles, each a third of the last, all corners alone.
    let mut corners = Vec::new();
    let (mut x, mut size) = (0.0, 1.0f32);
    for _ in 0..14 {
        let (a, b) = (vec3(x, 0.0, 0.0), vec3(x, size, 0.0));
        let (c, d) = (vec3(x + size, 0.0, 0.0), vec3(x + size, size / 3.0, 0.0));
        corners.extend([a, c, b, b, c, d]);
        (x, size) = (x + size, size / 3.0);
    }
    for tolerance in [1e-6, 1e-3, 0.1, 5.0] {
        let mut mesh = soup(&corners);
        let faces = soup(&corners)
            .build(NormalMode::File)
            .unwrap()
            .0
            .triangles()
            .len();
        mesh.join(tolerance).unwrap();
        for (p, q) in mesh.positions.iter().zip(&corners) {
            assert!(p.distance(*q) <= tolerance);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!(a != b && b != c && c != a);
        }
        assert_eq!(
            mesh.build(NormalMode::File).unwrap().0.triangles().len(),
            faces
        );
    }
}

#[test]
fn a_row_does_not_creep() {
    // Copies of a corner, each within the tolerance of the next: a fan with a long way from the first to the last.
    let corners: Vec<Vec3> = (0..20)
        .flat_map(|k| {
            let k = k as f32;
            let tip = vec3(0.04 * k, 0.0, 0.0);
            [tip, tip + vec3(1.0, 1.0, k), tip + vec3(-1.0, 1.0, k)]
        })
        .collect();
    let mut mesh = soup(&corners);
    let joined = mesh.join(0.05).unwrap();
    assert!(joined.positions > 5 && joined.farthest <= 0.05);
    let mut backward = corners.clone();
    backward.reverse();
    let mut other = soup(&backward);
    other.join(0.05).unwrap();
    // Whatever the order of the file.
    other.positions.reverse();
    assert_eq!(mesh.positions, other.positions);
}

#[test]
fn normals_and_texture_coordinates_that_differ_by_rounding_are_one() {
    let edge = |leaning: f32, shift: f32| {
        let mut mesh = folded(Vec3::Z * 1e-7);
        mesh.normals = vec![Vec3::Z; 6];
        mesh.texcoords = vec![vec2(0.25, 0.5); 6];
        mesh.normals[3] = vec3(leaning, 0.0, 1.0);
        mesh.texcoords[4] += Vec2::splat(shift);
        let joined = mesh.join(1e-6).unwrap();
        (joined.positions, joined.normals, joined.texcoords)
    };
    assert_eq!(edge(0.0, 0.0), (2, 0, 0));
    assert_eq!(edge(1e-4, 5e-7), (2, 1, 1));
    // A crease, and a seam.
    assert_eq!(edge(1e-3, 1e-4), (2, 0, 0));
}

#[test]
fn numbers_of_any_size_are_looked_at_quickly() {
    for scale in [1e-30, 1e-10, 1e10, 1e17] {
        let mut mesh = folded(vec3(1e-6, 0.0, 0.0));
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        assert_eq!(mesh.join(mesh.rounding()).unwrap().positions, 2, "{scale}");
        assert_eq!(mesh.join(1e-38).unwrap().positions, 0);
        mesh.join(f32::MAX).unwrap();
    }
}

#[test]
fn a_bad_mesh_is_refused() {
    let mut mesh = folded(Vec3::ZERO);
    mesh.triangles[0][1] = 6;
    assert!(mesh.rounding() > 0.0);
    assert!(matches!(
        mesh.join(1.0),
        Err(MeshError::IndexOutOfRange { index: 6, .. })
    ));
}
