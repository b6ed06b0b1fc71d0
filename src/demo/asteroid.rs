//! An asteroid: a lump of rock with craters upon craters and boulders strewn about.
//!
//! The icosahedron's 20 faces are cut into 3 kites each; a kite is one square chart of 2 x 2 quads:
//! 60 * 4 * 2 = 480 triangles of nearly equal size, with nearly even texels. The heights are those of a star-shaped
//! body, r(direction), less what the flat triangle already has, so no facet of the base mesh shows.

mod ground;

use glam::{Vec2, Vec3};

use super::shape::{self, Chart, Rect};
use super::{Demo, DemoFiles, paint};
use crate::surface::MeshBuilder;
use ground::Ground;

/// The demo.
pub const DEMO: Demo = Demo {
    name: "asteroid",
    title: "a cratered asteroid with boulders",
    triangles: 480,
    map_size: 4096,
    make,
};

const KITES: usize = 60;
/// Cells of the atlas along a side; 60 of the 64 cells are used.
const CELLS: usize = 8;
const GUTTER: usize = 4;
/// The base mesh's share of the smooth body's radius.
const SHRINK: f32 = 0.94;

fn make(map_size: usize) -> DemoFiles {
    let ground = Ground::new();
    let (mesh, charts) = base_mesh(&ground, map_size);
    let base = |st: Vec2| {
        let (chart, st) = locate(&charts, st);
        chart.base_point(&mesh, st)
    };
    let heights = paint::heights(map_size, |st| {
        let point = base(st);
        let direction = settle(point.position, point.normal);
        rise(point.position, point.normal, ground.radius(direction))
    });
    let color_size = map_size / 2;
    let colors = paint::colors(color_size, |st| {
        let point = base(st);
        ground.color(settle(point.position, point.normal))
    });
    let scene = scene(heights.scale(), heights.midlevel());
    DemoFiles {
        mesh,
        heights: heights.texels,
        map_size,
        colors,
        color_size,
        parts: Vec::new(),
        scene,
    }
}

/// The direction in which the displaced point will lie, but for craters and crags: the base mesh is
/// the smooth body shrunk, and the normal is nearly radial.
fn settle(p: Vec3, n: Vec3) -> Vec3 {
    let rise = (1.0 / SHRINK - 1.0) * p.length();
    (p + rise * n).normalize()
}

/// How far along `n` from `p` the sphere of the given radius about the origin is.
fn rise(p: Vec3, n: Vec3, radius: f32) -> f32 {
    let b = p.dot(n);
    let c = p.length_squared() - radius * radius;
    (b * b - c).max(0.0).sqrt() - b
}

/// The chart of a texel, and the texel's place in it; the four unused cells repeat the first four.
fn locate(charts: &[Chart], st: Vec2) -> (&Chart, Vec2) {
    let cell = (st * CELLS as f32)
        .floor()
        .clamp(Vec2::ZERO, Vec2::splat(CELLS as f32 - 1.0));
    let index = cell.y as usize * CELLS + cell.x as usize;
    let used = index % KITES;
    let home = Vec2::new((used % CELLS) as f32, (used / CELLS) as f32);
    (&charts[used], st + (home - cell) / CELLS as f32)
}

fn base_mesh(ground: &Ground, map_size: usize) -> (MeshBuilder, Vec<Chart>) {
    let mut mesh = MeshBuilder::default();
    let charts = kites()
        .iter()
        .enumerate()
        .map(|(index, kite)| {
            let rect = Rect::atlas_cell(index, CELLS, map_size, GUTTER);
            shape::add_grid(&mut mesh, (2, 2), rect, |uv| {
                let direction = between(kite, uv).normalize();
                SHRINK * ground.smooth_radius(direction) * direction
            })
        })
        .collect();
    shape::smooth_normals(&mut mesh);
    (mesh, charts)
}

/// Bilinear between a kite's corners. As a weighted sum of all four it gives the same bits from both
/// sides of a shared edge: the other two weights are zero there, and a sum of two commutes.
fn between(kite: &[Vec3; 4], uv: Vec2) -> Vec3 {
    let (u, v) = (uv.x, uv.y);
    (1.0 - u) * (1.0 - v) * kite[0]
        + u * (1.0 - v) * kite[1]
        + u * v * kite[2]
        + (1.0 - u) * v * kite[3]
}

/// For each corner of each face of an icosahedron: the corner, the next edge's middle, the face's middle, the last
/// edge's middle; counter-clockwise, on the unit sphere.
fn kites() -> Vec<[Vec3; 4]> {
    let mut kites = Vec::with_capacity(KITES);
    for face in icosahedron() {
        let middle = (face[0] + face[1] + face[2]).normalize();
        for k in 0..3 {
            let [a, b, c] = [face[k], face[(k + 1) % 3], face[(k + 2) % 3]];
            kites.push([a, (a + b).normalize(), middle, (c + a).normalize()]);
        }
    }
    kites
}

/// The 20 faces: a cap of 5, a belt of 10, a cap of 5.
fn icosahedron() -> Vec<[Vec3; 3]> {
    let ring = |y: f32, turn: f32, i: usize| {
        let angle = std::f32::consts::TAU * ((i % 5) as f32 + turn) / 5.0;
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * angle.sin(), y, r * angle.cos())
    };
    // The rings of five stand at latitude atan(1/2), whose sine is 1/sqrt(5).
    let y = 0.2f32.sqrt();
    let upper = |i: usize| ring(y, 0.0, i);
    let lower = |i: usize| ring(-y, 0.5, i);
    (0..5)
        .flat_map(|i| {
            [
                [Vec3::Y, upper(i), upper(i + 1)],
                [lower(i), upper(i + 1), upper(i)],
                [lower(i), lower(i + 1), upper(i + 1)],
                [Vec3::NEG_Y, lower(i + 1), lower(i)],
            ]
        })
        .collect()
}

fn scene(scale: f32, midlevel: f32) -> String {
    format!(
        r#"# An asteroid of 480 triangles above a polished floor.
[camera]
position = [0.6, 1.55, 4.9]
target = [0.0, 1.16, 0.0]
fov = 37.0

[film]
width = 640
height = 480
spp = 32
exposure = 0.0

[[mesh]]
name = "asteroid"
file = "asteroid.obj"
material = "rock"
transform = {{ translate = [0, 1.38, 0] }}

[mesh.displacement]
map = "asteroid_height.png"
scale = {scale}
midlevel = {midlevel}
wrap = "clamp"

[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "floor"

[[material]]
name = "rock"
base_color = {{ file = "asteroid_color.png", color_space = "srgb" }}
roughness = 0.95
specular = 0.2

[[material]]
name = "floor"
base_color = [0.16, 0.16, 0.17]
roughness = 0.15

[[light]]
type = "sun"
elevation = 33.0
azimuth = 50.0

[[light]]
type = "sky"
turbidity = 3.0
strength = 0.7
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::laws;

    #[test]
    fn obeys_the_laws() {
        laws::check(&DEMO, 256);
    }

    #[test]
    fn kites_tile_the_sphere() {
        // Solid angles of all spherical triangles add up to the whole sphere (Van Oosterom and Strackee 1983).
        let solid_angle = |a: Vec3, b: Vec3, c: Vec3| {
            let below = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
            2.0 * a.dot(b.cross(c)).atan2(below)
        };
        let total: f32 = kites()
            .iter()
            .map(|k| solid_angle(k[0], k[1], k[2]) + solid_angle(k[0], k[2], k[3]))
            .sum();
        assert!((total - 4.0 * std::f32::consts::PI).abs() < 1e-3);
    }

    #[test]
    fn texels_are_even() {
        let (mesh, _) = base_mesh(&Ground::new(), 1024);
        let areas = mesh.triangles.iter().map(|t| {
            let p = t.map(|i| mesh.positions[i as usize]);
            (p[1] - p[0]).cross(p[2] - p[0]).length()
        });
        let (lo, hi) = areas.fold((f32::MAX, 0.0f32), |(l, h), a| (l.min(a), h.max(a)));
        assert!(hi / lo < 4.0, "{lo} .. {hi}");
    }
}
