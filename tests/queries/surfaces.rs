//! Surfaces of all kinds: wrap modes, spikes, floats, folded prisms, texture coordinates without area.

use std::sync::Arc;

use glam::Vec2;
use prismarch::surface::{DisplacedSurface, UvTransform, Wrap};

use super::maps;
use super::meshes::{bent, displaced, leaning, texture_degenerate, torus, with_uv};

pub fn surfaces() -> Vec<(&'static str, Arc<DisplacedSurface>)> {
    let uv = UvTransform {
        scale: Vec2::new(2.3, -1.7),
        rotation: 0.4,
        offset: Vec2::new(-3.1, 5.2),
    };
    let wrapped = |wrap| with_uv(bent(3), maps::white(9, 7, wrap), 0.2, 0.4, uv);
    vec![
        ("repeat", wrapped(Wrap::Repeat)),
        ("clamp", wrapped(Wrap::Clamp)),
        ("mirror", wrapped(Wrap::Mirror)),
        ("spikes", displaced(torus(6), maps::comb(20), 0.3, 0.0)),
        (
            "floats",
            displaced(torus(5), maps::white_float(12), -0.1, 1.0),
        ),
        (
            "folded",
            displaced(
                leaning(bent(3), -0.3, 3),
                maps::white(8, 8, Wrap::Repeat),
                1.5,
                0.5,
            ),
        ),
        (
            "degenerate st",
            displaced(
                texture_degenerate(&bent(3)),
                maps::waves(16, Wrap::Repeat),
                0.2,
                0.1,
            ),
        ),
    ]
}
