//! Prisms for the paper's march: one record each, and the hit test of one.

use glam::Vec3;

use super::frame::Prism;
use super::march::polish::{Root, polish};
use super::march::uniform::{Field, Stepping};
use super::march::{March, bent};
use super::path::{HeightUnits, Path};
use super::room::EditBounds;
use super::sides::inside;
use super::simd::{Grid, Lanes};
use super::touch::{TouchIndex, around};
use super::{Asked, Parts, PrismHit, Prisms};
use crate::ray::Ray;
use crate::surface::DisplacedSurface;

/// Below this n_i . Ng a prism is bent: its rays take the slower exact route.
const BENT: f32 = 0.1;

/// One record per base triangle.
pub struct UniformPrisms {
    pub records: Vec<Prism>,
    /// Where they read the map.
    pub index: TouchIndex,
    units: HeightUnits,
}

impl UniformPrisms {
    pub fn new(surface: &DisplacedSurface, bounds: EditBounds) -> Self {
        let count = surface.mesh().triangles().len() as u32;
        let unit = surface.map().unit();
        Self {
            records: (0..count)
                .map(|prim| {
                    let patch = surface.patch(prim);
                    Prism::new(&patch, bounds.range(surface, prim))
                })
                .collect(),
            index: TouchIndex::new(count as usize, |prim| around(surface.patch(prim).texels)),
            units: HeightUnits {
                texel_per_world: unit / surface.displacement().scale,
                texel_midlevel: unit * surface.displacement().midlevel,
            },
        }
    }
}

/// The first hit over one base triangle.
#[inline(always)]
pub fn intersect<L: Lanes>(asked: &Asked<'_>, ray: &Ray, out: &mut PrismHit) -> bool {
    let prim = asked.primitive;
    out.put(first_root::<L>(asked.prisms, prim, ray).map(|root| root.to_hit(prim)))
}

/// Whether there is any.
#[inline(always)]
pub fn occluded<L: Lanes>(asked: &Asked<'_>, ray: &Ray) -> bool {
    first_root::<L>(asked.prisms, asked.primitive, ray).is_some()
}

#[inline(always)]
fn first_root<L: Lanes>(prisms: &Prisms, prim: u32, ray: &Ray) -> Option<Root> {
    let (March::Uniform { step, jitter }, Parts::Uniform(uniform)) = (prisms.march, &prisms.parts)
    else {
        return None;
    };
    let record = &uniform.records[prim as usize];
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
        heights: &uniform.units,
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
