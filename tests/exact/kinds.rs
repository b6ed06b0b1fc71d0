//! Surfaces of every kind, and rays at them.

use std::sync::Arc;

use glam::Vec2;
use prismarch::ray::{Aabb, Ray};
use prismarch::surface::{DisplacedSurface, UvTransform, Wrap};

use crate::common::numbers::Numbers;
use crate::{maps, meshes};

/// Rough, smooth and spiky, by every wrap mode and kind of texel, up and down, on flat, bent and leaning meshes.
pub fn surfaces() -> Vec<(&'static str, Arc<DisplacedSurface>)> {
    let repeated = |scale: f32| UvTransform {
        scale: Vec2::new(scale, 1.7 * scale),
        rotation: 0.4,
        offset: Vec2::new(0.3, -2.6),
    };
    let white = |wrap| maps::white(64, 64, wrap);
    vec![
        (
            "white noise, low",
            meshes::displaced(meshes::flat(2), white(Wrap::Repeat), 0.002, 0.5),
        ),
        (
            "white noise",
            meshes::displaced(meshes::flat(2), white(Wrap::Repeat), 0.2, 0.0),
        ),
        (
            "repeated",
            meshes::with_uv(
                meshes::bent(4),
                white(Wrap::Repeat),
                0.02,
                0.0,
                repeated(40.0),
            ),
        ),
        (
            "mirrored",
            meshes::with_uv(
                meshes::torus(12),
                white(Wrap::Mirror),
                -0.05,
                0.3,
                repeated(3.3),
            ),
        ),
        (
            "clamped",
            meshes::with_uv(
                meshes::bent(3),
                white(Wrap::Clamp),
                0.05,
                0.5,
                repeated(1.6),
            ),
        ),
        (
            "8 bits",
            meshes::displaced(meshes::torus(16), maps::white_8_bit(256), 0.02, 0.5),
        ),
        (
            "floats",
            meshes::displaced(meshes::torus(8), maps::white_float(64), -0.01, 0.2),
        ),
        (
            "spikes",
            meshes::displaced(meshes::flat(3), maps::comb(200), 0.3, 0.0),
        ),
        (
            "waves",
            meshes::displaced(meshes::bent(6), maps::waves(512, Wrap::Repeat), 0.1, 0.5),
        ),
        (
            "leaning",
            meshes::displaced(
                meshes::leaning(meshes::torus(16), 0.7, 5),
                maps::waves(64, Wrap::Repeat),
                0.2,
                0.5,
            ),
        ),
        (
            "a plane",
            meshes::displaced(meshes::flat(1), maps::constant(0.4), 0.1, 0.0),
        ),
        (
            "a ramp",
            meshes::displaced(meshes::flat(2), maps::ramp(64), 0.5, 0.0),
        ),
    ]
}

/// Half of them from afar, half from nearby, some with an interval.
pub fn ray(numbers: &mut Numbers, around: &Aabb) -> Ray {
    let (middle, size) = (0.5 * (around.min + around.max), around.diagonal());
    let away = size * 10f32.powf(numbers.between(-1.0, 1.0));
    let origin = middle + away * numbers.direction();
    let target = middle + 0.4 * size * numbers.direction() * numbers.number();
    let mut ray = Ray::new(origin, (target - origin) * numbers.between(0.1, 3.0));
    if numbers.number() < 0.2 {
        ray.tnear = numbers.number() * away / ray.direction.length();
        ray.tfar = ray.tnear + numbers.number() * size / ray.direction.length();
    }
    ray
}
