//! What a smooth interface reflects and how it bends what passes.

use glam::Vec3;

/// Fresnel reflectance: Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Eurographics 1994.
///
/// At grazing angles it reaches [`grazing`].
pub fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    f0 + (Vec3::splat(grazing(f0)) - f0) * schlick_weight(cos)
}

/// How far Schlick's reflectance is on its way from normal to grazing incidence.
pub fn schlick_weight(cos: f32) -> f32 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// Reflectance at grazing angles: 1, or less where `f0` is below 0.02, which no real surface has: so a
/// reflectance of 0 turns the lobe off (Lagarde and de Rousiers, "Moving Frostbite to PBR", 2014).
pub fn grazing(f0: Vec3) -> f32 {
    (50.0 * f0.element_sum() / 3.0).min(1.0)
}

/// Unpolarised reflectance of a dielectric interface. `cos` (0 .. 1) is on the viewer's side; `eta` is the
/// index of refraction beyond over that on the viewer's side. 1 in total reflection.
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let sin2_beyond = (1.0 - cos * cos) / (eta * eta);
    if sin2_beyond >= 1.0 {
        return 1.0;
    }
    let cos_beyond = (1.0 - sin2_beyond).sqrt();
    let parallel = (eta * cos - cos_beyond) / (eta * cos + cos_beyond);
    let perpendicular = (cos - eta * cos_beyond) / (cos + eta * cos_beyond);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Where `v`, pointing away from the interface, goes on beyond it by Snell's law; `None` in total reflection.
/// `normal` is on the side of `v`, `eta` as in [`dielectric`].
pub fn refract(v: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos = v.dot(normal);
    let sin2_beyond = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_beyond >= 1.0 {
        return None;
    }
    let cos_beyond = (1.0 - sin2_beyond).sqrt();
    Some(((cos / eta - cos_beyond) * normal - v / eta).normalize())
}

/// The mirror direction of `v` about `normal`.
pub fn reflect(v: Vec3, normal: Vec3) -> Vec3 {
    2.0 * v.dot(normal) * normal - v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_limits() {
        // ((n - 1) / (n + 1))^2 from either side; nothing at Brewster's angle of the parallel part; all at grazing.
        for eta in [1.5, 1.0 / 1.5] {
            assert!((dielectric(1.0, eta) - 0.04).abs() < 1e-6);
            assert!((dielectric(0.0, eta) - 1.0).abs() < 1e-6);
        }
        let brewster = 1.5_f32.atan();
        // There only the perpendicular part is left: half of ((n^2 - 1) / (n^2 + 1))^2.
        let expected = 0.5 * (1.25_f32 / 3.25).powi(2);
        assert!((dielectric(brewster.cos(), 1.5) - expected).abs() < 1e-6);
        assert_eq!(dielectric(0.5, 1.0 / 1.5), 1.0);
    }

    #[test]
    fn refraction_obeys_snell_and_can_be_gone_back() {
        for eta in [1.5, 1.33, 1.0 / 1.2] {
            for theta in [0.0, 0.3, 0.8_f32] {
                let v = Vec3::new(theta.sin(), 0.0, theta.cos());
                let Some(t) = refract(v, Vec3::Z, eta) else {
                    panic!("no total reflection at {theta}");
                };
                assert!((theta.sin() - eta * t.x.abs()).abs() < 1e-6);
                assert!(t.z < 0.0 && t.x <= 0.0);
                let back = refract(t, Vec3::NEG_Z, 1.0 / eta);
                assert!(back.is_some_and(|b| b.abs_diff_eq(v, 1e-5)));
            }
        }
        assert_eq!(refract(Vec3::new(0.8, 0.0, 0.6), Vec3::Z, 1.0 / 1.5), None);
    }
}
