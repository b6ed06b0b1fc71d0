//! Four f64 in one AVX register. The module documentation of [`super::avx2`] holds here too.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use super::quad::Quad;

#[derive(Clone, Copy)]
pub struct Avx2Quad(__m256d);

macro_rules! lanewise {
    ($operator:ident, $method:ident, $intrinsic:ident) => {
        impl $operator for Avx2Quad {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: AVX is there wherever an `Avx2Quad` is (module documentation).
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

lanewise!(Add, add, _mm256_add_pd);
lanewise!(Sub, sub, _mm256_sub_pd);
lanewise!(Mul, mul, _mm256_mul_pd);
lanewise!(Div, div, _mm256_div_pd);

impl Quad for Avx2Quad {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: called in AVX2 kernels only (module documentation).
        Self(unsafe { _mm256_set1_pd(x) })
    }

    #[inline(always)]
    fn from_array(x: [f64; 4]) -> Self {
        // SAFETY: called in AVX2 kernels only; an unaligned load of 4 doubles from an array of 4.
        Self(unsafe { _mm256_loadu_pd(x.as_ptr()) })
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        let mut out = [0.0; 4];
        // SAFETY: AVX is there; an unaligned store of 4 doubles into an array of 4.
        unsafe { _mm256_storeu_pd(out.as_mut_ptr(), self.0) };
        out
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        Self(unsafe { _mm256_min_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        Self(unsafe { _mm256_max_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        Self(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        unsafe {
            let bit = _mm256_and_pd(_mm256_set1_pd(-0.0), sign.0);
            Self(_mm256_or_pd(self.abs().0, bit))
        }
    }

    #[inline(always)]
    fn rotate(self) -> Self {
        // SAFETY: AVX2 is there wherever an `Avx2Quad` is. Lanes 1, 2, 0, 1.
        Self(unsafe { _mm256_permute4x64_pd::<0b01_00_10_01>(self.0) })
    }

    #[inline(always)]
    fn sign_mask(self) -> u32 {
        // SAFETY: AVX is there wherever an `Avx2Quad` is.
        unsafe { _mm256_movemask_pd(self.0) as u32 }
    }

    #[inline(always)]
    fn broadcast<const K: usize>(self) -> Self {
        // SAFETY: AVX2 is there wherever an `Avx2Quad` is.
        unsafe {
            Self(match K {
                0 => _mm256_permute4x64_pd::<0b00_00_00_00>(self.0),
                1 => _mm256_permute4x64_pd::<0b01_01_01_01>(self.0),
                2 => _mm256_permute4x64_pd::<0b10_10_10_10>(self.0),
                _ => _mm256_permute4x64_pd::<0b11_11_11_11>(self.0),
            })
        }
    }
}
