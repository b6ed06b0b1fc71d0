//! Shading normals of the displaced surface.

use glam::DVec3;

use crate::surface::Patch;

/// The paper's smooth displaced normal Ns' = Ns - Ng + N' (its equations 18 and 26), unit length: the change that
/// the displacement makes to the flat face's normal Ng, applied to the interpolated normal Ns.
///
/// N' is the normal of the face displaced along Ng, taken analytically: Ng - grad D, normalised, with D's gradient
/// in the face's plane from the map's gradient without jumps at texel borders.
pub fn smooth(patch: &Patch<'_>, u: f64, v: f64) -> DVec3 {
    let [v0, v1, v2] = patch.vertices;
    let (e1, e2) = (v1 - v0, v2 - v0);
    let face = patch.face_normal();
    let by_texel = patch.scale * patch.map.smooth_gradient(patch.texel(u, v));
    let (d1, d2) = (
        by_texel.dot(patch.texels[1] - patch.texels[0]),
        by_texel.dot(patch.texels[2] - patch.texels[0]),
    );
    // The gradient g in the plane has g . e1 = d1 and g . e2 = d2: the dual basis.
    let dual = |edge: DVec3| edge.cross(face) / e1.cross(e2).dot(face);
    let gradient = d1 * dual(e2) - d2 * dual(e1);
    let displaced = (face - gradient).normalize();
    let smooth = patch.normal(u, v).normalize();
    (smooth - face + displaced).normalize_or(displaced)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{DisplacementMap, Texels, Wrap};
    use glam::DVec2;

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
