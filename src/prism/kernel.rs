//! The hit tests, written once over [`Lanes`](super::simd::Lanes), stamped per instruction set, chosen once.
//!
//! # Safety
//!
//! The AVX2 stamps are reached only through a [`Kernel`] made for [`SimdLevel::Avx2`], and [`Kernel::new`] makes that
//! only where the machine supports it.

use super::block::{self, Block, Outline, Record};
use super::simd::{Portable, SimdLevel};
use super::{Asked, March, PrismHit, exact, uniform};
use crate::ray::{Aabb, Ray};
use crate::surface::DisplacedSurface;

/// Whether there is a hit, which is written to where the last argument says: most calls are misses, and these leave nothing in memory.
type Intersect = fn(&Asked<'_>, &Ray, &mut PrismHit) -> bool;
type Occluded = fn(&Asked<'_>, &Ray) -> bool;

/// The chosen hit tests.
#[derive(Clone, Copy)]
pub struct Kernel {
    level: SimdLevel,
    intersect: Intersect,
    occluded: Occluded,
}

/// A function of a march for a level: for [`Portable`] lanes, or for AVX2.
macro_rules! stamped {
    ($level:expr, $march:ident::$function:ident($($name:ident: $type:ty),*) -> $output:ty) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn avx2($($name: $type),*) -> $output {
            $march::$function::<super::simd::Avx2>($($name),*)
        }

        let portable: fn($($type),*) -> $output = $march::$function::<Portable>;
        match $level {
            SimdLevel::Baseline => portable,
            // SAFETY: the machine supports AVX2 and FMA, or this function would not have been chosen.
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => |$($name),*| unsafe { avx2($($name),*) },
            #[cfg(not(target_arch = "x86_64"))]
            SimdLevel::Avx2 => portable,
        }
    }};
}

/// The function for boxes of this machine; they are the same at every level.
pub fn outline() -> Outline {
    stamped!(SimdLevel::detect(), block::outline(surface: &DisplacedSurface, record: &Record, block: Block, room: Option<(f32, f32)>) -> Aabb)
}

/// The hit tests of a march.
macro_rules! march {
    ($level:expr, $march:ident) => {
        (
            stamped!($level, $march::intersect(asked: &Asked<'_>, ray: &Ray, out: &mut PrismHit) -> bool),
            stamped!($level, $march::occluded(asked: &Asked<'_>, ray: &Ray) -> bool),
        )
    };
}

impl Kernel {
    /// The kernel that counts its steps: at the baseline, so that all machines count the same.
    pub fn counting(march: March) -> Self {
        let (intersect, occluded): (Intersect, Occluded) = match march {
            March::Exact => (
                exact::intersect::<Portable<true>>,
                exact::occluded::<Portable<true>>,
            ),
            March::Uniform { .. } => (
                uniform::intersect::<Portable<true>>,
                uniform::occluded::<Portable<true>>,
            ),
        };
        Self {
            level: SimdLevel::Baseline,
            intersect,
            occluded,
        }
    }

    /// The kernel of `level`, or of the baseline where the machine lacks it.
    pub fn new(march: March, level: SimdLevel) -> Self {
        let level = if level.is_supported() {
            level
        } else {
            SimdLevel::Baseline
        };
        let (intersect, occluded): (Intersect, Occluded) = match march {
            March::Exact => march!(level, exact),
            March::Uniform { .. } => march!(level, uniform),
        };
        Self {
            level,
            intersect,
            occluded,
        }
    }

    pub fn level(&self) -> SimdLevel {
        self.level
    }

    #[inline]
    pub fn intersect(&self, asked: &Asked<'_>, ray: &Ray) -> Option<PrismHit> {
        let mut hit = PrismHit::BLANK;
        (self.intersect)(asked, ray, &mut hit).then_some(hit)
    }

    #[inline]
    pub fn occluded(&self, asked: &Asked<'_>, ray: &Ray) -> bool {
        (self.occluded)(asked, ray)
    }
}
