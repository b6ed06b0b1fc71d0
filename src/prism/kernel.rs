//! The hit test of one prism, written once over [`Lanes`], stamped per instruction set, chosen once.
//!
//! # Safety
//!
//! The AVX2 stamp is reached only through a [`Kernel`] made for [`SimdLevel::Avx2`], and [`Kernel::new`] makes that
//! only where the machine supports it.

use glam::Vec3;

use super::march::polish::{Root, polish};
use super::march::uniform::{Field, Stepping};
use super::march::{March, bent};
use super::path::Path;
use super::sides::inside;
use super::simd::{Grid, Lanes, Portable, SimdLevel};
use super::{BENT, PrismHit, Prisms};
use crate::ray::Ray;

/// The chosen hit test.
#[derive(Clone, Copy)]
pub struct Kernel {
    level: SimdLevel,
    first_root: fn(&Prisms, u32, &Ray) -> Option<Root>,
}

impl Kernel {
    /// The kernel of `level`, or of the baseline where the machine lacks it.
    pub fn new(level: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        if level == SimdLevel::Avx2 && level.is_supported() {
            let first_root: fn(&Prisms, u32, &Ray) -> Option<Root> = |prisms, prim, ray| {
                // SAFETY: the machine supports AVX2 and FMA, or this function would not have been chosen.
                unsafe { first_root_avx2(prisms, prim, ray) }
            };
            return Self { level, first_root };
        }
        Self {
            level: SimdLevel::Baseline,
            first_root: first_root::<Portable>,
        }
    }

    pub fn level(&self) -> SimdLevel {
        self.level
    }

    #[inline]
    pub fn intersect(&self, prisms: &Prisms, prim: u32, ray: &Ray) -> Option<PrismHit> {
        let root = (self.first_root)(prisms, prim, ray)?;
        let ng = root
            .ng
            .as_vec3()
            .try_normalize()
            .unwrap_or_else(|| root.ng.normalize_or_zero().as_vec3());
        let (u, v) = (root.u.clamp(0.0, 1.0) as f32, root.v.clamp(0.0, 1.0) as f32);
        Some(PrismHit {
            prim,
            t: root.t as f32,
            u,
            v: v.min(1.0 - u),
            ng,
        })
    }

    #[inline]
    pub fn occluded(&self, prisms: &Prisms, prim: u32, ray: &Ray) -> bool {
        (self.first_root)(prisms, prim, ray).is_some()
    }
}

/// # Safety
///
/// The machine must support AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn first_root_avx2(prisms: &Prisms, prim: u32, ray: &Ray) -> Option<Root> {
    first_root::<super::simd::Avx2>(prisms, prim, ray)
}

#[inline(always)]
fn first_root<L: Lanes>(prisms: &Prisms, prim: u32, ray: &Ray) -> Option<Root> {
    let March::Uniform { step, jitter } = prisms.march;
    let record = &prisms.records[prim as usize];
    let bent = || bent::intersect(&prisms.surface.patch(prim), ray, record.offsets(), step);
    if record.lowest_normal_height() <= BENT {
        return bent();
    }
    let clipped = Path::clip(record, prisms.surface.mesh().first_corner(prim), ray)?;
    let path = Path::new(record, &clipped);
    if !path.is_regular() {
        return bent();
    }
    let inside = inside(&path);
    if inside.intervals().is_empty() {
        return None;
    }
    let [n0, n1, n2] = prisms.surface.mesh().corner_normals(prim);
    let spread = Vec3::new(
        n0.distance_squared(n1),
        n0.distance_squared(n2),
        n1.distance_squared(n2),
    );
    let grid = Grid::new(prisms.surface.map());
    let field = Field {
        path: &path,
        heights: &prisms.units,
        grid: &grid,
        spread,
    };
    let first = if jitter {
        random_part(ray.key, prim)
    } else {
        1.0
    };
    let stepping = Stepping {
        step,
        speed: ray.direction.length(),
        first,
        limit: (ray.tfar - path.t0) / path.dt,
    };
    let accept = |crossing| {
        polish(&prisms.surface.patch(prim), ray, &crossing).filter(|root| root.is_hit(ray))
    };
    // A loop, not an iterator: lanes must not pass through functions that lack the kernel's instruction set.
    for &interval in inside.intervals() {
        let hit = field.march::<L, Root>(interval, &stepping, accept);
        if hit.is_some() {
            return hit;
        }
    }
    None
}

/// A number in (0, 1] from a ray's key and a prism.
fn random_part(key: u32, prim: u32) -> f32 {
    // PCG's output permutation (O'Neill 2014) over a mix of both.
    let state = (key ^ prim.wrapping_mul(0x9e37_79b9))
        .wrapping_mul(747_796_405)
        .wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    let bits = (word >> 22) ^ word;
    ((bits >> 8) + 1) as f32 / 16_777_216.0
}
