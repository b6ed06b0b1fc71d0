//! Four f64 values at once.
//!
//! Lane k is vertex or side k of a prism; lane 3 repeats lane 0, so that a rotation is one permutation.

use std::ops::{Add, Div, Mul, Sub};

/// Four f64 values: the least that the set-up needs. Additions and products are rounded one by one, so that a side's quadratic has the same
/// digits seen from both prisms, and at every level.
pub(crate) trait Quad:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn splat(x: f64) -> Self;
    fn from_array(x: [f64; 4]) -> Self;
    fn to_array(self) -> [f64; 4];
    fn sqrt(self) -> Self;
    /// `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// The magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// Lane k becomes lane k + 1 of the three; the fourth repeats the first.
    fn rotate(self) -> Self;
    /// Bit k: lane k's sign bit.
    fn sign_mask(self) -> u32;
    /// All lanes become lane k.
    fn broadcast<const K: usize>(self) -> Self;
    /// The largest of the lanes 0, 1, 2.
    #[inline(always)]
    fn max_of_three(self) -> f64 {
        let [a, b, c, _] = self.to_array();
        a.max(b).max(c)
    }
    /// The sum of the lanes 0, 1, 2, in all of them.
    #[inline(always)]
    fn sum_of_three(self) -> Self {
        let next = self.rotate();
        self + next + next.rotate()
    }
}

/// Plain Rust, for every machine.
#[derive(Clone, Copy)]
pub struct PortableQuad([f64; 4]);

impl PortableQuad {
    #[inline(always)]
    fn lanewise(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

macro_rules! lanewise {
    ($operator:ident, $method:ident) => {
        impl $operator for PortableQuad {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.lanewise(other, |a, b| a.$method(b))
            }
        }
    };
}

lanewise!(Add, add);
lanewise!(Sub, sub);
lanewise!(Mul, mul);
lanewise!(Div, div);

impl Quad for PortableQuad {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; 4])
    }
    #[inline(always)]
    fn from_array(x: [f64; 4]) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.0
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.lanewise(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.lanewise(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.lanewise(sign, f64::copysign)
    }
    #[inline(always)]
    fn rotate(self) -> Self {
        let [a, b, c, _] = self.0;
        Self([b, c, a, b])
    }
    #[inline(always)]
    fn sign_mask(self) -> u32 {
        (0..4).fold(0, |bits, k| {
            bits | u32::from(self.0[k].is_sign_negative()) << k
        })
    }
    #[inline(always)]
    fn broadcast<const K: usize>(self) -> Self {
        Self([self.0[K]; 4])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeps_its_word<Q: Quad>() {
        let x = Q::from_array([1.0, -2.0, 3.0, -0.0]);
        let y = Q::from_array([4.0, 9.0, 16.0, 25.0]);
        assert_eq!(x.rotate().to_array(), [-2.0, 3.0, 1.0, -2.0]);
        assert_eq!(x.sign_mask(), 0b1010);
        assert_eq!(y.sqrt().to_array(), [2.0, 3.0, 4.0, 5.0]);
        assert_eq!(y.copysign(x).to_array(), [4.0, -9.0, 16.0, -25.0]);
        assert_eq!(x.broadcast::<2>().to_array(), [3.0; 4]);
        assert_eq!(x.max_of_three(), 3.0);
        assert_eq!(x.sum_of_three().to_array()[0], 2.0);
        assert_eq!(x.abs().to_array(), [1.0, 2.0, 3.0, 0.0]);
        assert_eq!(
            x.min(y).max(Q::splat(-1.0)).to_array(),
            [1.0, -1.0, 3.0, -0.0]
        );
    }

    #[test]
    fn baseline() {
        keeps_its_word::<PortableQuad>();
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn avx2() {
        if super::super::SimdLevel::Avx2.is_supported() {
            keeps_its_word::<super::super::avx2_quad::Avx2Quad>();
        }
    }
}
