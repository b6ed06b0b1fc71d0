//! `[[material]]`.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{Item, Keyed, SceneError, Section, channel, file_path, keyed, uv_transform, wraps};
use crate::image::{Channel, ColorSpace};
use crate::scene::{Coordinates, Material};
use crate::surface::{UvTransform, Wrap};

/// A material as written.
#[derive(Debug)]
pub(in crate::scene) struct MaterialTable {
    pub name: Keyed<String>,
    pub base_color: Option<ColorTable>,
    pub metallic: Option<ScalarTable>,
    pub roughness: Option<ScalarTable>,
    pub specular: Option<ScalarTable>,
    pub transmission: Option<ScalarTable>,
    pub coat: Option<ScalarTable>,
    pub coat_roughness: Option<ScalarTable>,
    pub sheen_color: Option<ColorTable>,
    pub sheen_roughness: Option<ScalarTable>,
    pub emission: Option<ColorTable>,
    pub opacity: Option<ScalarTable>,
    pub detail: Option<DetailTable>,
    /// The rest, constants all of them.
    pub plain: Material,
}

/// A colour as written.
#[derive(Debug)]
pub(in crate::scene) enum ColorTable {
    /// Linear RGB.
    Constant(Vec3),
    Texture(TextureTable),
}

/// A texture as written.
#[derive(Debug)]
pub(in crate::scene) struct TextureTable {
    pub file: Keyed<PathBuf>,
    pub color_space: ColorSpace,
    pub wrap: [Wrap; 2],
    pub uv: UvTransform,
    pub coordinates: Coordinates,
}

/// A number as written.
#[derive(Debug)]
pub(in crate::scene) enum ScalarTable {
    Constant(f32),
    Texture(ScalarTextureTable),
}

/// One channel of a picture as written.
#[derive(Debug)]
pub(in crate::scene) struct ScalarTextureTable {
    pub file: Keyed<PathBuf>,
    pub channel: Channel,
    pub wrap: [Wrap; 2],
    pub uv: UvTransform,
    pub factor: f32,
}

/// A normal or bump map as written.
#[derive(Debug)]
pub(in crate::scene) enum DetailTable {
    NormalMap {
        texture: TextureTable,
        strength: f32,
    },
    Bump(ScalarTextureTable),
}

impl MaterialTable {
    pub(super) fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let mut section = item.section(&[
            "name",
            "base_color",
            "metallic",
            "roughness",
            "specular",
            "ior",
            "transmission",
            "attenuation_color",
            "attenuation_distance",
            "priority",
            "coat",
            "coat_roughness",
            "sheen_color",
            "sheen_roughness",
            "emission",
            "emission_strength",
            "opacity",
            "opacity_cutoff",
            "normal_map",
            "bump",
        ])?;
        let name = section.require("name", "a name, in quotes")?;
        let mut number = |key| section.optional(key, |i| scalar(i, folder));
        let [metallic, roughness, specular, transmission] = [
            number("metallic")?,
            number("roughness")?,
            number("specular")?,
            number("transmission")?,
        ];
        let [coat, coat_roughness, sheen_roughness, opacity] = [
            number("coat")?,
            number("coat_roughness")?,
            number("sheen_roughness")?,
            number("opacity")?,
        ];
        Ok(Self {
            name: keyed(&name, name.text("a name, in quotes")?.to_owned()),
            base_color: section.optional("base_color", |i| color(i, folder, Range::Unit))?,
            metallic,
            roughness,
            specular,
            transmission,
            coat,
            coat_roughness,
            sheen_color: section.optional("sheen_color", |i| color(i, folder, Range::Unit))?,
            sheen_roughness,
            emission: section.optional("emission", |i| color(i, folder, Range::Light))?,
            opacity,
            detail: detail(&mut section, folder)?,
            plain: plain(&mut section)?,
        })
    }
}

/// What has no texture: it belongs to the body, not to a place on its surface.
fn plain(section: &mut Section) -> Result<Material, SceneError> {
    let default = Material::default();
    let ior = section.optional("ior", |i| {
        i.number("an index of refraction from 1 to 3", |x| {
            (1.0..=3.0).contains(&x)
        })
    })?;
    let attenuation_color = section.optional("attenuation_color", |i| i.vec3(UNIT, unit))?;
    let attenuation_distance = section.optional("attenuation_distance", |i| {
        i.number("world units above 0", |x| x > 0.0)
    })?;
    let priority = section.optional("priority", |i| i.integer(0..=255))?;
    let emission_strength = section.optional("emission_strength", super::factor)?;
    let opacity_cutoff = section.optional("opacity_cutoff", |i| {
        i.number("an opacity from 0 to 1", |x| (0.0..=1.0).contains(&x))
    })?;
    Ok(Material {
        opacity_cutoff,
        ior: ior.unwrap_or(default.ior),
        attenuation_color: attenuation_color.unwrap_or(default.attenuation_color),
        attenuation_distance: attenuation_distance.unwrap_or(if attenuation_color.is_some() {
            1.0
        } else {
            default.attenuation_distance
        }),
        priority: priority.map_or(default.priority, |p| p as i32),
        emission_strength: emission_strength.unwrap_or(default.emission_strength),
        ..default
    })
}

/// What a colour's components may be.
#[derive(Clone, Copy)]
enum Range {
    /// 0 .. 1.
    Unit,
    /// Anything from 0.
    Light,
}

const UNIT: &str = "[r, g, b] from 0 to 1";

fn unit(c: Vec3) -> bool {
    c.cmpge(Vec3::ZERO).all() && c.cmple(Vec3::ONE).all()
}

fn color(item: Item, folder: &Path, range: Range) -> Result<ColorTable, SceneError> {
    if !item.is_table() {
        let (what, fits): (_, fn(Vec3) -> bool) = match range {
            Range::Unit => (UNIT, unit),
            Range::Light => ("[r, g, b] of at least 0", |c| c.cmpge(Vec3::ZERO).all()),
        };
        let expected = format!("{what}, or a texture like {{ file = \"rock.png\" }}");
        return Ok(ColorTable::Constant(item.vec3(&expected, fits)?));
    }
    let section = item.section(&["file", "color_space", "wrap", "uv", "projection", "size"])?;
    Ok(ColorTable::Texture(texture(section, folder)?))
}

fn texture(mut section: Section, folder: &Path) -> Result<TextureTable, SceneError> {
    let file = section.require("file", "the path of a picture")?;
    let spaces = [("srgb", ColorSpace::Srgb), ("linear", ColorSpace::Linear)];
    Ok(TextureTable {
        file: file_path(&file, folder)?,
        color_space: section
            .optional("color_space", |i| i.word(&spaces))?
            .unwrap_or(ColorSpace::Srgb),
        wrap: section.optional("wrap", wraps)?.unwrap_or_default(),
        uv: section.optional("uv", uv_transform)?.unwrap_or_default(),
        coordinates: coordinates(&mut section)?,
    })
}

fn coordinates(section: &mut Section) -> Result<Coordinates, SceneError> {
    let words = [("uv", false), ("triplanar", true)];
    let triplanar = section.optional("projection", |i| i.word(&words))?;
    let size = section.get("size");
    match (triplanar, size) {
        (Some(true), size) => {
            let read = |i: Item| i.number("world units above 0", |x| x > 0.0);
            Ok(Coordinates::Triplanar {
                size: size.map(read).transpose()?.unwrap_or(1.0),
            })
        }
        (_, Some(size)) => Err(size.error(
            "size without projection = \"triplanar\"",
            "uv = { scale = ... }",
        )),
        (_, None) => Ok(Coordinates::Uv),
    }
}

fn scalar(item: Item, folder: &Path) -> Result<ScalarTable, SceneError> {
    if !item.is_table() {
        let expected =
            "a number from 0 to 1, or a texture like { file = \"rough.png\", channel = \"r\" }";
        let number = item.number(expected, |x| (0.0..=1.0).contains(&x))?;
        return Ok(ScalarTable::Constant(number));
    }
    let mut section = item.section(&["file", "channel", "wrap", "uv", "factor"])?;
    let factor = section.optional("factor", super::factor)?.unwrap_or(1.0);
    Ok(ScalarTable::Texture(scalar_texture(
        section, folder, factor,
    )?))
}

fn scalar_texture(
    mut section: Section,
    folder: &Path,
    factor: f32,
) -> Result<ScalarTextureTable, SceneError> {
    let file = section.require("file", "the path of a picture")?;
    Ok(ScalarTextureTable {
        file: file_path(&file, folder)?,
        channel: section.optional("channel", channel)?.unwrap_or_default(),
        wrap: section.optional("wrap", wraps)?.unwrap_or_default(),
        uv: section.optional("uv", uv_transform)?.unwrap_or_default(),
        factor,
    })
}

fn detail(section: &mut Section, folder: &Path) -> Result<Option<DetailTable>, SceneError> {
    let bump = section.get("bump");
    if let Some(item) = section.get("normal_map") {
        if let Some(bump) = bump {
            return Err(bump.error("bump beside normal_map", "only one of them"));
        }
        let mut section = item.section(&["file", "wrap", "uv", "strength"])?;
        let strength = section.optional("strength", super::factor)?.unwrap_or(1.0);
        let texture = TextureTable {
            color_space: ColorSpace::Linear,
            ..texture(section, folder)?
        };
        return Ok(Some(DetailTable::NormalMap { texture, strength }));
    }
    let Some(item) = bump else { return Ok(None) };
    let mut section = item.section(&["file", "channel", "wrap", "uv", "scale"])?;
    let scale = section.require("scale", "world units from height 0 to height 1")?;
    let scale = scale.number("world units from height 0 to height 1", |_| true)?;
    let heights = scalar_texture(section, folder, scale)?;
    Ok(Some(DetailTable::Bump(heights)))
}
