//! a b + c rounded once, on machines that cannot: so that kernels have the same digits at every level.
//!
//! In f64 the product of two f32 is exact, and the sum is rounded to 53 digits, then to 24. What was rounded twice differs from what is rounded
//! once only where the first result lies halfway between two f32, or is so small that f32 has fewer digits for it. There the
//! sum is rounded to odd first (Boldo and Melquiond, "Emulation of a FMA and Correctly Rounded Sums: Proved Algorithms Using Rounding to
//! Odd", 2008): of the two neighbours of an inexact sum that with an odd last digit, which is never halfway.

use glam::Vec4;

#[cfg(all(target_arch = "x86_64", not(target_feature = "fma")))]
#[allow(unsafe_code)]
mod sse2;

/// a b + c in four lanes, and four more.
// Without optimisation every copy would have a piece of the stack to itself: there are hundreds in a kernel.
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn mul_add(a: [Vec4; 2], b: [Vec4; 2], c: [Vec4; 2]) -> [Vec4; 2] {
    #[cfg(all(target_arch = "x86_64", not(target_feature = "fma")))]
    {
        let low = sse2::Sums::new(a[0], b[0], c[0]);
        let high = sse2::Sums::new(a[1], b[1], c[1]);
        if sse2::any_in_doubt(&low, &high) {
            return to_odd(&a, &b, &c);
        }
        [low.rounded(), high.rounded()]
    }
    #[cfg(not(all(target_arch = "x86_64", not(target_feature = "fma"))))]
    std::array::from_fn(|k| lanewise(a[k], b[k], c[k], f32::mul_add))
}

#[inline(always)]
fn lanewise(a: Vec4, b: Vec4, c: Vec4, f: impl Fn(f32, f32, f32) -> f32) -> Vec4 {
    Vec4::new(
        f(a.x, b.x, c.x),
        f(a.y, b.y, c.y),
        f(a.z, b.z, c.z),
        f(a.w, b.w, c.w),
    )
}

#[cfg(all(target_arch = "x86_64", not(target_feature = "fma")))]
#[cold]
#[inline(never)]
fn to_odd(a: &[Vec4; 2], b: &[Vec4; 2], c: &[Vec4; 2]) -> [Vec4; 2] {
    let one = |a: f32, b: f32, c: f32| {
        let (product, c) = (f64::from(a) * f64::from(b), f64::from(c));
        let sum = product + c;
        // What the sum is short of, exactly (Knuth's TwoSum).
        let of_c = sum - product;
        let short = (product - (sum - of_c)) + (c - of_c);
        let bits = sum.to_bits();
        let odd = if short == 0.0 || !short.is_finite() || bits & 1 == 1 {
            sum
        } else if (short > 0.0) == (sum > 0.0) {
            f64::from_bits(bits + 1)
        } else {
            f64::from_bits(bits - 1)
        };
        odd as f32
    };
    std::array::from_fn(|k| lanewise(a[k], b[k], c[k], one))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of few digits, so that sums are often halfway; of all digits; tiny ones; and what is no number.
    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 5u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(77);
            let bits = (state >> 32) as u32;
            let exponent = |range: u32, first: u32| (first + (bits >> 9) % range) << 23;
            let sign = bits & 1 << 31;
            match bits % 8 {
                0 | 1 => f32::from_bits(sign | exponent(12, 120) | (bits & 0x7ff000)),
                2 | 3 => f32::from_bits(sign | exponent(30, 110) | (bits >> 3 & 0x7fffff)),
                4 => f32::from_bits(sign | exponent(40, 40) | (bits >> 3 & 0x7fffff)),
                5 => f32::from_bits(bits & 0x8000_ffff),
                6 => [0.0, -0.0, 1.0, -1.0][(bits >> 8) as usize % 4],
                _ => f32::from_bits(bits),
            }
        }
    }

    #[test]
    fn is_rounded_once() {
        let mut number = numbers();
        let mut rounded_twice = 0;
        for _ in 0..40_000 {
            let [a, b, c]: [[Vec4; 2]; 3] = std::array::from_fn(|_| {
                std::array::from_fn(|_| Vec4::from_array(std::array::from_fn(|_| number())))
            });
            let got = mul_add(a, b, c);
            for l in 0..8 {
                let [a, b, c, got] = [a, b, c, got].map(|x| x[l / 4][l % 4]);
                let (twice, want) = (
                    (f64::from(a) * f64::from(b) + f64::from(c)) as f32,
                    a.mul_add(b, c),
                );
                rounded_twice += usize::from(twice != want && !want.is_nan());
                let same = got.to_bits() == want.to_bits() || got.is_nan() && want.is_nan();
                assert!(same, "{a} * {b} + {c}: {got} {want}");
            }
        }
        assert!(rounded_twice > 0, "only easy cases");
    }

    #[test]
    fn halfway_but_for_a_little() {
        let at = |a: f32, b: f32, c: f32| {
            let [a, b, c] = [a, b, c].map(|x| [Vec4::splat(x); 2]);
            mul_add(a, b, c)[1].z
        };
        // (1 + 2^-23) (1 - 2^-23) 2^-24 is 2^-70 less than 2^-24, which is half of what f32 tells apart at 1.
        let (above, below) = (1.0 + f32::EPSILON, 1.0 - f32::EPSILON);
        let half = 2f32.powi(-24);
        assert_eq!(at(above, below * half, above), above);
        assert_eq!(at(-above, below * half, -above), -above);
        assert_eq!(at(1.0, half, above), 1.0 + 2.0 * f32::EPSILON);
        assert_eq!(at(1.0, half, 1.0), 1.0);
    }
}
