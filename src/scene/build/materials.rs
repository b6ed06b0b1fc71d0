//! Materials of scene and mesh files: their textures loaded.
//!
//! A picture that the scene file names and that cannot be read is an error. One that a mesh file names, which someone else
//! wrote for another machine, is a warning: a checker stands for a colour, the factor alone for a number.

use std::fmt::Display;
use std::path::Path;

use glam::Vec3;

use super::Builder;
use super::assets::Picture;
use crate::image::{Channel, ColorSpace, ImageError};
use crate::scene::error::{AssetError, SceneError};
use crate::scene::file::{
    ColorTable, DetailTable, MaterialTable, ScalarTable, ScalarTextureTable, TextureTable,
};
use crate::scene::load::{FileColor, FileDetail, FileMaterial, FileScalar, FileTextureUse};
use crate::scene::{Color, Coordinates, Detail, Material, Scalar, ScalarTexture, Texture};

impl Builder {
    /// The material of a scene file's table.
    pub(super) fn material(&mut self, table: &MaterialTable) -> Result<Material, SceneError> {
        let default = &table.plain;
        let mut color = |table: &Option<ColorTable>, default: &Color| match table {
            Some(table) => self.color(table),
            None => Ok(default.clone()),
        };
        let base_color = color(&table.base_color, &default.base_color)?;
        let sheen_color = color(&table.sheen_color, &default.sheen_color)?;
        let emission = color(&table.emission, &default.emission)?;
        let mut scalar = |table: &Option<ScalarTable>, default: &Scalar| match table {
            Some(ScalarTable::Constant(x)) => Ok(Scalar::Constant(*x)),
            Some(ScalarTable::Texture(t)) => self.scalar_texture(t).map(Scalar::Texture),
            None => Ok(default.clone()),
        };
        let material = Material {
            name: table.name.value.clone(),
            base_color,
            sheen_color,
            emission,
            metallic: scalar(&table.metallic, &default.metallic)?,
            roughness: scalar(&table.roughness, &default.roughness)?,
            specular: scalar(&table.specular, &default.specular)?,
            transmission: scalar(&table.transmission, &default.transmission)?,
            coat: scalar(&table.coat, &default.coat)?,
            coat_roughness: scalar(&table.coat_roughness, &default.coat_roughness)?,
            sheen_roughness: scalar(&table.sheen_roughness, &default.sheen_roughness)?,
            opacity: scalar(&table.opacity, &default.opacity)?,
            ..default.clone()
        };
        let detail = match &table.detail {
            Some(DetailTable::NormalMap { texture, strength }) => Some(Detail::NormalMap {
                texture: self.texture(texture)?,
                strength: *strength,
            }),
            Some(DetailTable::Bump(heights)) => Some(Detail::Bump(self.scalar_texture(heights)?)),
            None => None,
        };
        Ok(Material { detail, ..material })
    }

    fn color(&mut self, table: &ColorTable) -> Result<Color, SceneError> {
        match table {
            ColorTable::Constant(c) => Ok(Color::Constant(*c)),
            ColorTable::Texture(t) => self.texture(t).map(Color::Texture),
        }
    }

    fn texture(&mut self, table: &TextureTable) -> Result<Texture, SceneError> {
        let loaded = self.assets.color(
            Picture::File(&table.file.value),
            table.color_space,
            Vec3::ONE,
        );
        Ok(Texture {
            image: loaded.map_err(|e| table.file.asset(e))?,
            wrap: table.wrap,
            uv: table.uv,
            coordinates: table.coordinates,
        })
    }

    fn scalar_texture(&mut self, table: &ScalarTextureTable) -> Result<ScalarTexture, SceneError> {
        let loaded =
            self.assets
                .scalar(Picture::File(&table.file.value), &table.channel, table.wrap);
        Ok(ScalarTexture {
            image: loaded.map_err(|e| table.file.asset(e))?,
            uv: table.uv,
            factor: table.factor,
        })
    }

    /// Adds a material that the mesh file at `path` gives.
    pub(super) fn file_material(&mut self, path: &Path, file: FileMaterial) -> usize {
        let mut of_file = OfFile {
            builder: self,
            path,
            material: &file.name,
        };
        let mut color = |key, color: &FileColor| of_file.color(key, color);
        let (base_color, sheen_color, emission) = (
            color("base_color", &file.base_color),
            color("sheen_color", &file.sheen_color),
            color("emission", &file.emission),
        );
        let mut scalar = |key, scalar: &FileScalar| of_file.scalar(key, scalar);
        let material = Material {
            name: file.name.clone(),
            base_color,
            sheen_color,
            emission,
            metallic: scalar("metallic", &file.metallic),
            roughness: scalar("roughness", &file.roughness),
            specular: scalar("specular", &file.specular),
            transmission: scalar("transmission", &file.transmission),
            coat: scalar("coat", &file.coat),
            coat_roughness: scalar("coat_roughness", &file.coat_roughness),
            sheen_roughness: scalar("sheen_roughness", &file.sheen_roughness),
            opacity: scalar("opacity", &file.opacity),
            opacity_cutoff: file.opacity_cutoff,
            ior: file.ior,
            attenuation_color: file.attenuation_color,
            attenuation_distance: file.attenuation_distance,
            emission_strength: 1.0,
            priority: 0,
            detail: None,
        };
        let detail = file
            .detail
            .as_ref()
            .and_then(|detail| of_file.detail(detail));
        self.materials.push(Material { detail, ..material });
        self.materials.len() - 1
    }
}

/// Reads the pictures of a mesh file's material.
struct OfFile<'a> {
    builder: &'a mut Builder,
    path: &'a Path,
    material: &'a str,
}

impl OfFile<'_> {
    fn color(&mut self, key: &str, color: &FileColor) -> Color {
        let Some(texture) = &color.texture else {
            return Color::Constant(color.factor);
        };
        let loaded = self.texture(texture, ColorSpace::Srgb, color.factor);
        Color::Texture(loaded.unwrap_or_else(|error| {
            self.warn(key, &error, "a checker of magenta and black is shown");
            Texture {
                image: self.builder.assets.stand_in(),
                wrap: texture.wrap,
                uv: texture.uv,
                coordinates: Coordinates::Uv,
            }
        }))
    }

    fn scalar(&mut self, key: &str, scalar: &FileScalar) -> Scalar {
        let Some((texture, channel)) = &scalar.texture else {
            return Scalar::Constant(scalar.factor);
        };
        let Ok(channel): Result<Channel, _> = channel.parse();
        let picture = Picture::of(self.path, &texture.source);
        let assets = &mut self.builder.assets;
        match assets.scalar(picture, &channel, texture.wrap) {
            Ok(image) => Scalar::Texture(ScalarTexture {
                image,
                uv: texture.uv,
                factor: scalar.factor,
            }),
            // The alpha of a picture that has none is 1.
            Err(error) if channel == Channel::A && is_missing_channel(&error) => {
                Scalar::Constant(scalar.factor)
            }
            Err(error) => {
                let factor = scalar.factor;
                self.warn(key, &error, format_args!("{factor} is taken"));
                Scalar::Constant(factor)
            }
        }
    }

    fn detail(&mut self, detail: &FileDetail) -> Option<Detail> {
        match detail {
            FileDetail::NormalMap { texture, strength } => {
                match self.texture(texture, ColorSpace::Linear, Vec3::ONE) {
                    Ok(texture) => Some(Detail::NormalMap {
                        texture,
                        strength: *strength,
                    }),
                    Err(error) => {
                        self.warn("normal_map", &error, "normals are left as they are");
                        None
                    }
                }
            }
            FileDetail::Bump(heights) => match self.scalar("bump", heights) {
                Scalar::Texture(heights) => Some(Detail::Bump(heights)),
                Scalar::Constant(_) => None,
            },
        }
    }

    fn texture(
        &mut self,
        texture: &FileTextureUse,
        space: ColorSpace,
        factor: Vec3,
    ) -> Result<Texture, AssetError> {
        let picture = Picture::of(self.path, &texture.source);
        Ok(Texture {
            image: self.builder.assets.color(picture, space, factor)?,
            wrap: texture.wrap,
            uv: texture.uv,
            coordinates: Coordinates::Uv,
        })
    }

    fn warn(&mut self, key: &str, error: &AssetError, instead: impl Display) {
        let material = self.material;
        let what = format!("material {material:?}: {key}: {error}; {instead}");
        self.builder.warn(self.path, what);
    }
}

fn is_missing_channel(error: &AssetError) -> bool {
    let (AssetError::Image(source) | AssetError::Embedded { source, .. }) = error else {
        return false;
    };
    matches!(source, ImageError::NoSuchChannel { .. })
}
