//! Shapes to trace.

use super::*;

/// A ball of this radius around the origin, of 32 x 16 quads with smooth normals.
pub(super) fn ball(radius: f32) -> MeshBuilder {
    let (columns, rows) = (32, 16);
    let mut mesh = MeshBuilder::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let st = Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32);
            let (sin, cos) = (std::f32::consts::PI * st.y).sin_cos();
            // The last column is the first, to the bit.
            let turns = (column % columns) as f32 / columns as f32;
            let (y, x) = (std::f32::consts::TAU * turns).sin_cos();
            let sin = if row % rows == 0 { 0.0 } else { sin };
            let normal = Vec3::new(sin * x, sin * y, -cos);
            mesh.positions.push(radius * normal);
            mesh.normals.push(normal);
            mesh.texcoords.push(st);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            if row > 0 {
                mesh.triangles.push([a, a + 1, b + 1]);
            }
            if row + 1 < rows {
                mesh.triangles.push([a, b + 1, b]);
            }
        }
    }
    mesh
}

pub(super) fn built(mesh: MeshBuilder) -> Arc<crate::surface::BaseMesh> {
    Arc::new(mesh.build(NormalMode::File).unwrap().0)
}

/// A displaced ball; `height` is of (s, t).
pub(super) fn displaced_ball(radius: f32, scale: f32, height: impl Fn(f32, f32) -> f32) -> Shape {
    displaced(ball(radius), scale, height)
}

/// A displaced mesh; `height` is of (s, t).
pub(super) fn displaced(mesh: MeshBuilder, scale: f32, height: impl Fn(f32, f32) -> f32) -> Shape {
    let side = 64;
    let texel = |i: usize| (i as f32 + 0.5) / side as f32;
    let texels = (0..side * side).map(|i| height(texel(i % side), texel(i / side)));
    let map = DisplacementMap::new(side, side, Texels::F32(texels.collect()), Wrap::Repeat);
    let displacement = Displacement::new(scale);
    let surface = DisplacedSurface::new(built(mesh), Arc::new(map.unwrap()), displacement).unwrap();
    let surface = Arc::new(surface.with_seams(Seams::Closed));
    Shape::Displaced(Arc::new(
        Prisms::new(surface, PrismOptions::default()).unwrap(),
    ))
}

/// Waves that are 0 at the poles, where the map is drawn together.
pub(super) fn waves(s: f32, t: f32) -> f32 {
    let tau = std::f32::consts::TAU;
    (std::f32::consts::PI * t).sin().powi(2)
        * (0.5 + 0.5 * (6.0 * tau * s).sin() * (4.0 * tau * t).cos())
}

/// A quad from a corner along two edges, its front where `a x b` points to.
pub(super) fn quad(corner: Vec3, a: Vec3, b: Vec3) -> Shape {
    Shape::Triangles(built(quad_mesh(corner, a, b)))
}

/// Its mesh.
pub(super) fn quad_mesh(corner: Vec3, a: Vec3, b: Vec3) -> MeshBuilder {
    MeshBuilder {
        positions: vec![corner, corner + a, corner + a + b, corner + b],
        normals: vec![a.cross(b).normalize(); 4],
        texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A box from `min` to `max`, its front outside.
pub(super) fn slab(min: Vec3, max: Vec3) -> MeshBuilder {
    let d = max - min;
    let [x, y, z] = [Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z];
    let sides = [
        (min, y, x),
        (min + z, x, y),
        (min, z, y),
        (min + x, y, z),
        (min, x, z),
        (min + y, z, x),
    ];
    let mut mesh = MeshBuilder::default();
    for (corner, a, b) in sides {
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([corner, corner + a, corner + a + b, corner + b]);
        mesh.normals.extend([a.cross(b).normalize(); 4]);
        mesh.texcoords
            .extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        mesh.triangles
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}
