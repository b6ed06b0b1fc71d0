//! A base triangle about the middle of a block: P, N', 1/|N'| and the barycentrics as functions of texel coordinates (s, t) from there.

use glam::Vec3;

use super::record::BEFORE;
use super::{Block, Record, SIDE};
use crate::prism::simd::{LANES, Lanes};
use crate::surface::DisplacedSurface;

/// c + c_s s + c_t t.
#[derive(Clone, Copy, Debug, Default)]
pub struct Affine<T> {
    pub c: T,
    pub s: T,
    pub t: T,
}

impl Affine<f32> {
    #[inline(always)]
    pub fn at(&self, s: f32, t: f32) -> f32 {
        self.c + s * self.s + t * self.t
    }

    /// How much it changes at most within half extents.
    #[inline(always)]
    pub fn reach(&self, half: [f32; 2]) -> f32 {
        half[0] * self.s.abs() + half[1] * self.t.abs()
    }

    /// In lanes.
    #[inline(always)]
    pub fn lanes<L: Lanes>(&self, s: L, t: L) -> L {
        s.mul_add(
            L::splat(self.s),
            t.mul_add(L::splat(self.t), L::splat(self.c)),
        )
    }
}

impl Affine<Vec3> {
    #[inline(always)]
    pub fn at(&self, s: f32, t: f32) -> Vec3 {
        self.c + s * self.s + t * self.t
    }
}

/// P and N' along one axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    pub p: Affine<f32>,
    pub n: Affine<f32>,
}

impl Axis {
    /// With another P at the middle, both in other units.
    #[inline(always)]
    pub fn from(self, c: f32, scale: f32) -> Self {
        let scaled = |a: Affine<f32>| Affine {
            c: a.c * scale,
            s: a.s * scale,
            t: a.t * scale,
        };
        Self {
            p: Affine {
                c,
                ..scaled(self.p)
            },
            n: scaled(self.n),
        }
    }
}

/// D of a texel as it is stored: `stored` * `scale` + `offset`.
#[derive(Clone, Copy, Debug)]
pub struct Heights {
    pub scale: f32,
    pub offset: f32,
    /// The largest |D| of the map, with what its parts cancel.
    pub most: f32,
}

impl Heights {
    #[inline(always)]
    pub fn new(surface: &DisplacedSurface) -> Self {
        let (map, displacement) = (surface.map(), surface.displacement());
        let scale = displacement.scale * map.kind().per_unit();
        let offset = -displacement.scale * displacement.midlevel;
        let (low, high) = map.pyramid().range();
        Self {
            scale,
            offset,
            most: (low * scale).abs().max((high * scale).abs()) + offset.abs(),
        }
    }

    /// For other heights of the map too.
    pub fn with_room(self, room: Option<(f32, f32)>, unit: f32) -> Self {
        let Some((low, high)) = room else { return self };
        let of = |height: f32| (height * unit * self.scale).abs() + self.offset.abs();
        Self {
            most: self.most.max(of(low)).max(of(high)),
            ..self
        }
    }
}

/// What of a block does not depend on a ray.
pub struct Middle {
    /// Where it is, in texels from the record's corner.
    pub place: [f32; 2],
    /// From vertex 0.
    from: [f32; 2],
    /// N', in space.
    pub normal: Affine<Vec3>,
    /// |dN'/ds|, |dN'/dt|, and dN'/ds . dN'/dt.
    pub spread: [f32; 2],
    pub twist: f32,
    /// Barycentric coordinates of vertices 1 and 2.
    pub b: [Affine<f32>; 2],
    /// 1/|N'| to first order, and what that is off by.
    pub k: Affine<f32>,
    pub k_off: f32,
    /// |N'| is nowhere in the block less than this part of what it is in the middle.
    pub least: f32,
    /// What roundings are a part of: how far the vectors that make up a point of S go.
    pub size: f32,
}

/// No vertex of a block's leaves is farther from its middle, in texels.
const FARTHEST: f32 = SIDE as f32;

impl Middle {
    /// Whether the series for 1/|N'| is one: everything here is a bound only then.
    #[inline(always)]
    pub fn is_tame(&self) -> bool {
        self.least > 0.25
    }

    #[inline(always)]
    pub fn new<L: Lanes>(record: &Record, block: Block, heights: &Heights) -> Self {
        // The six vectors side by side: |x| + |y| + |z|, and lengths.
        let (x, y, z) = (
            L::from_array(*record.along(0)),
            L::from_array(*record.along(1)),
            L::from_array(*record.along(2)),
        );
        let [_, p_s_sum, p_t_sum, _, n_s_sum, n_t_sum, ..] =
            (x.abs() + y.abs() + z.abs()).to_array();
        let [.., n_s_length, n_t_length, _, _] = (x * x + y * y + z * z).sqrt().to_array();
        let first = record.first();
        let [[left, right], [bottom, top]] = [0, 1].map(|axis| extent(record, block, axis));
        let place = [0.5 * (left + right), 0.5 * (bottom + top)];
        let half = [0.5 * (right - left), 0.5 * (top - bottom)];
        let (ds, dt) = (place[0] - first[0], place[1] - first[1]);
        let [n, n_s, n_t] = [vector(record, 3), vector(record, 4), vector(record, 5)];
        let normal = Affine {
            c: n + ds * n_s + dt * n_t,
            s: n_s,
            t: n_t,
        };
        let spread = [n_s_length, n_t_length];
        let k = 1.0 / normal.c.length();
        let slope = -k * k * k;
        // 1/|N'| along a line is the generating function of the Legendre polynomials, of which none exceeds 1: terms shrink by `turn`.
        let turn = (half[0] * spread[0] + half[1] * spread[1]) * k * (1.0 + 1e-5);
        let least = 1.0 - turn;
        // No less than 1/least, where that is at least 1/4: a chord of a convex function.
        let longer = 1.0 + 4.0 * turn;
        let [b1_s, b1_t, b2_s, b2_t] = *record.slopes();
        let b = |s: f32, t: f32| Affine {
            c: ds * s + dt * t,
            s,
            t,
        };
        // Where vertex 0 is, from the corner, is rounded as well.
        let far_s = ds.abs() + first[0].abs() + FARTHEST;
        let far_t = dt.abs() + first[1].abs() + FARTHEST;
        let along_normals = 2.0 + far_s * n_s_sum + far_t * n_t_sum;
        Self {
            place,
            from: [ds, dt],
            normal,
            spread,
            twist: n_s.dot(n_t),
            b: [b(b1_s, b1_t), b(b2_s, b2_t)],
            k: Affine {
                c: k,
                s: slope * normal.c.dot(n_s),
                t: slope * normal.c.dot(n_t),
            },
            k_off: k * turn * turn * longer + 1e-6 * k,
            least,
            size: far_s * p_s_sum + far_t * p_t_sum + heights.most * k * longer * along_normals,
        }
    }

    /// From vertex 0, in texels.
    #[inline(always)]
    pub fn from(&self) -> [f32; 2] {
        self.from
    }

    /// P and N' along an axis, given by a record's words or what was made of them.
    #[inline(always)]
    pub fn axis(&self, w: &[f32; LANES]) -> Axis {
        let [ds, dt] = self.from;
        Axis {
            p: Affine {
                c: w[0] + ds * w[1] + dt * w[2],
                s: w[1],
                t: w[2],
            },
            n: Affine {
                c: w[3] + ds * w[4] + dt * w[5],
                s: w[4],
                t: w[5],
            },
        }
    }
}

/// The part of a block that may be the triangle's, along an axis, in texels from the record's corner.
#[inline(always)]
pub fn extent(record: &Record, block: Block, axis: usize) -> [f32; 2] {
    let from = u32::from(block.place[axis]);
    let to = (from + SIDE).min(record.end(axis)) as f32;
    let from = from.max(BEFORE as u32) as f32;
    [from, to.max(from)]
}

/// A vector of a record, in space.
#[inline(always)]
fn vector(record: &Record, k: usize) -> Vec3 {
    Vec3::new(record.along(0)[k], record.along(1)[k], record.along(2)[k])
}
