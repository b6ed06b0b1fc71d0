//! What a surface point is made of, and what its layers let through.

use glam::Vec3;

use super::{COAT_F0, SMOOTHEST, albedo, fresnel};

/// What a surface point is made of. Colours and weights are in 0 .. 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Diffuse albedo, a metal's reflectance at normal incidence, or the colour of glass seen through a body.
    pub color: Vec3,
    /// Dielectric .. metal.
    pub metallic: f32,
    /// GGX alpha of the base; a transmissive one below [`SMOOTHEST`] is smooth.
    pub alpha: f32,
    /// Reflectance of the opaque dielectric at normal incidence.
    pub f0: f32,
    /// How much of the dielectric is glass.
    pub transmission: f32,
    /// Index of refraction beyond the surface over that on the viewer's side.
    pub eta: f32,
    /// Whether the viewer is inside the body: coat and sheen are outside.
    pub inside: bool,
    /// Weight of the coat.
    pub coat: f32,
    /// GGX alpha of the coat.
    pub coat_alpha: f32,
    /// Colour of the sheen; black is none.
    pub sheen: Vec3,
    /// Width of the sheen: roughness^2.
    pub sheen_alpha: f32,
}

impl Parameters {
    /// Makes the reflections at least as rough as `alpha`.
    pub fn blur(&mut self, alpha: f32) {
        self.alpha = self.alpha.max(alpha);
        self.coat_alpha = self.coat_alpha.max(alpha);
    }

    /// What passes the coat in a direction of this cosine.
    pub(super) fn through_coat(&self, cos: f32) -> f32 {
        if self.coat == 0.0 {
            return 1.0;
        }
        let alpha = self.coat_alpha.max(SMOOTHEST);
        1.0 - self.coat * albedo::reflection(COAT_F0, 1.0, cos, alpha)
    }

    /// What passes coat and sheen.
    pub(super) fn through(&self, cos: f32) -> f32 {
        let mut through = self.through_coat(cos);
        if self.sheen != Vec3::ZERO {
            through *=
                (1.0 - self.sheen.max_element() * albedo::sheen(cos, self.sheen_alpha)).max(0.0);
        }
        through
    }

    /// What passes the layers and is not returned by the dielectric's specular lobe.
    pub(super) fn under_dielectric(&self, cos: f32) -> f32 {
        let f90 = fresnel::grazing(Vec3::splat(self.f0));
        let alpha = self.alpha.max(SMOOTHEST);
        self.through(cos) * (1.0 - albedo::reflection(self.f0, f90, cos, alpha))
    }

    /// The mean of [`Self::under_dielectric`] over the hemisphere.
    pub(super) fn mean_under_dielectric(&self) -> f32 {
        if self.has_layers() {
            return albedo::hemisphere_mean(|cos| self.under_dielectric(cos));
        }
        let f90 = fresnel::grazing(Vec3::splat(self.f0));
        1.0 - albedo::reflection_mean(self.f0, f90, self.alpha.max(SMOOTHEST))
    }

    /// The mean of [`Self::under_metal`] over the hemisphere.
    pub(super) fn mean_under_metal(&self) -> f32 {
        if self.has_layers() {
            return albedo::hemisphere_mean(|cos| self.under_metal(cos));
        }
        (1.0 - albedo::reflection_mean(1.0, 1.0, self.alpha.max(SMOOTHEST))).max(1e-6)
    }

    /// Whether there is a coat or a sheen.
    fn has_layers(&self) -> bool {
        self.coat != 0.0 || self.sheen != Vec3::ZERO
    }

    /// What passes the layers and is lost in a metal's microfacets.
    pub(super) fn under_metal(&self, cos: f32) -> f32 {
        let alpha = self.alpha.max(SMOOTHEST);
        self.through(cos) * (1.0 - albedo::reflection(1.0, 1.0, cos, alpha)).max(1e-6)
    }

    /// The parts of light that the diffuse dielectric and a metal's multiple scattering return to a viewer of this
    /// cosine.
    pub(super) fn diffuse_albedos(&self, cos: f32) -> [Vec3; 2] {
        let dielectric = self.color * ((1.0 - self.metallic) * (1.0 - self.transmission));
        [
            if dielectric == Vec3::ZERO {
                dielectric
            } else {
                dielectric * self.under_dielectric(cos)
            },
            if self.metallic == 0.0 {
                Vec3::ZERO
            } else {
                self.metallic * self.metal_again() * self.under_metal(cos)
            },
        ]
    }

    /// The part of light that the sheen returns.
    pub(super) fn sheen_albedo(&self, cos: f32) -> Vec3 {
        if self.sheen == Vec3::ZERO {
            return Vec3::ZERO;
        }
        self.sheen * (self.through_coat(cos) * albedo::sheen(cos, self.sheen_alpha))
    }

    /// The colour of light that a metal scatters more than once: F_avg^2 E_avg / (1 - F_avg (1 - E_avg)) with
    /// Schlick's mean F_avg (Kulla and Conty, with the square of Hill, "A Multi-Faceted Exploration", 2018).
    pub(super) fn metal_again(&self) -> Vec3 {
        let alpha = self.alpha.max(SMOOTHEST);
        let kept = albedo::reflection_mean(1.0, 1.0, alpha).min(1.0);
        let mean = self.color + (fresnel::grazing(self.color) - self.color) / 21.0;
        mean * mean * kept / (1.0 - mean * (1.0 - kept))
    }
}
