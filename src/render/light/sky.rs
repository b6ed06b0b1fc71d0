//! A clear daylight sky.
//!
//! Source: Preetham, Shirley, Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999, section 3.2 and
//! appendix 2: luminance and chromaticity are each Perez' five-parameter distribution, scaled to the zenith's
//! value. The parameters are linear in turbidity.
//!
//! The model ends at the horizon. Below it lies a grey ground, lit by this sky alone, that fades into the
//! horizon's haze, so that a floor's far edge meets no hard line.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};

use super::color::{luminance, xyy_to_xyz, xyz_to_rgb};
use super::sphere_distribution::SphereDistribution;
use super::{InfiniteLight, KILOCANDELA_PER_UNIT, LightSample, latlong};

/// Reflectance of the ground.
const GROUND_ALBEDO: f32 = 0.2;

/// The haze falls by 1/e over this sine of the angle below the horizon.
const HAZE: f32 = 0.05;

/// Cosines of the zenith angle below this count as the horizon: exp(B / cos) is flat there.
const HORIZON: f32 = 1e-3;

/// Cells across and down of the density that directions are drawn from.
const CELLS: (usize, usize) = (128, 64);

/// Perez' distribution: parameters A to E of the paper.
#[derive(Clone, Copy, Debug)]
struct Perez([f32; 5]);

impl Perez {
    /// A parameter is slope * turbidity + intercept.
    fn new(turbidity: f32, lines: [[f32; 2]; 5]) -> Self {
        Self(lines.map(|[slope, intercept]| slope * turbidity + intercept))
    }

    /// The distribution at a zenith angle (by its cosine, positive) and an angle `gamma` from the sun, with its cosine.
    fn value(&self, cos_zenith: f32, gamma: f32, cos_gamma: f32) -> f32 {
        let [a, b, c, d, e] = self.0;
        (1.0 + a * (b / cos_zenith).exp())
            * (1.0 + c * (d * gamma).exp() + e * cos_gamma * cos_gamma)
    }
}

/// Luminance (kcd/m^2) and chromaticity of the sky above the horizon.
#[derive(Clone, Copy, Debug)]
struct Dome {
    sun_direction: Vec3,
    /// Y, x, y of the paper, each with its scale: the zenith's value over the distribution there.
    distributions: [(Perez, f32); 3],
}

impl Dome {
    fn new(sun_direction: Vec3, turbidity: f32) -> Self {
        // A sun below the horizon lights the sky as one on it: the model has no twilight.
        let sun_zenith = sun_direction.y.clamp(0.0, 1.0).acos();
        let perez = [
            [
                [0.1787, -1.4630],
                [-0.3554, 0.4275],
                [-0.0227, 5.3251],
                [0.1206, -2.5771],
                [-0.0670, 0.3703],
            ],
            [
                [-0.0193, -0.2592],
                [-0.0665, 0.0008],
                [-0.0004, 0.2125],
                [-0.0641, -0.8989],
                [-0.0033, 0.0452],
            ],
            [
                [-0.0167, -0.2608],
                [-0.0950, 0.0092],
                [-0.0079, 0.2102],
                [-0.0441, -1.6537],
                [-0.0109, 0.0529],
            ],
        ]
        .map(|lines| Perez::new(turbidity, lines));
        let zenith = zenith(sun_zenith, turbidity);
        Self {
            sun_direction,
            distributions: std::array::from_fn(|i| {
                (
                    perez[i],
                    zenith[i] / perez[i].value(1.0, sun_zenith, sun_zenith.cos()),
                )
            }),
        }
    }

    /// Linear sRGB in kcd/m^2 from a direction; directions below the horizon read the horizon.
    fn color(&self, direction: Vec3) -> Vec3 {
        let cos_zenith = direction.y.max(HORIZON);
        let cos_gamma = direction.dot(self.sun_direction).clamp(-1.0, 1.0);
        let gamma = cos_gamma.acos();
        let [luminance, x, y] = self
            .distributions
            .map(|(perez, scale)| scale * perez.value(cos_zenith, gamma, cos_gamma));
        xyz_to_rgb(xyy_to_xyz(x, y, luminance.max(0.0)))
    }
}

/// Luminance (kcd/m^2) and chromaticity x, y of the zenith, for a sun at this zenith angle.
fn zenith(sun_zenith: f32, turbidity: f32) -> [f32; 3] {
    let chi = (4.0 / 9.0 - turbidity / 120.0) * (PI - 2.0 * sun_zenith);
    let luminance = (4.0453 * turbidity - 4.9710) * chi.tan() - 0.2155 * turbidity + 2.4192;
    let s = sun_zenith;
    let cubic = |[c3, c2, c1, c0]: [f32; 4]| ((c3 * s + c2) * s + c1) * s + c0;
    let chromaticity = |[quadratic, linear, constant]: [[f32; 4]; 3]| {
        (cubic(quadratic) * turbidity + cubic(linear)) * turbidity + cubic(constant)
    };
    [
        luminance,
        chromaticity([
            [0.001_66, -0.003_75, 0.002_09, 0.0],
            [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
            [0.116_93, -0.211_96, 0.060_52, 0.258_86],
        ]),
        chromaticity([
            [0.002_75, -0.006_10, 0.003_17, 0.0],
            [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
            [0.153_46, -0.267_56, 0.066_70, 0.266_88],
        ]),
    ]
}

/// A clear sky, without the sun's disk.
#[derive(Clone, Debug)]
pub struct Sky {
    dome: Dome,
    scale: f32,
    /// Radiance of the ground.
    ground: Vec3,
    distribution: SphereDistribution,
}

impl Sky {
    /// The sky around a sun in `sun_direction` (unit vector, +Y up). `turbidity` is clamped to 2 .. 10, the
    /// range the model was fitted on; `strength` multiplies.
    pub fn new(sun_direction: Vec3, turbidity: f32, strength: f32) -> Self {
        let dome = Dome::new(sun_direction, turbidity.clamp(2.0, 10.0));
        let scale = strength / KILOCANDELA_PER_UNIT;
        let ground = GROUND_ALBEDO / PI * scale * horizontal_irradiance(&dome);
        let (width, height) = CELLS;
        let distribution = SphereDistribution::new(width, height, |column, row| {
            let theta = PI * (row as f32 + 0.5) / height as f32;
            let azimuth = (column as f32 + 0.5) / width as f32;
            let direction = latlong::direction(Vec2::new(azimuth, theta.cos()));
            luminance(radiance(&dome, scale, ground, direction))
        });
        Self {
            dome,
            scale,
            ground,
            distribution,
        }
    }
}

/// The sky's irradiance on level ground, in the dome's units, by the midpoint rule.
fn horizontal_irradiance(dome: &Dome) -> Vec3 {
    let (columns, rows) = (32, 16);
    let (dphi, dtheta) = (2.0 * PI / columns as f32, FRAC_PI_2 / rows as f32);
    let mut sum = Vec3::ZERO;
    for row in 0..rows {
        let (sin, cos) = ((row as f32 + 0.5) * dtheta).sin_cos();
        for column in 0..columns {
            let azimuth = (column as f32 + 0.5) / columns as f32;
            let direction = latlong::direction(Vec2::new(azimuth, cos));
            sum += dome.color(direction) * (cos * sin * dphi * dtheta);
        }
    }
    sum
}

fn radiance(dome: &Dome, scale: f32, ground: Vec3, direction: Vec3) -> Vec3 {
    let sky = scale * dome.color(direction);
    if direction.y >= 0.0 {
        return sky;
    }
    ground.lerp(sky, (direction.y / HAZE).exp())
}

impl InfiniteLight for Sky {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        radiance(&self.dome, self.scale, self.ground, direction)
    }

    fn sample(&self, _normal: Vec3, u: Vec2) -> LightSample {
        let (direction, pdf) = self.distribution.sample(u);
        LightSample::far(direction, self.radiance(direction), pdf)
    }

    fn brightness(&self) -> f32 {
        self.distribution.integral()
    }

    fn pdf(&self, _normal: Vec3, direction: Vec3) -> f32 {
        self.distribution.pdf(direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun_at(elevation_degrees: f32) -> Vec3 {
        let (sin, cos) = elevation_degrees.to_radians().sin_cos();
        Vec3::new(cos, sin, 0.0)
    }

    #[test]
    fn finite_and_not_negative_everywhere() {
        for turbidity in [1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0] {
            for elevation in [-20.0, 0.0, 0.5, 10.0, 45.0, 90.0] {
                let sky = Sky::new(sun_at(elevation), turbidity, 1.0);
                for i in 0..500 {
                    let height = 1.0 - i as f32 / 249.5;
                    let d = latlong::direction(Vec2::new((i as f32 * 0.618).fract(), height));
                    let radiance = sky.radiance(d);
                    assert!(radiance.is_finite() && radiance.min_element() >= 0.0);
                    assert!(radiance.max_element() > 0.0);
                    assert!(sky.pdf(Vec3::Y, d) > 0.0);
                }
            }
        }
    }

    #[test]
    fn the_zenith_has_the_luminance_of_the_paper() {
        let (turbidity, elevation) = (3.0, 40.0_f32);
        let dome = Dome::new(sun_at(elevation), turbidity);
        let expected = zenith((90.0 - elevation).to_radians(), turbidity);
        assert!((luminance(dome.color(Vec3::Y)) - expected[0]).abs() < 1e-2 * expected[0]);
    }

    #[test]
    fn a_clear_sky_is_blue_away_from_the_sun_and_brightest_around_it() {
        let sky = Sky::new(sun_at(40.0), 2.5, 1.0);
        let zenith = sky.radiance(Vec3::Y);
        assert!(zenith.z > 1.5 * zenith.x);
        let around_sun = sky.radiance(sun_at(43.0));
        assert!(luminance(around_sun) > 2.0 * luminance(zenith));
    }

    #[test]
    fn the_horizon_has_no_seam() {
        let sky = Sky::new(sun_at(30.0), 3.0, 1.0);
        let above = sky.radiance(Vec3::new(0.0, 1e-5, -1.0).normalize());
        let below = sky.radiance(Vec3::new(0.0, -1e-5, -1.0).normalize());
        assert!(above.abs_diff_eq(below, 1e-3));
    }

    #[test]
    fn sky_light_on_the_ground_is_that_of_a_clear_day() {
        // Measured clear skies give 10 to 20 klx beside the sun's own light; the model is on the bright side.
        let klx = luminance(horizontal_irradiance(&Dome::new(sun_at(40.0), 3.0)));
        assert!((10.0..30.0).contains(&klx), "{klx}");
    }
}
