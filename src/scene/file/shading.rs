//! `[[material]]` and `[[light]]`.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{Item, Keyed, SceneError, Section, file_path, fraction, keyed, uv_transform, wrap};
use crate::image::ColorSpace;
use crate::surface::{UvTransform, Wrap};

/// A material as written.
#[derive(Debug)]
pub(in crate::scene) struct MaterialTable {
    pub name: Keyed<String>,
    pub base_color: BaseColorTable,
    pub metallic: f32,
    pub roughness: f32,
    pub specular: f32,
}

/// A colour as written.
#[derive(Debug)]
pub(in crate::scene) enum BaseColorTable {
    /// Linear RGB.
    Constant(Vec3),
    Texture(TextureTable),
}

/// A texture as written.
#[derive(Debug)]
pub(in crate::scene) struct TextureTable {
    pub file: Keyed<PathBuf>,
    pub color_space: ColorSpace,
    pub wrap: Wrap,
    pub uv: UvTransform,
}

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
}

impl MaterialTable {
    pub(super) fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let mut section =
            item.section(&["name", "base_color", "metallic", "roughness", "specular"])?;
        let name = section.require("name", "a name, in quotes")?;
        let mut number = |key, default| {
            Ok::<f32, SceneError>(section.optional(key, fraction)?.unwrap_or(default))
        };
        let (metallic, roughness, specular) = (
            number("metallic", 0.0)?,
            number("roughness", 1.0)?,
            number("specular", 0.5)?,
        );
        let base_color = section.optional("base_color", |i| base_color(i, folder))?;
        Ok(Self {
            name: keyed(&name, name.text("a name, in quotes")?.to_owned()),
            base_color: base_color.unwrap_or(BaseColorTable::Constant(Vec3::splat(0.5))),
            metallic,
            roughness,
            specular,
        })
    }
}

fn base_color(item: Item, folder: &Path) -> Result<BaseColorTable, SceneError> {
    if !item.is_table() {
        let expected = "[r, g, b] from 0 to 1, or a texture like { file = \"rock.png\" }";
        let unit = |c: Vec3| c.cmpge(Vec3::ZERO).all() && c.cmple(Vec3::ONE).all();
        return Ok(BaseColorTable::Constant(item.vec3(expected, unit)?));
    }
    let mut section = item.section(&["file", "color_space", "wrap", "uv"])?;
    let file = section.require("file", "the path of a picture")?;
    let spaces = [("srgb", ColorSpace::Srgb), ("linear", ColorSpace::Linear)];
    Ok(BaseColorTable::Texture(TextureTable {
        file: file_path(&file, folder)?,
        color_space: section
            .optional("color_space", |i| i.word(&spaces))?
            .unwrap_or(ColorSpace::Srgb),
        wrap: section.optional("wrap", wrap)?.unwrap_or_default(),
        uv: section.optional("uv", uv_transform)?.unwrap_or_default(),
    }))
}

/// What a `[[light]]` can be.
#[derive(Clone, Copy)]
enum LightKind {
    Sun,
    Sky,
    Environment,
}

impl LightTable {
    pub(super) fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let kinds = [
            ("sun", LightKind::Sun),
            ("sky", LightKind::Sky),
            ("environment", LightKind::Environment),
        ];
        let kind = item
            .peek("type", "\"sun\", \"sky\" or \"environment\"")?
            .word(&kinds)?;
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
    let strength = section.optional("strength", |i| {
        i.number("a factor of at least 0", |x| x >= 0.0)
    })?;
    Ok(strength.unwrap_or(1.0))
}
