//! The three kinds of rays that are timed.

use std::f32::consts::TAU;

use glam::Vec3;
use prismarch::ray::{Ray, RayPacket};
use prismarch::trace::Tracer;

use super::scene::random;

/// Secondary rays start this far above the surface, about half a texel: so that they leave the surface of every
/// contestant, tessellations included.
const LIFT: f32 = 5e-4;

/// Primary rays with the hits' secondary rays; all unit directions.
pub struct Rays {
    /// `size` x `size` in tiles of 4 x 2, these in blocks of 8 x 8, row by row: a pinhole camera that the displaced unit sphere
    /// fills.
    pub primary: Vec<Ray>,
    /// From every primary hit in a cosine-distributed direction around the geometric normal.
    pub bounce: Vec<Ray>,
    /// As `bounce`, in other directions; traced as occlusion rays.
    pub occlusion: Vec<Ray>,
}

impl Rays {
    /// The angle of one of `size` x `size` pixels.
    pub fn pixel_spread(size: u32) -> f32 {
        2.0 * HALF_WIDTH / size as f32
    }

    /// The rays for `size` x `size` pixels; `tracer` finds where secondary rays start.
    ///
    /// # Panics
    ///
    /// When `size` is not a multiple of 8.
    pub fn new(size: u32, tracer: &dyn Tracer) -> Self {
        let primary = primary(size);
        let mut bounce = Vec::new();
        let mut occlusion = Vec::new();
        for (index, ray) in (0u32..).zip(&primary) {
            let Some(hit) = tracer.intersect(ray) else {
                continue;
            };
            let facing = if hit.ng.dot(ray.direction) < 0.0 {
                hit.ng
            } else {
                -hit.ng
            };
            let from_here = |salt: u32| {
                let start = ray.at(hit.t) + LIFT * facing;
                Ray::new(start, cosine(facing, 4 * index + salt))
            };
            bounce.push(from_here(0));
            occlusion.push(from_here(2));
        }
        Self {
            primary,
            bounce,
            occlusion,
        }
    }
}

/// Of the film, at distance 1.
const HALF_WIDTH: f32 = 0.401;

fn primary(size: u32) -> Vec<Ray> {
    const EYE: Vec3 = Vec3::new(0.3, -2.9, 0.8);
    let forward = -EYE.normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let up = right.cross(forward);
    let on_film = |i: u32| ((i as f32 + 0.5) / size as f32 * 2.0 - 1.0) * HALF_WIDTH;
    assert!(
        size.is_multiple_of(8),
        "{size} pixels are no blocks of 8 x 8"
    );
    let pixel = |i: u32| {
        let (block, tile, lane) = (i / 64, i / 8 % 8, i % 8);
        let (x, y) = (block % (size / 8), block / (size / 8));
        (
            8 * x + 4 * (tile % 2) + lane % 4,
            8 * y + 2 * (tile / 2) + lane / 4,
        )
    };
    (0..size * size)
        .map(|i| {
            let (x, y) = pixel(i);
            let direction = forward + on_film(x) * right - on_film(y) * up;
            Ray::new(EYE, direction.normalize())
        })
        .collect()
}

/// The same rays as packets of eight neighbours; the last packet of a kind may have empty lanes.
pub struct Packets {
    /// The tiles.
    pub primary: Vec<RayPacket>,
    /// From eight primary hits in the order of their rays.
    pub bounce: Vec<RayPacket>,
    /// As `bounce`.
    pub occlusion: Vec<RayPacket>,
}

impl Packets {
    /// All rays, in their order.
    pub fn new(rays: &Rays) -> Self {
        let packets = |rays: &[Ray]| {
            let eights = rays.chunks(RayPacket::LANES);
            eights.map(RayPacket::from_rays).collect()
        };
        Self {
            primary: packets(&rays.primary),
            bounce: packets(&rays.bounce),
            occlusion: packets(&rays.occlusion),
        }
    }
}

/// A cosine-distributed unit direction around the unit vector `normal`: a point on the unit sphere
/// around its tip.
fn cosine(normal: Vec3, seed: u32) -> Vec3 {
    let z = 2.0 * random(seed) - 1.0;
    let (sin, cos) = (TAU * random(seed + 1)).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    (normal + 0.999 * Vec3::new(r * cos, r * sin, z)).normalize()
}
