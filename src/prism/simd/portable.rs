//! Eight lanes as two of glam's four: SSE2, NEON or plain Rust, whatever the architecture always has.

mod fused;

use std::ops::{Add, Div, Mul, Sub};

use glam::Vec4;

use super::{Grid, LANES, Lanes, Task, nine};
use crate::prism::steps;
use crate::surface::{Entries, StoredTexels, Texel};

/// `COUNTED`: steps of the march are counted.
#[derive(Clone, Copy)]
pub struct Portable<const COUNTED: bool = false>(Vec4, Vec4);

macro_rules! lanewise {
    ($operator:ident, $method:ident) => {
        impl<const COUNTED: bool> $operator for Portable<COUNTED> {
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

impl<const COUNTED: bool> Lanes for Portable<COUNTED> {
    type Quad = super::quad::PortableQuad;

    #[inline(never)]
    fn outline<T: Task<Self>>(task: T) -> T::Output {
        task.run()
    }

    const COUNTED: bool = COUNTED;

    #[inline(always)]
    fn step() {
        if COUNTED {
            steps::count();
        }
    }

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
        let sums = fused::mul_add([self.0, self.1], [a.0, a.1], [b.0, b.1]);
        Self(sums[0], sums[1])
    }

    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(-self.0, -self.1).mul_add(a, b)
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
        // The floor of -0 is -0, for which glam's SSE2 has 0.
        let four = |x: Vec4| x.floor().copysign(x);
        Self(four(self.0), four(self.1))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
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
        let (i, j) = (i.to_array(), j.to_array());
        let corners = match grid.texels {
            StoredTexels::U8(t) => corners::<u8>(t, grid, i, j),
            StoredTexels::U16(t) => corners::<u16>(t, grid, i, j),
            StoredTexels::F32(t) => corners::<f32>(t, grid, i, j),
        };
        corners.map(Self::from_array)
    }

    #[inline(always)]
    fn pairs(entries: &Entries, first: [usize; 2]) -> [Self; 2] {
        let mut pairs = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let from = first[lane / 4];
            if from.saturating_add(4) <= entries.count() {
                (pairs[0][lane], pairs[1][lane]) = entries.get(from + lane % 4);
            }
        }
        [Self::from_array(pairs[0]), Self::from_array(pairs[1])]
    }

    #[inline(always)]
    fn texel_rows(texels: &StoredTexels, index: usize) -> [Self; 2] {
        let row = match texels {
            StoredTexels::U8(t) => row::<u8>(t, index),
            StoredTexels::U16(t) => row::<u16>(t, index),
            StoredTexels::F32(t) => row::<f32>(t, index),
        };
        [0, 1].map(|from| Self::from_array(std::array::from_fn(|l| row[from + l])))
    }
}

/// Nine texels, or zeros.
#[inline(always)]
fn row<T: Texel>(t: &[T::Atomic], index: usize) -> [f32; LANES + 1] {
    match nine(t, index) {
        Some(row) => std::array::from_fn(|i| T::load(&row[i]).into()),
        None => [0.0; LANES + 1],
    }
}

/// The whole part of a number from 0 to `last`; others, and NaN, become `last`.
#[inline(always)]
fn whole(x: f32, last: usize) -> usize {
    const END: f32 = 2_147_483_648.0;
    let whole = if x.abs() < END { x as i32 } else { i32::MIN };
    (whole as u32 as usize).min(last)
}

#[inline(always)]
fn corners<T: Texel>(
    t: &[T::Atomic],
    grid: &Grid<'_>,
    i: [f32; LANES],
    j: [f32; LANES],
) -> [[f32; LANES]; 4] {
    let [last_i, last_j] = grid.size.map(|side| side as usize - 1);
    let mut out = [[0.0; LANES]; 4];
    for l in 0..LANES {
        let (i, j) = (whole(i[l], last_i), whole(j[l], last_j));
        let at = j * grid.stride + i;
        // One bounds check for the pair.
        let (bottom, top) = (&t[at..at + 2], &t[at + grid.stride..at + grid.stride + 2]);
        out[0][l] = T::load(&bottom[0]).into();
        out[1][l] = T::load(&bottom[1]).into();
        out[2][l] = T::load(&top[0]).into();
        out[3][l] = T::load(&top[1]).into();
    }
    out
}
