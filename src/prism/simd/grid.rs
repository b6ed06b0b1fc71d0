//! A displacement map as the uniform march samples it.

use super::Lanes;
use crate::surface::{DisplacementMap, StoredTexels, Wrap};

/// A displacement map, to be sampled in lanes.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'m> {
    pub(super) texels: &'m StoredTexels,
    pub(super) stride: usize,
    wrap: Wrap,
    /// Texels across and up.
    pub(super) size: [f32; 2],
}

impl<'m> Grid<'m> {
    #[inline(always)]
    pub fn new(map: &'m DisplacementMap) -> Self {
        let (width, height) = map.size();
        Self {
            texels: map.texels(),
            stride: map.stride(),
            wrap: map.wrap(),
            size: [width as f32, height as f32],
        }
    }

    /// Stored height (see [`DisplacementMap::unit`]) at texel coordinates, bilinear: a step of the march.
    #[inline(always)]
    pub fn sample<L: Lanes>(&self, x: L, y: L) -> L {
        L::step();
        let (x, y) = (self.fold(x, self.size[0]), self.fold(y, self.size[1]));
        // The last cell's right corners are stored too: see `DisplacementMap`.
        let i = x.floor().min(L::splat(self.size[0] - 1.0));
        let j = y.floor().min(L::splat(self.size[1] - 1.0));
        let (fx, fy) = (x - i, y - j);
        let [h00, h10, h01, h11] = L::cell_corners(self, i, j);
        let bottom = fx.mul_add(h10 - h00, h00);
        let top = fx.mul_add(h11 - h01, h01);
        fy.mul_add(top - bottom, bottom)
    }

    /// [`Wrap::fold`] in lanes.
    #[inline(always)]
    fn fold<L: Lanes>(&self, x: L, n: f32) -> L {
        let (zero, last) = (L::splat(0.0), L::splat(n - 1.0));
        match self.wrap {
            Wrap::Repeat => {
                let periods = (x * L::splat(1.0 / n)).floor();
                periods.mul_add(L::splat(-n), x).max(zero).min(L::splat(n))
            }
            Wrap::Clamp => x.max(zero).min(last),
            Wrap::Mirror => {
                let half = L::splat(0.5);
                let from_edge = x + half;
                let periods = from_edge.mul_add(L::splat(0.5 / n), half).floor();
                let signed = periods.mul_add(L::splat(-2.0 * n), from_edge);
                (signed.max(zero - signed) - half).max(zero).min(last)
            }
        }
    }
}
