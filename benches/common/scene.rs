//! A unit sphere of triangles and a map of rock to displace it by.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use prismarch::prism::{March, Prisms, Step};
use prismarch::surface::{
    BaseMesh, DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels,
    Wrap,
};

/// Largest displacement of the unit sphere.
pub const RANGE: f32 = 0.15;

/// An icosahedron with every face cut in four `subdivisions` times: 20 * 4^subdivisions triangles.
///
/// Texture coordinates are longitude and latitude, continuous over every triangle: vertices are not
/// shared, so that a triangle across the seam may go on beyond 1.
pub fn sphere(subdivisions: u32) -> Arc<BaseMesh> {
    let mut faces = icosahedron();
    for _ in 0..subdivisions {
        faces = faces.into_iter().flat_map(cut_in_four).collect();
    }
    let mut builder = MeshBuilder::default();
    for face in faces {
        let first = builder.positions.len() as u32;
        builder.triangles.push([first, first + 1, first + 2]);
        builder.positions.extend(face);
        builder.normals.extend(face);
        builder.texcoords.extend(texcoords(face));
    }
    let (mesh, _) = builder.build(NormalMode::File).expect("a sound sphere");
    Arc::new(mesh)
}

fn icosahedron() -> Vec<[Vec3; 3]> {
    let golden = (1.0 + 5f32.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for a in [-1.0, 1.0] {
        for b in [-golden, golden] {
            corners
                .extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(|p| Vec3::from(p).normalize()));
        }
    }
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let adjacent = |a: Vec3, b: Vec3| (a.distance(b) - edge).abs() < 1e-3;
    let mut faces = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if adjacent(a, b) && adjacent(b, c) && adjacent(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

fn cut_in_four([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let middle = |p: Vec3, q: Vec3| (p + q).normalize();
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn texcoords(face: [Vec3; 3]) -> [Vec2; 3] {
    let longitude = |p: Vec3| p.y.atan2(p.x) / TAU + 0.5;
    let is_pole = |p: Vec3| p.x.hypot(p.y) < 1e-6;
    let reference = longitude(face[0] + face[1] + face[2]);
    face.map(|p| {
        let offset = longitude(p) - reference;
        // At a pole any longitude is right: the one of the face's middle distorts least.
        let offset = if is_pole(p) {
            0.0
        } else {
            offset - offset.round()
        };
        Vec2::new(reference + offset, p.z.clamp(-1.0, 1.0).asin() / PI + 0.5)
    })
}

/// `mesh` displaced by `map` with a range of 0 .. [`RANGE`].
pub fn displaced(mesh: &Arc<BaseMesh>, map: &Arc<DisplacementMap>) -> Arc<DisplacedSurface> {
    let displacement = Displacement::new(RANGE);
    let surface = DisplacedSurface::new(mesh.clone(), map.clone(), displacement);
    Arc::new(surface.expect("a sphere that can be displaced"))
}

/// Prisms around `mesh` displaced by `map`.
pub fn prisms(mesh: &Arc<BaseMesh>, map: &Arc<DisplacementMap>, march: March) -> Prisms {
    Prisms::new(displaced(mesh, map), march).expect("a step above zero")
}

/// The paper's march with a step in texels.
pub fn uniform(texels: f32) -> March {
    March::Uniform {
        step: Step::Texels(texels),
        jitter: false,
    }
}

/// A rocky 16-bit map of `size` x `size` texels that repeats without a seam: ridged gradient noise
/// whose detail falls off like stone's, stretched to the full range.
pub fn rock_map(size: usize, seed: u32) -> Arc<DisplacementMap> {
    let octaves = (size as f32).log2() as u32 - 3;
    let heights: Vec<f32> = (0..size * size)
        .map(|i| {
            let p = Vec2::new((i % size) as f32, (i / size) as f32) / size as f32;
            ridged(p, octaves, seed)
        })
        .collect();
    let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
    let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let to_texel = |h: f32| ((h - low) / (high - low) * 65535.0).round() as u16;
    let texels = Texels::U16(heights.into_iter().map(to_texel).collect());
    Arc::new(DisplacementMap::new(size, size, texels, Wrap::Repeat).expect("a full map"))
}

fn ridged(p: Vec2, octaves: u32, seed: u32) -> f32 {
    (0..octaves)
        .map(|octave| {
            let period = 4 << octave;
            let noise = gradient_noise(p * period as f32, period, seed + octave);
            (1.0 - noise.abs()) * 0.5f32.powi(octave as i32)
        })
        .sum()
}

/// Perlin's gradient noise, repeating every `period` cells.
fn gradient_noise(p: Vec2, period: u32, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let corner = |dx: u32, dy: u32| {
        let x = (cell.x as u32 + dx) % period;
        let y = (cell.y as u32 + dy) % period;
        let angle = random(x ^ random_bits(y ^ random_bits(seed))) * TAU;
        Vec2::from_angle(angle).dot(f - Vec2::new(dx as f32, dy as f32))
    };
    let smooth = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
    mix(
        mix(corner(0, 0), corner(1, 0), smooth.x),
        mix(corner(0, 1), corner(1, 1), smooth.x),
        smooth.y,
    )
}

/// Well-mixed bits of `x` (the finaliser of MurmurHash3).
pub fn random_bits(x: u32) -> u32 {
    let x = (x ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
    let x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// A number in [0, 1) made from `x`.
pub fn random(x: u32) -> f32 {
    (random_bits(x) >> 8) as f32 / (1 << 24) as f32
}
