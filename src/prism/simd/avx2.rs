//! Eight lanes in one AVX register.
//!
//! # Safety
//!
//! The intrinsics below need AVX2 and FMA. A value of [`Avx2`] is made only inside kernels stamped with
//! `target_feature(enable = "avx2,fma")`, which are called only after [`SimdLevel::Avx2`](super::SimdLevel)
//! was found supported; so wherever one exists, the instructions do too. Every function here is
//! `inline(always)`, to become part of such a kernel.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use super::{Grid, LANES, Lanes, Task, nine};
use crate::surface::{Entries, StoredTexels};

#[derive(Clone, Copy)]
pub struct Avx2(__m256);

macro_rules! lanewise {
    ($operator:ident, $method:ident, $intrinsic:ident) => {
        impl $operator for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: AVX is there wherever an `Avx2` is (module documentation).
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

lanewise!(Add, add, _mm256_add_ps);
lanewise!(Sub, sub, _mm256_sub_ps);
lanewise!(Mul, mul, _mm256_mul_ps);
lanewise!(Div, div, _mm256_div_ps);

impl Lanes for Avx2 {
    type Quad = super::avx2_quad::Avx2Quad;

    #[inline(always)]
    fn outline<T: Task<Self>>(task: T) -> T::Output {
        #[inline(never)]
        #[target_feature(enable = "avx2,fma")]
        fn stamped<T: Task<Avx2>>(task: T) -> T::Output {
            task.run()
        }
        // SAFETY: called in AVX2 kernels only (module documentation).
        unsafe { stamped(task) }
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: called in AVX2 kernels only (module documentation).
        Self(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn from_array(x: [f32; LANES]) -> Self {
        // SAFETY: called in AVX2 kernels only; an unaligned load of 8 floats from an array of 8.
        Self(unsafe { _mm256_loadu_ps(x.as_ptr()) })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: AVX is there; an unaligned store of 8 floats into an array of 8.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
        out
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        // SAFETY: FMA is there wherever an `Avx2` is.
        Self(unsafe { _mm256_fmadd_ps(self.0, a.0, b.0) })
    }

    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        // SAFETY: FMA is there wherever an `Avx2` is.
        Self(unsafe { _mm256_fnmadd_ps(self.0, a.0, b.0) })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2` is.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2` is.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2` is.
        Self(unsafe { _mm256_floor_ps(self.0) })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2` is.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: AVX is there wherever an `Avx2` is.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn next(self) -> Self {
        // SAFETY: AVX2 is there wherever an `Avx2` is.
        unsafe {
            let order = _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 7);
            Self(_mm256_permutevar8x32_ps(self.0, order))
        }
    }

    #[inline(always)]
    fn max_lane(self) -> f32 {
        // SAFETY: AVX is there wherever an `Avx2` is.
        unsafe {
            let four = _mm_max_ps(
                _mm256_castps256_ps128(self.0),
                _mm256_extractf128_ps::<1>(self.0),
            );
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }

    #[inline(always)]
    fn sign_mask(self) -> u32 {
        // SAFETY: AVX is there wherever an `Avx2` is.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }

    #[inline(always)]
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4] {
        // SAFETY: AVX2 is there. i and j are moved inside, so that the gathers are in bounds whatever the caller passes:
        // 0 <= i <= width - 1 and 0 <= j <= height - 1, so index + stride + 1 is at most
        // (height + 1) * (width + 1) - 1, the last stored texel; it fits i32 because sides are at most
        // `DisplacementMap::MAX_SIDE`. The 32-bit loads of narrower texels start at such a texel and end inside
        // the texels that `StoredTexels` keeps after the last one.
        // An edit on another thread may store to these atomics meanwhile. The language has no atomic gather, so this
        // rests on the machine: the memory is atomics', so the compiler takes no value for constant, the intrinsic
        // is opaque to it, and x86 never tears an aligned texel: it is the old one or the new one.
        unsafe {
            let i = whole(i, _mm256_set1_epi32(grid.size[0] as i32 - 1));
            let j = whole(j, _mm256_set1_epi32(grid.size[1] as i32 - 1));
            let stride = _mm256_set1_epi32(grid.stride as i32);
            let index = _mm256_add_epi32(_mm256_mullo_epi32(j, stride), i);
            let above = _mm256_add_epi32(index, stride);
            match grid.texels {
                StoredTexels::U8(t) => {
                    let texels = t.as_ptr().cast::<i32>();
                    let (h00, h10) = pair::<8>(_mm256_i32gather_epi32::<1>(texels, index));
                    let (h01, h11) = pair::<8>(_mm256_i32gather_epi32::<1>(texels, above));
                    [h00, h10, h01, h11]
                }
                StoredTexels::U16(t) => {
                    let texels = t.as_ptr().cast::<i32>();
                    let (h00, h10) = pair::<16>(_mm256_i32gather_epi32::<2>(texels, index));
                    let (h01, h11) = pair::<16>(_mm256_i32gather_epi32::<2>(texels, above));
                    [h00, h10, h01, h11]
                }
                StoredTexels::F32(t) => {
                    let left = t.as_ptr().cast::<f32>();
                    let right = left.add(1);
                    [
                        Self(_mm256_i32gather_ps::<4>(left, index)),
                        Self(_mm256_i32gather_ps::<4>(right, index)),
                        Self(_mm256_i32gather_ps::<4>(left, above)),
                        Self(_mm256_i32gather_ps::<4>(right, above)),
                    ]
                }
            }
        }
    }

    #[inline(always)]
    fn pairs(entries: &Entries, [a, b]: [usize; 2]) -> [Self; 2] {
        let zeros = [Self::splat(0.0); 2];
        // SAFETY: AVX2 is there. Loads of four pairs from slices of as many. Edits meanwhile: as in `cell_corners`; a pair of floats may be one
        // old and one new.
        unsafe {
            match entries {
                Entries::U8(e) => {
                    let (Some(a), Some(b)) = (four::<_, 4>(e, a), four::<_, 4>(e, b)) else {
                        return zeros;
                    };
                    let a = _mm_loadl_epi64(a.as_ptr().cast());
                    let b = _mm_loadl_epi64(b.as_ptr().cast());
                    let both = _mm256_cvtepu16_epi32(_mm_unpacklo_epi64(a, b));
                    pair::<8>(both).into()
                }
                Entries::U16(e) => {
                    let (Some(a), Some(b)) = (four::<_, 4>(e, a), four::<_, 4>(e, b)) else {
                        return zeros;
                    };
                    let a = _mm_loadu_si128(a.as_ptr().cast());
                    let b = _mm_loadu_si128(b.as_ptr().cast());
                    pair::<16>(_mm256_set_m128i(b, a)).into()
                }
                Entries::F32(e) => {
                    let (Some(a), Some(b)) = (four::<_, 8>(e, 2 * a), four::<_, 8>(e, 2 * b))
                    else {
                        return zeros;
                    };
                    let a = _mm256_loadu_ps(a.as_ptr().cast());
                    let b = _mm256_loadu_ps(b.as_ptr().cast());
                    // Two of a, two of b, two of a, two of b.
                    let low = _mm256_shuffle_ps::<0b10_00_10_00>(a, b);
                    let high = _mm256_shuffle_ps::<0b11_01_11_01>(a, b);
                    [Self(in_order(low)), Self(in_order(high))]
                }
            }
        }
    }

    #[inline(always)]
    fn texel_rows(texels: &StoredTexels, index: usize) -> [Self; 2] {
        let zeros = [Self::splat(0.0); 2];
        // SAFETY: AVX2 is there. Loads of eight texels from the first and from the second of nine. Edits meanwhile: as in
        // `cell_corners`; x86 reads each aligned texel of a vector load whole.
        unsafe {
            match texels {
                StoredTexels::U8(t) => {
                    let Some(row) = nine(t, index) else {
                        return zeros;
                    };
                    let row = row.as_ptr();
                    let left = _mm256_cvtepu8_epi32(_mm_loadl_epi64(row.cast()));
                    let right = _mm256_cvtepu8_epi32(_mm_loadl_epi64(row.add(1).cast()));
                    [
                        Self(_mm256_cvtepi32_ps(left)),
                        Self(_mm256_cvtepi32_ps(right)),
                    ]
                }
                StoredTexels::U16(t) => {
                    let Some(row) = nine(t, index) else {
                        return zeros;
                    };
                    let row = row.as_ptr();
                    let left = _mm256_cvtepu16_epi32(_mm_loadu_si128(row.cast()));
                    let right = _mm256_cvtepu16_epi32(_mm_loadu_si128(row.add(1).cast()));
                    [
                        Self(_mm256_cvtepi32_ps(left)),
                        Self(_mm256_cvtepi32_ps(right)),
                    ]
                }
                StoredTexels::F32(t) => {
                    let Some(row) = nine(t, index) else {
                        return zeros;
                    };
                    let row = row.as_ptr();
                    [
                        Self(_mm256_loadu_ps(row.cast())),
                        Self(_mm256_loadu_ps(row.add(1).cast())),
                    ]
                }
            }
        }
    }
}

/// The second pair of lanes and the third change places.
///
/// # Safety
///
/// Needs AVX2.
#[inline(always)]
unsafe fn in_order(x: __m256) -> __m256 {
    // SAFETY: the caller has AVX2.
    unsafe {
        let pairs = _mm256_castps_pd(x);
        _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(pairs))
    }
}

/// `N` words from `index` on.
#[inline(always)]
fn four<T, const N: usize>(stored: &[T], index: usize) -> Option<&[T; N]> {
    stored.get(index..)?.first_chunk()
}

/// The whole part of numbers from 0 to `last`; others, and NaN, become `last`.
#[inline(always)]
fn whole(x: Avx2, last: __m256i) -> __m256i {
    // SAFETY: AVX2 is there wherever an `Avx2` is. What is no 32-bit number becomes i32::MIN, which is large without its sign.
    unsafe { _mm256_min_epu32(_mm256_cvttps_epi32(x.0), last) }
}

/// The two lowest unsigned `BITS`-bit numbers of every lane.
///
/// # Safety
///
/// Needs AVX2.
#[inline(always)]
unsafe fn pair<const BITS: i32>(words: __m256i) -> (Avx2, Avx2) {
    // SAFETY: the caller has AVX2.
    unsafe {
        let mask = _mm256_set1_epi32((1 << BITS) - 1);
        let first = _mm256_and_si256(words, mask);
        let second = _mm256_and_si256(_mm256_srli_epi32::<BITS>(words), mask);
        (
            Avx2(_mm256_cvtepi32_ps(first)),
            Avx2(_mm256_cvtepi32_ps(second)),
        )
    }
}
