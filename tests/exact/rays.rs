//! Rays of all kinds at one surface.

use glam::{DVec3, Vec3};
use prismarch::ray::Ray;
use prismarch::surface::DisplacedSurface;

use super::common::numbers::Numbers;

/// Rays per case. Without full optimisation fewer, so that the whole stays below a minute.
pub const COUNT: usize = if cfg!(debug_assertions) { 200 } else { 2000 };

/// A point on S with its unit normal, and the size of it all.
struct Aim<'a> {
    surface: &'a DisplacedSurface,
    numbers: Numbers,
    size: f32,
}

impl<'a> Aim<'a> {
    fn new(surface: &'a DisplacedSurface, seed: u64) -> Self {
        Self {
            surface,
            numbers: Numbers::new(seed),
            size: surface.mesh().bounds().diagonal(),
        }
    }

    fn triangle(&mut self) -> u32 {
        self.numbers.below(self.surface.mesh().triangles().len()) as u32
    }

    fn point(&mut self) -> (Vec3, DVec3) {
        let (u, v) = self.numbers.barycentric();
        self.point_at(u, v)
    }

    /// On a random triangle.
    fn point_at(&mut self, u: f32, v: f32) -> (Vec3, DVec3) {
        let triangle = self.triangle();
        let point = self.surface.patch(triangle).point(u.into(), v.into());
        let normal = point.du.cross(point.dv).normalize_or(DVec3::Z);
        (point.position.as_vec3(), normal)
    }

    /// A ray through `target` from `distance` sizes away.
    fn through(&mut self, target: Vec3, direction: Vec3, distance: f32) -> Ray {
        let origin = target - distance * self.size * direction.normalize();
        let length = 10f32.powf(self.numbers.between(-3.0, 3.0));
        Ray::new(origin, length * direction)
    }
}

/// Camera-like, grazing, through the inside, from inside and axis-aligned rays in equal parts, with directions of all
/// lengths.
pub fn mixed(surface: &DisplacedSurface, seed: u64) -> Vec<Ray> {
    let mut aim = Aim::new(surface, seed);
    let eye = aim.numbers.direction();
    (0..COUNT)
        .map(|k| {
            let (target, normal) = aim.point();
            let anywhere = aim.numbers.direction();
            match k % 5 {
                0 => {
                    let origin = target + 1.5 * aim.size * eye + 0.05 * aim.size * anywhere;
                    Ray::new(origin, target - origin)
                }
                1 => {
                    let tangent = anywhere - anywhere.dot(normal.as_vec3()) * normal.as_vec3();
                    let slope = aim.numbers.between(-0.1, 0.1);
                    let direction = tangent.normalize_or(Vec3::X) + slope * normal.as_vec3();
                    aim.through(target, direction, 1.0)
                }
                2 => {
                    let (other, _) = aim.point();
                    let direction = (other - target).normalize_or(anywhere);
                    aim.through(target, direction, 2.0)
                }
                3 => {
                    let (other, _) = aim.point();
                    aim.through(0.5 * (target + other), anywhere, 0.0)
                }
                _ => {
                    let axis = Vec3::AXES[aim.numbers.below(3)];
                    let sign = if aim.numbers.number() < 0.5 {
                        -1.0
                    } else {
                        1.0
                    };
                    aim.through(target, sign * axis, 1.3)
                }
            }
        })
        .collect()
}

/// Along the interpolated normals, from both sides.
pub fn along_normals(surface: &DisplacedSurface, seed: u64) -> Vec<Ray> {
    let mut aim = Aim::new(surface, seed);
    (0..COUNT)
        .map(|k| {
            let (u, v) = aim.numbers.barycentric();
            let triangle = aim.triangle();
            let patch = aim.surface.patch(triangle);
            let base = patch.base(u.into(), v.into()).as_vec3();
            let normal = patch.normal(u.into(), v.into()).as_vec3();
            let side = if k % 2 == 0 { -1.0 } else { 1.0 };
            aim.through(base, side * normal, 1.0)
        })
        .collect()
}

/// At points over vertices and edges of the base mesh, as exactly as single precision can.
pub fn through_edges(surface: &DisplacedSurface, seed: u64) -> Vec<Ray> {
    let mut aim = Aim::new(surface, seed);
    (0..COUNT)
        .map(|k| {
            let part = aim.numbers.number();
            let (u, v) = match k % 4 {
                0 => [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)][aim.numbers.below(3)],
                1 => (part, 0.0),
                2 => (0.0, part),
                _ => (part, 1.0 - part),
            };
            let (target, _) = aim.point_at(u, v);
            let direction = aim.numbers.direction();
            aim.through(target, direction, 1.0)
        })
        .collect()
}

/// Exactly parallel to the plane z = 0 and at heights in `range`, every other one along x or y.
pub fn in_plane(surface: &DisplacedSurface, range: [f32; 2], seed: u64) -> Vec<Ray> {
    let mut aim = Aim::new(surface, seed);
    (0..COUNT)
        .map(|k| {
            let (mut target, _) = aim.point();
            target.z = aim.numbers.between(range[0], range[1]);
            let mut direction = aim.numbers.direction();
            direction.z = 0.0;
            if k % 2 == 0 {
                direction = if k % 4 == 0 { Vec3::X } else { Vec3::NEG_Y };
            }
            aim.through(target, direction, 1.0)
        })
        .collect()
}
