//! Materials of scene and mesh files: their textures loaded.

use std::path::Path;

use glam::Vec3;

use super::Builder;
use crate::image::{Channel, ColorSpace};
use crate::scene::error::{AssetError, SceneError};
use crate::scene::file::{
    ColorTable, DetailTable, MaterialTable, ScalarTable, ScalarTextureTable, TextureTable,
};
use crate::scene::load::{
    FileColor, FileDetail, FileMaterial, FileScalar, FileTexture, FileTextureUse,
};
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
        let loaded = self
            .assets
            .color(&table.file.value, table.color_space, Vec3::ONE);
        Ok(Texture {
            image: loaded.map_err(|e| table.file.asset(e))?,
            wrap: table.wrap,
            uv: table.uv,
            coordinates: table.coordinates,
        })
    }

    fn scalar_texture(&mut self, table: &ScalarTextureTable) -> Result<ScalarTexture, SceneError> {
        let loaded = self
            .assets
            .scalar(&table.file.value, &table.channel, table.wrap);
        Ok(ScalarTexture {
            image: loaded.map_err(|e| table.file.asset(e))?,
            uv: table.uv,
            factor: table.factor,
        })
    }

    /// Adds a material that the mesh file at `path` gives.
    pub(super) fn file_material(
        &mut self,
        path: &Path,
        file: FileMaterial,
    ) -> Result<usize, AssetError> {
        let mut color = |color: &FileColor| self.file_color(path, color);
        let (base_color, sheen_color, emission) = (
            color(&file.base_color)?,
            color(&file.sheen_color)?,
            color(&file.emission)?,
        );
        let mut scalar = |scalar: &FileScalar| self.file_scalar(path, scalar);
        let material = Material {
            name: file.name.clone(),
            base_color,
            sheen_color,
            emission,
            metallic: scalar(&file.metallic)?,
            roughness: scalar(&file.roughness)?,
            specular: scalar(&file.specular)?,
            transmission: scalar(&file.transmission)?,
            coat: scalar(&file.coat)?,
            coat_roughness: scalar(&file.coat_roughness)?,
            sheen_roughness: scalar(&file.sheen_roughness)?,
            opacity: scalar(&file.opacity)?,
            opacity_cutoff: file.opacity_cutoff,
            ior: file.ior,
            attenuation_color: file.attenuation_color,
            attenuation_distance: file.attenuation_distance,
            emission_strength: 1.0,
            priority: 0,
            detail: None,
        };
        let detail = match &file.detail {
            Some(FileDetail::NormalMap { texture, strength }) => Some(Detail::NormalMap {
                texture: self.file_texture(path, texture, ColorSpace::Linear, Vec3::ONE)?,
                strength: *strength,
            }),
            None => None,
        };
        self.materials.push(Material { detail, ..material });
        Ok(self.materials.len() - 1)
    }

    fn file_color(&mut self, path: &Path, color: &FileColor) -> Result<Color, AssetError> {
        match &color.texture {
            Some(texture) => self
                .file_texture(path, texture, ColorSpace::Srgb, color.factor)
                .map(Color::Texture),
            None => Ok(Color::Constant(color.factor)),
        }
    }

    fn file_texture(
        &mut self,
        path: &Path,
        texture: &FileTextureUse,
        space: ColorSpace,
        factor: Vec3,
    ) -> Result<Texture, AssetError> {
        Ok(Texture {
            image: match &texture.source {
                FileTexture::Path(picture) => self.assets.color(picture, space, factor)?,
                FileTexture::Embedded(bytes) => {
                    self.assets.embedded_color(path, bytes, space, factor)?
                }
            },
            wrap: texture.wrap,
            uv: texture.uv,
            coordinates: Coordinates::Uv,
        })
    }

    fn file_scalar(&mut self, path: &Path, scalar: &FileScalar) -> Result<Scalar, AssetError> {
        let Some((texture, channel)) = &scalar.texture else {
            return Ok(Scalar::Constant(scalar.factor));
        };
        let Ok(channel): Result<Channel, _> = channel.parse();
        Ok(Scalar::Texture(ScalarTexture {
            image: match &texture.source {
                FileTexture::Path(picture) => {
                    self.assets.scalar(picture, &channel, texture.wrap)?
                }
                FileTexture::Embedded(bytes) => {
                    let assets = &mut self.assets;
                    assets.embedded_scalar(path, bytes, &channel, texture.wrap)?
                }
            },
            uv: texture.uv,
            factor: scalar.factor,
        }))
    }
}
