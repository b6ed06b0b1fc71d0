//! The hit tests, written once over [`Lanes`](super::simd::Lanes), stamped per instruction set, chosen once.
//!
//! # Safety
//!
//! The AVX2 stamps are reached only through a [`Kernel`] made for [`SimdLevel::Avx2`], and [`Kernel::new`] makes that
//! only where the machine supports it.

use super::simd::{Portable, SimdLevel};
use super::{March, PrismHit, Prisms, exact, packet, uniform};
use crate::ray::{Ray, RayPacket, lanes_of};

/// Whether there is a hit, which is written to where the last argument says: most calls are misses, and these leave nothing in memory.
type Intersect = fn(&Prisms, u32, &Ray, &mut PrismHit) -> bool;
type Occluded = fn(&Prisms, u32, &Ray) -> bool;

/// Of a packet: hits, and the lanes that are to be asked one by one.
type Intersect8 = fn(&Prisms, u32, &RayPacket, u8, &mut Hits) -> u8;
type Occluded8 = fn(&Prisms, u32, &RayPacket, u8) -> [u8; 2];
type Hits = [Option<PrismHit>; RayPacket::LANES];

/// The chosen hit tests.
#[derive(Clone, Copy)]
pub struct Kernel {
    level: SimdLevel,
    intersect: Intersect,
    occluded: Occluded,
    /// Of marches that know packets.
    packets: Option<(Intersect8, Occluded8)>,
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

/// The hit tests of a march for single rays.
macro_rules! single {
    ($level:expr, $march:ident) => {
        (
            stamped!($level, $march::intersect(prisms: &Prisms, prim: u32, ray: &Ray, out: &mut PrismHit) -> bool),
            stamped!($level, $march::occluded(prisms: &Prisms, prim: u32, ray: &Ray) -> bool),
        )
    };
}

/// Those of the exact march for packets.
fn packets(level: SimdLevel) -> (Intersect8, Occluded8) {
    (
        stamped!(level, packet::intersect(prisms: &Prisms, prim: u32, rays: &RayPacket, valid: u8, hits: &mut Hits) -> u8),
        stamped!(level, packet::occluded(prisms: &Prisms, prim: u32, rays: &RayPacket, valid: u8) -> [u8; 2]),
    )
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
            packets: None,
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
            March::Exact => single!(level, exact),
            March::Uniform { .. } => single!(level, uniform),
        };
        Self {
            level,
            intersect,
            occluded,
            packets: (march == March::Exact).then(|| packets(level)),
        }
    }

    pub fn level(&self) -> SimdLevel {
        self.level
    }

    #[inline]
    pub fn intersect(&self, prisms: &Prisms, primitive: u32, ray: &Ray) -> Option<PrismHit> {
        let mut hit = PrismHit::BLANK;
        (self.intersect)(prisms, primitive, ray, &mut hit).then_some(hit)
    }

    #[inline]
    pub fn occluded(&self, prisms: &Prisms, primitive: u32, ray: &Ray) -> bool {
        (self.occluded)(prisms, primitive, ray)
    }

    #[inline]
    pub fn intersect8(&self, prisms: &Prisms, primitive: u32, rays: &RayPacket, valid: u8) -> Hits {
        let mut hits = [None; RayPacket::LANES];
        let alone = match self.packets {
            Some((intersect, _)) => intersect(prisms, primitive, rays, valid, &mut hits),
            None => valid,
        };
        for lane in lanes_of(alone) {
            hits[lane] = self.intersect(prisms, primitive, &rays.ray(lane));
        }
        hits
    }

    #[inline]
    pub fn occluded8(&self, prisms: &Prisms, primitive: u32, rays: &RayPacket, valid: u8) -> u8 {
        let [mut hit, alone] = match self.packets {
            Some((_, occluded)) => occluded(prisms, primitive, rays, valid),
            None => [0, valid],
        };
        for lane in lanes_of(alone) {
            hit |= u8::from(self.occluded(prisms, primitive, &rays.ray(lane))) << lane;
        }
        hit
    }
}
