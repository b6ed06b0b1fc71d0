//! The displaced surface S(b): a base mesh, a map, and what the map's heights mean.

use std::sync::{Arc, OnceLock};

use glam::{Affine2, DVec2, Vec2, Vec3};
use thiserror::Error;

use super::frames::{CornerFrames, Frames};
use super::{
    BaseMesh, Corners, DisplacementMap, Patch, Seams, ShadingNormals, UvTransform, Wall, seams,
};
use crate::ray::MAX_COORDINATE;

/// How a map's heights become displacement: D = scale * (h - midlevel).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// World units per unit of height; finite, not zero.
    pub scale: f32,
    /// The height that displaces by nothing; finite.
    pub midlevel: f32,
    /// Applied to the mesh's texture coordinates.
    pub uv: UvTransform,
}

impl Displacement {
    /// Heights times `scale`, from the base surface outward.
    pub fn new(scale: f32) -> Self {
        Self {
            scale,
            midlevel: 0.0,
            uv: UvTransform::default(),
        }
    }

    /// D of a height; infinite where no f32 holds it.
    pub(crate) fn of(&self, height: f32) -> f32 {
        (f64::from(self.scale) * (f64::from(height) - f64::from(self.midlevel))) as f32
    }
}

/// Why a surface was refused.
#[derive(Debug, Error, PartialEq)]
pub enum SurfaceError {
    /// The mesh has no texture coordinates.
    #[error(
        "the mesh has no texture coordinates, so the map cannot be laid on it; \
         unwrap it in a modelling program and export it with UVs, or have some made: \
         texcoords = \"box\", \"spherical\", \"cylindrical\" or \"planar\" in the scene's [[mesh]], \
         --texcoords on the command line"
    )]
    MissingTexcoords,
    /// NaN, infinite or zero where a number is needed.
    #[error("{what} is {value}; expected {expected}")]
    BadParameter {
        /// Which parameter.
        what: &'static str,
        /// What was found.
        value: f32,
        /// What is expected.
        expected: &'static str,
    },
    /// A height that displaces by more than [`MAX_COORDINATE`].
    #[error(
        "texel ({x}, {y}) of the map (from the bottom left) is {height:?}, which the scale {scale:?} and the midlevel {midlevel:?} make a \
         displacement of {displacement:?}; expected one within +-{MAX_COORDINATE:e}"
    )]
    TooHigh {
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
        /// What is there.
        height: f32,
        /// Of the surface.
        scale: f32,
        /// Of the surface.
        midlevel: f32,
        /// What comes out, world units.
        displacement: f32,
    },
    /// More texels under a triangle than [`DisplacedSurface::MAX_TEXELS`].
    #[error(
        "triangle {triangle} (from 0) is spread over {texels:.2e} texels of the map by its texture coordinates and their transform; \
         expected at most {max} from corner to corner",
        max = DisplacedSurface::MAX_TEXELS
    )]
    TooFine {
        /// The triangle, from 0.
        triangle: usize,
        /// Texels from corner to corner.
        texels: f64,
    },
}

/// A base mesh displaced by a map.
#[derive(Clone, Debug)]
pub struct DisplacedSurface {
    pub(super) mesh: Arc<BaseMesh>,
    pub(super) map: Arc<DisplacementMap>,
    displacement: Displacement,
    seams: Seams,
    /// By triangle and side; none where seams are open.
    pub(super) walls: Arc<[Wall]>,
    /// The UV transform, its sine and cosine taken once.
    uv: Affine2,
    shading: ShadingNormals,
    /// Made when the first smooth normal is asked for.
    frames: OnceLock<Arc<Frames>>,
}

/// All a shader wants to know of a hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// S(b), or P(b) for an undisplaced mesh.
    pub position: Vec3,
    /// P(b).
    pub base_position: Vec3,
    /// Unit interpolated normal of the base mesh.
    pub base_normal: Vec3,
    /// Unit geometric normal of S (its true tangent plane), on the base mesh's outer side.
    pub geometric_normal: Vec3,
    /// Unit normal to shade by: which one is the surface's [`ShadingNormals`].
    pub shading_normal: Vec3,
    /// Texture coordinates of the mesh, before any UV transform.
    pub texcoord: Vec2,
    /// D, world units along the unit interpolated normal.
    pub displacement: f32,
    /// Rays that leave the point start as much further off the surface: half the width of the footprint that it was seen with; 0 but
    /// where there is level of detail. Else texels smaller than the footprint would shade one another, which is noise where normals
    /// are means.
    pub tolerance: f32,
}

impl DisplacedSurface {
    /// Checks that the parts fit together.
    pub fn new(
        mesh: Arc<BaseMesh>,
        map: Arc<DisplacementMap>,
        displacement: Displacement,
    ) -> Result<Self, SurfaceError> {
        if mesh.texcoords().is_empty() {
            return Err(SurfaceError::MissingTexcoords);
        }
        let finite = |what, value: f32| {
            let expected = "a finite number";
            if value.is_finite() {
                Ok(())
            } else {
                Err(SurfaceError::BadParameter {
                    what,
                    value,
                    expected,
                })
            }
        };
        let Displacement {
            scale,
            midlevel,
            uv,
        } = displacement;
        finite("displacement scale", scale)?;
        if scale == 0.0 {
            let expected = "a number other than 0 (leave the displacement out instead)";
            return Err(SurfaceError::BadParameter {
                what: "displacement scale",
                value: scale,
                expected,
            });
        }
        finite("displacement midlevel", midlevel)?;
        for value in [
            uv.scale.x,
            uv.scale.y,
            uv.offset.x,
            uv.offset.y,
            uv.rotation,
        ] {
            finite("displacement uv transform", value)?;
        }
        check_heights(&map, &displacement)?;
        let surface = Self {
            mesh,
            map,
            displacement,
            seams: Seams::Open,
            walls: Arc::new([]),
            uv: uv.to_affine(),
            shading: ShadingNormals::default(),
            frames: OnceLock::new(),
        };
        surface.check_texels()?;
        Ok(surface)
    }

    /// Texels across or up from corner to corner of a triangle, at most: the exact march does not go along more of them.
    pub const MAX_TEXELS: f64 = (1u32 << 25) as f64;

    fn check_texels(&self) -> Result<(), SurfaceError> {
        let (width, height) = self.map.size();
        let size = DVec2::new(width as f64, height as f64);
        for triangle in 0..self.mesh.triangles().len() {
            let [a, b, c] = self
                .corner_texcoords(triangle as u32)
                .map(|st| st.as_dvec2() * size);
            let across = (b - a).abs().max((c - a).abs()).max_element();
            // NaN, as infinite coordinates make it, is no number of texels.
            if !(across <= Self::MAX_TEXELS && a.is_finite()) {
                return Err(SurfaceError::TooFine {
                    triangle,
                    texels: across,
                });
            }
        }
        Ok(())
    }

    /// The same surface with its seams open, as [`Self::new`] leaves them, or closed.
    ///
    /// Walls take 28 bytes each. The uniform march knows no walls: [`Prisms::new`](crate::prism::Prisms::new) refuses
    /// closed seams with it.
    pub fn with_seams(mut self, seams: Seams) -> Self {
        self.seams = seams;
        self.walls = match seams {
            Seams::Open => Arc::new([]),
            Seams::Closed => {
                let texcoords = |triangle| self.corner_texcoords(triangle);
                seams::walls(&self.mesh, texcoords, self.map.wrap()).into()
            }
        };
        self
    }

    /// The same surface with other normals to shade by; [`Self::new`] takes the smooth ones.
    pub fn with_shading_normals(mut self, shading: ShadingNormals) -> Self {
        self.shading = shading;
        self
    }

    /// The normals that it is shaded by.
    pub fn shading_normals(&self) -> ShadingNormals {
        self.shading
    }

    /// The frames that smooth normals are made in.
    pub(super) fn frames(&self) -> &Arc<Frames> {
        self.frames.get_or_init(|| Arc::new(Frames::new(self)))
    }

    /// Those of a triangle's corners; `None` where normals are not made in frames.
    pub(crate) fn corner_frames(&self, triangle: u32) -> Option<CornerFrames> {
        (self.shading == ShadingNormals::Smooth).then(|| self.frames().of(triangle))
    }

    /// The same over other vertices of the mesh, and with frames of those: open seams only, for walls depend on normals.
    pub(super) fn with_vertices(
        &self,
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        frames: Option<Frames>,
    ) -> Self {
        Self {
            mesh: Arc::new(self.mesh.with_vertices(positions, normals)),
            frames: frames.map_or_else(OnceLock::new, |frames| Arc::new(frames).into()),
            ..self.clone()
        }
    }

    /// What happens where sheets part.
    pub fn seams(&self) -> Seams {
        self.seams
    }

    /// The base mesh.
    pub fn mesh(&self) -> &Arc<BaseMesh> {
        &self.mesh
    }

    /// The heights.
    pub fn map(&self) -> &Arc<DisplacementMap> {
        &self.map
    }

    /// What heights mean.
    pub fn displacement(&self) -> &Displacement {
        &self.displacement
    }

    /// Smallest and largest D anywhere on the map, world units.
    pub fn range(&self) -> (f32, f32) {
        let (low, high) = self.map.range();
        let [low, high] = [low, high].map(|h| self.displacement.of(h));
        (low.min(high), low.max(high))
    }

    /// Where in the map the corners of a triangle are: its texture coordinates after the UV transform.
    pub fn corner_texcoords(&self, triangle: u32) -> [Vec2; 3] {
        self.mesh
            .corner_texcoords(triangle)
            .map(|st| self.uv.transform_point2(st))
    }

    /// The piece of the surface over one base triangle.
    pub fn patch(&self, triangle: u32) -> Patch<'_> {
        let (mesh, normals) = (&self.mesh, self.mesh.corner_normals(triangle));
        self.patch_over(triangle, (mesh.corners(triangle), normals))
    }

    /// The same where the triangle's corners are elsewhere.
    pub(crate) fn patch_over(&self, triangle: u32, (vertices, normals): Corners) -> Patch<'_> {
        let texcoords = self.corner_texcoords(triangle).map(|st| st.as_dvec2());
        let wrap = self.map.wrap();
        let periods = DVec2::new(
            wrap.whole_periods(texcoords[0].x),
            wrap.whole_periods(texcoords[0].y),
        );
        Patch {
            vertices: vertices.map(|v| v.as_dvec3()),
            normals: normals.map(|n| n.as_dvec3()),
            texels: texcoords.map(|st| self.map.to_texel(st - periods)),
            map: &self.map,
            scale: f64::from(self.displacement.scale),
            midlevel: f64::from(self.displacement.midlevel),
        }
    }
}

/// Fails at the first texel that displaces by too much.
fn check_heights(map: &DisplacementMap, displacement: &Displacement) -> Result<(), SurfaceError> {
    let is_too_high = |h: f32| displacement.of(h).abs() > MAX_COORDINATE;
    let (low, high) = map.range();
    if !is_too_high(low) && !is_too_high(high) {
        return Ok(());
    }
    let (width, height) = map.size();
    let mut row = vec![0.0; width];
    for y in 0..height {
        map.texels().copy(y * map.stride(), &mut row);
        let heights = row.iter().map(|&stored| stored / map.unit());
        if let Some((x, height)) = heights.enumerate().find(|&(_, h)| is_too_high(h)) {
            return Err(SurfaceError::TooHigh {
                x,
                y,
                height,
                scale: displacement.scale,
                midlevel: displacement.midlevel,
                displacement: displacement.of(height),
            });
        }
    }
    Ok(())
}
