//! How a surface point scatters light: a Lambertian base under a GGX coat, or a metal.
//!
//! Directions are unit vectors in the shading basis: z is the normal, both point away from the surface.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::ggx;
use crate::scene::{Color, Material};

/// The smallest GGX alpha: a mirror to the eye, and still a density that f32 holds.
const SMOOTHEST: f32 = 1e-3;

/// Alpha below which a surface seen in a reflection is blurred, because it is lit by sampling the lights only.
const SMOOTHEST_IN_REFLECTION: f32 = 0.25;

/// A reflection ray that adds less than this is not traced.
const NEGLIGIBLE: f32 = 0.01;

/// Scattering at one surface point.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// Albedo of the base.
    diffuse: Vec3,
    /// Reflectance at normal incidence, of the coat and of the whole.
    coat: f32,
    f0: Vec3,
    alpha: f32,
    /// How much reflections of other surfaces matter, beside Fresnel: 0 for a rough coat.
    gloss: f32,
}

/// Both lobes for one pair of directions, each times the cosine to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// The base.
    pub diffuse: Vec3,
    /// The coat or metal.
    pub specular: Vec3,
    /// Density with which [`Bsdf::sample_specular`] finds the direction to the light.
    pub specular_pdf: f32,
}

/// A direction drawn from the specular lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularSample {
    /// To the light.
    pub direction: Vec3,
    /// BSDF times cosine over density.
    pub weight: Vec3,
    /// Density per steradian.
    pub pdf: f32,
}

impl Bsdf {
    /// The material at texture coordinates `texcoord` of the mesh. Colours are clamped to 0 .. 1: nothing
    /// reflects more than it receives.
    pub fn new(material: &Material, texcoord: Vec2) -> Self {
        let color = base_color(&material.base_color, texcoord).clamp(Vec3::ZERO, Vec3::ONE);
        let coat = 0.08 * material.specular;
        Self {
            diffuse: color * (1.0 - material.metallic),
            coat,
            f0: Vec3::splat(coat).lerp(color, material.metallic),
            alpha: (material.roughness * material.roughness).max(SMOOTHEST),
            gloss: 1.0 - material.roughness * (1.0 - material.metallic),
        }
    }

    /// What is reflected of white light from all around, seen from above.
    pub fn albedo(&self) -> Vec3 {
        (self.diffuse * (1.0 - self.coat) + self.f0).min(Vec3::ONE)
    }

    /// The same, blurred, for a surface that is seen in a reflection and traces none itself.
    pub fn seen_in_reflection(mut self) -> Self {
        self.alpha = self.alpha.max(SMOOTHEST_IN_REFLECTION);
        self
    }

    /// Whether a reflection ray could change the picture.
    pub fn reflects(&self, to_viewer: Vec3) -> bool {
        schlick(self.f0, to_viewer.z).max_element() * self.gloss > NEGLIGIBLE
    }

    /// Both lobes. Zero unless both directions are above the surface.
    pub fn evaluate(&self, to_viewer: Vec3, to_light: Vec3) -> Scattering {
        if to_viewer.z <= 0.0 || to_light.z <= 0.0 {
            return Scattering {
                diffuse: Vec3::ZERO,
                specular: Vec3::ZERO,
                specular_pdf: 0.0,
            };
        }
        // What enters the base and what leaves it has passed the coat.
        let passes = |cos: f32| 1.0 - schlick(Vec3::splat(self.coat), cos).x;
        let diffuse =
            self.diffuse * (FRAC_1_PI * to_light.z * passes(to_viewer.z) * passes(to_light.z));
        let half = (to_viewer + to_light).normalize();
        let density = ggx::distribution(half, self.alpha)
            * ggx::masking_shadowing(to_viewer, to_light, self.alpha);
        Scattering {
            diffuse,
            specular: schlick(self.f0, to_viewer.dot(half)) * (density / (4.0 * to_viewer.z)),
            specular_pdf: ggx::reflection_pdf(to_viewer, half, self.alpha),
        }
    }

    /// A direction of the specular lobe for a uniform point `u`; `None` when it would go below the surface.
    /// `to_viewer` is above the surface.
    pub fn sample_specular(&self, to_viewer: Vec3, u: Vec2) -> Option<SpecularSample> {
        let half = ggx::sample_visible_normal(to_viewer, self.alpha, u);
        let direction = 2.0 * to_viewer.dot(half) * half - to_viewer;
        if direction.z <= 0.0 {
            return None;
        }
        let unmasked = ggx::masking_shadowing(to_viewer, direction, self.alpha)
            / ggx::masking(to_viewer, self.alpha);
        Some(SpecularSample {
            direction,
            weight: schlick(self.f0, to_viewer.dot(half)) * unmasked,
            pdf: ggx::reflection_pdf(to_viewer, half, self.alpha),
        })
    }
}

fn base_color(color: &Color, texcoord: Vec2) -> Vec3 {
    match color {
        Color::Constant(rgb) => *rgb,
        Color::Texture(texture) => texture
            .image
            .sample(texture.uv.apply(texcoord), texture.wrap),
    }
}

/// Fresnel reflectance: Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Eurographics 1994.
///
/// At grazing angles it reaches 1, or less where `f0` is below 0.02, which no real surface has: so a
/// reflectance of 0 turns the lobe off (Lagarde and de Rousiers, "Moving Frostbite to PBR", 2014).
fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    let f90 = (50.0 * f0.element_sum() / 3.0).min(1.0);
    f0 + (Vec3::splat(f90) - f0) * (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(color: Vec3, metallic: f32, roughness: f32, specular: f32) -> Bsdf {
        let material = Material {
            name: "test".into(),
            base_color: Color::Constant(color),
            metallic,
            roughness,
            specular,
        };
        Bsdf::new(&material, Vec2::ZERO)
    }

    fn viewer(theta: f32) -> Vec3 {
        Vec3::new(theta.sin(), 0.0, theta.cos())
    }

    fn points(n: usize) -> impl Iterator<Item = Vec2> {
        (0..n).map(move |i| Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / n as f32))
    }

    #[test]
    fn the_specular_sample_agrees_with_evaluate() {
        for roughness in [0.2, 0.5, 1.0] {
            let bsdf = material(Vec3::new(0.9, 0.6, 0.2), 1.0, roughness, 0.5);
            let v = viewer(0.7);
            for u in points(200) {
                let Some(sample) = bsdf.sample_specular(v, u) else {
                    continue;
                };
                let f = bsdf.evaluate(v, sample.direction);
                let scale = sample.weight.max_element().max(1e-3);
                let weight = f.specular / f.specular_pdf;
                assert!(weight.abs_diff_eq(sample.weight, 2e-3 * scale));
                assert!((f.specular_pdf / sample.pdf - 1.0).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn no_material_reflects_more_than_it_receives() {
        for (metallic, roughness) in [(0.0, 0.05), (0.0, 1.0), (1.0, 0.3), (0.5, 0.6)] {
            let bsdf = material(Vec3::ONE, metallic, roughness, 1.0);
            for theta in [0.0, 0.8, 1.4, 1.55] {
                let v = viewer(theta);
                let n = 20_000;
                let (mut specular, mut diffuse) = (Vec3::ZERO, Vec3::ZERO);
                for u in points(n) {
                    specular += bsdf.sample_specular(v, u).map_or(Vec3::ZERO, |s| s.weight);
                    // Cosine-weighted directions: pdf = z / pi.
                    let (sin, cos) = (std::f32::consts::TAU * u.x).sin_cos();
                    let l = Vec3::new(u.y.sqrt() * cos, u.y.sqrt() * sin, (1.0 - u.y).sqrt());
                    diffuse += bsdf.evaluate(v, l).diffuse / (l.z * FRAC_1_PI);
                }
                let albedo = (specular + diffuse) / n as f32;
                assert!(
                    albedo.max_element() <= 1.001,
                    "{metallic} {roughness} {theta} {albedo}"
                );
            }
        }
    }

    #[test]
    fn reciprocal() {
        let bsdf = material(Vec3::new(0.9, 0.6, 0.2), 0.3, 0.4, 0.5);
        let (a, b) = (viewer(1.0), Vec3::new(-0.2, 0.5, 0.8).normalize());
        let over_cosine = |v: Vec3, l: Vec3| {
            let f = bsdf.evaluate(v, l);
            (f.diffuse + f.specular) / l.z
        };
        assert!(over_cosine(a, b).abs_diff_eq(over_cosine(b, a), 1e-5));
    }

    #[test]
    fn no_specular_is_lambert_exactly() {
        let bsdf = material(Vec3::new(0.8, 0.5, 0.2), 0.0, 1.0, 0.0);
        let f = bsdf.evaluate(viewer(1.3), viewer(-0.4));
        assert_eq!(f.specular, Vec3::ZERO);
        let lambert = Vec3::new(0.8, 0.5, 0.2) * FRAC_1_PI * 0.4_f32.cos();
        assert!(f.diffuse.abs_diff_eq(lambert, 1e-6));
        assert!(!bsdf.reflects(viewer(1.5)));
    }

    #[test]
    fn rough_dielectrics_need_no_reflection_ray_and_metals_do() {
        assert!(!material(Vec3::ONE, 0.0, 1.0, 0.5).reflects(Vec3::Z));
        assert!(material(Vec3::ONE, 0.0, 0.2, 0.5).reflects(Vec3::Z));
        assert!(material(Vec3::ONE, 1.0, 1.0, 0.5).reflects(Vec3::Z));
    }
}
