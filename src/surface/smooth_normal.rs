//! Shading normals of the displaced surface.

use glam::{DVec2, DVec3};

use super::Patch;

/// The paper's smooth displaced normal Ns' = Ns - Ng + N' (its equations 18 and 26), unit length: the change that
/// the displacement makes to the flat face's normal Ng, applied to the interpolated normal Ns.
///
/// N' is the normal of the face displaced along Ng, taken analytically: Ng - grad D, normalised, with D's gradient
/// in the face's plane from the map's gradient without jumps at texel borders.
pub fn smooth(patch: &Patch<'_>, u: f64, v: f64) -> DVec3 {
    smooth_by(patch, patch.map.smooth_gradient(patch.texel(u, v)), u, v)
}

/// The same for another gradient of the map, in heights per texel.
pub fn smooth_by(patch: &Patch<'_>, gradient: DVec2, u: f64, v: f64) -> DVec3 {
    let face = patch.face_normal();
    let by_texel = patch.scale * gradient;
    let change = [1, 2].map(|k| by_texel.dot(patch.texels[k] - patch.texels[0]));
    let displaced = (face - in_plane(patch, change)).normalize();
    let smooth = patch.normal(u, v).normalize();
    (smooth - face + displaced).normalize_or(displaced)
}

/// The gradient g in the face's plane of what changes by these amounts along both edges from corner 0: g . e1 = d1 and g . e2 = d2, by
/// the dual basis.
pub fn in_plane(patch: &Patch<'_>, [d1, d2]: [f64; 2]) -> DVec3 {
    let [dual1, dual2] = dual_edges(patch);
    d1 * dual1 + d2 * dual2
}

/// The vectors in the face's plane along which u and v change by their lengths: those of [`in_plane`].
pub fn dual_edges(patch: &Patch<'_>) -> [DVec3; 2] {
    let [v0, v1, v2] = patch.vertices;
    let (e1, e2) = (v1 - v0, v2 - v0);
    let normal = e1.cross(e2);
    let scaled = normal / normal.length_squared();
    [e2.cross(scaled), scaled.cross(e1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{DisplacementMap, Texels, Wrap};

    fn patch(map: &DisplacementMap, normals: [DVec3; 3]) -> Patch<'_> {
        Patch {
            vertices: [
                DVec3::ZERO,
                DVec3::new(2.0, 0.0, 0.0),
                DVec3::new(0.5, 1.0, 0.0),
            ],
            normals,
            texels: [
                DVec2::new(10.0, 10.0),
                DVec2::new(14.0, 10.0),
                DVec2::new(11.0, 12.0),
            ],
            map,
            scale: 3.0,
            midlevel: 0.5,
        }
    }

    #[test]
    fn a_ramp_tilts_a_flat_face_by_its_slope() {
        let ramp = Texels::F32((0..32 * 32).map(|i| (i % 32) as f32 * 0.1).collect());
        let map = DisplacementMap::new(32, 32, ramp, Wrap::Clamp).unwrap();
        // x = 0.5 per texel, so D rises by 3 * 0.1 per texel: slope 0.6 along x.
        let n = smooth(&patch(&map, [DVec3::Z; 3]), 0.3, 0.3);
        assert!(
            (n - DVec3::new(-0.6, 0.0, 1.0).normalize()).length() < 1e-6,
            "{n}"
        );
    }

    #[test]
    fn a_constant_map_keeps_the_interpolated_normal() {
        let map = DisplacementMap::new(2, 2, Texels::U8(vec![90; 4]), Wrap::Repeat).unwrap();
        let normals = [
            DVec3::Z,
            DVec3::new(0.6, 0.0, 0.8),
            DVec3::new(0.0, 0.28, 0.96),
        ];
        let p = patch(&map, normals);
        assert!((smooth(&p, 0.25, 0.5) - p.normal(0.25, 0.5).normalize()).length() < 1e-12);
    }
}
