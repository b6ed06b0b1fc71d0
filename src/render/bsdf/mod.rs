//! How a surface point scatters light: a subset of the principled material, in layers.
//!
//! ```text
//! coat         GGX reflection, uncoloured
//! sheen        microfibres, reflection only
//! base         metal | glass | specular over diffuse, mixed linearly
//! ```
//!
//! A layer lets through what it does not reflect, by its directional albedo E. Two shapes keep that reciprocal:
//! diffuse light is (1 - E(v)) (1 - E(l)) over its mean (Kulla and Conty, SIGGRAPH 2017 course), which conserves
//! energy exactly; other lobes take min(1 - E(v), 1 - E(l)), which never gains any.
//!
//! Directions are unit vectors in the shading basis: z is the normal, both point away from the surface, and the
//! viewer is above it. Values are of radiance and include the cosine to the light.

mod albedo;
mod fresnel;
mod ggx;
mod glass;
mod parameters;

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

pub use albedo::make_tables;
use fresnel::{reflect, schlick};
use glass::{Glass, Ways};
pub use parameters::Parameters;

/// The smallest GGX alpha of a reflection: a mirror to the eye, and still a density that f32 holds.
pub const SMOOTHEST: f32 = 1e-3;

/// Reflectance of a coat at normal incidence: an index of 1.5.
const COAT_F0: f32 = 0.04;

/// Alpha to which reflections are blurred that are lit by sampling lights only.
pub const SMOOTHEST_WHEN_LAST: f32 = 0.25;

/// A lobe that returns less than this is not sampled.
const NEGLIGIBLE: f32 = 1e-4;

/// A way to go on, each with a depth limit of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounce {
    /// Off a diffuse base.
    Diffuse,
    /// Off a coat, a metal, or a dielectric from outside.
    Glossy,
    /// Through a dielectric, or back inside it.
    Transmission,
}

/// Which bounces are still allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allowed {
    /// [`Bounce::Diffuse`].
    pub diffuse: bool,
    /// [`Bounce::Glossy`].
    pub glossy: bool,
    /// [`Bounce::Transmission`].
    pub transmission: bool,
}

#[cfg(test)]
impl Allowed {
    /// Everything.
    pub const ALL: Self = Self {
        diffuse: true,
        glossy: true,
        transmission: true,
    };
}

/// The material for one pair of directions: BSDF times cosine by kind of bounce, and a density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scattering {
    /// [`Bounce::Diffuse`].
    pub diffuse: Vec3,
    /// [`Bounce::Glossy`].
    pub glossy: Vec3,
    /// [`Bounce::Transmission`].
    pub transmission: Vec3,
    /// Density per steradian with which [`Bsdf::sample`] finds the direction to the light.
    pub pdf: f32,
}

impl Scattering {
    /// Everything.
    pub fn total(&self) -> Vec3 {
        self.diffuse + self.glossy + self.transmission
    }

    /// The part that bounces of these kinds make up.
    pub fn part(&self, kinds: Allowed) -> Vec3 {
        let pick = |open: bool, value: Vec3| if open { value } else { Vec3::ZERO };
        pick(kinds.diffuse, self.diffuse)
            + pick(kinds.glossy, self.glossy)
            + pick(kinds.transmission, self.transmission)
    }
}

/// A direction drawn from the material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// To the light.
    pub direction: Vec3,
    /// For a smooth interface BSDF times cosine over the chance of this direction; others are to be
    /// [evaluated](Bsdf::evaluate).
    pub mirror_weight: Option<Vec3>,
    /// What kind of bounce.
    pub bounce: Bounce,
}

/// The material of one point, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    p: Parameters,
    /// Coat and sheen outside, for light that passes from there to a viewer inside.
    outside: (f32, Vec3),
    v: Vec3,
    /// The part of light from the viewer that reaches the base.
    through: f32,
    /// Diffuse albedo over the mean that keeps its energy, times the part that leaves to the viewer.
    diffuse: Vec3,
    /// The same of a metal's light that is scattered more than once.
    metal: Vec3,
    /// Reflectance at normal incidence of the specular lobe, and its weight.
    f0: Vec3,
    specular: f32,
    glass: Option<Glass>,
    /// Chances of the diffuse, specular, coat and glass lobes, not normalised.
    chances: [f32; 4],
}

impl Bsdf {
    /// The material `p` seen from `v`, which is above the surface.
    pub fn new(mut p: Parameters, v: Vec3) -> Self {
        let outside = (p.coat, p.sheen);
        if p.inside {
            (p.coat, p.sheen) = (0.0, Vec3::ZERO);
        }
        let through = p.through(v.z);
        let [dielectric, metal] = p.diffuse_albedos(v.z);
        let over = |albedo: Vec3, mean: fn(&Parameters) -> f32| {
            if albedo == Vec3::ZERO {
                albedo
            } else {
                albedo / mean(&p)
            }
        };
        let weight = 1.0 - (1.0 - p.metallic) * p.transmission;
        // Metal and opaque dielectric share one distribution: one lobe of their mean colour.
        let share = if weight > 0.0 {
            p.metallic / weight
        } else {
            0.0
        };
        let f0 = Vec3::splat(p.f0).lerp(p.color, share);
        let glass_share = (1.0 - p.metallic) * p.transmission;
        let glass = (glass_share > 0.0 && p.eta != 1.0).then(|| {
            let alpha = if p.alpha < SMOOTHEST { 0.0 } else { p.alpha };
            Glass::new(alpha, p.eta, v)
        });
        let alpha = p.alpha.max(SMOOTHEST);
        let brightness = |c: Vec3| c.element_sum() / 3.0;
        let reflected =
            |f0: Vec3, alpha| albedo::reflection(brightness(f0), fresnel::grazing(f0), v.z, alpha);
        let chances = [
            brightness(dielectric + metal + p.sheen_albedo(v.z)),
            through * weight * reflected(f0, alpha),
            if p.coat > 0.0 {
                p.coat * reflected(Vec3::splat(COAT_F0), p.coat_alpha.max(SMOOTHEST))
            } else {
                0.0
            },
            if glass.is_some() {
                through * glass_share
            } else {
                0.0
            },
        ];
        Self {
            p,
            outside,
            v,
            through,
            diffuse: over(dielectric, Parameters::mean_under_dielectric),
            metal: over(metal, Parameters::mean_under_metal),
            f0,
            specular: weight,
            glass,
            chances: chances.map(|c| if c > NEGLIGIBLE { c } else { 0.0 }),
        }
    }

    /// How much reflections of other surfaces matter: what the glossy lobes return, but for rough dielectrics, whose
    /// reflections are too blurred and weak to be missed.
    pub fn gloss(&self) -> f32 {
        let sharp = 1.0 - self.p.alpha.sqrt() * (1.0 - self.p.metallic);
        let coat = self.chances[2] * (1.0 - self.p.coat_alpha.sqrt());
        self.chances[1] * sharp + coat + self.chances[3]
    }

    /// Index of refraction beyond the surface over that on the viewer's side.
    pub fn eta(&self) -> f32 {
        self.p.eta
    }

    /// Chances of the four lobes, summing to 1, or all 0 where nothing is allowed.
    fn probabilities(&self, allowed: Allowed) -> [f32; 4] {
        let ways = self.ways(allowed);
        let open = [
            allowed.diffuse,
            allowed.glossy,
            allowed.glossy,
            ways.reflect || ways.refract,
        ];
        let chances: [f32; 4] =
            std::array::from_fn(|i| if open[i] { self.chances[i] } else { 0.0 });
        let sum: f32 = chances.iter().sum();
        if sum > 0.0 {
            chances.map(|c| c / sum)
        } else {
            [0.0; 4]
        }
    }

    /// What a glass interface may do: what is reflected inside a body counts as transmission.
    fn ways(&self, allowed: Allowed) -> Ways {
        Ways {
            reflect: if self.p.inside {
                allowed.transmission
            } else {
                allowed.glossy
            },
            refract: allowed.transmission,
        }
    }

    /// All lobes for light from `l`, and the density of [`Self::sample`] under `allowed`.
    pub fn evaluate(&self, l: Vec3, allowed: Allowed) -> Scattering {
        let mut sum = Scattering::default();
        let [diffuse, specular, coat, glass] = self.probabilities(allowed);
        if l.z > 0.0 {
            let cosine = l.z * FRAC_1_PI;
            sum.diffuse = self.diffuse_lobe(l) * cosine;
            sum.pdf += diffuse * cosine;
            let through = self.through.min(self.p.through(l.z));
            let half = (self.v + l).normalize();
            if self.specular > 0.0 {
                let (value, pdf) = self.reflection(l, half, self.f0, self.p.alpha);
                sum.glossy += value * (self.specular * through);
                sum.pdf += specular * pdf;
            }
            if self.p.coat > 0.0 {
                let (value, pdf) =
                    self.reflection(l, half, Vec3::splat(COAT_F0), self.p.coat_alpha);
                sum.glossy += value * self.p.coat;
                sum.pdf += coat * pdf;
            }
        }
        if let Some(interface) = &self.glass {
            let ways = self.ways(allowed);
            let found = interface.evaluate(l, ways);
            let glossy = l.z > 0.0 && !self.p.inside;
            let kind = if glossy {
                &mut sum.glossy
            } else {
                &mut sum.transmission
            };
            *kind += found.value * self.glass_weight(l);
            sum.pdf += glass * found.pdf;
        }
        sum
    }

    /// BSDF (times pi) of the lobes that are sampled by the cosine.
    fn diffuse_lobe(&self, l: Vec3) -> Vec3 {
        let p = &self.p;
        let mut sum = self.diffuse * p.under_dielectric(l.z) + self.metal * p.under_metal(l.z);
        if p.sheen != Vec3::ZERO {
            let coat = p.through_coat(self.v.z).min(p.through_coat(l.z));
            sum += p.sheen * (coat * PI / l.z * sheen(self.v, l, p.sheen_alpha));
        }
        sum
    }

    /// A GGX reflection lobe and its density.
    fn reflection(&self, l: Vec3, half: Vec3, f0: Vec3, alpha: f32) -> (Vec3, f32) {
        let alpha = alpha.max(SMOOTHEST);
        let density = ggx::distribution(half, alpha) * ggx::masking_shadowing(self.v, l, alpha);
        let value = schlick(f0, self.v.dot(half)) * (density / (4.0 * self.v.z));
        (value, ggx::reflection_pdf(self.v, half, alpha))
    }

    /// Weight and colour of the glass for light from `l`. Each crossing takes the root of the colour: through a
    /// body one sees the colour itself.
    fn glass_weight(&self, l: Vec3) -> Vec3 {
        let p = &self.p;
        let share = (1.0 - p.metallic) * p.transmission;
        if l.z > 0.0 {
            Vec3::splat(share * self.through.min(p.through(l.z)))
        } else {
            let tint = Vec3::new(p.color.x.sqrt(), p.color.y.sqrt(), p.color.z.sqrt());
            let through = if p.inside {
                let (coat, sheen) = self.outside;
                Parameters { coat, sheen, ..*p }.through(-l.z)
            } else {
                self.through
            };
            share * through * tint
        }
    }

    /// A direction by one of the allowed lobes; `choice` and `u` are uniform in [0, 1). `None` where nothing is
    /// allowed, or the direction would be on the wrong side.
    pub fn sample(&self, choice: f32, u: Vec2, allowed: Allowed) -> Option<BsdfSample> {
        let [diffuse, specular, coat, glass] = self.probabilities(allowed);
        let found = |direction: Vec3, bounce| {
            (direction.z > 0.0).then_some(BsdfSample {
                direction,
                mirror_weight: None,
                bounce,
            })
        };
        let mirrored = |alpha: f32| {
            let half = ggx::sample_visible_normal(self.v, alpha.max(SMOOTHEST), u);
            found(reflect(self.v, half), Bounce::Glossy)
        };
        if choice < diffuse {
            return found(cosine_hemisphere(u), Bounce::Diffuse);
        }
        let choice = choice - diffuse;
        if choice < specular {
            return mirrored(self.p.alpha);
        }
        let choice = choice - specular;
        if choice < coat {
            return mirrored(self.p.coat_alpha);
        }
        if glass <= 0.0 {
            return None;
        }
        let choice = ((choice - coat) / glass).clamp(0.0, 1.0 - f32::EPSILON);
        let sample = self.glass.as_ref()?.sample(choice, u, self.ways(allowed))?;
        let direction = sample.direction;
        Some(BsdfSample {
            direction,
            mirror_weight: sample
                .mirror_weight
                .map(|w| self.glass_weight(direction) * (w / glass)),
            bounce: if direction.z > 0.0 && !self.p.inside {
                Bounce::Glossy
            } else {
                Bounce::Transmission
            },
        })
    }

    /// What the lobes of the base and the layers above it return of a white world, for pictures of the material itself.
    pub fn albedo(&self) -> Vec3 {
        let p = &self.p;
        let specular = |f0: Vec3, alpha: f32| {
            let grazing = fresnel::grazing(f0);
            let alpha = alpha.max(SMOOTHEST);
            Vec3::from_array(
                f0.to_array()
                    .map(|f0| albedo::reflection(f0, grazing, self.v.z, alpha)),
            )
        };
        let base = self.specular * self.through * specular(self.f0, p.alpha);
        let coat = p.coat * specular(Vec3::splat(COAT_F0), p.coat_alpha);
        let glass = (1.0 - p.metallic) * p.transmission * self.through * p.color;
        let [diffuse, metal] = p.diffuse_albedos(self.v.z);
        diffuse + metal + p.sheen_albedo(self.v.z) + base + coat + glass
    }
}

/// A microfibre sheen times cosine: Charlie's distribution (Estevez and Kulla, "Production Friendly Microfacet Sheen
/// BRDF", SIGGRAPH 2017 course, equation 2) with Neubelt and Pettineo's visibility ("Crafting a Next-Gen Material
/// Pipeline for The Order: 1886", SIGGRAPH 2013 course).
fn sheen(v: Vec3, l: Vec3, alpha: f32) -> f32 {
    /// Below, the lobe is too narrow for f32.
    const NARROWEST: f32 = 0.01;
    let inverse = 1.0 / alpha.max(NARROWEST);
    let half = (v + l).normalize();
    let sin2 = (1.0 - half.z * half.z).max(0.0);
    let distribution = (2.0 + inverse) * sin2.powf(0.5 * inverse) / TAU;
    distribution / (4.0 * (l.z + v.z - l.z * v.z)) * l.z
}

/// A direction about +z with density cos / pi (Malley's method).
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let (sin, cos) = (TAU * u.x).sin_cos();
    let radius = u.y.sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - u.y).sqrt())
}

#[cfg(test)]
mod tests;
