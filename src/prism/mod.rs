//! How a ray meets one prism: the room of Projective Displacement Mapping.
//!
//! R. Hoetzlein, "Projective Displacement Mapping for Ray Traced Editable Surfaces", Computer Graphics Forum 44(7),
//! 2025, doi 10.1111/cgf.70235.
//!
//! The exact march: base triangles are cut into blocks of texels (`exact`, `block`), whose displaced vertices are held against the ray in
//! f32; what that cannot tell is decided in f64 (`judge`, `curve`). The uniform march, the paper's: a ray that enters a prism's box is
//! clipped to slabs (`frame`, `path`), then to the prism's sides (`sides`); along what is left the surface is looked for (`march`), and
//! the crossing is polished on the surface's definition ([`crate::surface`]). This room knows no Embree, no scene and no picture.

mod block;
mod curve;
mod detail;
mod edits;
mod exact;
mod explain;
mod frame;
mod judge;
#[allow(unsafe_code)] // SIMD stamps
mod kernel;
mod march;
mod motion;
mod path;
mod ray_frame;
mod room;
#[cfg(test)]
mod seam_tests;
mod sides;
mod simd;
mod steps;
#[cfg(test)]
mod tests;
mod touch;
mod uniform;

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64};

use glam::Vec3;

use crate::ray::{Aabb, Ray, RayPacket, lanes_of};
use crate::surface::{
    ChartEdges, ClosestPoint, Corners, DisplacedSurface, PointQuery, Seams, SurfacePoint, TexelBox,
};
use exact::{Asked, ExactPrisms};
use kernel::Kernel;
use uniform::UniformPrisms;

pub use detail::Lod;
pub use edits::BoundsChange;
pub use explain::{
    BlockTold, CellFate, CellTold, Explanation, Fate, LeafTold, PartTold, PathPoint,
};
pub use march::{March, MarchError, Step};
pub use motion::MovingPrisms;
pub use room::EditBounds;
pub use simd::SimdLevel;
pub use steps::count_steps;

/// Where a ray first meets the surface inside one prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrismHit {
    /// Base triangle; or, on a wall of closed [`Seams`], the number of base triangles plus the index into
    /// [`DisplacedSurface::walls`].
    pub prim: u32,
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of vertex 1; on a wall 0 to 1 along its edge, from its first corner in the triangle's order.
    pub u: f32,
    /// Barycentric coordinate of vertex 2; on a wall 0 at its other height, 1 at its triangle's own.
    pub v: f32,
    /// Geometric normal of S, unit, on the base mesh's outer side; on a wall on the solid's outer side.
    pub ng: Vec3,
}

impl PrismHit {
    /// What a hit is written over.
    const BLANK: Self = Self {
        prim: 0,
        t: 0.0,
        u: 0.0,
        v: 0.0,
        ng: Vec3::ZERO,
    };

    /// Writes a hit, if there is one, over `self`.
    #[inline(always)]
    fn put(&mut self, hit: Option<Self>) -> bool {
        if let Some(hit) = hit {
            *self = hit;
        }
        hit.is_some()
    }

    /// Nearer, or at the same t on a primitive of a lower number.
    fn is_before(&self, other: &Self) -> bool {
        self.t < other.t || self.t == other.t && self.prim < other.prim
    }
}

/// A displaced surface as a set of prisms, one per base triangle: what a backend traces.
pub struct Prisms {
    surface: Arc<DisplacedSurface>,
    parts: Parts,
    march: March,
    kernel: Kernel,
    edit_bounds: EditBounds,
    /// Heights for which every prism has room.
    room: Option<(f32, f32)>,
    lod: Lod,
    /// What means must not reach across; only where there is level of detail.
    charts: Option<ChartEdges>,
    /// Bits of [`Self::spread`].
    spread: AtomicU32,
    /// Edits so far that made bounds grow.
    growths: AtomicU64,
}

/// How prisms are made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrismOptions {
    /// How the surface is looked for.
    pub march: March,
    /// How much room they have for edits of the map.
    pub edit_bounds: EditBounds,
    /// Whether surfaces are seen as the ray's cone sees them: the exact march only.
    pub lod: Lod,
}

impl From<March> for PrismOptions {
    /// With [tight](EditBounds::Tight) bounds and no level of detail.
    fn from(march: March) -> Self {
        Self {
            march,
            ..Self::default()
        }
    }
}

/// Ulps by which bounds go beyond what they hold.
const BOUNDS_ULPS: f32 = 16.0;

/// What a march reads beside mesh and map.
enum Parts {
    Exact(ExactPrisms),
    Uniform(UniformPrisms),
}

impl Prisms {
    /// Builds the prisms; a [`March`] alone will do for the options. The kernel is chosen once, for this machine.
    ///
    /// # Errors
    ///
    /// A step that is no positive number; closed [`Seams`] or [`Lod::Cone`] with the uniform march; more blocks than a backend can
    /// number (2^32 - 1).
    pub fn new(
        surface: Arc<DisplacedSurface>,
        options: impl Into<PrismOptions>,
    ) -> Result<Self, MarchError> {
        let PrismOptions {
            march,
            edit_bounds,
            lod,
        } = options.into();
        let march = march.validate()?;
        let room = edit_bounds.room(surface.map());
        let parts = match march {
            March::Exact => {
                Parts::Exact(ExactPrisms::new(&surface, edit_bounds, kernel::outline())?)
            }
            March::Uniform { .. } if surface.seams() == Seams::Closed => {
                return Err(MarchError::SeamsNeedExact);
            }
            March::Uniform { .. } if lod == Lod::Cone => return Err(MarchError::LodNeedsExact),
            March::Uniform { .. } => Parts::Uniform(UniformPrisms::new(&surface, edit_bounds)),
        };
        if lod == Lod::Cone {
            surface.map().build_means();
        }
        Ok(Self {
            lod,
            charts: (lod == Lod::Cone).then(|| surface.chart_edges()),
            spread: AtomicU32::new(0),
            surface,
            parts,
            march,
            kernel: Kernel::new(march, SimdLevel::detect()),
            edit_bounds,
            room,
            growths: AtomicU64::new(0),
        })
    }

    /// The same prisms with kernels of a given level (for tests and benches); `None` if this machine lacks it.
    pub fn with_simd(mut self, level: SimdLevel) -> Option<Self> {
        self.kernel = Kernel::new(self.march, level);
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

    /// How much room there is for edits of the map.
    pub fn edit_bounds(&self) -> EditBounds {
        self.edit_bounds
    }

    /// The smallest and largest height of the map, or that there is room for.
    pub(crate) fn heights(&self) -> (f32, f32) {
        let (low, high) = self.surface.map().range();
        let room = self.room.unwrap_or((low, high));
        (low.min(room.0), high.max(room.1))
    }

    /// Number of primitives that a backend traces. A hit names its base triangle.
    pub fn len(&self) -> usize {
        match &self.parts {
            Parts::Exact(exact) => exact.len(),
            Parts::Uniform(uniform) => uniform.records.len(),
        }
    }

    /// Never true: a base mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes beside mesh and map: 108 per base triangle; of the exact march 32 per block of up to 32x32 texels, or 28 per base triangle
    /// that has none, and where seams are closed 28 per base triangle with walls and 28 per wall; 32 for every 64 primitives, by which an edit
    /// finds what it touches; and 1 per base triangle for level of detail.
    pub fn bytes(&self) -> usize {
        let prisms = match &self.parts {
            Parts::Exact(exact) => exact.bytes(),
            Parts::Uniform(uniform) => size_of_val(&uniform.records[..]) + uniform.index.bytes(),
        };
        let charts = self.charts.as_ref().map_or(0, ChartEdges::bytes);
        prisms + size_of_val(self.surface.walls()) + charts
    }

    /// Conservative bounds of what one traced primitive holds of the surface.
    pub fn bounds(&self, primitive: u32) -> Aabb {
        let bounds = match &self.parts {
            Parts::Exact(exact) => exact.bounds(primitive),
            Parts::Uniform(uniform) => {
                let offsets = uniform.records[primitive as usize].offsets();
                self.surface.patch(primitive).hull([0, 1, 2], offsets)
            }
        };
        bounds.padded(BOUNDS_ULPS)
    }

    /// The first intersection of `ray` with what one traced primitive holds of the surface, with t in (tnear, tfar).
    /// The ray must be [valid](Ray::is_valid).
    #[inline]
    pub fn intersect(&self, primitive: u32, ray: &Ray) -> Option<PrismHit> {
        self.kernel.intersect(&self.asked(primitive, None), ray)
    }

    /// Whether there is any.
    #[inline]
    pub fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.kernel.occluded(&self.asked(primitive, None), ray)
    }

    #[inline(always)]
    fn asked<'a>(&'a self, primitive: u32, corners: Option<&'a Corners>) -> Asked<'a> {
        Asked {
            prisms: self,
            primitive,
            corners,
        }
    }

    /// [`intersect`](Self::intersect) for the lanes whose bits are set in `valid`: their rays must be valid. Other lanes get `None`.
    #[inline]
    pub fn intersect8(
        &self,
        primitive: u32,
        rays: &RayPacket,
        valid: u8,
    ) -> [Option<PrismHit>; RayPacket::LANES] {
        let mut hits = [None; RayPacket::LANES];
        for lane in lanes_of(valid) {
            hits[lane] = self.intersect(primitive, &rays.ray(lane));
        }
        hits
    }

    /// [`occluded`](Self::occluded) for the lanes whose bits are set in `valid`: bit i of the result tells of lane i.
    #[inline]
    pub fn occluded8(&self, primitive: u32, rays: &RayPacket, valid: u8) -> u8 {
        lanes_of(valid)
            .filter(|&lane| self.occluded(primitive, &rays.ray(lane)))
            .fold(0, |bits, lane| bits | 1 << lane)
    }

    /// [`DisplacedSurface::closest`] of what one traced primitive holds of the surface.
    pub fn closest(&self, primitive: u32, query: &PointQuery) -> Option<ClosestPoint> {
        self.surface.closest_in([self.part(primitive)], query)
    }

    /// The base triangle of a primitive, and the part of it that it is.
    fn part(&self, primitive: u32) -> (u32, TexelBox) {
        match &self.parts {
            Parts::Exact(exact) => exact.part(self.surface.map(), primitive),
            Parts::Uniform(_) => (primitive, TexelBox::EVERYWHERE),
        }
    }

    /// The primitives of a base triangle.
    fn primitives_of(&self, triangle: u32) -> Vec<u32> {
        match &self.parts {
            Parts::Exact(exact) => exact.primitives_of(triangle).collect(),
            Parts::Uniform(_) => vec![triangle],
        }
    }

    /// A range that holds D over a base triangle, with room for edits.
    fn displacements(&self, triangle: u32) -> [f64; 2] {
        let offsets = match &self.parts {
            Parts::Exact(exact) => exact.record(triangle).offsets(),
            Parts::Uniform(uniform) => uniform.records[triangle as usize].offsets(),
        };
        self.surface.patch(triangle).displacements_of(offsets)
    }

    /// [`DisplacedSurface::point`].
    pub fn point(&self, prim: u32, u: f32, v: f32) -> SurfacePoint {
        self.surface.point(prim, u, v)
    }
}
