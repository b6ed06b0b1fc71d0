//! Four sums a b + c in f64, by instructions that every x86-64 has.

use std::arch::x86_64::*;

use glam::Vec4;

pub struct Sums([__m128d; 2]);

impl Sums {
    #[inline(always)]
    pub fn new(a: Vec4, b: Vec4, c: Vec4) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        let wide = |x: Vec4| unsafe {
            let x = __m128::from(x);
            [_mm_cvtps_pd(x), _mm_cvtps_pd(_mm_movehl_ps(x, x))]
        };
        let ([a0, a1], [b0, b1], [c0, c1]) = (wide(a), wide(b), wide(c));
        // SAFETY: as above.
        let sum = |a, b, c| unsafe { _mm_add_pd(_mm_mul_pd(a, b), c) };
        Self([sum(a0, b0, c0), sum(a1, b1, c1)])
    }

    /// To f32.
    #[inline(always)]
    pub fn rounded(&self) -> Vec4 {
        let [low, high] = self.0;
        // SAFETY: SSE2 is part of x86-64.
        Vec4::from(unsafe { _mm_movelh_ps(_mm_cvtpd_ps(low), _mm_cvtpd_ps(high)) })
    }

    /// All bits of the lanes whose sum, rounded to f32, may be something else than what is rounded once.
    #[inline(always)]
    fn in_doubt(&self) -> __m128i {
        // What f64 has beyond the digits of a normal f32 is 29 bits.
        const BEYOND: i32 = (1 << 29) - 1;
        const HALFWAY: i32 = 1 << 28;
        // The upper half of the least normal f32 as f64, without its sign.
        const LEAST: i32 = ((f32::MIN_POSITIVE as f64).to_bits() >> 31) as i32;
        let [low, high] = self.0;
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let (low, high) = (_mm_castpd_ps(low), _mm_castpd_ps(high));
            let lower = _mm_castps_si128(_mm_shuffle_ps::<0b10_00_10_00>(low, high));
            let upper = _mm_castps_si128(_mm_shuffle_ps::<0b11_01_11_01>(low, high));
            let beyond = _mm_and_si128(lower, _mm_set1_epi32(BEYOND));
            let halfway = _mm_cmpeq_epi32(beyond, _mm_set1_epi32(HALFWAY));
            // From above 0 to below the least: less one unsigned, with the first bit turned, as signed numbers are compared.
            let magnitude = _mm_slli_epi32::<1>(upper);
            let turned = _mm_add_epi32(magnitude, _mm_set1_epi32(i32::MAX));
            let tiny = _mm_cmplt_epi32(turned, _mm_set1_epi32(LEAST.wrapping_add(i32::MAX)));
            _mm_or_si128(halfway, tiny)
        }
    }
}

#[inline(always)]
pub fn any_in_doubt(a: &Sums, b: &Sums) -> bool {
    // SAFETY: SSE2 is part of x86-64.
    unsafe { _mm_movemask_epi8(_mm_or_si128(a.in_doubt(), b.in_doubt())) != 0 }
}
