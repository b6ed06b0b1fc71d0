//! Materials: a subset of the principled material, each parameter a value or a texture.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::image::{ColorImage, ScalarImage};
use crate::surface::{SurfacePoint, UvTransform, Wrap};

/// A colour texture, linear RGB in memory.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The picture.
    pub image: Arc<ColorImage>,
    /// Outside [0, 1], across and up.
    pub wrap: [Wrap; 2],
    /// Applied to the mesh's texture coordinates.
    pub uv: UvTransform,
    /// How the picture is laid on the surface.
    pub coordinates: Coordinates,
}

/// How a picture is laid on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Coordinates {
    /// By the mesh's texture coordinates.
    #[default]
    Uv,
    /// From three sides, by the undisplaced position and normal in world space: the weights are the squares of the
    /// normal's components. A picture is `size` world units wide and high.
    Triplanar {
        /// World units.
        size: f32,
    },
}

impl Texture {
    /// Linear RGB on the surface at `point`.
    pub fn sample(&self, point: &SurfacePoint) -> Vec3 {
        let read = |st: Vec2| self.image.sample(self.uv.apply(st), self.wrap);
        match self.coordinates {
            Coordinates::Uv => read(point.texcoord),
            Coordinates::Triplanar { size } => {
                let p = point.base_position / size;
                let weights = point.base_normal * point.base_normal;
                let sides = [
                    Vec2::new(p.z, p.y),
                    Vec2::new(p.x, p.z),
                    Vec2::new(p.x, p.y),
                ];
                let blend = |sum: Vec3, (side, weight): (Vec2, f32)| match weight {
                    0.0 => sum,
                    weight => sum + weight * read(side),
                };
                sides
                    .into_iter()
                    .zip(weights.to_array())
                    .fold(Vec3::ZERO, blend)
            }
        }
    }
}

/// A colour, constant or textured.
#[derive(Clone, Debug)]
pub enum Color {
    /// Linear RGB.
    Constant(Vec3),
    /// From a picture.
    Texture(Texture),
}

impl Color {
    /// Linear RGB on the surface at `point`.
    pub fn at(&self, point: &SurfacePoint) -> Vec3 {
        match self {
            Self::Constant(rgb) => *rgb,
            Self::Texture(texture) => texture.sample(point),
        }
    }

    /// Whether it is nothing but black.
    pub fn is_black(&self) -> bool {
        matches!(self, Self::Constant(Vec3::ZERO))
    }
}

/// A number over a surface.
#[derive(Clone, Debug)]
pub enum Scalar {
    /// The same everywhere.
    Constant(f32),
    /// From one channel of a picture.
    Texture(ScalarTexture),
}

/// One channel of a picture, linear: 0 .. 1 for integer pictures, as stored for float ones.
#[derive(Clone, Debug)]
pub struct ScalarTexture {
    /// The channel, with its wrap modes.
    pub image: Arc<ScalarImage>,
    /// Applied to the mesh's texture coordinates.
    pub uv: UvTransform,
    /// Multiplies.
    pub factor: f32,
}

impl Scalar {
    /// The number on the surface at `point`.
    pub fn at(&self, point: &SurfacePoint) -> f32 {
        match self {
            Self::Constant(x) => *x,
            Self::Texture(t) => t.factor * t.image.sample(t.uv.apply(point.texcoord)),
        }
    }

    /// Whether it is `x` everywhere.
    pub fn is(&self, x: f32) -> bool {
        matches!(self, Self::Constant(y) if *y == x)
    }
}

/// Detail finer than the displacement: it turns the shading normal and moves nothing.
#[derive(Clone, Debug)]
pub enum Detail {
    /// Normals in tangent space, red along u, green along v (OpenGL's convention, as glTF has it), linear.
    NormalMap {
        /// The picture, read linearly.
        texture: Texture,
        /// Multiplies red and green.
        strength: f32,
    },
    /// Heights; `factor` of the texture is world units from 0 to 1.
    Bump(ScalarTexture),
}

/// A subset of the principled material. Numbers without a unit are clamped to 0 .. 1 where they come from textures.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Diffuse albedo, the reflectance at normal incidence of a metal, or the colour of glass seen through a body.
    pub base_color: Color,
    /// 0 dielectric .. 1 metal.
    pub metallic: Scalar,
    /// 0 mirror .. 1; alpha = roughness^2.
    pub roughness: Scalar,
    /// Multiplies the reflectance of the opaque dielectric at normal incidence by twice this.
    pub specular: Scalar,
    /// Index of refraction of the dielectric, 1 .. 3.
    pub ior: f32,
    /// 0 opaque .. 1 glass.
    pub transmission: Scalar,
    /// What is left of light after `attenuation_distance` inside the body (Beer and Lambert).
    pub attenuation_color: Vec3,
    /// World units; infinite for clear bodies.
    pub attenuation_distance: f32,
    /// Where bodies overlap, the one of the highest priority fills the space.
    pub priority: i32,
    /// Weight of a clear coat of index 1.5.
    pub coat: Scalar,
    /// Roughness of the coat.
    pub coat_roughness: Scalar,
    /// Colour of the sheen; black is none.
    pub sheen_color: Color,
    /// Roughness of the sheen.
    pub sheen_roughness: Scalar,
    /// Radiance from both sides, linear RGB.
    pub emission: Color,
    /// Multiplies the emission.
    pub emission_strength: f32,
    /// 0 is a hole.
    pub opacity: Scalar,
    /// Where it is given, an opacity from it on counts as 1, and one below as 0.
    pub opacity_cutoff: Option<f32>,
    /// Normal or bump map.
    pub detail: Option<Detail>,
}

impl Default for Material {
    /// Rough grey without a name.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Color::Constant(Vec3::splat(0.5)),
            metallic: Scalar::Constant(0.0),
            roughness: Scalar::Constant(1.0),
            specular: Scalar::Constant(0.5),
            ior: 1.5,
            transmission: Scalar::Constant(0.0),
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            priority: 0,
            coat: Scalar::Constant(0.0),
            coat_roughness: Scalar::Constant(0.0),
            sheen_color: Color::Constant(Vec3::ZERO),
            sheen_roughness: Scalar::Constant(0.5),
            emission: Color::Constant(Vec3::ZERO),
            emission_strength: 1.0,
            opacity: Scalar::Constant(1.0),
            opacity_cutoff: None,
            detail: None,
        }
    }
}

impl Material {
    /// Whether rays go through it as through glass. Holes do not count.
    pub fn is_transmissive(&self) -> bool {
        !self.transmission.is(0.0)
    }

    /// Whether there may be points at which not all rays meet it.
    pub fn has_holes(&self) -> bool {
        match (&self.opacity, self.opacity_cutoff) {
            (Scalar::Constant(x), Some(cutoff)) => *x < cutoff,
            (opacity, _) => !opacity.is(1.0),
        }
    }

    /// The pictures it reads: an address each, the same for shared ones, and the bytes held there.
    pub fn pictures(&self) -> Vec<(usize, usize)> {
        let color = |texture: &Texture| {
            let image = &texture.image;
            (Arc::as_ptr(image) as usize, image.bytes())
        };
        let scalar = |texture: &ScalarTexture| {
            let image = &texture.image;
            (Arc::as_ptr(image) as usize, image.bytes())
        };
        let colors = [&self.base_color, &self.sheen_color, &self.emission];
        let colors = colors.into_iter().filter_map(|c| match c {
            Color::Texture(texture) => Some(color(texture)),
            Color::Constant(_) => None,
        });
        let detail = self.detail.iter().map(|detail| match detail {
            Detail::NormalMap { texture, .. } => color(texture),
            Detail::Bump(heights) => scalar(heights),
        });
        let scalars = [
            &self.metallic,
            &self.roughness,
            &self.specular,
            &self.transmission,
            &self.coat,
            &self.coat_roughness,
            &self.sheen_roughness,
            &self.opacity,
        ];
        let scalars = scalars.into_iter().filter_map(|s| match s {
            Scalar::Texture(texture) => Some(scalar(texture)),
            Scalar::Constant(_) => None,
        });
        colors.chain(detail).chain(scalars).collect()
    }

    /// Whether it is a source of light.
    pub fn is_emissive(&self) -> bool {
        !self.emission.is_black() && self.emission_strength > 0.0
    }
}
