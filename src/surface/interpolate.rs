//! The displaced surface at given barycentric coordinates: points, normals, derivatives.

use glam::Vec3;
use thiserror::Error;

use super::frames::CornerFrames;
use super::{DisplacedSurface, HeightSample, Patch, ShadingNormals, SurfacePoint, smooth_normal};

/// A point of the displaced surface with its derivatives.
///
/// On a wall of closed [`Seams`](super::Seams) u and v are those of a [`PrismHit`](crate::prism::PrismHit) there: along the edge, and from
/// the other height to the triangle's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interpolated {
    /// Position, base position, normals, texture coordinates, displacement.
    pub point: SurfacePoint,
    /// dS/du, world units. On a line between texels, where S has a crease, that of one side: of the cell that follows the line in the
    /// stored map.
    pub du: Vec3,
    /// dS/dv, world units, as `du`. du x dv runs along the geometric normal, on a wall along it or against it.
    pub dv: Vec3,
}

/// Why a point of the surface cannot be given.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum InterpolateError {
    /// No such triangle or wall.
    #[error("entry {entry}: primitive {prim} is not there; the surface has {primitives}")]
    BadPrimitive {
        /// Which of the points that were asked for, from 0.
        entry: usize,
        /// The primitive that was asked for.
        prim: u32,
        /// Base triangles and walls of the surface.
        primitives: usize,
    },
    /// NaN or infinite barycentric coordinates.
    #[error("entry {entry}: (u, v) is ({u}, {v}); expected finite numbers")]
    BadCoordinates {
        /// Which of the points that were asked for, from 0.
        entry: usize,
        /// Barycentric coordinate of vertex 1.
        u: f32,
        /// Barycentric coordinate of vertex 2.
        v: f32,
    },
    /// The vertex normals cancel, or the numbers leave the range of single precision.
    #[error("entry {entry}: the surface has no point at (u, v) = ({u}, {v}) of primitive {prim}")]
    NoPoint {
        /// Which of the points that were asked for, from 0.
        entry: usize,
        /// The primitive.
        prim: u32,
        /// Barycentric coordinate of vertex 1.
        u: f32,
        /// Barycentric coordinate of vertex 2.
        v: f32,
    },
    /// Arrays of different lengths.
    #[error("{what} has {found} entries; expected {expected}, as many as there are primitives")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its entries.
        found: usize,
        /// Primitives asked for.
        expected: usize,
    },
}

impl DisplacedSurface {
    /// Base triangles and walls: what a hit's primitive is below.
    pub fn primitives(&self) -> usize {
        self.mesh.triangles().len() + self.walls.len()
    }

    /// All a shader wants to know of the point (u, v) over base triangle `prim`; or on a wall, for the number of base triangles plus the
    /// index into [`Self::walls`].
    ///
    /// # Panics
    ///
    /// If `prim` is not below [`Self::primitives`].
    pub fn point(&self, prim: u32, u: f32, v: f32) -> SurfacePoint {
        self.with_derivatives(prim, u, v).point
    }

    /// The displaced surface at barycentric coordinates (u, v) of `prim`, in f64 inside: what `rtcInterpolate` gives of a mesh. `prim` is
    /// what hits report. Coordinates outside the triangle extrapolate.
    ///
    /// # Errors
    ///
    /// A primitive that is not there, NaN or infinite coordinates, a point where the vertex normals cancel.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use glam::{Vec2, Vec3};
    /// use prismarch::surface::*;
    ///
    /// // A slope of 1/2 along x, displaced along z.
    /// let mesh = MeshBuilder {
    ///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
    ///     normals: vec![Vec3::Z; 3],
    ///     texcoords: vec![Vec2::new(0.25, 0.5), Vec2::new(0.75, 0.5), Vec2::new(0.25, 1.0)],
    ///     triangles: vec![[0, 1, 2]],
    /// };
    /// let (mesh, _) = mesh.build(NormalMode::File)?;
    /// let map = DisplacementMap::new(2, 1, Texels::F32(vec![0.0, 0.5]), Wrap::Clamp)?;
    /// let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(1.0))?;
    ///
    /// let at = surface.interpolate(0, 0.5, 0.25)?;
    /// assert_eq!(at.point.position, Vec3::new(0.5, 0.25, 0.25));
    /// assert_eq!((at.du, at.dv), (Vec3::new(1.0, 0.0, 0.5), Vec3::Y));
    /// assert!(surface.interpolate(1, 0.5, 0.25).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn interpolate(&self, prim: u32, u: f32, v: f32) -> Result<Interpolated, InterpolateError> {
        self.checked(0, prim, u, v, || self.with_derivatives(prim, u, v))
    }

    /// [`Self::interpolate`] for many points at once, as `rtcInterpolateN`: entry i of `out` is the surface at `prims[i]`, `u[i]`, `v[i]`.
    /// Where `valid` is given, an entry that is false may hold anything and its place in `out` is left alone.
    ///
    /// # Errors
    ///
    /// Arrays of different lengths, before anything is written; else as [`Self::interpolate`], of the first valid entry that cannot be
    /// given: those before it are written.
    pub fn interpolate_n(
        &self,
        valid: Option<&[bool]>,
        prims: &[u32],
        u: &[f32],
        v: &[f32],
        out: &mut [Interpolated],
    ) -> Result<(), InterpolateError> {
        let expected = prims.len();
        let lengths = [
            ("valid", valid.map_or(expected, <[bool]>::len)),
            ("u", u.len()),
            ("v", v.len()),
            ("out", out.len()),
        ];
        if let Some(&(what, found)) = lengths.iter().find(|(_, found)| *found != expected) {
            return Err(InterpolateError::WrongLength {
                what,
                found,
                expected,
            });
        }
        for (entry, out) in out.iter_mut().enumerate() {
            if valid.is_none_or(|valid| valid[entry]) {
                let (prim, u, v) = (prims[entry], u[entry], v[entry]);
                *out = self.checked(entry, prim, u, v, || self.with_derivatives(prim, u, v))?;
            }
        }
        Ok(())
    }

    /// What `point` gives, called only for what there is.
    pub(super) fn checked(
        &self,
        entry: usize,
        prim: u32,
        u: f32,
        v: f32,
        point: impl FnOnce() -> Interpolated,
    ) -> Result<Interpolated, InterpolateError> {
        let primitives = self.primitives();
        if prim as usize >= primitives {
            return Err(InterpolateError::BadPrimitive {
                entry,
                prim,
                primitives,
            });
        }
        if !(u.is_finite() && v.is_finite()) {
            return Err(InterpolateError::BadCoordinates { entry, u, v });
        }
        let found = point();
        let sound = found.point.position + found.du + found.dv;
        if sound.is_finite() {
            Ok(found)
        } else {
            Err(InterpolateError::NoPoint { entry, prim, u, v })
        }
    }

    fn with_derivatives(&self, prim: u32, u: f32, v: f32) -> Interpolated {
        match (prim as usize).checked_sub(self.mesh.triangles().len()) {
            Some(wall) => self.on_wall(wall, u, v),
            None => {
                let frames = self.corner_frames(prim);
                self.on_triangle(&self.patch(prim), frames.as_ref(), prim, u, v)
            }
        }
    }

    /// `patch` and `frames` are those of `prim`, at some time.
    pub(super) fn on_triangle(
        &self,
        patch: &Patch<'_>,
        frames: Option<&CornerFrames>,
        prim: u32,
        u: f32,
        v: f32,
    ) -> Interpolated {
        let [st0, st1, st2] = self.mesh.corner_texcoords(prim);
        let texcoord = st0 + u * (st1 - st0) + v * (st2 - st0);
        let (u, v) = (f64::from(u), f64::from(v));
        let own = self.map.sample(patch.texel(u, v));
        let at = patch.point_of(own, u, v);
        let geometric_normal = at.ng.normalize_or(patch.face_normal()).as_vec3();
        let width = match self.shading_normals() {
            ShadingNormals::Smooth => SMOOTH_WIDTH,
            _ => PAPER_WIDTH,
        };
        let smooth = || self.map().smooth(patch.texel(u, v), width);
        let shading_normal = match self.shading_normals() {
            ShadingNormals::Geometric => geometric_normal,
            _ => self.shading_normal(patch, frames, [smooth(), own], u, v),
        };
        Interpolated {
            point: SurfacePoint {
                position: at.position.as_vec3(),
                base_position: patch.base(u, v).as_vec3(),
                base_normal: unit_normal(patch, u, v),
                geometric_normal,
                shading_normal,
                texcoord,
                displacement: at.displacement as f32,
                tolerance: 0.0,
            },
            du: at.du.as_vec3(),
            dv: at.dv.as_vec3(),
        }
    }

    /// The smooth normal for a smoothed height and gradient of the map there, and its own: in `frames` where they hold, else the paper's.
    pub(crate) fn shading_normal(
        &self,
        patch: &Patch<'_>,
        frames: Option<&CornerFrames>,
        [sample, own]: [HeightSample; 2],
        u: f64,
        v: f64,
    ) -> Vec3 {
        let framed =
            frames.and_then(|f| smooth_normal::framed(patch, f, sample, own.gradient, u, v));
        framed
            .unwrap_or_else(|| smooth_normal::paper(patch, sample.gradient, u, v))
            .as_vec3()
    }
}

/// Texels over which the slopes of smooth normals are taken: the least without jumps.
const SMOOTH_WIDTH: f64 = 1.0;

/// The same for the paper's: central differences of texels.
const PAPER_WIDTH: f64 = 2.0;

/// N of the base mesh.
fn unit_normal(patch: &Patch<'_>, u: f64, v: f64) -> Vec3 {
    patch
        .normal(u, v)
        .normalize_or(patch.face_normal())
        .as_vec3()
}
