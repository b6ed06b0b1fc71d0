//! Eight samples of one ray at once, at the instruction set of the machine that runs.
//!
//! Kernels are written once over [`Lanes`] and stamped per [`SimdLevel`]; [`SimdLevel::detect`] is asked once,
//! when the prisms are made, and the chosen functions are kept as pointers.

mod portable;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2;

use std::ops::{Add, Div, Mul, Sub};

use crate::surface::{DisplacementMap, StoredTexels, Wrap};

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
pub(crate) use portable::Portable;

/// The instruction set of a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// What every machine of the architecture has.
    Baseline,
    /// x86-64 with AVX2 and FMA.
    Avx2,
}

impl SimdLevel {
    /// Whether this machine can run kernels of this level.
    pub fn is_supported(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
        }
    }

    /// The best level of this machine. The environment variable `PRISMARCH_SIMD=baseline` asks for the lowest.
    pub fn detect() -> Self {
        let baseline = std::env::var_os("PRISMARCH_SIMD").is_some_and(|v| v == "baseline");
        if !baseline && Self::Avx2.is_supported() {
            Self::Avx2
        } else {
            Self::Baseline
        }
    }

    /// `baseline` or `avx2+fma`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "avx2+fma",
        }
    }
}

/// Number of lanes.
pub(crate) const LANES: usize = 8;

/// Eight f32 values: the least that the kernels need.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn splat(x: f32) -> Self;
    fn from_array(x: [f32; LANES]) -> Self;
    fn to_array(self) -> [f32; LANES];
    /// self * a + b, fused where the machine can.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    fn floor(self) -> Self;
    fn sqrt(self) -> Self;
    /// Lane k becomes lane k + 1; the last stays.
    fn next(self) -> Self;
    /// The largest lane.
    fn max_lane(self) -> f32;
    /// Bit k: lane k's sign bit.
    fn sign_mask(self) -> u32;
    /// The stored texels at the corners (0,0) (1,0) (0,1) (1,1) of the cells (i, j), integers in float lanes.
    /// Cells outside the grid, and NaN, are moved inside first.
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4];
}

/// A displacement map as the kernels see it.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'m> {
    texels: &'m StoredTexels,
    stride: usize,
    wrap: Wrap,
    /// Texels across and up.
    size: [f32; 2],
}

impl<'m> Grid<'m> {
    pub fn new(map: &'m DisplacementMap) -> Self {
        let (width, height) = map.size();
        Self {
            texels: map.texels(),
            stride: map.stride(),
            wrap: map.wrap(),
            size: [width as f32, height as f32],
        }
    }

    /// Stored height (see [`DisplacementMap::unit`]) at texel coordinates, bilinear.
    #[inline(always)]
    pub fn sample<L: Lanes>(&self, x: L, y: L) -> L {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texels;
    use glam::DVec2;

    fn maps() -> Vec<DisplacementMap> {
        let height = |i: usize| (i * 2654435761) >> 7;
        let (w, h) = (7, 5);
        let mut maps = Vec::new();
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for texels in [
                Texels::U8((0..w * h).map(|i| height(i) as u8).collect()),
                Texels::U16((0..w * h).map(|i| height(i) as u16).collect()),
                Texels::F32(
                    (0..w * h)
                        .map(|i| height(i) as u16 as f32 / 7.0 - 3.0)
                        .collect(),
                ),
            ] {
                maps.push(DisplacementMap::new(w, h, texels, wrap).unwrap());
            }
        }
        maps
    }

    fn samples_like_the_map<L: Lanes>() {
        for map in maps() {
            let grid = Grid::new(&map);
            for k in 0..200 {
                let x: [f32; LANES] =
                    std::array::from_fn(|l| (k * 8 + l as i32 - 800) as f32 * 0.0371);
                let y: [f32; LANES] =
                    std::array::from_fn(|l| (k * 3 + l as i32 * 5 - 300) as f32 * 0.0673);
                let got = grid.sample(L::from_array(x), L::from_array(y)).to_array();
                for l in 0..LANES {
                    let want = map.sample(DVec2::new(x[l].into(), y[l].into())).height as f32;
                    let unit = map.unit();
                    assert!(
                        (got[l] / unit - want).abs() < 1e-4 * want.abs().max(1.0),
                        "{:?} {}",
                        map.wrap(),
                        x[l]
                    );
                }
            }
        }
    }

    fn survives_any_coordinate<L: Lanes>() {
        for map in maps() {
            let grid = Grid::new(&map);
            let odd = [
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                1e30,
                -1e30,
                f32::MIN_POSITIVE,
                7.0,
                -0.0,
            ];
            for shift in 0..LANES {
                let y = std::array::from_fn(|l| odd[(l + shift) % LANES]);
                grid.sample(L::from_array(odd), L::from_array(y));
            }
        }
    }

    fn moves_lanes<L: Lanes>() {
        let x = L::from_array([1.0, -2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0]);
        assert_eq!(
            x.next().to_array(),
            [-2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0, 8.0]
        );
        assert_eq!(x.max_lane(), 9.0);
        assert_eq!(x.next().next().next().next().max_lane(), 8.0);
        assert_eq!(x.sign_mask(), 0b0001_0010);
    }

    #[test]
    fn baseline_samples_the_map() {
        moves_lanes::<Portable>();
        samples_like_the_map::<Portable>();
        survives_any_coordinate::<Portable>();
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn avx2_samples_the_map() {
        if SimdLevel::Avx2.is_supported() {
            moves_lanes::<Avx2>();
            samples_like_the_map::<Avx2>();
            survives_any_coordinate::<Avx2>();
        }
    }
}
