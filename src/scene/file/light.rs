//! `[[light]]`.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{Item, Keyed, SceneError, Section, factor, file_path};
use crate::scene::Light;

/// A light as written.
#[derive(Debug)]
pub(in crate::scene) enum LightTable {
    Sun {
        direction: Vec3,
        strength: f32,
    },
    Sky {
        turbidity: f32,
        strength: f32,
    },
    Environment {
        file: Keyed<PathBuf>,
        /// Radians.
        rotation: f32,
        strength: f32,
    },
    /// One that needs nothing else.
    Ready(Light),
}

/// What a `[[light]]` can be.
#[derive(Clone, Copy)]
enum LightKind {
    Sun,
    Sky,
    Environment,
    Sphere,
    Disk,
    Rectangle,
    Point,
    Spot,
    Directional,
}

const KINDS: [(&str, LightKind); 9] = [
    ("sun", LightKind::Sun),
    ("sky", LightKind::Sky),
    ("environment", LightKind::Environment),
    ("sphere", LightKind::Sphere),
    ("disk", LightKind::Disk),
    ("rectangle", LightKind::Rectangle),
    ("point", LightKind::Point),
    ("spot", LightKind::Spot),
    ("directional", LightKind::Directional),
];

impl LightTable {
    pub(super) fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let kind = item
            .peek("type", "a type of light, like \"sun\"")?
            .word(&KINDS)?;
        match kind {
            LightKind::Sun => {
                let mut section = item.section(&["type", "elevation", "azimuth", "strength"])?;
                let elevation = section.optional("elevation", |i| degrees(i, 90.0))?;
                let azimuth = section.optional("azimuth", |i| degrees(i, 360.0))?;
                Ok(Self::Sun {
                    direction: sun_direction(
                        elevation.unwrap_or(SUN_ELEVATION),
                        azimuth.unwrap_or(SUN_AZIMUTH),
                    ),
                    strength: strength(&mut section)?,
                })
            }
            LightKind::Sky => {
                let mut section = item.section(&["type", "turbidity", "strength"])?;
                let turbidity = section.optional("turbidity", |i| {
                    i.number("a number from 2 (very clear) to 10 (hazy)", |x| {
                        (2.0..=10.0).contains(&x)
                    })
                })?;
                Ok(Self::Sky {
                    turbidity: turbidity.unwrap_or(SKY_TURBIDITY),
                    strength: strength(&mut section)?,
                })
            }
            LightKind::Environment => {
                let mut section = item.section(&["type", "file", "rotate", "strength"])?;
                let file = section.require("file", "the path of an EXR picture")?;
                let rotation = section.optional("rotate", |i| degrees(i, 360.0))?;
                Ok(Self::Environment {
                    file: file_path(&file, folder)?,
                    rotation: rotation.unwrap_or(0.0).to_radians(),
                    strength: strength(&mut section)?,
                })
            }
            LightKind::Sphere => {
                let mut section =
                    item.section(&["type", "position", "radius", "color", "strength"])?;
                Ok(Self::Ready(Light::Sphere {
                    center: point(&mut section, "position")?,
                    radius: radius(&mut section)?,
                    radiance: color(&mut section)?,
                }))
            }
            LightKind::Disk => {
                let mut section =
                    item.section(&["type", "position", "target", "radius", "color", "strength"])?;
                let center = point(&mut section, "position")?;
                Ok(Self::Ready(Light::Disk {
                    center,
                    normal: towards(&mut section, center)?,
                    radius: radius(&mut section)?,
                    radiance: color(&mut section)?,
                }))
            }
            LightKind::Rectangle => rectangle(item),
            LightKind::Point => {
                let mut section =
                    item.section(&["type", "position", "range", "color", "strength"])?;
                Ok(Self::Ready(Light::Point {
                    position: point(&mut section, "position")?,
                    intensity: color(&mut section)?,
                    range: range(&mut section)?,
                }))
            }
            LightKind::Spot => spot(item),
            LightKind::Directional => {
                let mut section = item.section(&["type", "direction", "color", "strength"])?;
                let from = section.require("direction", DIRECTION)?;
                let from = from.vec3(DIRECTION, |v| v.try_normalize().is_some())?;
                Ok(Self::Ready(Light::Directional {
                    direction: -from.normalize(),
                    irradiance: color(&mut section)?,
                }))
            }
        }
    }

    /// What a scene without lights is lit by: sun and sky.
    pub fn daylight() -> Vec<Self> {
        vec![
            Self::Sun {
                direction: default_sun(),
                strength: 1.0,
            },
            Self::Sky {
                turbidity: SKY_TURBIDITY,
                strength: 1.0,
            },
        ]
    }
}

const DIRECTION: &str = "the direction in which light goes, [x, y, z], not zero";

fn rectangle(item: Item) -> Result<LightTable, SceneError> {
    let mut section = item.section(&["type", "corner", "edges", "color", "strength"])?;
    let corner = point(&mut section, "corner")?;
    let expected = "two edges from the corner, [[x, y, z], [x, y, z]], that span an area";
    let edges = section.require("edges", expected)?;
    let refusal = edges.refuse(expected);
    let items = edges.items(expected)?;
    let read = items.iter().map(Item::point);
    let edges: Vec<Vec3> = read.collect::<Result<_, _>>()?;
    match edges[..] {
        [a, b] if a.cross(b).try_normalize().is_some() => Ok(LightTable::Ready(Light::Rectangle {
            corner,
            edges: [a, b],
            radiance: color(&mut section)?,
        })),
        _ => Err(refusal),
    }
}

fn spot(item: Item) -> Result<LightTable, SceneError> {
    let mut section = item.section(&[
        "type", "position", "target", "angle", "softness", "range", "color", "strength",
    ])?;
    let position = point(&mut section, "position")?;
    let angle = section.optional("angle", |i| {
        i.number("degrees across the cone, above 0 and below 360", |x| {
            (0.1..360.0).contains(&x)
        })
    })?;
    let softness = section.optional("softness", super::fraction)?;
    let outer = 0.5 * angle.unwrap_or(45.0).to_radians();
    let inner = outer * (1.0 - softness.unwrap_or(0.2));
    let [cos_outer, cos_inner] = Light::cone(outer, inner);
    Ok(LightTable::Ready(Light::Spot {
        position,
        direction: towards(&mut section, position)?,
        cos_outer,
        cos_inner,
        intensity: color(&mut section)?,
        range: range(&mut section)?,
    }))
}

fn point(section: &mut Section, key: &str) -> Result<Vec3, SceneError> {
    section.require(key, "a point, [x, y, z]")?.point()
}

/// The unit vector from `position` to the required `target`.
fn towards(section: &mut Section, position: Vec3) -> Result<Vec3, SceneError> {
    let expected = "a point other than the position, [x, y, z]";
    let target = section.require("target", expected)?;
    let towards = target.point()? - position;
    towards
        .try_normalize()
        .ok_or_else(|| target.refuse(expected))
}

fn radius(section: &mut Section) -> Result<f32, SceneError> {
    section
        .require("radius", "world units above 0")?
        .length(false)
}

/// Where the light has faded out; without one it goes on.
fn range(section: &mut Section) -> Result<f32, SceneError> {
    let range = section.optional("range", |i| i.length(false))?;
    Ok(range.unwrap_or(f32::INFINITY))
}

/// `color` times `strength`.
fn color(section: &mut Section) -> Result<Vec3, SceneError> {
    let color = section.optional("color", |i| {
        i.vec3("[r, g, b] of at least 0", |c| c.cmpge(Vec3::ZERO).all())
    })?;
    Ok(color.unwrap_or(Vec3::ONE) * strength(section)?)
}

const SUN_ELEVATION: f32 = 35.0;
const SUN_AZIMUTH: f32 = -30.0;
const SKY_TURBIDITY: f32 = 3.0;

/// Where the sun stands when nothing is said of it.
pub(in crate::scene) fn default_sun() -> Vec3 {
    sun_direction(SUN_ELEVATION, SUN_AZIMUTH)
}

/// The unit vector to a sun at `elevation` degrees above the horizon and `azimuth` degrees from +Z towards +X.
fn sun_direction(elevation: f32, azimuth: f32) -> Vec3 {
    let (up, level) = elevation.to_radians().sin_cos();
    let (x, z) = azimuth.to_radians().sin_cos();
    Vec3::new(level * x, up, level * z)
}

fn degrees(item: Item, limit: f32) -> Result<f32, SceneError> {
    item.number(&format!("degrees from -{limit} to {limit}"), |x| {
        x.abs() <= limit
    })
}

fn strength(section: &mut Section) -> Result<f32, SceneError> {
    Ok(section.optional("strength", factor)?.unwrap_or(1.0))
}
