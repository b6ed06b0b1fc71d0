//! A displaced surface whose base mesh moves: vertices at time steps over [0, 1], linear between them.
//!
//! At time t between two steps v_i(t) is linear and n_i(t) the unit vector along the linear interpolation, so that at every time
//!
//! ```text
//! S(b, t) = P(b, t) + D N'(b, t)/|N'(b, t)|,   P = sum b_i v_i(t),   N' = sum b_i n_i(t)
//! ```
//!
//! is a displaced surface like any other: the one over the mesh as it stands then. D does not depend on the time.

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use thiserror::Error;

use super::frames::{CornerFrames, Frames};
use super::mesh::has_area;
use super::{
    ClosestPoint, DisplacedSurface, InterpolateError, Interpolated, Patch, PointQuery, Seams,
    ShadingNormals, TexelBox, normals,
};
use crate::ray::{MAX_COORDINATE, time_within};

/// The base mesh's vertices at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimeStep {
    /// One per vertex of the mesh, in its order; world units.
    pub positions: Vec<Vec3>,
    /// One per vertex, of any length but 0; or none, to have smooth ones computed.
    pub normals: Vec<Vec3>,
}

/// Why a motion was refused. Steps are counted from 0, which is the surface's own mesh.
#[derive(Debug, Error, PartialEq)]
pub enum MotionError {
    /// More than [`MovingSurface::MAX_TIME_STEPS`].
    #[error("{found} time steps; at most {max} are supported")]
    TooManySteps {
        /// How many were given, the mesh's own included.
        found: usize,
        /// Most that are supported.
        max: usize,
    },
    /// A step of another mesh.
    #[error("time step {step} has {found} {what} for {vertices} vertices; expected one per vertex")]
    WrongLength {
        /// Which step.
        step: usize,
        /// `positions` or `normals`.
        what: &'static str,
        /// Entries given.
        found: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A NaN or infinite coordinate, a position beyond [`MAX_COORDINATE`], or a normal of no length.
    #[error(
        "time step {step}: the {what} of vertex {vertex} is {value}; expected finite numbers, positions within +-{MAX_COORDINATE:e}, and normals not 0"
    )]
    BadVector {
        /// Which step.
        step: usize,
        /// `position` or `normal`.
        what: &'static str,
        /// Index of the vertex, from 0.
        vertex: usize,
        /// What was found.
        value: Vec3,
    },
    /// A triangle that is a line or a point at a step.
    #[error("time step {step}: triangle {triangle} has no area")]
    NoArea {
        /// Which step.
        step: usize,
        /// Index of the triangle, from 0.
        triangle: usize,
    },
    /// Faces around a vertex that point in opposite directions have no smooth normal there.
    #[error(
        "time step {step}: no normals are given, and faces that share a vertex cancel each other out; give normals"
    )]
    NoSmoothNormals {
        /// Which step.
        step: usize,
    },
    /// Walls stand where normals differ, which changes with the time.
    #[error(
        "the surface's seams are closed; a surface that moves must leave them open (seams = \"open\")"
    )]
    ClosedSeams,
}

/// A displaced surface whose base mesh moves over the times [0, 1].
#[derive(Clone, Debug)]
pub struct MovingSurface {
    /// At time 0.
    surface: Arc<DisplacedSurface>,
    /// The other steps, normals of unit length.
    later: Vec<TimeStep>,
    /// Frames of the other steps, made when the first smooth normal is asked for.
    later_frames: OnceLock<Vec<Frames>>,
}

/// Corners and unit vertex normals of a triangle.
pub(crate) type Corners = ([Vec3; 3], [Vec3; 3]);

impl MovingSurface {
    /// Embree's limit.
    pub const MAX_TIME_STEPS: usize = 129;

    /// The mesh of `surface` is the first step, at time 0; `later` has the others, evenly spaced, the last at time 1. None makes a surface
    /// that stands still.
    ///
    /// # Errors
    ///
    /// Steps that do not fit the mesh or hold what is no position or normal, triangles without area, closed seams.
    pub fn new(
        surface: Arc<DisplacedSurface>,
        mut later: Vec<TimeStep>,
    ) -> Result<Self, MotionError> {
        if later.len() >= Self::MAX_TIME_STEPS {
            return Err(MotionError::TooManySteps {
                found: later.len() + 1,
                max: Self::MAX_TIME_STEPS,
            });
        }
        if surface.seams() == Seams::Closed {
            return Err(MotionError::ClosedSeams);
        }
        for (k, step) in later.iter_mut().enumerate() {
            step.finish(k + 1, &surface)?;
        }
        Ok(Self {
            surface,
            later,
            later_frames: OnceLock::new(),
        })
    }

    /// The surface at time 0.
    pub fn surface(&self) -> &Arc<DisplacedSurface> {
        &self.surface
    }

    /// Time steps, at least 1.
    pub fn time_steps(&self) -> usize {
        1 + self.later.len()
    }

    /// Positions and normals of all vertices at a step.
    fn vertices(&self, step: usize) -> (&[Vec3], &[Vec3]) {
        match step.checked_sub(1) {
            None => (
                self.surface.mesh().positions(),
                self.surface.mesh().normals(),
            ),
            Some(k) => (&self.later[k].positions, &self.later[k].normals),
        }
    }

    /// The same at the steps before and after a time.
    fn vertices_around(&self, time: f32) -> [(&[Vec3], &[Vec3]); 2] {
        let step = self.segment(time).0;
        [step, (step + 1).min(self.later.len())].map(|step| self.vertices(step))
    }

    /// Positions and unit normals of a triangle's corners at a step.
    pub(crate) fn corners_of(&self, step: usize, triangle: u32) -> Corners {
        let (positions, normals) = self.vertices(step);
        let corners = self.surface.mesh().triangles()[triangle as usize];
        (
            corners.map(|i| positions[i as usize]),
            corners.map(|i| normals[i as usize]),
        )
    }

    /// The positions of a triangle's corners at a time; times outside [0, 1] count as the nearer end, NaN as 0.
    #[inline]
    pub(crate) fn positions(&self, triangle: u32, time: f32) -> [Vec3; 3] {
        let [(from, _), (to, _)] = self.vertices_around(time);
        let part = self.segment(time).1;
        let corners = self.surface.mesh().triangles()[triangle as usize];
        corners.map(|i| position_between(from[i as usize], to[i as usize], part))
    }

    /// The same with unit normals.
    pub(crate) fn corners(&self, triangle: u32, time: f32) -> Corners {
        let [(_, from), (_, to)] = self.vertices_around(time);
        let part = self.segment(time).1;
        let corners = self.surface.mesh().triangles()[triangle as usize];
        let normals = corners.map(|i| normal_between(from[i as usize], to[i as usize], part));
        (self.positions(triangle, time), normals)
    }

    /// The last step not after a time, and which part of the way to the next one is gone: 0 at a step.
    fn segment(&self, time: f32) -> (usize, f64) {
        let at = f64::from(time_within(time)) * self.later.len() as f64;
        (at as usize, at.fract())
    }

    /// The frames at the steps before and after a time; `None` where normals are not made in frames.
    fn frames_around(&self, time: f32) -> Option<[&Frames; 2]> {
        if self.surface.shading_normals() != ShadingNormals::Smooth {
            return None;
        }
        let first = self.surface.frames();
        let later = self.later_frames.get_or_init(|| {
            let over = |s: &TimeStep| first.over(&self.surface, &s.positions, &s.normals);
            self.later.iter().map(over).collect()
        });
        let at = |step: usize| step.checked_sub(1).map_or(&**first, |k| &later[k]);
        let step = self.segment(time).0;
        Some([at(step), at((step + 1).min(self.later.len()))])
    }

    /// Those of a triangle's corners.
    fn corner_frames(&self, triangle: u32, time: f32) -> Option<CornerFrames> {
        let [from, to] = self.frames_around(time)?;
        Some(from.of_between(to, self.segment(time).1, triangle))
    }

    /// The piece of the surface over one base triangle at a time.
    pub fn patch(&self, triangle: u32, time: f32) -> Patch<'_> {
        self.surface
            .patch_over(triangle, self.corners(triangle, time))
    }

    /// The surface as it stands at a time: what moving prisms show then. A copy of all vertices.
    pub fn at(&self, time: f32) -> DisplacedSurface {
        let [(v, n), (v1, n1)] = self.vertices_around(time);
        let part = self.segment(time).1;
        let positions = v.iter().zip(v1);
        let normals = n.iter().zip(n1);
        self.surface.with_vertices(
            positions
                .map(|(&a, &b)| position_between(a, b, part))
                .collect(),
            normals.map(|(&a, &b)| normal_between(a, b, part)).collect(),
            self.frames_around(time).map(|[a, b]| a.lerp(b, part)),
        )
    }

    /// [`DisplacedSurface::interpolate`] at a time.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn interpolate(
        &self,
        prim: u32,
        u: f32,
        v: f32,
        time: f32,
    ) -> Result<Interpolated, InterpolateError> {
        self.surface.checked(0, prim, u, v, || {
            let frames = self.corner_frames(prim, time);
            self.surface
                .on_triangle(&self.patch(prim, time), frames.as_ref(), prim, u, v)
        })
    }

    /// [`DisplacedSurface::closest`] at the query's time.
    pub fn closest(
        &self,
        prims: impl IntoIterator<Item = u32>,
        query: &PointQuery,
    ) -> Option<ClosestPoint> {
        let prims = prims.into_iter();
        self.closest_in(prims.map(|prim| (prim, TexelBox::EVERYWHERE)), query)
    }

    /// [`DisplacedSurface::closest_in`] at the query's time.
    pub(crate) fn closest_in(
        &self,
        blocks: impl IntoIterator<Item = (u32, TexelBox)>,
        query: &PointQuery,
    ) -> Option<ClosestPoint> {
        super::closest::closest(blocks, |prim| self.patch(prim, query.time), query)
    }
}

/// Between two positions that are `part` 0 and 1; at 0 the first to the bit.
fn position_between(a: Vec3, b: Vec3, part: f64) -> Vec3 {
    a.as_dvec3().lerp(b.as_dvec3(), part).as_vec3()
}

/// The same for unit normals; the first where they cancel.
fn normal_between(a: Vec3, b: Vec3, part: f64) -> Vec3 {
    if part == 0.0 {
        return a;
    }
    let between = a.as_dvec3().lerp(b.as_dvec3(), part);
    between.normalize_or(a.as_dvec3()).as_vec3()
}

impl TimeStep {
    /// Checks that it is one of the surface's mesh, and makes its normals unit vectors.
    fn finish(&mut self, step: usize, surface: &DisplacedSurface) -> Result<(), MotionError> {
        let mesh = surface.mesh();
        let vertices = mesh.positions().len();
        let lengths = [
            ("positions", self.positions.len()),
            ("normals", self.normals.len()),
        ];
        for (what, found) in lengths {
            let computed = what == "normals" && found == 0;
            if found != vertices && !computed {
                return Err(MotionError::WrongLength {
                    step,
                    what,
                    found,
                    vertices,
                });
            }
        }
        let bad = |what, (vertex, &value): (usize, &Vec3)| MotionError::BadVector {
            step,
            what,
            vertex,
            value,
        };
        let mut positions = self.positions.iter().enumerate();
        if let Some(found) =
            positions.find(|(_, p)| !(p.abs().max_element() <= MAX_COORDINATE && p.is_finite()))
        {
            return Err(bad("position", found));
        }
        let corners = |t: &[u32; 3]| t.map(|i| self.positions[i as usize]);
        let mut triangles = mesh.triangles().iter();
        if let Some(triangle) = triangles.position(|t| !has_area(corners(t))) {
            return Err(MotionError::NoArea { step, triangle });
        }
        if self.normals.is_empty() {
            let smooth = normals::smooth(&self.positions, mesh.triangles(), std::f32::consts::PI);
            if !smooth.copies.is_empty() {
                return Err(MotionError::NoSmoothNormals { step });
            }
            self.normals = smooth.normals;
        }
        let mut given = self.normals.iter().enumerate();
        if let Some(found) = given.find(|(_, n)| !n.is_finite() || **n == Vec3::ZERO) {
            return Err(bad("normal", found));
        }
        for n in &mut self.normals {
            *n = normals::unit(n.as_dvec3());
        }
        Ok(())
    }
}
