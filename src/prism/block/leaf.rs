//! A leaf seen along the ray: five rows of nine texels, displaced and projected, and the cells between them that may hold the ray.

use super::LEAF;
use super::middle::{Axis, Heights};
use super::view::View;
use crate::prism::simd::Lanes;

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
    /// `None` where the normal turns too much for the series.
    #[inline(always)]
    pub fn new(view: &View, heights: &Heights, s: f32, t: f32) -> Option<Self> {
        let normal = view.middle.normal.at(s, t);
        let [a, b] = [
            normal.dot(view.middle.normal.s),
            normal.dot(view.middle.normal.t),
        ];
        let [aa, bb] = view.middle.spread.map(|n| n * n);
        let per_squared = 1.0 / normal.length_squared();
        let k = per_squared.sqrt();
        let (k3, k5) = (k * per_squared, k * per_squared * per_squared);
        let x =
            (HALF[0] * view.middle.spread[0] + HALF[1] * view.middle.spread[1]) * k * (1.0 + 1e-5);
        let least = 1.0 - x;
        // The terms of the series from the third on, of which each is below the last times x.
        let remainder = x * x * x / least;
        let off = heights.most * (1.0 + x) * remainder;
        let leaf = Self {
            s,
            t,
            k: [
                k,
                -a * k3,
                -b * k3,
                0.5 * (3.0 * a * a * k5 - aa * k3),
                3.0 * a * b * k5 - view.middle.twist * k3,
                0.5 * (3.0 * b * b * k5 - bb * k3),
            ],
            off: view.noise + view.shear * off,
            depth_off: view.depth_noise + view.per_length * off,
            turn: (view.middle.spread[0] + view.middle.spread[1]) * k / least,
        };
        (least > 0.5).then_some(leaf)
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
        view: &View,
        heights: &Heights,
        rise: f32,
        rows: &impl Rows,
    ) -> u32 {
        L::step();
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let tolerance = self.off + view.shear * 0.5 * self.beta(rise, heights.most);
        let tolerance = L::splat(tolerance);
        let s0 = L::from_array([-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]);
        let s1 = s0 + one;
        let [k, ks, kt, kss, kst, ktt] = self.k;
        let (k, ks, kt) = (L::splat(k), L::splat(ks), L::splat(kt));
        let (kss, kst, ktt) = (L::splat(kss), L::splat(kst), L::splat(ktt));
        let (base0, base1) = (
            s0.mul_add(s0.mul_add(kss, ks), k),
            s1.mul_add(s1.mul_add(kss, ks), k),
        );
        let (slope0, slope1) = (s0.mul_add(kst, kt), s1.mul_add(kst, kt));
        let (scale, offset) = (L::splat(heights.scale), L::splat(heights.offset));
        let x = Columns::new(&view.x, self, s0, s1);
        let y = Columns::new(&view.y, self, s0, s1);
        let mut cells = 0;
        let mut last = [zero; 4];
        for row in 0..5 {
            let t = L::splat(row as f32 - 2.0);
            let [h0, h1] = rows.row::<L>(row);
            let k0 = t.mul_add(t.mul_add(ktt, slope0), base0);
            let k1 = t.mul_add(t.mul_add(ktt, slope1), base1);
            let w0 = h0.mul_add(scale, offset) * k0;
            let w1 = h1.mul_add(scale, offset) * k1;
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
