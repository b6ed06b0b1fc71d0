use super::*;
use crate::surface::{
    Displacement, DisplacementMap, MeshBuilder, NormalMode, ShadingNormals, Texels, Wrap,
};
use glam::Vec2;
use std::f32::consts::{PI, TAU};

/// A unit cylinder about y of `faces` sides, the map once around it and `height` up; normals are the cylinder's.
fn cylinder(faces: u32, height: f32) -> MeshBuilder {
    let mut mesh = MeshBuilder::default();
    for i in 0..=faces {
        let s = i as f32 / faces as f32;
        // The first and the last line are the same to the bit.
        let turn = if i == faces { 0.0 } else { TAU * s };
        let out = Vec3::new(turn.sin(), 0.0, turn.cos());
        for t in [0.0, 1.0] {
            mesh.positions.push(out + height * t * Vec3::Y);
            mesh.normals.push(out);
            mesh.texcoords.push(Vec2::new(s, t));
        }
        if i < faces {
            let [a, b, c, d] = [0, 2, 3, 1].map(|k| 2 * i + k);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn bumps(n: usize) -> DisplacementMap {
    let tau = TAU / n as f32;
    let at = |i: usize| {
        let (x, y) = (tau * (i % n) as f32, tau * (i / n) as f32);
        0.5 + 0.25 * ((3.0 * x + y).sin() + (2.0 * y).cos())
    };
    let heights = Texels::F32((0..n * n).map(at).collect());
    DisplacementMap::new(n, n, heights, Wrap::Repeat).unwrap()
}

fn surface(mesh: MeshBuilder, map: DisplacementMap, scale: f32) -> DisplacedSurface {
    let (mesh, _) = mesh.build(NormalMode::File).unwrap();
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(scale)).unwrap()
}

/// Angles in degrees between the shading normals on both sides of the lines of a cylinder, and of its faces' diagonals.
fn jumps(surface: &DisplacedSurface) -> Vec<f32> {
    let triangles = surface.mesh().triangles().len() as u32;
    let mut jumps = Vec::new();
    for face in 0..triangles / 2 {
        for k in 1..40 {
            let x = k as f32 / 40.0;
            // Triangles are (a, b, c) and (a, c, d): b-c is the next face's a-d, a-c the diagonal.
            let sides = [
                ((2 * face, 1.0 - x, x), ((2 * face + 3) % triangles, 0.0, x)),
                ((2 * face, 0.0, x), (2 * face + 1, x, 0.0)),
            ];
            for (a, b) in sides {
                let [a, b] = [a, b].map(|(prim, u, v)| surface.point(prim, u, v));
                assert!(a.position.distance(b.position) < 1e-5);
                jumps.push(
                    a.shading_normal
                        .angle_between(b.shading_normal)
                        .to_degrees(),
                );
            }
        }
    }
    jumps
}

#[test]
fn smooth_normals_go_on_across_edges_where_the_paper_s_jump() {
    let smooth = surface(cylinder(10, 1.0), bumps(64), 0.3);
    let largest = jumps(&smooth).into_iter().fold(0.0, f32::max);
    assert!(largest < 0.1, "{largest} degrees");
    let paper = jumps(&smooth.with_shading_normals(ShadingNormals::Paper));
    let mean = paper.iter().sum::<f32>() / paper.len() as f32;
    println!("mean jump of the paper's: {mean} degrees");
    assert!(mean > 3.0, "{mean}");
}

#[test]
fn smooth_normals_are_the_surface_s_own_where_the_base_is_flat() {
    // Slopes are constant, so that texels have no edges; the map lies askew on two triangles.
    let n = 64;
    let ramp = (0..n * n).map(|i| 0.02 * (i % n) as f32 - 0.01 * (i / n) as f32);
    let map = DisplacementMap::new(n, n, Texels::F32(ramp.collect()), Wrap::Clamp).unwrap();
    let corners = [Vec2::ZERO, Vec2::X, Vec2::new(1.3, 1.0), Vec2::Y];
    let askew = |c: &Vec2| Vec2::new(0.2 + 0.4 * c.x + 0.1 * c.y, 0.3 - 0.1 * c.x + 0.3 * c.y);
    let mesh = MeshBuilder {
        positions: corners.map(|c| c.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        texcoords: corners.iter().map(askew).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let surface = surface(mesh, map, 0.8);
    for prim in [0, 1] {
        for (u, v) in [(0.2, 0.3), (0.6, 0.1), (0.1, 0.8)] {
            let point = surface.point(prim, u, v);
            let apart = point.shading_normal.distance(point.geometric_normal);
            assert!(apart < 1e-5, "{point:?}");
        }
    }
}

/// On many faces the frames are those of the cylinder itself, whose displaced surface is r(phi, y) = 1 + D: its normal is
/// (1, -D_phi / r, -D_y) along (out, around, up).
#[test]
fn smooth_normals_are_those_of_the_smooth_base() {
    let n = 256;
    let surface = surface(cylinder(600, 2.0), bumps(n), 0.5);
    for k in 0..200 {
        let (prim, u, v) = (6 * k as u32, 0.31, 0.27);
        let point = surface.point(prim, u, v);
        let r = 1.0 + point.displacement;
        let at = surface.map().to_texel(point.texcoord.as_dvec2());
        let slope = 0.5 * surface.map().smooth(at, 1.0).gradient.as_vec2() * n as f32;
        let out = Vec3::new(point.position.x, 0.0, point.position.z).normalize();
        let around = Vec3::Y.cross(out);
        let wanted = out - slope.x / (TAU * r) * around - slope.y / 2.0 * Vec3::Y;
        let apart = point.shading_normal.angle_between(wanted.normalize());
        assert!(apart < 0.2 * PI / 180.0, "{}", apart.to_degrees());
    }
}

#[test]
fn mirrored_charts_keep_their_own_frames() {
    // A strip whose right half shows the left half's part of the map from the other side.
    let positions = [
        (0.0, 0.0),
        (1.0, 0.0),
        (2.0, 0.0),
        (0.0, 1.0),
        (1.0, 1.0),
        (2.0, 1.0),
    ];
    let texcoords = [
        (0.1, 0.1),
        (0.5, 0.1),
        (0.1, 0.1),
        (0.1, 0.5),
        (0.5, 0.5),
        (0.1, 0.5),
    ];
    let mesh = MeshBuilder {
        positions: positions.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        normals: vec![Vec3::Z; 6],
        texcoords: texcoords.map(|(s, t)| Vec2::new(s, t)).to_vec(),
        triangles: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
    };
    let n = 64;
    let ramp = (0..n * n).map(|i| 0.03 * (i % n) as f32).collect();
    let map = DisplacementMap::new(n, n, Texels::F32(ramp), Wrap::Clamp).unwrap();
    let surface = surface(mesh, map, 1.0);
    let near = |prim, u, v| surface.point(prim, u, v);
    let (left, right) = (near(0, 0.9, 0.05), near(3, 0.05, 0.05));
    for point in [left, right] {
        assert!(point.shading_normal.distance(point.geometric_normal) < 1e-5);
    }
    assert!(left.shading_normal.x < -0.3 && right.shading_normal.x > 0.3);
}
