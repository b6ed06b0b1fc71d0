//! A leaf seen along the ray: five rows of nine texels, displaced and projected, and the cells between them that may hold the ray.

use glam::Vec3;

use super::LEAF;
use super::middle::{Axis, Heights, Middle};
use super::view::View;
use crate::prism::simd::Lanes;
use crate::ray::Aabb;

/// Half a leaf.
pub const HALF: [f32; 2] = [LEAF[0] as f32 / 2.0, LEAF[1] as f32 / 2.0];

/// The texels of a leaf.
pub trait Rows {
    /// Texels 0 to 8 and 1 to 9 of a row of five, as stored. Must be `inline(always)`.
    fn row<L: Lanes>(&self, row: usize) -> [L; 2];
    /// Those at the corners (0,0), (1,0), (0,1) and (1,1) of a cell.
    fn corners(&self, cell: (u32, u32)) -> [f32; 4];
}

/// A leaf of a block.
pub struct Leaf {
    /// Its middle, in texels from the block's.
    pub s: f32,
    pub t: f32,
    /// 1/|N'| to second order: c + c_s s + c_t t + c_ss s^2 + c_st s t + c_tt t^2, from the leaf's middle.
    k: [f32; 6],
    /// How far a vertex may be from where f32 sees it, sideways.
    pub off: f32,
    /// The same along the ray, in ray parameters.
    pub depth_off: f32,
    /// |dN/ds| + |dN/dt| at most, N the unit normal.
    pub turn: f32,
}

impl Leaf {
    /// As the ray sees it; `None` where the normal turns too much for the series.
    #[inline(always)]
    pub fn new(view: &View<'_>, heights: &Heights, s: f32, t: f32) -> Option<Self> {
        let leaf = Self::over(view.middle, heights, s, t)?;
        Some(Self {
            off: view.noise + view.shear * leaf.off,
            depth_off: view.depth_noise + view.per_length * leaf.off,
            ..leaf
        })
    }

    /// In space, without roundings.
    #[inline(always)]
    pub fn over(middle: &Middle, heights: &Heights, s: f32, t: f32) -> Option<Self> {
        let normal = middle.normal.at(s, t);
        let [a, b] = [normal.dot(middle.normal.s), normal.dot(middle.normal.t)];
        let [aa, bb] = middle.spread.map(|n| n * n);
        let per_squared = 1.0 / normal.length_squared();
        let k = per_squared.sqrt();
        let (k3, k5) = (k * per_squared, k * per_squared * per_squared);
        let x = (HALF[0] * middle.spread[0] + HALF[1] * middle.spread[1]) * k * (1.0 + 1e-5);
        // No less than 1 / (1 - x), where x is 1/2 at most: a chord of a convex function.
        let longer = 1.0 + 2.0 * x;
        // The terms of the series from the third on, of which each is below the last times x.
        let remainder = x * x * x * longer;
        let off = heights.most * (1.0 + x) * remainder;
        let leaf = Self {
            s,
            t,
            k: [
                k,
                -a * k3,
                -b * k3,
                0.5 * (3.0 * a * a * k5 - aa * k3),
                3.0 * a * b * k5 - middle.twist * k3,
                0.5 * (3.0 * b * b * k5 - bb * k3),
            ],
            off,
            depth_off: off,
            turn: (middle.spread[0] + middle.spread[1]) * k * longer,
        };
        (x < 0.5).then_some(leaf)
    }

    /// 1/|N'| at a vertex, from the leaf's middle.
    #[inline(always)]
    pub fn k(&self, s: glam::Vec4, t: glam::Vec4) -> glam::Vec4 {
        let [c, cs, ct, css, cst, ctt] = self.k;
        c + s * (cs + s * css) + t * (ct + s * cst + t * ctt)
    }

    /// How far a cell's piece of S may be from the bilinear patch of its corners, where D differs by `rise` between these: half of beta.
    #[inline(always)]
    pub fn beta(&self, rise: f32, most: f32) -> f32 {
        (0.5 * rise + 0.3 * most * self.turn) * self.turn
    }

    /// The cells that may hold the ray: bit 8 j + i for cell (i, j). `rise` is the range of D.
    #[inline(always)]
    pub fn cells<L: Lanes>(
        &self,
        view: &View<'_>,
        heights: &Heights,
        rise: f32,
        rows: &impl Rows,
    ) -> u32 {
        L::step();
        let tolerance = self.off + view.shear * 0.5 * self.beta(rise, heights.most);
        let tolerance = L::splat(tolerance);
        let zero = L::splat(0.0);
        let [s0, s1] = columns::<L>();
        let offsets = Offsets::new(self, heights);
        let x = Columns::new(&view.x, self, s0, s1);
        let y = Columns::new(&view.y, self, s0, s1);
        let mut cells = 0;
        let mut last = [zero; 4];
        for row in 0..5 {
            let t = L::splat(row as f32 - 2.0);
            let [w0, w1] = offsets.at(t, rows.row::<L>(row));
            let [x0, x1] = x.at(t, w0, w1);
            let [y0, y1] = y.at(t, w0, w1);
            let now = [x0.min(x1), x0.max(x1), y0.min(y1), y0.max(y1)];
            if row > 0 {
                let low = last[0].min(now[0]).max(last[2].min(now[2]));
                let high = last[1].max(now[1]).min(last[3].max(now[3]));
                let out = low.max(zero - high) - tolerance;
                // What is 0 is kept.
                let kept = !(zero - out).sign_mask() & 0xff;
                cells |= kept << (8 * (row - 1));
            }
            last = now;
        }
        cells
    }
}

/// The columns of vertices on the left of eight cells, and on the right, from the leaf's middle.
#[inline(always)]
fn columns<L: Lanes>() -> [L; 2] {
    [
        L::from_array([-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]),
        L::from_array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0]),
    ]
}

/// w = D/|N'| at the columns of vertices.
struct Offsets<L> {
    base: [L; 2],
    slope: [L; 2],
    bend: L,
    scale: L,
    offset: L,
}

impl<L: Lanes> Offsets<L> {
    #[inline(always)]
    fn new(leaf: &Leaf, heights: &Heights) -> Self {
        let [s0, s1] = columns::<L>();
        let [k, ks, kt, kss, kst, ktt] = leaf.k;
        let (k, ks, kt) = (L::splat(k), L::splat(ks), L::splat(kt));
        let (kss, kst) = (L::splat(kss), L::splat(kst));
        Self {
            base: [
                s0.mul_add(s0.mul_add(kss, ks), k),
                s1.mul_add(s1.mul_add(kss, ks), k),
            ],
            slope: [s0.mul_add(kst, kt), s1.mul_add(kst, kt)],
            bend: L::splat(ktt),
            scale: L::splat(heights.scale),
            offset: L::splat(heights.offset),
        }
    }

    /// In row t, where these texels are stored.
    #[inline(always)]
    fn at(&self, t: L, [h0, h1]: [L; 2]) -> [L; 2] {
        let k0 = t.mul_add(t.mul_add(self.bend, self.slope[0]), self.base[0]);
        let k1 = t.mul_add(t.mul_add(self.bend, self.slope[1]), self.base[1]);
        [
            h0.mul_add(self.scale, self.offset) * k0,
            h1.mul_add(self.scale, self.offset) * k1,
        ]
    }
}

/// What is above 0 where no cell around a vertex reaches into the triangle, or into the block, which has so many more columns.
#[inline(always)]
fn beside<L: Lanes>(middle: &Middle, s: L, t: L, column: L, columns: f32) -> L {
    const SLACK: f32 = 1e-3;
    let [b1, b2] = &middle.b;
    let far = (b1.s + b2.s).abs() + (b1.t + b2.t).abs();
    let reach = [b1.reach([1.0; 2]), b2.reach([1.0; 2]), far + 1.0];
    let (b1, b2) = (b1.lanes(s, t), b2.lanes(s, t));
    let inside = (b1 + L::splat(reach[0])).min(b2 + L::splat(reach[1]));
    let inside = inside.min(L::splat(reach[2]) - (b1 + b2)) + L::splat(SLACK);
    (L::splat(0.0) - inside).max(column - L::splat(columns))
}

impl Leaf {
    /// The box of the displaced vertices that are around cells of the triangle and of the block, which has `count` cells more across and up;
    /// empty where there are none.
    #[inline(always)]
    pub fn bounds<L: Lanes>(
        &self,
        middle: &Middle,
        axes: &[Axis; 3],
        heights: &Heights,
        rows: &impl Rows,
        count: [u32; 2],
    ) -> Aabb {
        // Far enough out for anything.
        const AWAY: f32 = 1e30;
        let [s0, s1] = columns::<L>();
        let (zero, away) = (L::splat(0.0), L::splat(AWAY));
        let offsets = Offsets::new(self, heights);
        let x = Columns::new(&axes[0], self, s0, s1);
        let y = Columns::new(&axes[1], self, s0, s1);
        let z = Columns::new(&axes[2], self, s0, s1);
        let (left, right) = (s0 + L::splat(HALF[0]), s1 + L::splat(HALF[0]));
        let (from, to) = (s0 + L::splat(self.s), s1 + L::splat(self.s));
        let columns = count[0] as f32;
        let mut low = [L::splat(f32::INFINITY); 3];
        let mut high = [L::splat(f32::NEG_INFINITY); 3];
        for row in 0..=count[1].min(LEAF[1]) {
            let t = L::splat(row as f32 - HALF[1]);
            let up = t + L::splat(self.t);
            let out0 = beside(middle, from, up, left, columns).max(zero) * away;
            let out1 = beside(middle, to, up, right, columns).max(zero) * away;
            let [w0, w1] = offsets.at(t, rows.row::<L>(row as usize));
            let all = [x.at(t, w0, w1), y.at(t, w0, w1), z.at(t, w0, w1)];
            for (axis, [a, b]) in all.into_iter().enumerate() {
                low[axis] = low[axis].min((a + out0).min(b + out1));
                high[axis] = high[axis].max((a - out0).max(b - out1));
            }
        }
        let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            min[axis] = -(zero - low[axis]).max_lane();
            max[axis] = high[axis].max_lane();
        }
        if max[0] < -0.5 * AWAY || min[0] > 0.5 * AWAY {
            return Aabb::EMPTY;
        }
        Aabb {
            min: Vec3::from(min),
            max: Vec3::from(max),
        }
    }
}

/// P and N' along an axis at the columns of vertices: the left ones of eight cells, and the right ones.
struct Columns<L> {
    p: [L; 2],
    n: [L; 2],
    p_t: L,
    n_t: L,
}

impl<L: Lanes> Columns<L> {
    #[inline(always)]
    fn new(axis: &Axis, leaf: &Leaf, s0: L, s1: L) -> Self {
        let (p, n) = (
            L::splat(axis.p.at(leaf.s, leaf.t)),
            L::splat(axis.n.at(leaf.s, leaf.t)),
        );
        let (ps, ns) = (L::splat(axis.p.s), L::splat(axis.n.s));
        Self {
            p: [s0.mul_add(ps, p), s1.mul_add(ps, p)],
            n: [s0.mul_add(ns, n), s1.mul_add(ns, n)],
            p_t: L::splat(axis.p.t),
            n_t: L::splat(axis.n.t),
        }
    }

    /// P + w N' in row t.
    #[inline(always)]
    fn at(&self, t: L, w0: L, w1: L) -> [L; 2] {
        let n0 = t.mul_add(self.n_t, self.n[0]);
        let n1 = t.mul_add(self.n_t, self.n[1]);
        [
            w0.mul_add(n0, t.mul_add(self.p_t, self.p[0])),
            w1.mul_add(n1, t.mul_add(self.p_t, self.p[1])),
        ]
    }
}
