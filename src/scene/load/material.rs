//! What a mesh file says of a material, whatever its format.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;

use crate::surface::{UvTransform, Wrap};

/// What a mesh file says of a material, in the parameters of [`Material`](crate::scene::Material).
#[derive(Clone, Debug, PartialEq)]
pub struct FileMaterial {
    /// Its name, perhaps empty.
    pub name: String,
    /// Diffuse albedo or a metal's colour.
    pub base_color: FileColor,
    /// 0 dielectric .. 1 metal.
    pub metallic: FileScalar,
    /// 0 mirror .. 1.
    pub roughness: FileScalar,
    /// 0.5 is the reflectance that follows from `ior`.
    pub specular: FileScalar,
    /// Index of refraction, 1 .. 3.
    pub ior: f32,
    /// 0 opaque .. 1 glass.
    pub transmission: FileScalar,
    /// Colour after `attenuation_distance`.
    pub attenuation_color: Vec3,
    /// World units; may be infinite.
    pub attenuation_distance: f32,
    /// Clear coat.
    pub coat: FileScalar,
    /// Its roughness.
    pub coat_roughness: FileScalar,
    /// Sheen.
    pub sheen_color: FileColor,
    /// Its roughness.
    pub sheen_roughness: FileScalar,
    /// Radiance.
    pub emission: FileColor,
    /// 0 is a hole.
    pub opacity: FileScalar,
    /// If given, below it there is a hole and from it on there is none.
    pub opacity_cutoff: Option<f32>,
    /// A normal map or a bump map.
    pub detail: Option<FileDetail>,
    /// The displacement map, where the format knows one (MTL).
    pub displacement: Option<FileDisplacement>,
}

impl FileMaterial {
    /// For a surface that its displacement map displaces: the same picture must not shade as a bump map once more.
    #[must_use]
    pub fn displaced(mut self) -> Self {
        if let (Some(FileDetail::Bump(heights)), Some(map)) = (&self.detail, &self.displacement)
            && let Some((texture, _)) = &heights.texture
            && texture.source == FileTexture::Path(map.path.clone())
        {
            self.detail = None;
        }
        self
    }
}

impl Default for FileMaterial {
    /// Rough white.
    fn default() -> Self {
        let scalar = FileScalar::constant;
        Self {
            name: String::new(),
            base_color: FileColor::constant(Vec3::ONE),
            metallic: scalar(0.0),
            roughness: scalar(1.0),
            specular: scalar(0.5),
            ior: 1.5,
            transmission: scalar(0.0),
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            coat: scalar(0.0),
            coat_roughness: scalar(0.0),
            sheen_color: FileColor::constant(Vec3::ZERO),
            sheen_roughness: scalar(0.0),
            emission: FileColor::constant(Vec3::ZERO),
            opacity: scalar(1.0),
            opacity_cutoff: None,
            detail: None,
            displacement: None,
        }
    }
}

/// A colour: a factor, perhaps times an sRGB texture.
#[derive(Clone, Debug, PartialEq)]
pub struct FileColor {
    /// Linear RGB.
    pub factor: Vec3,
    /// Multiplied by it.
    pub texture: Option<FileTextureUse>,
}

impl FileColor {
    /// Without a texture.
    pub fn constant(factor: Vec3) -> Self {
        Self {
            factor,
            texture: None,
        }
    }
}

/// A number: a factor, perhaps times a channel of a linear texture.
#[derive(Clone, Debug, PartialEq)]
pub struct FileScalar {
    /// The number.
    pub factor: f32,
    /// Multiplied by it: the texture, and `r`, `g`, `b`, `a` or `luminance`.
    pub texture: Option<(FileTextureUse, &'static str)>,
}

impl FileScalar {
    /// Without a texture.
    pub fn constant(factor: f32) -> Self {
        Self {
            factor,
            texture: None,
        }
    }
}

/// A texture and how it is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct FileTextureUse {
    /// The picture.
    pub source: FileTexture,
    /// Outside [0, 1], along u and v.
    pub wrap: [Wrap; 2],
    /// Of texture coordinates with v up.
    pub uv: UvTransform,
    /// What names it, for messages: `map_Kd of material "rock" in rock.mtl`.
    pub from: String,
}

/// A texture by path or by value.
#[derive(Clone, Debug, PartialEq)]
pub enum FileTexture {
    /// A picture file; not checked to exist.
    Path(PathBuf),
    /// A picture that the mesh file holds.
    Embedded {
        /// What messages call it, different from the file's others.
        name: String,
        /// The bytes of a picture file.
        bytes: Arc<[u8]>,
    },
}

/// Detail finer than the mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum FileDetail {
    /// Normals in tangent space.
    NormalMap {
        /// Linear.
        texture: FileTextureUse,
        /// Multiplies red and green.
        strength: f32,
    },
    /// Heights, in world units; they have a texture.
    Bump(FileScalar),
}

/// A displacement map that a mesh file names.
#[derive(Clone, Debug, PartialEq)]
pub struct FileDisplacement {
    /// The picture file; not checked to exist.
    pub path: PathBuf,
    /// World units per unit of height, if the file says.
    pub scale: Option<f32>,
    /// The height that displaces by nothing, if the file says.
    pub midlevel: Option<f32>,
    /// Applied to the texture coordinates.
    pub uv: UvTransform,
    /// If the file says.
    pub wrap: Option<Wrap>,
    /// `r`, `g`, `b`, `a` or `luminance`, if the file says.
    pub channel: Option<&'static str>,
    /// What names it, for messages: `disp of material "rock" in rock.mtl`.
    pub from: String,
}
