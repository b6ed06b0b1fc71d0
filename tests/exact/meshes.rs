//! Base meshes.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Affine3A, Mat2, Vec2, Vec3};
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, UvTransform,
};

use super::common::numbers::Numbers;

/// `mesh` displaced by `scale * (h - midlevel)`.
pub fn displaced(
    mesh: MeshBuilder,
    map: DisplacementMap,
    scale: f32,
    midlevel: f32,
) -> Arc<DisplacedSurface> {
    with_uv(mesh, map, scale, midlevel, UvTransform::default())
}

/// As [`displaced`], the texture coordinates transformed.
pub fn with_uv(
    mesh: MeshBuilder,
    map: DisplacementMap,
    scale: f32,
    midlevel: f32,
    uv: UvTransform,
) -> Arc<DisplacedSurface> {
    let mesh = mesh.build(NormalMode::File).unwrap().0;
    let displacement = Displacement {
        scale,
        midlevel,
        uv,
    };
    Arc::new(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap())
}

/// `n` x `n` quads in two triangles each over the unit square of (s, t): a point and a normal for each.
pub fn sheet(n: usize, at: impl Fn(Vec2) -> (Vec3, Vec3)) -> MeshBuilder {
    let mut builder = MeshBuilder::default();
    for j in 0..=n {
        for i in 0..=n {
            let st = Vec2::new(i as f32, j as f32) / n as f32;
            let (position, normal) = at(st);
            builder.positions.push(position);
            builder.normals.push(normal);
            builder.texcoords.push(st);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let [a, b] = [j * (n + 1) + i, (j + 1) * (n + 1) + i].map(|k| k as u32);
            builder.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    builder
}

/// The unit square in the plane z = 0.
pub fn flat(n: usize) -> MeshBuilder {
    sheet(n, |st| (st.extend(0.0), Vec3::Z))
}

/// A piece of a tube, rolled up by a third of a turn and twisted a little.
pub fn bent(n: usize) -> MeshBuilder {
    sheet(n, |st| {
        let (sin, cos) = (2.0 * (st.x - 0.5)).sin_cos();
        let twist = 0.3 * st.y;
        let position = Vec3::new(0.5 * sin, st.y, 0.5 * cos + twist * sin);
        let along_x = Vec3::new(0.5 * cos, 0.0, -0.5 * sin + twist * cos);
        let along_y = Vec3::new(0.0, 1.0, 0.3 * sin);
        (position, along_x.cross(along_y).normalize())
    })
}

/// A ring with tube radius 0.4; the seams are shared by position, not by texture coordinates.
pub fn torus(n: usize) -> MeshBuilder {
    sheet(n, |st| {
        let (around, along) = (Vec2::from_angle(TAU * st.x), Vec2::from_angle(TAU * st.y));
        let normal = Vec3::new(around.x * along.x, around.y * along.x, along.y);
        (around.extend(0.0) + 0.4 * normal, normal)
    })
}

/// The mesh with every normal leaned over at random until its cosine with the old one is about `cosine`.
pub fn leaning(mut mesh: MeshBuilder, cosine: f32, seed: u64) -> MeshBuilder {
    let mut numbers = Numbers::new(seed);
    for n in &mut mesh.normals {
        let across = n.cross(numbers.direction()).normalize();
        let cosine = 1.0 + (cosine - 1.0) * numbers.number();
        *n = (cosine * *n + (1.0 - cosine * cosine).sqrt() * across).normalize();
    }
    mesh
}

/// Every vertex moved.
pub fn moved(mesh: MeshBuilder, transform: Affine3A) -> MeshBuilder {
    mesh.transformed(&transform)
}

/// Texture coordinates scaled and turned.
pub fn remapped(mut mesh: MeshBuilder, scale: f32, angle: f32) -> MeshBuilder {
    let matrix = Mat2::from_scale_angle(Vec2::splat(scale), angle);
    for st in &mut mesh.texcoords {
        *st = matrix * *st;
    }
    mesh
}

/// Every third triangle's corners get one texture coordinate, or coordinates on one line.
pub fn texture_degenerate(mesh: &MeshBuilder) -> MeshBuilder {
    let mut split = MeshBuilder::default();
    for (k, triangle) in mesh.triangles.iter().enumerate() {
        let first = split.positions.len() as u32;
        split.triangles.push([first, first + 1, first + 2]);
        let st = triangle.map(|i| mesh.texcoords[i as usize]);
        let st = match k % 3 {
            0 => st,
            1 => [st[0]; 3],
            _ => [st[0], st[1], st[0] + 0.3 * (st[1] - st[0])],
        };
        for (&i, st) in triangle.iter().zip(st) {
            split.positions.push(mesh.positions[i as usize]);
            split.normals.push(mesh.normals[i as usize]);
            split.texcoords.push(st);
        }
    }
    split
}
