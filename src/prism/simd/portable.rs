//! Eight lanes in plain Rust; the compiler turns them into the baseline's vectors (SSE2, NEON).

use std::array::from_fn;
use std::ops::{Add, Div, Mul, Sub};

use super::{Grid, LANES, Lanes};
use crate::surface::Texels;

#[derive(Clone, Copy)]
pub struct Portable([f32; LANES]);

macro_rules! lanewise {
    ($operator:ident, $method:ident, $op:tt) => {
        impl $operator for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|l| self.0[l] $op other.0[l]))
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn from_array(x: [f32; LANES]) -> Self {
        Self(x)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.0
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(from_fn(|l| {
            if self.0[l] < other.0[l] {
                self.0[l]
            } else {
                other.0[l]
            }
        }))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(from_fn(|l| {
            if self.0[l] > other.0[l] {
                self.0[l]
            } else {
                other.0[l]
            }
        }))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        // f32::floor is a library call without SSE4.1. Beyond 2^23 every f32 is an integer already.
        Self(self.0.map(|x| {
            let whole = x as i32 as f32;
            let down = if whole > x { whole - 1.0 } else { whole };
            if x.abs() < 8_388_608.0 { down } else { x }
        }))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn sign_mask(self) -> u32 {
        (0..LANES).fold(0, |mask, l| mask | (self.0[l].to_bits() >> 31) << l)
    }

    #[inline(always)]
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4] {
        match grid.texels {
            Texels::U8(t) => corners(t, grid, i, j),
            Texels::U16(t) => corners(t, grid, i, j),
            Texels::F32(t) => corners(t, grid, i, j),
        }
    }
}

#[inline(always)]
fn corners<T: Copy + Into<f32>>(
    t: &[T],
    grid: &Grid<'_>,
    i: Portable,
    j: Portable,
) -> [Portable; 4] {
    let [width, height] = grid.size;
    let mut out = [[0.0; LANES]; 4];
    for l in 0..LANES {
        // `as usize` turns NaN and negatives into 0.
        let (i, j) = (
            i.0[l].min(width - 1.0) as usize,
            j.0[l].min(height - 1.0) as usize,
        );
        let at = j * grid.stride + i;
        for (corner, offset) in [0, 1, grid.stride, grid.stride + 1].into_iter().enumerate() {
            out[corner][l] = t[at + offset].into();
        }
    }
    out.map(Portable)
}
