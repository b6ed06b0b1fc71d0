//! What an integrator hands to the film for one sample.

use glam::{Vec2, Vec3};

/// What one camera ray brought home.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraSample {
    /// Linear radiance; a NaN or infinite one is left out of its pixel.
    pub radiance: Vec3,
    /// The first thing that the ray met; `None` for nothing. What is not finite in it counts as 0.
    pub first: Option<FirstHit>,
    /// Steps of the march; 0 where none are counted.
    pub cost: u32,
}

/// The first thing that a camera ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// What the surface reflects of white light from all around, 0 .. 1; 1 for a mirror or glass.
    pub albedo: Vec3,
    /// Unit shading normal, in world space.
    pub normal: Vec3,
    /// On the displaced surface, in world space.
    pub position: Vec3,
    /// The mesh's texture coordinates.
    pub texcoord: Vec2,
    /// Signed displacement, in the object's units.
    pub displacement: f32,
    /// Index of the object.
    pub object: usize,
    /// Base triangle.
    pub prim: u32,
}

impl CameraSample {
    /// A sample of which only the radiance is known, and that met nothing.
    pub fn background(radiance: Vec3) -> Self {
        Self {
            radiance,
            first: None,
            cost: 0,
        }
    }
}
