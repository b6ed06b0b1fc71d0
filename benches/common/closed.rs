//! Closed displaced surfaces, and the laws of lines that cross them.
//!
//! A closed surface is crossed an even number of times by every line, as often inward as outward; from inside, every
//! ray hits. That needs D to be continuous across every edge: here texture coordinates are a function of position,
//! shared per vertex, so both halves of a body read the same part of the map.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use prismarch::prism::Prisms;
use prismarch::ray::Ray;
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap,
};
use prismarch::trace::Tracer;
use rayon::prelude::*;

use super::numbers::Numbers;
use super::{march, scene};

/// A closed surface around the origin, within [`REACH`] of it, that holds the ball of [`INSIDE`].
pub struct Closed {
    pub name: &'static str,
    pub surface: Arc<DisplacedSurface>,
    /// It does not pass through itself: crossings alternate between entering and leaving.
    pub embedded: bool,
}

const REACH: f32 = 2.5;
const INSIDE: f32 = 0.2;

/// All of them.
pub fn all() -> Vec<Closed> {
    let map = Arc::new(rough_map(512));
    let closed = |name, mesh: MeshBuilder, embedded, scale, midlevel| {
        let mesh = Arc::new(mesh.build(NormalMode::File).unwrap().0);
        let displacement = Displacement {
            midlevel,
            ..Displacement::new(scale)
        };
        let surface = DisplacedSurface::new(mesh, map.clone(), displacement).unwrap();
        Closed {
            name,
            surface: Arc::new(surface),
            embedded,
        }
    };
    // On a sphere N' is along P: the surface is star-shaped.
    vec![
        closed("icosahedron, 80", sphere(1), true, 0.2, 0.0),
        closed("icosahedron, 1280", sphere(3), true, 0.15, 0.0),
        closed("the same, two-sided", sphere(3), true, 0.2, 0.5),
        closed("leaning normals, 80", leaning(sphere(1)), false, 0.2, 0.0),
        closed("leaning normals, 1280", leaning(sphere(3)), false, 0.1, 0.3),
        closed("head, 1280", head(), false, 0.12, 0.2),
    ]
}

impl Closed {
    /// Its prisms, with the march under test.
    pub fn prisms(&self) -> Prisms {
        Prisms::new(self.surface.clone(), march::under_test()).expect("a sound march")
    }
}

fn texcoord(p: Vec3) -> Vec2 {
    Vec2::splat(0.5) + 0.3 * Vec2::new(p.x + 0.1 * p.z, p.y - 0.15 * p.z)
}

/// A unit sphere of 20 * 4^n triangles, every vertex shared.
fn sphere(subdivisions: u32) -> MeshBuilder {
    let split = scene::sphere(subdivisions);
    let mut builder = MeshBuilder::default();
    let mut indices = HashMap::new();
    for triangle in 0..split.triangles().len() as u32 {
        let corners = split.corners(triangle).map(|p| {
            *indices
                .entry(p.to_array().map(f32::to_bits))
                .or_insert_with(|| {
                    builder.positions.push(p);
                    builder.normals.push(p);
                    builder.texcoords.push(texcoord(p));
                    builder.positions.len() as u32 - 1
                })
        });
        builder.triangles.push(corners);
    }
    builder
}

/// Every normal leaned over by up to half a radian.
fn leaning(mut mesh: MeshBuilder) -> MeshBuilder {
    let mut numbers = Numbers::new(21);
    for n in &mut mesh.normals {
        *n = (*n + 0.5 * numbers.number() * numbers.direction()).normalize();
    }
    mesh
}

/// A head: ears, a nose and sunken eyes on a long skull, with smooth normals.
fn head() -> MeshBuilder {
    let mut mesh = sphere(3);
    let bumps = [
        (Vec3::new(1.0, 0.0, 0.3), 0.3, 0.8),
        (Vec3::new(-1.0, 0.0, 0.3), 0.3, 0.8),
        (Vec3::new(0.0, -1.0, -0.1), 0.25, 0.4),
        (Vec3::new(0.4, -0.8, 0.35), 0.25, -0.3),
        (Vec3::new(-0.4, -0.8, 0.35), 0.25, -0.3),
        (Vec3::new(0.0, -0.7, -0.6), 0.3, -0.15),
    ];
    for (p, st) in mesh.positions.iter_mut().zip(&mut mesh.texcoords) {
        let bump = |(at, width, height): (Vec3, f32, f32)| {
            height * (-p.distance_squared(at.normalize()) / (width * width)).exp()
        };
        *p *= 1.0 + bumps.into_iter().map(bump).sum::<f32>();
        *p *= Vec3::new(0.85, 1.0, 1.15);
        *st = texcoord(*p);
    }
    mesh.normals.clear();
    mesh
}

/// 16 bits: hills of smoothed noise, and white noise of an eighth of their height.
fn rough_map(size: usize) -> DisplacementMap {
    let mut numbers = Numbers::new(22);
    let coarse = size / 16;
    let hills: Vec<f32> = (0..coarse * coarse).map(|_| numbers.number()).collect();
    let hill = |x: f32, y: f32| {
        let (i, j) = (x.floor(), y.floor());
        let smooth = |f: f32| f * f * (3.0 - 2.0 * f);
        let (fx, fy) = (smooth(x - i), smooth(y - j));
        let at = |di: usize, dj: usize| {
            hills[(j as usize + dj) % coarse * coarse + (i as usize + di) % coarse]
        };
        let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
        mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy)
    };
    let texels = (0..size * size)
        .map(|k| {
            let h = hill((k % size) as f32 / 16.0, (k / size) as f32 / 16.0);
            ((0.875 * h + 0.125 * numbers.number()) * 65535.0) as u16
        })
        .collect();
    DisplacementMap::new(size, size, Texels::U16(texels), Wrap::Repeat).expect("a full map")
}

/// Lines and inside rays that broke a law.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Crossed an odd number of times, or not as often inward as outward, or (embedded surfaces) twice in a row the
    /// same way.
    pub odd: Vec<Ray>,
    /// Left the inside without a hit.
    pub escaped: Vec<Ray>,
}

/// Shoots `count` lines and `count` rays from inside at `closed`, on all cores.
pub fn faults(closed: &Closed, tracer: &dyn Tracer, count: usize, seed: u64) -> Faults {
    const CHUNK: usize = 1024;
    let chunk = |k: usize| {
        let mut numbers = Numbers::new(seed ^ (k as u64) << 20);
        let mut faults = Faults::default();
        for _ in 0..CHUNK.min(count - k * CHUNK) {
            let line = line(&mut numbers);
            if !is_crossed_evenly(tracer, &line, closed.embedded) {
                faults.odd.push(line);
            }
            let origin = INSIDE * numbers.number() * numbers.direction();
            let ray = Ray::new(origin, numbers.direction());
            if tracer.intersect(&ray).is_none() {
                faults.escaped.push(ray);
            }
        }
        faults
    };
    let join = |mut a: Faults, b: Faults| {
        a.odd.extend(b.odd);
        a.escaped.extend(b.escaped);
        a
    };
    (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(chunk)
        .reduce(Faults::default, join)
}

/// From outside through the middle of things.
pub fn line(numbers: &mut Numbers) -> Ray {
    let origin = REACH * numbers.direction();
    let target = 1.1 * numbers.number().cbrt() * numbers.direction();
    Ray::new(origin, (target - origin).normalize())
}

/// Whether a line keeps the law.
pub fn is_crossed_evenly(tracer: &dyn Tracer, line: &Ray, embedded: bool) -> bool {
    /// No line crosses so often; a tracer that does not move on would.
    const MOST: usize = 1000;
    let mut rest = *line;
    let mut depth = 0;
    for _ in 0..MOST {
        let Some(hit) = tracer.intersect(&rest) else {
            return depth == 0;
        };
        depth += if hit.ng.dot(line.direction) < 0.0 {
            1
        } else {
            -1
        };
        if embedded && !(0..=1).contains(&depth) {
            return false;
        }
        rest.tnear = hit.t;
    }
    false
}
