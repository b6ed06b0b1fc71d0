//! Prisms that move: the base mesh has vertices at time steps ([`MovingSurface`]).
//!
//! For a ray at time t the prisms of a cluster are made over the corners as they stand then, and the exact march meets them as it meets
//! any: nothing of it knows of time. Making them takes about a microsecond per ray and cluster.
//!
//! **Bounds.** A backend that knows motion, as Embree, has a box per primitive and time step and takes the linear interpolation of both
//! boxes of a segment at the times between. That holds the surface: a coordinate of S is P_a + D N_a. P_a(t) lies between the
//! linear interpolations of the least and the largest v_a, since v_i(t) is linear. N(b, t) is the unit vector along a positive
//! combination of the six vertex normals at both ends of the segment, because n_i(t) is one of n_i's two; so D N_a lies in one interval
//! for all times of the segment ([`along_axis`]). Each step's box is that of the corners then, grown by the union of the intervals
//! of the segments it ends: the same interval, or a larger one, is added at both ends.

use std::sync::Arc;

use glam::Vec3;

use super::simd::LANES;
use super::{BoundsChange, Lod, March, MarchError, Parts, PrismHit, PrismOptions, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, MovingSurface, PointQuery, TexelRect};

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
        let bounds = self
            .lanes(primitive)
            .fold(Aabb::EMPTY, |bounds, (prim, range)| {
                bounds.union(self.prism_bounds(prim, range, step))
            });
        bounds.padded(super::BOUNDS_ULPS)
    }

    /// The base triangles of a primitive, and a range that holds D on each.
    fn lanes(&self, primitive: u32) -> impl Iterator<Item = (u32, [f32; 2])> {
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
                let [low, high] = patch.displacements_of(cluster.offsets(lane));
                (prim, [(low as f32).next_down(), (high as f32).next_up()])
            })
        })
    }

    fn prism_bounds(&self, prim: u32, range: [f32; 2], step: usize) -> Aabb {
        let last = self.time_steps() - 1;
        let segments = step.saturating_sub(1)..(step + 1).min(last);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for segment in segments {
            let normals = [segment, segment + 1].map(|step| self.moving.corners_of(step, prim).1);
            for axis in 0..3 {
                let [a, b] = along_axis(normals.as_flattened(), axis, range);
                low[axis] = low[axis].min(a);
                high[axis] = high[axis].max(b);
            }
        }
        let corners = self.moving.corners_of(step, prim).0;
        let around = corners.into_iter().fold(Aabb::EMPTY, Aabb::including);
        Aabb {
            min: around.min + low,
            max: around.max + high,
        }
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

/// Where D N_a may lie for a coordinate a, D in `range` and N a unit vector along any positive combination m = sum c_j n_j, sum c_j = 1, of
/// unit vectors. m_a lies between the least and the largest n_j,a; N_a = m_a/|m| has its sign, and 1/|m| is at most
/// (1 - spread/2)^(-1/2), for |m|^2 = 1 - sum_{j<k} c_j c_k |n_j - n_k|^2 and the sum of the c_j c_k is below 1/2.
fn along_axis(normals: &[Vec3], axis: usize, range: [f32; 2]) -> [f32; 2] {
    let mut spread: f32 = 0.0;
    for (k, a) in normals.iter().enumerate() {
        for b in &normals[k + 1..] {
            spread = spread.max(a.distance_squared(*b));
        }
    }
    let shortest = (1.0 - 0.5 * spread).max(0.0).sqrt();
    // Of rounding, the normals' own length and the spread's.
    const SLACK: f32 = 1e-5;
    let longer = |x: f32| {
        if shortest < 1e-2 {
            x.signum()
        } else {
            (x / shortest * (1.0 + SLACK)).clamp(-1.0, 1.0)
        }
    };
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for n in normals {
        (low, high) = (low.min(n[axis]), high.max(n[axis]));
    }
    let (low, high) = (low - SLACK, high + SLACK);
    let ends = [low.min(longer(low)), high.max(longer(high))];
    let products = [
        range[0] * ends[0],
        range[0] * ends[1],
        range[1] * ends[0],
        range[1] * ends[1],
    ];
    products
        .into_iter()
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], x| {
            [a.min(x), b.max(x)]
        })
}
