//! Shading normals of the displaced surface.

use glam::{DVec2, DVec3};

use super::frames::{CornerFrames, Frame};
use super::{HeightSample, Patch};

/// Which normal of the displaced surface is shaded by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingNormals {
    /// Continuous wherever the base mesh's normals and texture coordinates are, and the surface's own where the base is flat; both but
    /// for a mean over one texel.
    #[default]
    Smooth,
    /// The paper's Ns' = Ns - Ng + N' (equations 18 and 26), which jumps at the base's edges.
    Paper,
    /// The surface's own, with a crease at every line between texels.
    Geometric,
}

impl ShadingNormals {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Smooth, Self::Paper, Self::Geometric];

    /// `smooth`, `paper` or `geometric`, as in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::Paper => "paper",
            Self::Geometric => "geometric",
        }
    }
}

/// Radians, to first order, that smoothing over a texel turns a normal by at most. Texels that resolve a relief turn by less than twice that from one
/// to the next. Where they turn by more, their edges are the relief, and a normal that is smooth across them shades another surface:
/// on texels of noise light from a low angle was 3.5 % off without this limit.
const MOST_APART: f64 = 0.1;

/// The normal of the displaced surface in the frame that is interpolated between the triangle's corners, unit length. `sample` is D's height and
/// gradient per texel there.
///
/// With N = N'/|N'|, A = dP/ds + D (dN'/ds)/|N'| and B likewise along t, both without their parts along N, the tangents of S are
/// A + D_s N and B + D_t N, and their product over N . (A x B) is
///
/// ```text
/// N - D_s (B x N)/(N . (A x B)) - D_t (N x A)/(N . (A x B))
/// ```
///
/// Where the frame is the face's own, as on a flat base, that is the normal of S. It is at most [`MOST_APART`] from what the map's `own`
/// gradient makes. `None` where the frame has no area, or the displacement turns it over.
pub fn framed(
    patch: &Patch<'_>,
    frames: &CornerFrames,
    sample: HeightSample,
    own: DVec2,
    u: f64,
    v: f64,
) -> Option<DVec3> {
    let raw = patch.normal(u, v);
    let inverse_length = raw.length_recip();
    let normal = raw * inverse_length;
    let displacement = patch.scale * (sample.height - patch.midlevel);
    let [along, turn] = Frame::between(frames, [1.0 - u - v, u, v]);
    let flat = |x: DVec3| x - normal * normal.dot(x);
    let base = along.map(flat);
    let [a, b] = [0, 1].map(|k| base[k] + displacement * inverse_length * flat(turn[k]));
    let area = normal.dot(a.cross(b));
    let whole = normal.dot(base[0].cross(base[1]));
    // Less is a frame that is a line, or one that the displacement folds.
    const LEAST: f64 = 1e-3;
    let is_sound = area * whole.signum() > LEAST * whole.abs();
    if !is_sound {
        return None;
    }
    let rise = |slope: DVec2| (slope.x * b.cross(normal) + slope.y * normal.cross(a)) / area;
    let own = rise(patch.scale * own);
    let apart = rise(patch.scale * sample.gradient) - own;
    let most = MOST_APART * (1.0 + own.length_squared());
    let change = own + apart * (most / apart.length().max(most));
    (normal - change).try_normalize()
}

/// The paper's smooth displaced normal Ns' = Ns - Ng + N' (its equations 18 and 26), unit length: the change that
/// the displacement makes to the flat face's normal Ng, applied to the interpolated normal Ns.
///
/// N' is the normal of the face displaced along Ng, taken analytically: Ng - grad D, normalised, with D's gradient
/// in the face's plane from a gradient of the map, in heights per texel.
pub fn paper(patch: &Patch<'_>, gradient: DVec2, u: f64, v: f64) -> DVec3 {
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
        let p = patch(&map, [DVec3::Z; 3]);
        let n = paper(&p, map.smooth(p.texel(0.3, 0.3), 2.0).gradient, 0.3, 0.3);
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
        assert!(
            (paper(&p, DVec2::ZERO, 0.25, 0.5) - p.normal(0.25, 0.5).normalize()).length() < 1e-12
        );
    }
}
