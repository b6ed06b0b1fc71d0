//! How much of the light each microfacet lobe returns: the energy that single scattering loses is what the
//! multiple-scattering lobes give back (Kulla and Conty, "Revisiting Physically Based Shading at Imageworks",
//! SIGGRAPH 2017 course).
//!
//! Tables are integrated once, at their first use, over cos(theta) and roughness; between their entries they
//! are linear.

use std::f32::consts::PI;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::fresnel::{dielectric, reflect, refract, schlick_weight};
use super::{SMOOTHEST, ggx};

/// Entries along cos(theta) and along roughness.
const SIDE: usize = 32;

/// Directions per entry.
const SAMPLES: usize = 512;

/// Abscissas and weights of the 5-point Gauss-Legendre rule on [0, 1], for means over the hemisphere.
const GAUSS: [(f32, f32); 5] = [
    (0.046_910_08, 0.118_463_44),
    (0.230_765_34, 0.239_314_34),
    (0.5, 0.284_444_44),
    (0.769_234_66, 0.239_314_34),
    (0.953_089_9, 0.118_463_44),
];

/// Makes the tables now, that of sheen and that of rough glass where these are asked for, so that no sample waits for them.
pub fn make_tables(sheen: bool, rough_glass: bool) {
    LazyLock::force(&REFLECTION_MEANS);
    if sheen {
        LazyLock::force(&SHEEN);
    }
    if rough_glass {
        LazyLock::force(&GLASS);
    }
}

/// The cosine-weighted mean of `f(cos)` over the hemisphere.
pub fn hemisphere_mean(f: impl Fn(f32) -> f32) -> f32 {
    GAUSS.iter().map(|&(cos, w)| w * 2.0 * cos * f(cos)).sum()
}

/// The part of light that a GGX reflection lobe returns into all directions, for Schlick's Fresnel term: it is
/// linear in the reflectances at normal and at grazing incidence (Karis, "Real Shading in Unreal Engine 4", 2013).
pub fn reflection(f0: f32, f90: f32, cos: f32, alpha: f32) -> f32 {
    let [normal, grazing] = REFLECTION.at(cos, alpha);
    f0 * normal + f90 * grazing
}

/// The mean of [`reflection`] over the hemisphere.
pub fn reflection_mean(f0: f32, f90: f32, alpha: f32) -> f32 {
    let (y, fy) = cell(alpha.sqrt(), SIDE);
    let [normal, grazing] = Vec2::from(REFLECTION_MEANS[y])
        .lerp(Vec2::from(REFLECTION_MEANS[y + 1]), fy)
        .to_array();
    f0 * normal + f90 * grazing
}

/// By roughness alone: what is linear in the table's rows has means that are.
static REFLECTION_MEANS: LazyLock<Vec<[f32; 2]>> = LazyLock::new(|| {
    let rows = (0..SIDE).map(|y| {
        let alpha = (y as f32 / (SIDE - 1) as f32).powi(2);
        [0, 1].map(|k| hemisphere_mean(|cos| REFLECTION.at(cos, alpha)[k]))
    });
    rows.collect()
});

/// What the sheen lobe of colour 1 returns.
pub fn sheen(cos: f32, alpha: f32) -> f32 {
    SHEEN.at(cos, alpha)[0]
}

/// Reflected and transmitted together by a rough dielectric of relative index `eta`, as energy.
pub fn glass(cos: f32, alpha: f32, eta: f32) -> f32 {
    GLASS.at(cos, alpha, eta)
}

/// The mean of [`glass`] over the hemisphere.
pub fn glass_mean(alpha: f32, eta: f32) -> f32 {
    hemisphere_mean(|cos| glass(cos, alpha, eta))
}

static REFLECTION: LazyLock<Table> = LazyLock::new(|| {
    Table::new(|v, alpha| {
        let mut sum = [0.0; 2];
        for half in normals(v, alpha) {
            let l = reflect(v, half);
            if l.z > 0.0 {
                let unmasked = ggx::masking_shadowing(v, l, alpha) / ggx::masking(v, alpha);
                let at_grazing = schlick_weight(v.dot(half));
                sum[0] += unmasked * (1.0 - at_grazing);
                sum[1] += unmasked * at_grazing;
            }
        }
        sum.map(|s| s / SAMPLES as f32)
    })
});

static SHEEN: LazyLock<Table> = LazyLock::new(|| {
    Table::new(|v, alpha| {
        let directions = points().map(super::cosine_hemisphere);
        let sum: f32 = directions
            .map(|l| PI * super::sheen(v, l, alpha) / l.z)
            .sum();
        [sum / SAMPLES as f32, 0.0]
    })
});

/// Microfacet normals visible from `v`.
fn normals(v: Vec3, alpha: f32) -> impl Iterator<Item = Vec3> {
    points().map(move |u| ggx::sample_visible_normal(v, alpha, u))
}

/// Hammersley's points.
fn points() -> impl Iterator<Item = Vec2> {
    (0..SAMPLES as u32).map(|i| {
        let radical_inverse = i.reverse_bits() as f32 / (u32::MAX as f32 + 1.0);
        Vec2::new(radical_inverse, (i as f32 + 0.5) / SAMPLES as f32)
    })
}

/// Two functions of (cos, roughness).
struct Table(Vec<[f32; 2]>);

impl Table {
    fn new(entry: impl Fn(Vec3, f32) -> [f32; 2]) -> Self {
        let axis = |i: usize| i as f32 / (SIDE - 1) as f32;
        let entries =
            (0..SIDE * SIDE).map(|i| entry(viewer(axis(i % SIDE)), alpha(axis(i / SIDE))));
        Self(entries.collect())
    }

    fn at(&self, cos: f32, alpha: f32) -> [f32; 2] {
        let (x, fx) = cell(cos, SIDE);
        let (y, fy) = cell(alpha.sqrt(), SIDE);
        let entry = |x: usize, y: usize| Vec2::from(self.0[y * SIDE + x]);
        let low = entry(x, y).lerp(entry(x + 1, y), fx);
        let high = entry(x, y + 1).lerp(entry(x + 1, y + 1), fx);
        low.lerp(high, fy).to_array()
    }
}

static GLASS: LazyLock<GlassTable> = LazyLock::new(GlassTable::new);

/// Energy kept by a rough dielectric, over (cos, roughness, index).
struct GlassTable(Vec<f32>);

impl GlassTable {
    const COS: usize = 24;
    const ROUGHNESS: usize = 12;
    /// Even: no entry stands at an index of 1, where nothing is bent and the table is not asked.
    const INDEX: usize = 26;

    fn new() -> Self {
        let axis = |i: usize, n: usize| i as f32 / (n - 1) as f32;
        let (nx, ny, nz) = (Self::COS, Self::ROUGHNESS, Self::INDEX);
        let entries = (0..nx * ny * nz).map(|i| {
            let v = viewer(axis(i % nx, nx));
            let alpha = alpha(axis(i / nx % ny, ny));
            Self::entry(v, alpha, Self::eta(axis(i / (nx * ny), nz)))
        });
        Self(entries.collect())
    }

    /// From the table's coordinate to the index: (eta - 1) / (eta + 1) goes from -0.5 to 0.5, eta from 1/3 to 3.
    fn eta(z: f32) -> f32 {
        let contrast = z - 0.5;
        (1.0 + contrast) / (1.0 - contrast)
    }

    fn entry(v: Vec3, alpha: f32, eta: f32) -> f32 {
        let kept = normals(v, alpha).map(|half| {
            let unmasked = |l: Vec3| ggx::masking_shadowing(v, l, alpha) / ggx::masking(v, alpha);
            let reflectance = dielectric(v.dot(half), eta);
            let up = Some(reflect(v, half)).filter(|l| l.z > 0.0);
            let down = refract(v, half, eta).filter(|l| l.z < 0.0);
            reflectance * up.map_or(0.0, unmasked)
                + (1.0 - reflectance) * down.map_or(0.0, unmasked)
        });
        kept.sum::<f32>() / SAMPLES as f32
    }

    fn at(&self, cos: f32, alpha: f32, eta: f32) -> f32 {
        let (nx, ny) = (Self::COS, Self::ROUGHNESS);
        let (x, fx) = cell(cos, nx);
        let (y, fy) = cell(alpha.sqrt(), ny);
        let (z, fz) = cell((eta - 1.0) / (eta + 1.0) + 0.5, Self::INDEX);
        let mut sum = 0.0;
        for (dz, wz) in [(0, 1.0 - fz), (1, fz)] {
            for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
                let row = ((z + dz) * ny + y + dy) * nx + x;
                sum += wz * wy * ((1.0 - fx) * self.0[row] + fx * self.0[row + 1]);
            }
        }
        sum
    }
}

fn viewer(cos: f32) -> Vec3 {
    let cos = cos.max(1e-3);
    Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

fn alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(SMOOTHEST)
}

/// The entry below `x` (in 0 .. 1) of `n`, and how far `x` is towards the next.
fn cell(x: f32, n: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let first = (x as usize).min(n - 2);
    (first, x - first as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_mirror_returns_everything_and_a_rough_one_less() {
        assert!((reflection(1.0, 1.0, 0.7, SMOOTHEST) - 1.0).abs() < 2e-3);
        // Kulla and Conty's figure: at alpha 1 a white conductor loses about 60 % at worst, 40 % on average.
        let mean = hemisphere_mean(|cos| reflection(1.0, 1.0, cos, 1.0));
        assert!((0.4..0.7).contains(&mean), "{mean}");
    }

    #[test]
    fn smooth_glass_keeps_everything_on_both_sides() {
        for eta in [1.5, 1.0 / 1.5, 1.33] {
            for cos in [0.2, 0.6, 1.0] {
                assert!(
                    (glass(cos, SMOOTHEST, eta) - 1.0).abs() < 0.01,
                    "{eta} {cos}"
                );
                assert!(glass(cos, 1.0, eta) < 1.0);
            }
        }
    }

    #[test]
    fn means_by_the_table_are_those_by_the_rule() {
        for alpha in [SMOOTHEST, 0.01, 0.2, 0.7, 1.0] {
            let exact = hemisphere_mean(|cos| reflection(0.04, 1.0, cos, alpha));
            let found = reflection_mean(0.04, 1.0, alpha);
            assert!((found - exact).abs() < 1e-5, "{alpha}: {found} {exact}");
        }
    }

    #[test]
    fn the_rule_integrates_the_cosine_and_schlick() {
        assert!((hemisphere_mean(|_| 1.0) - 1.0).abs() < 1e-5);
        assert!((hemisphere_mean(schlick_weight) - 1.0 / 21.0).abs() < 1e-5);
    }
}
