//! `[camera]`.

use glam::Vec3;

use super::{Item, Keyed, SceneError, keyed};

/// The camera as written; what is left out is framed around the scene.
#[derive(Debug)]
pub(in crate::scene) struct CameraTable {
    pub position: Option<Keyed<Vec3>>,
    pub target: Option<Keyed<Vec3>>,
    pub up: Option<Keyed<Vec3>>,
    /// Radians.
    pub fov: f32,
}

impl Default for CameraTable {
    fn default() -> Self {
        Self {
            position: None,
            target: None,
            up: None,
            fov: 40f32.to_radians(),
        }
    }
}

impl CameraTable {
    pub(super) fn read(item: Item) -> Result<Self, SceneError> {
        let mut section = item.section(&["position", "target", "up", "fov"])?;
        let point = "a point, [x, y, z]";
        let position = section.optional("position", |i| Ok(keyed(&i, i.vec3(point, |_| true)?)))?;
        let target = section.optional("target", |i| Ok(keyed(&i, i.vec3(point, |_| true)?)))?;
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
        Ok(Self {
            position,
            target,
            up,
            fov: fov.map_or(Self::default().fov, f32::to_radians),
        })
    }
}
