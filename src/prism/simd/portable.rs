//! Eight lanes as two of glam's four: SSE2, NEON or plain Rust, whatever the architecture always has.

use std::ops::{Add, Div, Mul, Sub};

use glam::Vec4;

use super::{Grid, LANES, Lanes};
use crate::surface::{StoredTexels, Texel};

#[derive(Clone, Copy)]
pub struct Portable(Vec4, Vec4);

macro_rules! lanewise {
    ($operator:ident, $method:ident) => {
        impl $operator for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}

lanewise!(Add, add);
lanewise!(Sub, sub);
lanewise!(Mul, mul);
lanewise!(Div, div);

impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(Vec4::splat(x), Vec4::splat(x))
    }

    #[inline(always)]
    fn from_array(x: [f32; LANES]) -> Self {
        Self(Vec4::from_slice(&x[..4]), Vec4::from_slice(&x[4..]))
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        self.0.write_to_slice(&mut out[..4]);
        self.1.write_to_slice(&mut out[4..]);
        out
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.floor(), self.1.floor())
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn next(self) -> Self {
        let (a, b) = (self.0, self.1);
        Self(Vec4::new(a.y, a.z, a.w, b.x), Vec4::new(b.y, b.z, b.w, b.w))
    }

    #[inline(always)]
    fn max_lane(self) -> f32 {
        self.0.max(self.1).max_element()
    }

    #[inline(always)]
    fn sign_mask(self) -> u32 {
        self.0.is_negative_bitmask() | self.1.is_negative_bitmask() << 4
    }

    #[inline(always)]
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4] {
        match grid.texels {
            StoredTexels::U8(t) => corners::<u8>(t, grid, i, j),
            StoredTexels::U16(t) => corners::<u16>(t, grid, i, j),
            StoredTexels::F32(t) => corners::<f32>(t, grid, i, j),
        }
    }
}

#[inline(always)]
fn corners<T: Texel>(t: &[T::Atomic], grid: &Grid<'_>, i: Portable, j: Portable) -> [Portable; 4] {
    let [width, height] = grid.size;
    let (i, j) = (i.to_array(), j.to_array());
    let mut out = [[0.0; LANES]; 4];
    for l in 0..LANES {
        // `as usize` turns NaN and negatives into 0.
        let (i, j) = (
            i[l].min(width - 1.0) as usize,
            j[l].min(height - 1.0) as usize,
        );
        let at = j * grid.stride + i;
        // One bounds check for the pair.
        let (bottom, top) = (&t[at..at + 2], &t[at + grid.stride..at + grid.stride + 2]);
        out[0][l] = T::load(&bottom[0]).into();
        out[1][l] = T::load(&bottom[1]).into();
        out[2][l] = T::load(&top[0]).into();
        out[3][l] = T::load(&top[1]).into();
    }
    [
        Portable::from_array(out[0]),
        Portable::from_array(out[1]),
        Portable::from_array(out[2]),
        Portable::from_array(out[3]),
    ]
}
