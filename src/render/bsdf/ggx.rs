//! The GGX microfacet distribution (Walter et al., "Microfacet Models for Refraction through Rough Surfaces",
//! EGSR 2007), isotropic, in a basis whose z is the normal.
//!
//! Masking and shadowing are Smith's, height-correlated (Heitz, "Understanding the Masking-Shadowing Function
//! in Microfacet-Based BRDFs", JCGT 3(2), 2014). Normals are drawn from those visible to the viewer (Dupuy and
//! Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023).

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// Density of microfacet normals around `half`, per projected steradian. `alpha` is positive.
pub fn distribution(half: Vec3, alpha: f32) -> f32 {
    // x and y instead of 1 - z^2: a mirror's alpha leaves no digits in the latter.
    let slope = (half.x * half.x + half.y * half.y) / (alpha * alpha) + half.z * half.z;
    1.0 / (PI * alpha * alpha * slope * slope)
}

/// Smith's auxiliary function of a direction with positive z.
fn lambda(v: Vec3, alpha: f32) -> f32 {
    let tan2 = (v.x * v.x + v.y * v.y) / (v.z * v.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// The part of the microfacets that is seen from `v`.
pub fn masking(v: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(v, alpha))
}

/// The part of the microfacets that is seen from both directions.
pub fn masking_shadowing(a: Vec3, b: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(a, alpha) + lambda(b, alpha))
}

/// Density per steradian of the mirror direction of `to_viewer` about a visible normal `half`.
pub fn reflection_pdf(to_viewer: Vec3, half: Vec3, alpha: f32) -> f32 {
    masking(to_viewer, alpha) * distribution(half, alpha) / (4.0 * to_viewer.z)
}

/// A microfacet normal visible from `to_viewer` (z > 0) for a uniform point `u`.
pub fn sample_visible_normal(to_viewer: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    // Stretched by alpha the distribution is a hemisphere's; its visible part is a spherical cap.
    let stretched = (to_viewer * Vec3::new(alpha, alpha, 1.0)).normalize();
    let (sin, cos) = (TAU * u.x).sin_cos();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let radius = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let half = Vec3::new(radius * cos, radius * sin, z) + stretched;
    (half * Vec3::new(alpha, alpha, 1.0)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projected_area_of_microfacets_is_one() {
        for alpha in [0.1, 0.5, 1.0_f32] {
            let n = 2000;
            let sum: f32 = (0..n)
                .map(|i| {
                    let theta = (i as f32 + 0.5) / n as f32 * 0.5 * PI;
                    let half = Vec3::new(theta.sin(), 0.0, theta.cos());
                    distribution(half, alpha) * theta.cos() * theta.sin()
                })
                .sum();
            let area = sum * TAU * 0.5 * PI / n as f32;
            assert!((area - 1.0).abs() < 1e-3, "{alpha} {area}");
        }
    }

    #[test]
    fn sampled_reflections_follow_their_density() {
        // The mean of f / pdf over samples is the integral of f, here the solid angle of a polar cap, for
        // rough surfaces that reach the cap everywhere.
        for (alpha, theta) in [(0.5, 0.3_f32), (1.0, 1.2), (0.8, 0.0)] {
            let to_viewer = Vec3::new(theta.sin(), 0.0, theta.cos());
            let n = 40_000;
            let mut sum = 0.0;
            for i in 0..n {
                let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / n as f32);
                let half = sample_visible_normal(to_viewer, alpha, u);
                let reflected = 2.0 * to_viewer.dot(half) * half - to_viewer;
                if reflected.z > 0.5 {
                    sum += 1.0 / reflection_pdf(to_viewer, half, alpha);
                }
            }
            let solid_angle = sum / n as f32;
            assert!(
                (solid_angle / PI - 1.0).abs() < 0.03,
                "{alpha} {solid_angle}"
            );
        }
    }
}
