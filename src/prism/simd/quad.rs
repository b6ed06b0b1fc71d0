//! Four f64 values at once.
//!
//! In the set-up of one ray against one prism lane k is vertex or side k; lane 3 repeats lane 0, so that a rotation is one permutation.
//! Where a packet's hits are landed lanes are rays.

use std::ops::{Add, Div, Mul, Sub};

use glam::{DVec2, Vec4};

use crate::surface::DisplacementMap;

/// One f64 value or four, with the same digits in every lane as alone: additions and products are rounded one by one.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn splat(x: f64) -> Self;
    fn sqrt(self) -> Self;
    /// Height and in-cell gradient of a map at texel coordinates: see [`DisplacementMap::sample`].
    fn sampled(map: &DisplacementMap, texel: [Self; 2]) -> [Self; 3];
}

impl Real for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn sampled(map: &DisplacementMap, [x, y]: [Self; 2]) -> [Self; 3] {
        let sample = map.sample(DVec2::new(x, y));
        [sample.height, sample.gradient.x, sample.gradient.y]
    }
}

/// Four f64 values: the least that the set-up needs. Additions and products are rounded one by one, so that a side's quadratic has the same
/// digits seen from both prisms, and at every level.
pub(crate) trait Quad: Real {
    fn from_array(x: [f64; 4]) -> Self;
    fn to_array(self) -> [f64; 4];
    /// Three lanes, and the first once more.
    fn from_three(x: [f32; 3]) -> Self;
    /// Rounded.
    fn to_f32(self) -> Vec4;
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

/// [`Real::sampled`], lane by lane.
#[inline(always)]
pub(super) fn sampled_in_lanes<Q: Quad>(map: &DisplacementMap, [x, y]: [Q; 2]) -> [Q; 3] {
    let (x, y) = (x.to_array(), y.to_array());
    let (a, b) = (
        f64::sampled(map, [x[0], y[0]]),
        f64::sampled(map, [x[1], y[1]]),
    );
    let (c, d) = (
        f64::sampled(map, [x[2], y[2]]),
        f64::sampled(map, [x[3], y[3]]),
    );
    [
        Q::from_array([a[0], b[0], c[0], d[0]]),
        Q::from_array([a[1], b[1], c[1], d[1]]),
        Q::from_array([a[2], b[2], c[2], d[2]]),
    ]
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

impl Real for PortableQuad {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; 4])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn sampled(map: &DisplacementMap, texel: [Self; 2]) -> [Self; 3] {
        sampled_in_lanes(map, texel)
    }
}

impl Quad for PortableQuad {
    #[inline(always)]
    fn from_array(x: [f64; 4]) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.0
    }
    #[inline(always)]
    fn from_three([a, b, c]: [f32; 3]) -> Self {
        Self([a.into(), b.into(), c.into(), a.into()])
    }
    #[inline(always)]
    fn to_f32(self) -> Vec4 {
        let [a, b, c, d] = self.0;
        Vec4::new(a as f32, b as f32, c as f32, d as f32)
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
        assert_eq!(
            Q::from_three([1.5, 2.0, -3.0]).to_array(),
            [1.5, 2.0, -3.0, 1.5]
        );
        assert_eq!(y.to_f32(), Vec4::new(4.0, 9.0, 16.0, 25.0));
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
