//! Prisms that move: the base mesh has vertices at time steps ([`MovingSurface`]).
//!
//! For a ray at time t a primitive's base triangle is made over the corners as they stand then, and the exact march meets it as it meets
//! any: nothing of it knows of time.
//!
//! **Bounds.** A backend that knows motion, as Embree, has a box per primitive and time step and takes the linear interpolation of both
//! boxes of a segment at the times between. [`MovingSurface::block_bounds`] makes boxes that hold the surface then.

use std::sync::Arc;

use super::edits::Growth;
use super::{BoundsChange, Lod, March, MarchError, PrismHit, PrismOptions, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, Corners, MovingSurface, PointQuery, TexelBox, TexelRect};

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
    /// The uniform march, [`Lod::Cone`], more blocks than a backend can number.
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

    /// [`Prisms::map_edited`], of [`Self::bounds`].
    pub fn map_edited(&self, rect: TexelRect) -> BoundsChange {
        let Growth { change, widened } = self.prisms.grow(rect);
        if self.time_steps() == 1 {
            return change;
        }
        // These boxes are made of a triangle's whole range.
        let primitives = widened
            .into_iter()
            .flat_map(|t| self.prisms.primitives_of(t));
        let mut primitives: Vec<u32> = primitives.collect();
        primitives.sort_unstable();
        BoundsChange {
            primitives,
            ..change
        }
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
        let (triangle, texels) = self.prisms.part(primitive);
        let range = self.prisms.displacements(triangle);
        let of = |texels| self.moving.block_bounds(triangle, texels, range, step);
        // A block may touch its triangle by a hair less than nothing.
        let bounds = of(&texels).or_else(|| of(&TexelBox::EVERYWHERE));
        bounds.unwrap_or(Aabb::EMPTY).padded(super::BOUNDS_ULPS)
    }

    /// The first intersection of `ray`, at its time, with what one traced primitive holds of the surface, with t in (tnear, tfar).
    /// The ray must be [valid](Ray::is_valid).
    pub fn intersect(&self, primitive: u32, ray: &Ray) -> Option<PrismHit> {
        if self.time_steps() == 1 {
            return self.prisms.intersect(primitive, ray);
        }
        let corners = self.corners(primitive, ray);
        let asked = self.prisms.asked(primitive, Some(&corners));
        let hit = self.prisms.kernel.intersect(&asked, ray)?;
        // A triangle may have no area for a moment.
        hit.ng.is_finite().then_some(hit)
    }

    /// Whether there is any.
    pub fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        if self.time_steps() == 1 {
            return self.prisms.occluded(primitive, ray);
        }
        let corners = self.corners(primitive, ray);
        let asked = self.prisms.asked(primitive, Some(&corners));
        self.prisms.kernel.occluded(&asked, ray)
    }

    /// [`Prisms::closest`] at the query's time.
    pub fn closest(&self, primitive: u32, query: &PointQuery) -> Option<ClosestPoint> {
        self.moving.closest_in([self.prisms.part(primitive)], query)
    }

    /// Where the corners of a primitive's triangle are at a ray's time.
    fn corners(&self, primitive: u32, ray: &Ray) -> Corners {
        self.moving.corners(self.prisms.part(primitive).0, ray.time)
    }
}
