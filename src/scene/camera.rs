//! Where a picture is taken from, and how.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

/// The least field of view and the largest, degrees.
pub(super) const FIELD_OF_VIEW: std::ops::RangeInclusive<f32> = 0.01..=179.9;

/// A camera without a shutter: everything stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point.
    pub position: Vec3,
    /// Point looked at; differs from `position`.
    pub target: Vec3,
    /// Up direction, not parallel to the view.
    pub up: Vec3,
    /// Vertical field of view of a perspective, radians, in (0, pi).
    pub fov: f32,
    /// Width over height of what must be in the picture, above 0: a narrower film shows more above and below. Not of panoramas.
    pub aspect: Option<f32>,
    /// How directions lie on the film.
    pub projection: Projection,
    /// By which part of the picture's height the film is moved to the right and up; not of panoramas.
    pub shift: Vec2,
    /// Depth of field of a perspective; without it everything is sharp.
    pub lens: Option<Lens>,
    /// Whether the camera may be inside of a closed surface, as in a room.
    pub allow_inside: bool,
}

impl Default for Camera {
    /// From the origin along -Z, 40 degrees.
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            target: Vec3::NEG_Z,
            up: Vec3::Y,
            fov: 40f32.to_radians(),
            aspect: None,
            projection: Projection::Perspective,
            shift: Vec2::ZERO,
            lens: None,
            allow_inside: false,
        }
    }
}

impl Camera {
    /// Half the height of what a film of `width` x `height` square pixels shows: at distance 1, or of an orthographic picture. Not of panoramas.
    pub fn half_height(&self, width: u32, height: u32) -> f32 {
        let half = match self.projection {
            Projection::Orthographic { height } => 0.5 * height,
            _ => (0.5 * self.fov).tan(),
        };
        let film = width as f32 / height as f32;
        half * self.aspect.map_or(1.0, |aspect| (aspect / film).max(1.0))
    }

    /// The angle of a row of pixels of a film of `width` x `height`, radians, in the middle of the picture: the spread of the cone around a camera
    /// ray. 0 where all rays are parallel.
    pub fn pixel_spread(&self, width: u32, height: u32) -> f32 {
        let picture = match self.projection {
            Projection::Perspective => 2.0 * self.half_height(width, height),
            Projection::Orthographic { .. } => 0.0,
            Projection::Panorama => PI,
        };
        picture / height as f32
    }
}

/// How directions lie on the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Straight lines stay straight.
    Perspective,
    /// Parallel rays.
    Orthographic {
        /// World units from the picture's bottom to its top.
        height: f32,
    },
    /// All around, equirectangular: the view is in the middle.
    Panorama,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, world units, above 0.
    pub radius: f32,
    /// Distance along the view of the plane that is sharp, world units, above 0.
    pub focus: f32,
    /// Corners of the aperture; below 3 it is round.
    pub blades: u32,
    /// Of the first corner from the right, radians, counter-clockwise.
    pub rotation: f32,
}
