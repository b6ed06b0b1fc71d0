//! `[camera]`.

use glam::{Vec2, Vec3};

use super::{Item, Keyed, SceneError, Section, keyed};
use crate::scene::Camera;
use crate::scene::camera::FIELD_OF_VIEW;

/// What places a camera: with any of these it is the scene's own.
const OWN: [&str; 6] = ["type", "position", "target", "up", "fov", "height"];

/// The camera as written; what is left out is framed around the scene, or a mesh file's.
#[derive(Debug)]
pub(in crate::scene) struct CameraTable {
    /// Which camera of the mesh files.
    pub from: Option<Keyed<CameraChoice>>,
    /// Whether the scene places it, by any key that does so.
    pub own: bool,
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

/// Names a camera of the mesh files.
#[derive(Clone, Debug)]
pub(in crate::scene) enum CameraChoice {
    Name(String),
    /// From 0, across the files.
    Number(usize),
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
            from: None,
            own: false,
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
            "from",
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
        let from = section.optional("from", choice)?;
        let own = OWN.into_iter().find(|key| section.has(key));
        if let (Some(from), Some(key)) = (&from, own) {
            let found = format!("a camera of a mesh file, beside {key}");
            let expected = format!("no camera.{key}; shift and the lens may be given");
            return Err(from.refuse(found, expected));
        }
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
                FIELD_OF_VIEW.contains(&x)
            })
        })?;
        let default = Self::default();
        Ok(Self {
            from,
            own: own.is_some(),
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

fn choice(item: Item) -> Result<Keyed<CameraChoice>, SceneError> {
    let choice = if item.is_integer() {
        CameraChoice::Number(item.integer(0..=u32::MAX)? as usize)
    } else {
        let expected = "the name of a camera of a mesh file, or its number from 0";
        CameraChoice::Name(item.text(expected)?.to_owned())
    };
    Ok(keyed(&item, choice))
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
