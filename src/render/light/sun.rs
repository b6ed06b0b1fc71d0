//! The sun's disk, dimmed and reddened by the air.
//!
//! Source: Preetham, Shirley, Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999, appendix 1:
//! Rayleigh and aerosol transmittance over the relative optical mass. Ozone, mixed gases and water vapour take
//! a few percent of visible light and are left out. Outside the air the sun is a black body of 5778 K that
//! gives 128 klx.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::color::{luminance, matching_functions, xyz_to_rgb};
use super::{InfiniteLight, KILOCANDELA_PER_UNIT, LightSample};
use crate::render::basis::Basis;

/// Illuminance outside the air, kilolux.
const SOLAR_KILOLUX: f32 = 128.0;

/// Surface temperature, kelvin.
const TEMPERATURE: f32 = 5778.0;

/// 1 - cos of the disk's angular radius, 0.2665 degrees. The cosine itself has too few digits in f32.
const ONE_MINUS_COS_RADIUS: f32 = 1.081_73e-5;

/// The sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    basis: Basis,
    radiance: Vec3,
}

impl Sun {
    /// A sun in `direction` (unit vector) through air of the given turbidity; `strength` 1 is a clear day's.
    ///
    /// Below the horizon it keeps the colour it has there.
    pub fn new(direction: Vec3, turbidity: f32, strength: f32) -> Self {
        let irradiance = through_air(direction.y, turbidity) / KILOCANDELA_PER_UNIT;
        Self {
            basis: Basis::around(direction),
            radiance: strength * irradiance / solid_angle(),
        }
    }
}

impl InfiniteLight for Sun {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        if self.pdf(Vec3::ZERO, direction) > 0.0 {
            self.radiance
        } else {
            Vec3::ZERO
        }
    }

    /// Uniform over the disk's solid angle.
    fn sample(&self, _normal: Vec3, u: Vec2) -> LightSample {
        let (sin, cos) = (2.0 * PI * u.x).sin_cos();
        let drop = u.y * ONE_MINUS_COS_RADIUS;
        let radius = (drop * (2.0 - drop)).sqrt();
        let local = Vec3::new(radius * cos, radius * sin, 1.0 - drop);
        LightSample::far(
            self.basis.to_world(local),
            self.radiance,
            1.0 / solid_angle(),
        )
    }

    fn brightness(&self) -> f32 {
        luminance(self.radiance) * solid_angle()
    }

    fn pdf(&self, _normal: Vec3, direction: Vec3) -> f32 {
        // |a - b|^2 = 2 (1 - cos) between unit vectors.
        if (direction - self.basis.z).length_squared() <= 2.0 * ONE_MINUS_COS_RADIUS {
            1.0 / solid_angle()
        } else {
            0.0
        }
    }
}

fn solid_angle() -> f32 {
    2.0 * PI * ONE_MINUS_COS_RADIUS
}

/// Illuminance on a surface that faces the sun, kilolux in linear sRGB, by the cosine of its zenith angle.
fn through_air(cos_zenith: f32, turbidity: f32) -> Vec3 {
    let cos_zenith = cos_zenith.clamp(0.0, 1.0);
    let zenith_degrees = cos_zenith.acos().to_degrees();
    let mass = 1.0 / (cos_zenith + 0.15 * (93.885 - zenith_degrees).powf(-1.253));
    let aerosol = 0.046_083_66 * turbidity - 0.045_860_26;

    let (mut outside, mut inside) = (Vec3::ZERO, Vec3::ZERO);
    for nanometres in (380..=780).step_by(10) {
        let micrometres = nanometres as f32 * 1e-3;
        let optical_depth = mass
            * (0.008_735 * micrometres.powf(-4.08) + aerosol.max(0.0) * micrometres.powf(-1.3));
        let stimulus = planck(micrometres) * matching_functions(nanometres as f32);
        outside += stimulus;
        inside += (-optical_depth).exp() * stimulus;
    }
    xyz_to_rgb(inside * (SOLAR_KILOLUX / outside.y))
}

/// Planck's law for the sun's temperature, in arbitrary units.
fn planck(micrometres: f32) -> f32 {
    /// h c / k in micrometres times kelvin.
    const SECOND_RADIATION_CONSTANT: f32 = 14_387.77;
    micrometres.powi(-5) / ((SECOND_RADIATION_CONSTANT / (micrometres * TEMPERATURE)).exp() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_on_the_disk_and_integrate_to_its_irradiance() {
        let direction = Vec3::new(0.6, 0.64, 0.48);
        let sun = Sun::new(direction, 3.0, 2.0);
        let n = 1000;
        let mut irradiance = Vec3::ZERO;
        for i in 0..n {
            let u = Vec2::new((i as f32 * 0.618_034).fract(), i as f32 / n as f32);
            let s = sun.sample(Vec3::Y, u);
            assert!(direction.angle_between(s.direction) < 0.2666_f32.to_radians() + 1e-4);
            assert_eq!(sun.radiance(s.direction), s.radiance);
            irradiance += s.radiance / s.pdf / n as f32;
        }
        let expected = 2.0 * through_air(0.64, 3.0) / KILOCANDELA_PER_UNIT;
        assert!(irradiance.abs_diff_eq(expected, 1e-3), "{irradiance}");
        assert_eq!(
            sun.radiance(Vec3::new(0.61, 0.64, 0.48).normalize()),
            Vec3::ZERO
        );
    }

    #[test]
    fn a_clear_high_sun_gives_what_a_light_meter_reads() {
        // Direct sun on a clear day: 80 to 110 klx facing it.
        let klx = luminance(through_air(60_f32.to_radians().sin(), 3.0));
        assert!((80.0..110.0).contains(&klx), "{klx}");
    }

    #[test]
    fn low_suns_are_dimmer_and_redder() {
        let suns = [90.0_f32, 45.0, 20.0, 8.0, 2.0, 0.0, -10.0]
            .map(|elevation| through_air(elevation.to_radians().sin(), 3.0));
        for (high, low) in suns.iter().zip(&suns[1..]) {
            assert!(luminance(*low) <= luminance(*high));
            assert!(low.z * high.x <= low.x * high.z * 1.0001);
            assert!(low.is_finite() && low.min_element() >= 0.0);
        }
    }
}
