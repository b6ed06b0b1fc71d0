//! One base triangle's piece of the displaced surface, in f64: the definition that every fast path is held to.

use glam::{DVec2, DVec3};

use super::{DisplacementMap, HeightSample};
use crate::ray::Aabb;

/// S(b) over one base triangle, and its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'m> {
    /// v_i, world units.
    pub vertices: [DVec3; 3],
    /// n_i, unit.
    pub normals: [DVec3; 3],
    /// st_i after the UV transform, in texel coordinates, moved by whole periods of the map towards 0.
    pub texels: [DVec2; 3],
    /// The heights.
    pub map: &'m DisplacementMap,
    /// World units per unit of height.
    pub scale: f64,
    /// The height that displaces by nothing.
    pub midlevel: f64,
}

/// A point of S with its tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint {
    /// S(b).
    pub position: DVec3,
    /// dS/du (u = b1).
    pub du: DVec3,
    /// dS/dv (v = b2).
    pub dv: DVec3,
    /// dS/du x dS/dv, of more digits than that product: over a triangle that is tiny beside D both run along N.
    pub ng: DVec3,
    /// D.
    pub displacement: f64,
}

impl Patch<'_> {
    /// P(b) = sum b_i v_i.
    #[inline(always)]
    pub fn base(&self, u: f64, v: f64) -> DVec3 {
        weighted(&self.vertices, u, v)
    }

    /// N'(b) = sum b_i n_i, not normalised.
    #[inline(always)]
    pub fn normal(&self, u: f64, v: f64) -> DVec3 {
        weighted(&self.normals, u, v)
    }

    /// Texel coordinates at b.
    #[inline(always)]
    pub fn texel(&self, u: f64, v: f64) -> DVec2 {
        let t = &self.texels;
        t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])
    }

    /// D at b.
    pub fn displacement(&self, u: f64, v: f64) -> f64 {
        self.scale * (self.map.sample(self.texel(u, v)).height - self.midlevel)
    }

    /// Unit normal of the flat base triangle, counter-clockwise outward.
    pub fn face_normal(&self) -> DVec3 {
        let [a, b, c] = self.vertices;
        (b - a).cross(c - a).normalize()
    }

    /// Smallest and largest D over the triangle, conservative.
    pub fn range(&self) -> [f64; 2] {
        self.displacements(self.map.range_over(self.texels))
    }

    /// The range of D for a range of heights.
    pub fn displacements(&self, (low, high): (f32, f32)) -> [f64; 2] {
        let [a, b] = [low, high].map(|h| self.scale * (f64::from(h) - self.midlevel));
        [a.min(b), a.max(b)]
    }

    /// The range of w = D/|N'| for a range of D, conservative, and never empty.
    pub fn offsets_of(&self, [low, high]: [f64; 2]) -> [f32; 2] {
        let [a, b, c] = self.vertices;
        let size = (b - a).abs().max((c - a).abs()).max_element();
        let slack = 1e-6 * (low.abs().max(high.abs()) + size);
        let stretch = self.stretch();
        let (low, high) = (low - slack, high + slack);
        [
            low.min(low * stretch) as f32,
            high.max(high * stretch) as f32,
        ]
    }

    /// A range of D that holds the one which [`Self::offsets_of`] was given.
    pub fn displacements_of(&self, [low, high]: [f32; 2]) -> [f64; 2] {
        let inverse = 1.0 / self.stretch();
        let (low, high) = (f64::from(low), f64::from(high));
        [low.max(low * inverse), high.min(high * inverse)]
    }

    /// |w| is at most this times |D|.
    fn stretch(&self) -> f64 {
        1.000_001 / self.shortest_normal()
    }

    /// |N'(b)| at its smallest over the triangle, from below: |N'|^2 = 1 - sum b_i b_j |n_i - n_j|^2 and the sum
    /// of the b_i b_j is at most 1/3. Never less than [`Self::LEAST_NORMAL`].
    pub fn shortest_normal(&self) -> f64 {
        let [a, b, c] = self.normals;
        let spread = a
            .distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
        (1.0 - spread / 3.0)
            .max(Self::LEAST_NORMAL * Self::LEAST_NORMAL)
            .sqrt()
    }

    /// Where opposed normals cancel to less than this, the surface is cut off.
    pub const LEAST_NORMAL: f64 = 1e-3;

    /// Conservative bounds of S between some corners, for a range of w: every point is sum b_i (v_i + w n_i) for one w of the range, so it
    /// is in the hull of these; and no further than the largest |D| from the triangle.
    pub(crate) fn hull<const N: usize>(&self, corners: [usize; N], offsets: [f32; 2]) -> Aabb {
        let offsets = offsets.map(f64::from);
        let (mut hull_min, mut hull_max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in corners {
            let (v, n) = (self.vertices[corner], self.normals[corner]);
            (min, max) = (min.min(v), max.max(v));
            for w in offsets {
                (hull_min, hull_max) = (hull_min.min(v + w * n), hull_max.max(v + w * n));
            }
        }
        // w |N'| = D and |N'| <= 1.
        let reach = offsets[0].abs().max(offsets[1].abs());
        Aabb {
            min: hull_min.max(min - reach).as_vec3(),
            max: hull_max.min(max + reach).as_vec3(),
        }
    }

    /// The exact inverse of P(b) + w N'(b) = x near a guess, by Newton's method: (u, v, w), or `None` where it does
    /// not converge.
    pub fn project(&self, x: DVec3, mut u: f64, mut v: f64) -> Option<DVec3> {
        let face = self.face_normal();
        let mut w = (x - self.base(u, v)).dot(face) / self.normal(u, v).dot(face);
        for _ in 0..16 {
            let normal = self.normal(u, v);
            let du = self.vertices[1] - self.vertices[0] + w * (self.normals[1] - self.normals[0]);
            let dv = self.vertices[2] - self.vertices[0] + w * (self.normals[2] - self.normals[0]);
            let step = solve([du, dv, normal], x - self.base(u, v) - w * normal)?;
            (u, v, w) = (u + step.x, v + step.y, w + step.z);
            if step.x.abs().max(step.y.abs()) < 1e-12 {
                return Some(DVec3::new(u, v, w));
            }
        }
        None
    }

    /// S, dS/du and dS/dv at b:
    /// dS = dA + dD N, dA = dP + D (dN' - N (N . dN')) / |N'| with N = N'/|N'|.
    #[inline(always)]
    pub fn point(&self, u: f64, v: f64) -> PatchPoint {
        self.point_of(self.map.sample(self.texel(u, v)), u, v)
    }

    /// The same for another height and gradient of the map there.
    #[inline(always)]
    pub fn point_of(&self, sample: HeightSample, u: f64, v: f64) -> PatchPoint {
        let displacement = self.scale * (sample.height - self.midlevel);
        let raw_normal = self.normal(u, v);
        // Finite, so that where normals cancel S is on the base if D is 0.
        let inverse_length = raw_normal.length_recip().min(f64::MAX);
        let normal = raw_normal * inverse_length;
        let tangent = |i: usize| {
            let dd = self.scale * sample.gradient.dot(self.texels[i] - self.texels[0]);
            let dn = self.normals[i] - self.normals[0];
            let da = self.vertices[i] - self.vertices[0]
                + displacement * inverse_length * (dn - normal * normal.dot(dn));
            (da, dd)
        };
        let ((du, rise_u), (dv, rise_v)) = (tangent(1), tangent(2));
        PatchPoint {
            position: self.base(u, v) + displacement * normal,
            du: du + rise_u * normal,
            dv: dv + rise_v * normal,
            // N x N is left out.
            ng: du.cross(dv) + normal.cross(rise_u * dv - rise_v * du),
            displacement,
        }
    }
}

/// The solution of [a b c] x = r by Cramer's rule; `None` for a singular or non-finite system.
pub(crate) fn solve([a, b, c]: [DVec3; 3], r: DVec3) -> Option<DVec3> {
    let bc = b.cross(c);
    let x = DVec3::new(r.dot(bc), a.dot(r.cross(c)), a.dot(b.cross(r))) / a.dot(bc);
    x.is_finite().then_some(x)
}

#[inline(always)]
fn weighted(x: &[DVec3; 3], u: f64, v: f64) -> DVec3 {
    x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Texels, Wrap};

    #[test]
    fn tangents_are_difference_quotients() {
        let map = DisplacementMap::new(
            3,
            3,
            Texels::U8(vec![0, 50, 9, 200, 255, 3, 70, 80, 90]),
            Wrap::Repeat,
        );
        let map = map.unwrap();
        let patch = Patch {
            vertices: [
                DVec3::ZERO,
                DVec3::new(1.0, 0.1, 0.0),
                DVec3::new(0.2, 1.0, 0.3),
            ],
            normals: [
                DVec3::Z,
                DVec3::new(0.6, 0.0, 0.8),
                DVec3::new(0.0, -0.28, 0.96),
            ],
            texels: [
                DVec2::new(0.2, 0.3),
                DVec2::new(0.9, 0.4),
                DVec2::new(0.3, 0.95),
            ],
            map: &map,
            scale: 0.7,
            midlevel: 0.25,
        };
        let (u, v, e) = (0.3, 0.4, 1e-6);
        let p = patch.point(u, v);
        let du = (patch.point(u + e, v).position - patch.point(u - e, v).position) / (2.0 * e);
        let dv = (patch.point(u, v + e).position - patch.point(u, v - e).position) / (2.0 * e);
        assert!((p.du - du).length() < 1e-8 && (p.dv - dv).length() < 1e-8);
        assert!((p.ng - du.cross(dv)).length() < 1e-8);
        assert!((p.displacement - patch.displacement(u, v)).abs() < 1e-15);
        let x = patch.base(u, v) + 0.3 * patch.normal(u, v);
        let found = patch.project(x, 0.1, 0.1).unwrap();
        assert!((found - DVec3::new(u, v, 0.3)).length() < 1e-10);
    }
}
