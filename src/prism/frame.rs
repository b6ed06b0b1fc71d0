//! The record of one prism: 27 floats, the paper's 108 bytes per base triangle.
//!
//! In the affine frame of the base triangle, x = v0 + b e1 + c e2 + h Ng (Ng unit), a ray is linear, and the
//! vertex normals n_i have components (b, c, h). The parallel offset prism has its corners at height h at
//! v_i + h m_i with m_i = n_i / (n_i . Ng), so the in-plane components of m_i are the first two of n_i over its
//! third; keeping n_i instead of m_i and 1/(n_i . Ng) costs one division when a ray comes, and holds for faces
//! with n_i . Ng <= 0 too. v0 comes from the mesh, so that a ray is moved near the triangle before anything is
//! multiplied (f32 keeps its digits far from the origin); the three floats saved hold the range of the surface.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3, Vec2, Vec3, Vec4};

use crate::surface::Patch;

/// One prism.
pub struct Prism {
    numbers: [f32; 25],
    /// Bits of the smallest and the largest D: an edit of the map changes them in place.
    range: [AtomicU32; 2],
}

const _: () = assert!(size_of::<Prism>() == 108);

const NORMALS: usize = 9;
const TEXELS: usize = 18;
const STRETCH: usize = 24;

impl Prism {
    /// The prism over a patch, for this range of D.
    pub fn new(patch: &Patch<'_>, range: [f64; 2]) -> Self {
        let [v0, v1, v2] = patch.vertices;
        let to_world = DMat3::from_cols(v1 - v0, v2 - v0, patch.face_normal());
        let to_frame = to_world.inverse();
        let mut numbers = [0.0; 25];
        let mut put =
            |at: usize, v: DVec3| numbers[at..at + 3].copy_from_slice(&v.as_vec3().to_array());
        put(0, to_frame.x_axis);
        put(3, to_frame.y_axis);
        put(6, to_frame.z_axis);
        for (i, &n) in patch.normals.iter().enumerate() {
            put(NORMALS + 3 * i, to_frame * n);
        }
        for (i, st) in patch.texels.iter().enumerate() {
            numbers[TEXELS + 2 * i..][..2].copy_from_slice(&st.as_vec2().to_array());
        }
        numbers[STRETCH] = (1.000_001 / patch.shortest_normal()) as f32;
        Self {
            numbers,
            range: outward(range).map(|d| AtomicU32::new(d.to_bits())),
        }
    }

    /// Whether there is room for this range of D.
    pub fn holds(&self, range: [f64; 2]) -> bool {
        super::room::holds(self.range(), outward(range))
    }

    /// Makes room for this range of D; whether there was none.
    pub fn widen(&self, range: [f64; 2]) -> bool {
        super::room::widen([&self.range[0], &self.range[1]], outward(range))
    }

    /// A vector in the frame: (b, c, h, b + c).
    #[inline(always)]
    pub fn vector(&self, d: Vec3) -> Vec4 {
        with_sum(self.column(0) * d.x + self.column(3) * d.y + self.column(6) * d.z)
    }

    /// Smallest and largest D.
    #[inline(always)]
    pub fn range(&self) -> [f32; 2] {
        let [low, high] = &self.range;
        [low, high].map(|d| f32::from_bits(d.load(Ordering::Relaxed)))
    }

    /// The range of w = D / |N'|.
    #[inline(always)]
    pub fn offsets(&self) -> [f32; 2] {
        let ([low, high], stretch) = (self.range(), self.numbers[STRETCH]);
        [low.min(low * stretch), high.max(high * stretch)]
    }

    /// n_i in the frame: (b, c, h, b + c).
    #[inline(always)]
    pub fn normal(&self, i: usize) -> Vec4 {
        with_sum(self.column(NORMALS + 3 * i))
    }

    /// Texel coordinates of vertex i.
    #[inline(always)]
    pub fn texel(&self, i: usize) -> Vec2 {
        Vec2::new(
            self.numbers[TEXELS + 2 * i],
            self.numbers[TEXELS + 2 * i + 1],
        )
    }

    /// The smallest n_i . Ng.
    #[inline(always)]
    pub fn lowest_normal_height(&self) -> f32 {
        self.numbers[NORMALS + 2]
            .min(self.numbers[NORMALS + 5])
            .min(self.numbers[NORMALS + 8])
    }

    /// Three floats as lanes; the fourth lane is whatever follows.
    #[inline(always)]
    fn column(&self, at: usize) -> Vec4 {
        Vec4::from_slice(&self.numbers[at..at + 4])
    }
}

/// A range, outward by a rounding.
fn outward([low, high]: [f64; 2]) -> [f32; 2] {
    let slack = 1e-6 * low.abs().max(high.abs());
    [(low - slack) as f32, (high + slack) as f32]
}

/// (b, c, h, b + c).
#[inline(always)]
fn with_sum(v: Vec4) -> Vec4 {
    v.with_w(v.x + v.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{DisplacementMap, Texels, Wrap};
    use glam::DVec2;

    #[test]
    fn the_frame_has_the_vertices_at_its_corners() {
        let map = DisplacementMap::new(1, 1, Texels::U8(vec![0]), Wrap::Repeat).unwrap();
        let vertices = [
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(2.0, 2.5, 3.0),
            DVec3::new(1.5, 4.0, 2.0),
        ];
        let normals = [
            DVec3::new(0.0, 0.6, 0.8),
            DVec3::Z,
            DVec3::new(0.28, 0.0, 0.96),
        ];
        let patch = Patch {
            vertices,
            normals,
            texels: [DVec2::ZERO; 3],
            map: &map,
            scale: 1.0,
            midlevel: 0.0,
        };
        let prism = Prism::new(&patch, patch.range());
        let near = |a: Vec4, b: Vec4| assert!((a - b).abs().max_element() < 1e-5, "{a} {b}");
        let lift = 0.5 * patch.face_normal();
        let point = |p: DVec3| prism.vector((p - vertices[0]).as_vec3());
        near(point(vertices[0]), Vec4::ZERO);
        near(point(vertices[1] + lift), Vec4::new(1.0, 0.0, 0.5, 1.0));
        near(point(vertices[2] - lift), Vec4::new(0.0, 1.0, -0.5, 1.0));
        for (i, n) in normals.iter().enumerate() {
            near(prism.normal(i), prism.vector(n.as_vec3()));
            assert!((prism.normal(i).z - n.dot(patch.face_normal()) as f32).abs() < 1e-6);
        }
    }
}
