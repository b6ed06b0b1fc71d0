//! Eight samples of one ray at once, at the instruction set of the machine that runs.
//!
//! Kernels are written once over [`Lanes`] and stamped per [`SimdLevel`]; [`SimdLevel::detect`] is asked once,
//! when the prisms are made, and the chosen functions are kept as pointers.

mod grid;
mod portable;
mod quad;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2_quad;

use std::ops::{Add, Div, Mul, Sub};

use crate::surface::{Entries, StoredTexels};

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
pub(crate) use grid::Grid;
pub(crate) use portable::Portable;
pub(crate) use quad::Quad;

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

/// A part of a kernel that may stand in a function of its own.
pub(crate) trait Task<L> {
    /// What it gives.
    type Output;
    /// Must be `inline(always)`, to be compiled for the instruction set of who runs it.
    fn run(self) -> Self::Output;
}

/// Eight f32 values: the least that the kernels need.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The f64 lanes that go with these.
    type Quad: Quad;

    /// Runs a task in a function of its own, stamped for the instruction set: for what would bloat its callers.
    fn outline<T: Task<Self>>(task: T) -> T::Output;

    /// Whether steps are counted.
    const COUNTED: bool = false;

    /// Called at every step of a march ([`count_steps`](super::count_steps)). Only lanes that count them do anything.
    #[inline(always)]
    fn step() {}

    fn splat(x: f32) -> Self;
    fn from_array(x: [f32; LANES]) -> Self;
    fn to_array(self) -> [f32; LANES];
    /// self * a + b, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// b - self * a, rounded once.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    fn floor(self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// Lane k becomes lane k + 1; the last stays.
    fn next(self) -> Self;
    /// The largest lane.
    fn max_lane(self) -> f32;
    /// Bit k: lane k's sign bit.
    fn sign_mask(self) -> u32;
    /// The stored texels at the corners (0,0) (1,0) (0,1) (1,1) of the cells (i, j), integers in float lanes.
    /// Cells outside the grid, and NaN, are moved inside first.
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4];
    /// Smallest and largest of stored pairs: four from each number on; zeros where there are fewer.
    fn pairs(entries: &Entries, first: [usize; 2]) -> [Self; 2];
    /// The stored texels from `index` on, and from `index` + 1 on: the left and the right ends of eight cells in a row. Zeros where
    /// not all nine are stored; from the first to the last texel of a map they are.
    fn texel_rows(texels: &StoredTexels, index: usize) -> [Self; 2];
}

/// Nine in a row.
#[inline(always)]
fn nine<T>(stored: &[T], index: usize) -> Option<&[T; LANES + 1]> {
    stored.get(index..)?.first_chunk()
}

#[cfg(test)]
mod stored_tests;
#[cfg(test)]
mod tests;
