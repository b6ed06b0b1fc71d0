//! Prisms that move: the base mesh has vertices at time steps ([`MovingSurface`]).
//!
//! For a ray at time t the prisms of a cluster are made over the corners as they stand then, and the exact march meets them as it meets
//! any: nothing of it knows of time. Making them takes about a microsecond per ray and cluster.
//!
//! **Bounds.** A backend that knows motion, as Embree, has a box per primitive and time step and takes the linear interpolation of both
//! boxes of a segment at the times between. [`MovingSurface::block_bounds`] makes boxes that hold the surface then.

use std::sync::Arc;

use glam::Vec3;

use super::simd::LANES;
use super::{BoundsChange, Lod, March, MarchError, Parts, PrismHit, PrismOptions, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, MovingSurface, PointQuery, TexelBox, TexelRect};

/// A [`MovingSurface`] as a set of prisms, for rays at any time from 0 to 1 ([`Ray::time`]).
///
/// Primitives are those of [`Prisms`] over the surface at time 0.
///
/// ```
/// # use std::sync::Arc;
/// # use glam::{Vec2, Vec3};
/// use prismarch::{prism::*, ray::Ray, surface::*};
///
/// // A triangle that rises from z = 0 to z = 1, displaced by 1/2.
/// let mesh = MeshBuilder {
///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
///     normals: vec![Vec3::Z; 3],
///     texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
///     triangles: vec![[0, 1, 2]],
/// };
/// let raised = TimeStep {
///     positions: mesh.positions.iter().map(|p| p + Vec3::Z).collect(),
///     normals: mesh.normals.clone(),
/// };
/// let (mesh, _) = mesh.build(NormalMode::File)?;
/// let map = DisplacementMap::new(1, 1, Texels::F32(vec![0.5]), Wrap::Repeat)?;
/// let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(1.0))?;
/// let moving = MovingSurface::new(Arc::new(surface), vec![raised])?;
/// let prisms = MovingPrisms::new(Arc::new(moving), March::Exact)?;
///
/// let down = Ray::new(Vec3::new(0.2, 0.2, 3.0), -Vec3::Z);
/// let at = |time| prisms.intersect(0, &Ray { time, ..down }).expect("a hit").t;
/// assert_eq!([at(0.0), at(0.25), at(1.0)], [2.5, 2.25, 1.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct MovingPrisms {
    moving: Arc<MovingSurface>,
    /// At time 0.
    prisms: Prisms,
}

impl MovingPrisms {
    /// Builds the prisms: the exact march, without level of detail.
    ///
    /// # Errors
    ///
    /// The uniform march, [`Lod::Cone`], more base triangles than the exact march can number.
    pub fn new(
        moving: Arc<MovingSurface>,
        options: impl Into<PrismOptions>,
    ) -> Result<Self, MarchError> {
        let options = options.into();
        if options.march != March::Exact {
            return Err(MarchError::MotionNeedsExact);
        }
        if options.lod != Lod::Off {
            return Err(MarchError::MotionHasNoLod);
        }
        Ok(Self {
            prisms: Prisms::new(moving.surface().clone(), options)?,
            moving,
        })
    }

    /// The surface that the prisms enclose.
    pub fn surface(&self) -> &Arc<MovingSurface> {
        &self.moving
    }

    /// The prisms at time 0.
    pub fn at_start(&self) -> &Prisms {
        &self.prisms
    }

    /// Time steps, at least 1: evenly spaced over [0, 1].
    pub fn time_steps(&self) -> usize {
        self.moving.time_steps()
    }

    /// Number of primitives that a backend traces. A hit names its base triangle.
    pub fn len(&self) -> usize {
        self.prisms.len()
    }

    /// Never true: a base mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.prisms.is_empty()
    }

    /// [`Prisms::map_edited`].
    pub fn map_edited(&self, rect: TexelRect) -> BoundsChange {
        self.prisms.map_edited(rect)
    }

    /// The box of one traced primitive at a time step. Between two steps the surface is in the linear interpolation of their boxes.
    ///
    /// # Panics
    ///
    /// If there is no such primitive or step.
    pub fn bounds(&self, primitive: u32, step: usize) -> Aabb {
        assert!(step < self.time_steps(), "there is no time step {step}");
        if self.time_steps() == 1 {
            return self.prisms.bounds(primitive);
        }
        let prisms = self.lanes(primitive).filter_map(|(prim, range)| {
            let whole = TexelBox::EVERYWHERE;
            self.moving.block_bounds(prim, &whole, range, step)
        });
        let bounds = prisms.fold(Aabb::EMPTY, Aabb::union);
        bounds.padded(super::BOUNDS_ULPS)
    }

    /// The base triangles of a primitive, and a range that holds D on each.
    fn lanes(&self, primitive: u32) -> impl Iterator<Item = (u32, [f64; 2])> {
        let index = primitive as usize;
        let exact = match &self.prisms.parts {
            Parts::Exact(exact) => Some(exact),
            Parts::Uniform(_) => None,
        };
        exact.into_iter().flat_map(move |exact| {
            let cluster = &exact.clusters[index];
            (0..exact.len(index)).map(|lane| {
                let prim = cluster.prim(lane);
                let patch = self.prisms.surface.patch(prim);
                (prim, patch.displacements_of(cluster.offsets(lane)))
            })
        })
    }

    /// The first intersection of `ray`, at its time, with what one traced primitive holds of the surface, with t in (tnear, tfar).
    /// The ray must be [valid](Ray::is_valid).
    pub fn intersect(&self, primitive: u32, ray: &Ray) -> Option<PrismHit> {
        if self.time_steps() == 1 {
            return self.prisms.intersect(primitive, ray);
        }
        let hit = self.standing(primitive, ray)?.intersect(0, ray)?;
        // A triangle may have no area for a moment.
        hit.ng.is_finite().then_some(hit)
    }

    /// Whether there is any.
    pub fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        if self.time_steps() == 1 {
            return self.prisms.occluded(primitive, ray);
        }
        let standing = self.standing(primitive, ray);
        standing.is_some_and(|prisms| prisms.occluded(0, ray))
    }

    /// [`Prisms::closest`] at the query's time.
    pub fn closest(&self, primitive: u32, query: &PointQuery) -> Option<ClosestPoint> {
        let prims = self.lanes(primitive).map(|(prim, _)| prim);
        self.moving.closest(prims, query)
    }

    /// The prisms of one primitive that a ray may meet, as they stand at its time.
    fn standing(&self, primitive: u32, ray: &Ray) -> Option<Prisms> {
        let Parts::Exact(exact) = &self.prisms.parts else {
            return None;
        };
        let index = primitive as usize;
        let cluster = &exact.clusters[index];
        let (mut met, mut count) = ([0; LANES], 0);
        for lane in 0..exact.len(index) {
            let corners = self.moving.positions(cluster.prim(lane), ray.time);
            let [low, high] = cluster.offsets(lane);
            // S is no further than |D| <= |w| from the triangle.
            if may_pass(corners, low.abs().max(high.abs()), ray) {
                met[count] = lane;
                count += 1;
            }
        }
        if count == 0 {
            return None;
        }
        let corners = |prim| self.moving.corners(prim, ray.time);
        let moved = cluster.moved(&self.prisms.surface, &met[..count], corners);
        Some(self.prisms.of_one(moved, count))
    }
}

/// Whether a ray may pass within `reach` of the box around a triangle.
fn may_pass(corners: [Vec3; 3], reach: f32, ray: &Ray) -> bool {
    let around = corners.into_iter().fold(Aabb::EMPTY, Aabb::including);
    let around = around.padded(super::BOUNDS_ULPS);
    let (origin, reach) = (ray.origin.as_dvec3(), f64::from(reach) * 1.000_001);
    let inverse = ray.direction.as_dvec3().recip();
    let a = (around.min.as_dvec3() - reach - origin) * inverse;
    let b = (around.max.as_dvec3() + reach - origin) * inverse;
    // Of rounding.
    const SLACK: f64 = 1e-12;
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    let (tnear, tfar) = (f64::from(ray.tnear), f64::from(ray.tfar));
    let slack = SLACK * (enter.abs() + leave.abs());
    // Not what may be NaN: of a ray that starts on a face.
    !(enter > leave + slack || enter > tfar + slack || leave < tnear - slack)
}
