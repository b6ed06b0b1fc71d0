//! `[camera]`.

use glam::{Vec2, Vec3};

use super::{Item, Keyed, SceneError, Section, keyed};
use crate::scene::Camera;

/// The camera as written; what is left out is framed around the scene.
#[derive(Debug)]
pub(in crate::scene) struct CameraTable {
    pub position: Option<Keyed<Vec3>>,
    pub target: Option<Keyed<Vec3>>,
    pub up: Option<Keyed<Vec3>>,
    /// Radians.
    pub fov: f32,
    pub projection: ProjectionTable,
    pub shift: Vec2,
    pub lens: Option<LensTable>,
    pub allow_inside: bool,
}

/// A projection as written.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) enum ProjectionTable {
    Perspective,
    Orthographic { height: Option<f32> },
    Panorama,
}

/// A lens as written.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct LensTable {
    /// Diameter, world units.
    pub aperture: f32,
    /// Default: the distance to the target.
    pub focus_distance: Option<f32>,
    pub blades: u32,
    /// Radians.
    pub blade_rotation: f32,
}

impl Default for CameraTable {
    fn default() -> Self {
        let Camera {
            fov,
            shift,
            allow_inside,
            ..
        } = Camera::default();
        Self {
            position: None,
            target: None,
            up: None,
            fov,
            projection: ProjectionTable::Perspective,
            shift,
            lens: None,
            allow_inside,
        }
    }
}

impl CameraTable {
    pub(super) fn read(item: Item) -> Result<Self, SceneError> {
        let mut section = item.section(&[
            "type",
            "position",
            "target",
            "up",
            "fov",
            "height",
            "shift",
            "aperture",
            "focus_distance",
            "blades",
            "blade_rotation",
            "allow_inside",
        ])?;
        let position = section.optional("position", |i| Ok(keyed(&i, i.point()?)))?;
        let target = section.optional("target", |i| Ok(keyed(&i, i.point()?)))?;
        let up = section.optional("up", |i| {
            let up = i.vec3("a direction, [x, y, z], not zero", |v| {
                v.try_normalize().is_some()
            })?;
            Ok(keyed(&i, up))
        })?;
        let fov = section.optional("fov", |i| {
            i.number("degrees above 0 and below 180", |x| {
                (0.01..=179.9).contains(&x)
            })
        })?;
        let default = Self::default();
        Ok(Self {
            position,
            target,
            up,
            fov: fov.map_or(default.fov, f32::to_radians),
            projection: projection(&mut section)?,
            shift: section
                .optional("shift", |i| i.vec2("[right, up], in picture heights"))?
                .unwrap_or(default.shift),
            lens: lens(&mut section)?,
            allow_inside: section
                .optional("allow_inside", |i| i.boolean())?
                .unwrap_or(default.allow_inside),
        })
    }
}

fn projection(section: &mut Section) -> Result<ProjectionTable, SceneError> {
    let words = [
        ("perspective", ProjectionTable::Perspective),
        (
            "orthographic",
            ProjectionTable::Orthographic { height: None },
        ),
        ("panorama", ProjectionTable::Panorama),
    ];
    let found = section.optional("type", |i| i.word(&words))?;
    let found = found.unwrap_or(ProjectionTable::Perspective);
    let Some(item) = section.get("height") else {
        return Ok(found);
    };
    let height = item.length(false)?;
    match found {
        ProjectionTable::Orthographic { .. } => Ok(ProjectionTable::Orthographic {
            height: Some(height),
        }),
        _ => Err(item.error(
            "a height without parallel rays",
            "type = \"orthographic\"; else use fov",
        )),
    }
}

fn lens(section: &mut Section) -> Result<Option<LensTable>, SceneError> {
    let aperture = section.optional("aperture", |i| i.length(true))?;
    let focus_distance = section.optional("focus_distance", |i| i.length(false))?;
    let blades = section.optional("blades", |i| {
        let blades = i.integer(0..=64)?;
        let some = blades == 0 || blades >= 3;
        some.then_some(blades)
            .ok_or_else(|| i.refuse("0 for a round aperture, or a whole number from 3 to 64"))
    })?;
    let rotation = section.optional("blade_rotation", |i| i.number("degrees", |_| true))?;
    Ok(aperture.filter(|&a| a > 0.0).map(|aperture| LensTable {
        aperture,
        focus_distance,
        blades: blades.unwrap_or(0),
        blade_rotation: rotation.unwrap_or(0.0).to_radians(),
    }))
}
