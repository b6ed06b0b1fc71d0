//! A dielectric interface, smooth or rough: reflection and refraction.
//!
//! Rough: Walter, Marschner, Li, Torrance, "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007,
//! equations 20 and 21. What single scattering loses is returned by two cosine lobes, one on each side, that keep
//! the whole reciprocal (Kulla and Conty 2017, here with exact Fresnel terms in the tables).
//!
//! Values are of radiance: what passes is divided by eta^2, the change of solid angle; on the way back it is
//! multiplied again.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::fresnel::{dielectric, reflect, refract};
use super::{albedo, cosine_hemisphere, ggx};

/// Missing energy below this is not returned.
const NEGLIGIBLE: f32 = 1e-4;

/// Part of the missing energy that passes, where reciprocity leaves the choice.
const PASSING: f32 = 0.9;

/// The interface seen from one side.
#[derive(Clone, Copy, Debug)]
pub struct Glass {
    /// GGX alpha; 0 is smooth.
    alpha: f32,
    /// Index of refraction beyond over that on the viewer's side; not 1.
    eta: f32,
    /// To the viewer, z > 0.
    v: Vec3,
    /// Energy that single scattering loses, for this viewer and on average on either side.
    lost: f32,
    lost_here: f32,
    lost_beyond: f32,
}

/// Which ways light may go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ways {
    /// Back to the viewer's side.
    pub reflect: bool,
    /// To the other side.
    pub refract: bool,
}

/// The interface for one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GlassValue {
    /// BSDF times the cosine to the light.
    pub value: f32,
    /// Density per steradian of [`Glass::sample`].
    pub pdf: f32,
}

/// A direction drawn from the interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlassSample {
    /// To the light.
    pub direction: Vec3,
    /// For a smooth interface the whole weight; rough ones are evaluated.
    pub mirror_weight: Option<f32>,
}

impl Glass {
    /// The interface with GGX `alpha` (0: smooth) and relative index `eta` (not 1), seen from `v` (z > 0).
    pub fn new(alpha: f32, eta: f32, v: Vec3) -> Self {
        let rough = alpha > 0.0;
        let lost = |energy: f32| (1.0 - energy).max(0.0);
        let mean = |eta| {
            if rough {
                lost(albedo::glass_mean(alpha, eta))
            } else {
                0.0
            }
        };
        Self {
            alpha,
            eta,
            v,
            lost: if rough {
                lost(albedo::glass(v.z, alpha, eta))
            } else {
                0.0
            },
            lost_here: mean(eta).max(NEGLIGIBLE),
            lost_beyond: mean(1.0 / eta).max(NEGLIGIBLE),
        }
    }

    /// The part of the lost energy that passes. Reciprocity asks that it times lost_here be n^2 of the other side
    /// over n^2 of this one as large as seen from beyond.
    fn passing(&self) -> f32 {
        let (here, beyond) = (self.lost_here, self.eta * self.eta * self.lost_beyond);
        PASSING * here.min(beyond) / here
    }

    /// BSDF and density for light from `l`, through the open `ways`.
    pub fn evaluate(&self, l: Vec3, ways: Ways) -> GlassValue {
        if self.alpha == 0.0 || l.z == 0.0 {
            return GlassValue::default();
        }
        let single = if l.z > 0.0 {
            self.reflected(l, ways)
        } else {
            self.refracted(l, ways)
        };
        if self.lost < NEGLIGIBLE {
            return single;
        }
        let passing = self.passing();
        let (part, lost, mean, scale) = if l.z > 0.0 {
            let lost = 1.0 - albedo::glass(l.z, self.alpha, self.eta);
            (1.0 - passing, lost, self.lost_here, 1.0)
        } else {
            let lost = 1.0 - albedo::glass(-l.z, self.alpha, 1.0 / self.eta);
            (passing, lost, self.lost_beyond, 1.0 / (self.eta * self.eta))
        };
        let cosine = l.z.abs() * FRAC_1_PI;
        let open = if l.z > 0.0 {
            ways.reflect
        } else {
            ways.refract
        };
        let chance = match (open, ways.reflect && ways.refract) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => part,
        };
        GlassValue {
            value: single.value + part * self.lost * lost.max(0.0) / mean * cosine * scale,
            pdf: (1.0 - self.lost) * single.pdf + self.lost * chance * cosine,
        }
    }

    /// Equation 20.
    fn reflected(&self, l: Vec3, ways: Ways) -> GlassValue {
        let (v, alpha) = (self.v, self.alpha);
        let half = (v + l).normalize();
        let reflectance = dielectric(v.dot(half), self.eta);
        let density = ggx::distribution(half, alpha) * ggx::masking_shadowing(v, l, alpha);
        GlassValue {
            value: reflectance * density / (4.0 * v.z),
            pdf: ggx::reflection_pdf(v, half, alpha) * chance_to_reflect(reflectance, ways),
        }
    }

    /// Equation 21, times the cosine, over eta^2.
    fn refracted(&self, l: Vec3, ways: Ways) -> GlassValue {
        let (v, alpha, eta) = (self.v, self.alpha, self.eta);
        let half = (v + eta * l).normalize_or_zero();
        let half = if half.z < 0.0 { -half } else { half };
        let (vh, lh) = (v.dot(half), l.dot(half));
        if vh <= 0.0 || lh >= 0.0 {
            return GlassValue::default();
        }
        let reflectance = dielectric(vh, eta);
        let jacobian = -lh / (lh + vh / eta).powi(2);
        let facets = ggx::distribution(half, alpha) * vh / v.z;
        let seen = ggx::masking_shadowing(v, Vec3::new(l.x, l.y, -l.z), alpha);
        GlassValue {
            value: (1.0 - reflectance) * facets * seen * jacobian / (eta * eta),
            pdf: facets
                * ggx::masking(v, alpha)
                * jacobian
                * (1.0 - chance_to_reflect(reflectance, ways)),
        }
    }

    /// A direction through one of the open `ways`; `choice` and `u` are uniform in [0, 1).
    pub fn sample(&self, choice: f32, u: Vec2, ways: Ways) -> Option<GlassSample> {
        let rough = |direction| GlassSample {
            direction,
            mirror_weight: None,
        };
        if choice < self.lost && self.lost >= NEGLIGIBLE {
            let passes = choice / self.lost < self.passing();
            let passes = ways.refract && (passes || !ways.reflect);
            if !passes && !ways.reflect {
                return None;
            }
            let up = cosine_hemisphere(u);
            let side = if passes { -1.0 } else { 1.0 };
            return Some(rough(Vec3::new(up.x, up.y, side * up.z)));
        }
        let choice = if self.lost >= NEGLIGIBLE {
            (choice - self.lost) / (1.0 - self.lost)
        } else {
            choice
        };
        let smooth = self.alpha == 0.0;
        let half = if smooth {
            Vec3::Z
        } else {
            ggx::sample_visible_normal(self.v, self.alpha, u)
        };
        let reflectance = dielectric(self.v.dot(half), self.eta);
        let chance = chance_to_reflect(reflectance, ways);
        if !ways.reflect && !ways.refract {
            return None;
        }
        let (direction, weight) = if choice < chance {
            (reflect(self.v, half), reflectance / chance)
        } else {
            let direction = refract(self.v, half, self.eta)?;
            (
                direction,
                (1.0 - reflectance) / (1.0 - chance) / (self.eta * self.eta),
            )
        };
        let stays = (direction.z > 0.0) == (choice < chance);
        stays.then_some(GlassSample {
            direction,
            mirror_weight: smooth.then_some(weight),
        })
    }
}

/// Probability to reflect, of the open ways.
fn chance_to_reflect(reflectance: f32, ways: Ways) -> f32 {
    match (ways.reflect, ways.refract) {
        (true, true) => reflectance,
        (true, false) => 1.0,
        (false, _) => 0.0,
    }
}
