//! From a scene's material to what it is at one point.

use glam::Vec3;

use super::bsdf::{self, Parameters};
use crate::scene::{Material, Scalar};
use crate::surface::SurfacePoint;

/// Makes what tables these materials look up, once per process.
pub fn make_tables(materials: &[Material]) {
    let is_sheen = |material: &Material| !material.sheen_color.is_black();
    let is_rough_glass =
        |material: &Material| material.is_transmissive() && !material.roughness.is(0.0);
    bsdf::make_tables(
        materials.iter().any(is_sheen),
        materials.iter().any(is_rough_glass),
    );
}

/// The material at `point`. `eta` is the index of refraction beyond the surface over that on the viewer's side, and
/// `inside` tells that the viewer is in the body. Values are clamped to 0 .. 1: nothing reflects more than it receives.
pub fn parameters(material: &Material, point: &SurfacePoint, eta: f32, inside: bool) -> Parameters {
    let unit = |scalar: &Scalar| scalar.at(point).clamp(0.0, 1.0);
    let alpha = |roughness: &Scalar| unit(roughness).powi(2);
    let contrast = (material.ior - 1.0) / (material.ior + 1.0);
    Parameters {
        color: material.base_color.at(point).clamp(Vec3::ZERO, Vec3::ONE),
        metallic: unit(&material.metallic),
        alpha: alpha(&material.roughness),
        f0: (2.0 * unit(&material.specular) * contrast * contrast).min(1.0),
        transmission: unit(&material.transmission),
        eta,
        inside,
        coat: unit(&material.coat),
        coat_alpha: alpha(&material.coat_roughness),
        sheen: material.sheen_color.at(point).clamp(Vec3::ZERO, Vec3::ONE),
        sheen_alpha: alpha(&material.sheen_roughness),
    }
}

/// Radiance that the surface itself sends out at `point`.
pub fn emission(material: &Material, point: &SurfacePoint) -> Vec3 {
    if material.is_emissive() {
        material.emission_strength * material.emission.at(point).max(Vec3::ZERO)
    } else {
        Vec3::ZERO
    }
}

/// The part of rays that meet the surface at `point`.
pub fn opacity(material: &Material, point: &SurfacePoint) -> f32 {
    let opacity = material.opacity.at(point).clamp(0.0, 1.0);
    match material.opacity_cutoff {
        Some(cutoff) if opacity >= cutoff => 1.0,
        Some(_) => 0.0,
        None => opacity,
    }
}
