//! The benches' scene: a unit sphere over ten rhombi of one map, displaced by rock, one texel as large as the next.
//!
//! Two faces of an icosahedron make a rhombus, cut into n x n cells of two base triangles each; rhombus k lies in cell
//! (k mod 4, k / 4) of a 4 x 4 partition of the map, a few texels from its border. So texels are of one size on all
//! of the sphere, and base triangles are cut along whole texels: with 4096 x 4096 texels and n = 8, 1280 triangles of 127
//! texels a side, 20.6 million triangles with one vertex per texel.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{IVec3, Vec2, Vec3};
use prismarch::surface::{BaseMesh, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap};
use rayon::prelude::*;

use super::scene::random_bits;

/// Texels between a rhombus and the border of its cell of the partition.
const BORDER: usize = 3;

/// Corners of the ten rhombi: the first and third are the ends of the diagonal that is no edge of the icosahedron.
fn rhombi() -> [[Vec3; 4]; 10] {
    let ring = |angle: f32, z: f32| {
        let (sin, cos) = angle.sin_cos();
        Vec3::new(2.0 * cos, 2.0 * sin, z) / 5f32.sqrt()
    };
    let mut all = [[Vec3::ZERO; 4]; 10];
    for k in 0..5 {
        let upper = |k: usize| ring(k as f32 * TAU / 5.0, 1.0);
        let lower = |k: usize| ring(k as f32 * TAU / 5.0 + PI / 5.0, -1.0);
        all[2 * k] = [Vec3::Z, upper(k), lower(k), upper(k + 1)];
        all[2 * k + 1] = [upper(k + 1), lower(k), -Vec3::Z, lower(k + 1)];
    }
    all
}

/// The point of the unit sphere at (p, q) of a rhombus, both in [0, 1].
fn on_sphere([start, along_p, end, along_q]: [Vec3; 4], p: f32, q: f32) -> Vec3 {
    let flat = if p + q <= 1.0 {
        start * (1.0 - p - q) + along_p * p + along_q * q
    } else {
        end * (p + q - 1.0) + along_p * (1.0 - q) + along_q * (1.0 - p)
    };
    flat.normalize()
}

/// Whole texels along a rhombus of a map of this size.
pub fn side(size: usize) -> usize {
    size / 4 - 2 * BORDER - 2
}

/// The same, and the first texel of rhombus k.
fn layout(size: usize) -> (f32, impl Fn(usize) -> Vec2) {
    let cell = size / 4;
    let start = move |k: usize| {
        let corner = [k % 4, k / 4].map(|i| (i * cell + BORDER) as f32);
        Vec2::from(corner)
    };
    (side(size) as f32, start)
}

/// The sphere over a map of `size` x `size` texels, 20 `cells`^2 base triangles.
pub fn mesh(cells: usize, size: usize) -> Arc<BaseMesh> {
    let (side, start) = layout(size);
    let mut builder = MeshBuilder::default();
    for (k, rhombus) in rhombi().into_iter().enumerate() {
        let first = builder.positions.len() as u32;
        for j in 0..=cells {
            for i in 0..=cells {
                let at = Vec2::new(i as f32, j as f32) / cells as f32;
                let point = on_sphere(rhombus, at.x, at.y);
                builder.positions.push(point);
                builder.normals.push(point);
                builder
                    .texcoords
                    .push((start(k) + side * at + 0.5) / size as f32);
            }
        }
        let row = cells as u32 + 1;
        for j in 0..cells as u32 {
            for i in 0..cells as u32 {
                let [a, b] = [first + j * row + i, first + (j + 1) * row + i];
                builder.triangles.push([a, a + 1, b]);
                builder.triangles.push([b + 1, b, a + 1]);
            }
        }
    }
    let (mesh, _) = builder.build(NormalMode::File).expect("a sound sphere");
    Arc::new(mesh)
}

/// The rock on the rhombi of a map of `size` x `size` 16-bit texels.
pub fn map(size: usize) -> Arc<DisplacementMap> {
    let (side, start) = layout(size);
    let (rhombi, cell) = (rhombi(), size / 4);
    let height = |i: usize| {
        let (x, y) = (i % size, i / size);
        let k = x / cell + 4 * (y / cell);
        // Around a rhombus its outline goes on, so that no texel is far from its neighbours.
        let at = (Vec2::new(x as f32, y as f32) - start(k)) / side;
        rhombi
            .get(k)
            .map(|&rhombus| rock(on_sphere(rhombus, at.x, at.y)))
    };
    let heights: Vec<Option<f32>> = (0..size * size).into_par_iter().map(height).collect();
    let (low, high) = heights
        .iter()
        .flatten()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &h| {
            (low.min(h), high.max(h))
        });
    let to_texel = |h: Option<f32>| ((h.unwrap_or(low) - low) / (high - low) * 65535.0) as u16;
    let texels = Texels::U16(heights.into_iter().map(to_texel).collect());
    Arc::new(DisplacementMap::new(size, size, texels, Wrap::Clamp).expect("a full map"))
}

/// Ridged multifractal noise (Musgrave, in Ebert et al., "Texturing and Modeling", ch. 16): sharp crests, on which the finer
/// octaves are strongest.
fn rock(p: Vec3) -> f32 {
    const OCTAVES: u32 = 8;
    let (mut sum, mut amplitude, mut frequency, mut ridge) = (0.0, 0.5, 3.5, 1.0);
    for octave in 0..OCTAVES {
        let noise = gradient_noise(p * frequency + Vec3::splat(17.3 * octave as f32));
        let crest = (1.0 - noise.abs()).powi(2);
        sum += crest * amplitude * ridge;
        ridge = 0.5 + 0.5 * crest;
        amplitude *= 0.5;
        frequency *= 2.03;
    }
    sum
}

/// Perlin's gradient noise.
fn gradient_noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let corner = |offset: IVec3| {
        let [x, y, z] = (cell.as_ivec3() + offset).to_array();
        let bits = random_bits(x as u32 ^ random_bits(y as u32 ^ random_bits(z as u32)));
        // One of twelve directions: towards the edges of a cube.
        let sign = |bit: u32| if bits >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let d = f - offset.as_vec3();
        let (a, b) = match bits >> 2 & 3 {
            0 => (d.x, d.y),
            1 => (d.y, d.z),
            _ => (d.z, d.x),
        };
        sign(0) * a + sign(1) * b
    };
    let smooth = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
    let along_x = |y: i32, z: i32| {
        let ends = [IVec3::new(0, y, z), IVec3::new(1, y, z)];
        mix(corner(ends[0]), corner(ends[1]), smooth.x)
    };
    let along_y = |z: i32| mix(along_x(0, z), along_x(1, z), smooth.y);
    mix(along_y(0), along_y(1), smooth.z)
}
