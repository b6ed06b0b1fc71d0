//! The displaced surface S(b) itself, and what a shader wants to know of a point on it.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use thiserror::Error;

use super::{BaseMesh, DisplacementMap, UvTransform};

/// How a map's heights become displacement: D = scale * (h - midlevel).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// World units per unit of height; finite, not zero.
    pub scale: f32,
    /// The height that displaces by nothing; finite.
    pub midlevel: f32,
    /// Applied to the mesh's texture coordinates.
    pub uv: UvTransform,
}

/// Why a surface was refused.
#[derive(Debug, Error, PartialEq)]
pub enum SurfaceError {
    /// The mesh has no texture coordinates.
    #[error("the mesh has no texture coordinates; unwrap it (any UV tool) before displacing it")]
    MissingTexcoords,
    /// NaN, infinite or zero where a number is needed.
    #[error("displacement {what} is {value}; expected a finite number{extra}")]
    BadParameter {
        /// Which parameter.
        what: &'static str,
        /// What was found.
        value: f32,
        /// More of what is expected.
        extra: &'static str,
    },
}

/// A base mesh displaced by a map.
#[derive(Clone, Debug)]
pub struct DisplacedSurface {
    /// The base mesh.
    pub mesh: Arc<BaseMesh>,
    /// The heights.
    pub map: Arc<DisplacementMap>,
    /// What heights mean.
    pub displacement: Displacement,
}

/// All a shader wants to know of a hit, in the surface's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// S(b), or P(b) for an undisplaced mesh.
    pub position: Vec3,
    /// P(b).
    pub base_position: Vec3,
    /// Unit geometric normal of S (true tangent plane), on the base mesh's outer side.
    pub geometric_normal: Vec3,
    /// Unit smooth normal: Ns' = Ns - Ng + N' (the paper, equations 18 and 26).
    pub shading_normal: Vec3,
    /// Texture coordinates of the mesh (before any UV transform).
    pub texcoord: Vec2,
    /// D, world units along the unit interpolated normal.
    pub displacement: f32,
}
