//! How a ray meets one prism: the room of Projective Displacement Mapping.
//!
//! R. Hoetzlein, "Projective Displacement Mapping for Ray Traced Editable Surfaces", Computer Graphics Forum 44(7),
//! 2025, doi 10.1111/cgf.70235.
//!
//! A ray that enters a prism's box is clipped to slabs (`frame`, `path`), then to the prism's sides
//! (`sides`); along what is left the surface is looked for (`march`), and the crossing is polished on the
//! surface's definition ([`crate::surface`]). This room knows no Embree, no scene and no picture.

mod frame;
#[allow(unsafe_code)] // SIMD stamps
mod kernel;
mod march;
mod normal;
mod path;
mod sides;
mod simd;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::ray::{Aabb, Ray};
use crate::surface::{DisplacedSurface, SurfacePoint};
use frame::Prism;
use kernel::Kernel;
use path::HeightUnits;

pub use march::{March, MarchError, Step};
pub use simd::SimdLevel;

/// Where a ray first meets the surface inside one prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrismHit {
    /// Base triangle.
    pub prim: u32,
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of vertex 1.
    pub u: f32,
    /// Barycentric coordinate of vertex 2.
    pub v: f32,
    /// Geometric normal of S, unit, on the base mesh's outer side.
    pub ng: Vec3,
}

/// A displaced surface as a set of prisms, one per base triangle: what a backend traces.
pub struct Prisms {
    surface: Arc<DisplacedSurface>,
    records: Vec<Prism>,
    units: HeightUnits,
    march: March,
    kernel: Kernel,
}

/// Below this n_i . Ng a prism is bent: its rays take the slower exact route.
const BENT: f32 = 0.1;

impl Prisms {
    /// Builds the prisms; the kernel is chosen once, for this machine.
    pub fn new(surface: Arc<DisplacedSurface>, march: March) -> Result<Self, MarchError> {
        let march = march.validate()?;
        let count = surface.mesh().triangles().len() as u32;
        let records: Vec<Prism> = (0..count)
            .map(|prim| Prism::new(&surface.patch(prim)))
            .collect();
        let unit = surface.map().unit();
        let units = HeightUnits {
            texel_per_world: unit / surface.displacement().scale,
            texel_midlevel: unit * surface.displacement().midlevel,
        };
        Ok(Self {
            surface,
            records,
            units,
            march,
            kernel: Kernel::new(SimdLevel::detect()),
        })
    }

    /// The same prisms with kernels of a given level (for tests and benches); `None` if this machine lacks it.
    pub fn with_simd(mut self, level: SimdLevel) -> Option<Self> {
        self.kernel = Kernel::new(level);
        level.is_supported().then_some(self)
    }

    /// The level of the kernels.
    pub fn simd(&self) -> SimdLevel {
        self.kernel.level()
    }

    /// The surface that the prisms enclose.
    pub fn surface(&self) -> &Arc<DisplacedSurface> {
        &self.surface
    }

    /// How the surface is looked for.
    pub fn march(&self) -> March {
        self.march
    }

    /// Number of primitives that a backend traces. A hit names its base triangle.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Never true: a base mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Bytes beside mesh and map: 108 per base triangle.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.records[..])
    }

    /// Conservative bounds of the surface over one base triangle: every point is sum b_i (v_i + w n_i) for one w of
    /// the range, so it is in the hull of six corners; and no further than the largest |D| from the triangle.
    pub fn bounds(&self, prim: u32) -> Aabb {
        let patch = self.surface.patch(prim);
        let record = &self.records[prim as usize];
        let ([low, high], offsets) = (
            record.range().map(f64::from),
            record.offsets().map(f64::from),
        );
        let (mut hull_min, mut hull_max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (&v, &n) in patch.vertices.iter().zip(&patch.normals) {
            (min, max) = (min.min(v), max.max(v));
            for w in offsets {
                (hull_min, hull_max) = (hull_min.min(v + w * n), hull_max.max(v + w * n));
            }
        }
        let reach = low.abs().max(high.abs());
        let bounds = Aabb {
            min: hull_min.max(min - reach).as_vec3(),
            max: hull_max.min(max + reach).as_vec3(),
        };
        const ULPS: f32 = 16.0;
        bounds.padded(ULPS)
    }

    /// The first intersection of `ray` with the surface over base triangle `prim`, with t in (tnear, tfar).
    #[inline]
    pub fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        self.kernel.intersect(self, prim, ray)
    }

    /// Whether there is any.
    #[inline]
    pub fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        self.kernel.occluded(self, prim, ray)
    }

    /// All a shader wants to know of the point (u, v) over base triangle `prim`.
    pub fn point(&self, prim: u32, u: f32, v: f32) -> SurfacePoint {
        let patch = self.surface.patch(prim);
        let (bu, bv) = (f64::from(u), f64::from(v));
        let point = patch.point(bu, bv);
        let [st0, st1, st2] = self.surface.mesh().corner_texcoords(prim);
        SurfacePoint {
            position: point.position.as_vec3(),
            base_position: patch.base(bu, bv).as_vec3(),
            geometric_normal: point
                .du
                .cross(point.dv)
                .normalize_or(patch.face_normal())
                .as_vec3(),
            shading_normal: normal::smooth(&patch, bu, bv).as_vec3(),
            texcoord: st0 + u * (st1 - st0) + v * (st2 - st0),
            displacement: point.displacement as f32,
        }
    }
}
