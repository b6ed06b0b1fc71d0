//! How a ray meets one prism: the room of Projective Displacement Mapping.

use std::sync::Arc;

use glam::Vec3;

use crate::ray::{Aabb, Ray};
use crate::surface::DisplacedSurface;

/// The step of the uniform march.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Texels of the map per step.
    Texels(f32),
    /// World units per step.
    World(f32),
}

/// How the surface is looked for inside a prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum March {
    /// The paper's march: equal steps along the ray.
    Uniform {
        /// Step length.
        step: Step,
        /// Shift the samples of each ray by a random part of a step (thin-feature sampling).
        jitter: bool,
    },
}

/// The instruction set of a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// What every machine of the architecture has.
    Baseline,
    /// x86-64 with AVX2 and FMA.
    Avx2,
}

/// Where a ray first meets the surface inside one prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrismHit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of vertex 1.
    pub u: f32,
    /// Barycentric coordinate of vertex 2.
    pub v: f32,
    /// Geometric normal of S, unit.
    pub ng: Vec3,
}

/// A displaced surface as a set of prisms, one per base triangle: what a backend traces.
pub struct Prisms {
    surface: Arc<DisplacedSurface>,
}

impl Prisms {
    /// Builds the prisms; the kernel is chosen once, for this machine.
    pub fn new(surface: Arc<DisplacedSurface>, march: March) -> Self {
        let _ = march;
        Self { surface }
    }

    /// The same prisms with kernels of a given level (for tests and benches); `None` if this machine lacks it.
    pub fn with_simd(self, level: SimdLevel) -> Option<Self> {
        let _ = level;
        todo!()
    }

    /// The surface that the prisms enclose.
    pub fn surface(&self) -> &Arc<DisplacedSurface> {
        &self.surface
    }

    /// Number of prisms = number of base triangles.
    pub fn len(&self) -> usize {
        self.surface.mesh.triangles().len()
    }

    /// Never true: a base mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Conservative bounds of the surface over one base triangle.
    pub fn bounds(&self, prim: u32) -> Aabb {
        let _ = prim;
        todo!()
    }

    /// The first intersection of `ray` with the surface over base triangle `prim`, with t in (tnear, tfar).
    pub fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        let _ = (prim, ray);
        todo!()
    }

    /// Whether there is any.
    pub fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        self.intersect(prim, ray).is_some()
    }

    /// Bytes beside mesh and map: 108 per base triangle.
    pub fn bytes(&self) -> usize {
        todo!()
    }
}
