//! Subdivision surfaces: polygons refined by Catmull and Clark's or Loop's scheme, vertices and normals at the limit.
//!
//! ```text
//! cage (polygons) -> level 0 -> refined N times -> each vertex at its limit, with the limit surface's normals
//! ```
//!
//! The rules are OpenSubdiv's, as its options VTX_BOUNDARY_EDGE_AND_CORNER, CREASE_UNIFORM, TRI_SUB_CATMARK and FVAR_LINEAR_BOUNDARIES name them:
//! borders are creases, a vertex of one face stays where it is, sharpness shrinks by one a level, and texture coordinates are smooth inside of a chart and
//! linear along its border. In f64, in one order: the outcome does not depend on the machine.
//!
//! Faces are joined by position, bit for bit, not by vertex numbers, so copies of a vertex that carry other texture coordinates are one.

mod cage;
mod level;
mod limit;
mod refine;

use glam::{DVec2, Vec2, Vec3};
use thiserror::Error;

use crate::ray::MAX_COORDINATE;
use level::Level;

/// A subdivision scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// Catmull and Clark 1978, for polygons: each gives as many quads as it has corners, then every quad four.
    CatmullClark,
    /// Loop 1987, for triangles: each gives four.
    Loop,
}

impl Scheme {
    /// Corners of its refined faces.
    pub fn corners(self) -> usize {
        match self {
            Self::CatmullClark => 4,
            Self::Loop => 3,
        }
    }
}

/// Polygons to be subdivided.
#[derive(Clone, Debug, Default)]
pub struct Cage {
    /// Vertex positions; equal ones are one vertex of the surface.
    pub positions: Vec<Vec3>,
    /// Per vertex, or empty.
    pub texcoords: Vec<Vec2>,
    /// How many corners each face has, at least 3.
    pub sizes: Vec<u32>,
    /// The vertices of the faces, face after face, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// Edges by their two vertices, and how sharp they are: for how many refinements they stay so, 0 smooth, from 10 on for ever. Pairs without an
    /// edge count for nothing.
    pub creases: Vec<([u32; 2], f32)>,
    /// Vertices that stay where they are for so many refinements.
    pub sharp_vertices: Vec<(u32, f32)>,
}

/// A cage refined, at the limit.
#[derive(Clone, Debug, Default)]
pub struct Refined {
    /// Vertex positions. Copies of one vertex, where texture coordinates or normals part, are equal bit for bit.
    pub positions: Vec<Vec3>,
    /// Unit normals of the limit surface, one per vertex; 0 where it has none.
    pub normals: Vec<Vec3>,
    /// One per vertex, or empty.
    pub texcoords: Vec<Vec2>,
    /// The vertices of the faces, [`Scheme::corners`] each.
    pub corners: Vec<u32>,
    /// Of each face, the cage's that it is a part of.
    pub origins: Vec<u32>,
    /// Faces of the cage that were left out: after equal corners became one they had less than three.
    pub left_out: usize,
}

/// Why a cage was refused.
#[derive(Debug, Error, PartialEq)]
pub enum SubdivideError {
    /// More triangles than [`Cage::MAX_TRIANGLES`].
    #[error(
        "{levels} levels of subdivision make {found} triangles of {faces} faces; at most {max} are made"
    )]
    TooLarge {
        /// Levels asked for.
        levels: u32,
        /// What they would make; `u64::MAX` for that and more.
        found: u64,
        /// Faces of the cage.
        faces: usize,
        /// Most that are made.
        max: u64,
    },
    /// No refinement asked for, which has no limit that is told.
    #[error("0 levels of subdivision; expected at least 1")]
    NoLevels,
    /// No face with three corners.
    #[error("no faces to subdivide")]
    NoFaces,
    /// Faces and corners that do not fit.
    #[error("{found} corners for faces that have {expected}; expected at least 3 for each face")]
    WrongLength {
        /// Corners given.
        found: usize,
        /// Corners that the faces have.
        expected: u64,
    },
    /// Loop's scheme is asked for faces of more than three corners.
    #[error("face {face} (from 0) has {corners} corners; Loop's scheme takes triangles")]
    NotATriangle {
        /// Index of the face, from 0.
        face: usize,
        /// Its corners.
        corners: u32,
    },
    /// A corner, crease or sharp vertex that names a vertex that is not there.
    #[error("vertex {index} is named, but the mesh has {vertices} vertices (counted from 0)")]
    IndexOutOfRange {
        /// The vertex.
        index: u32,
        /// Vertices of the cage.
        vertices: usize,
    },
    /// A coordinate or sharpness that is no number, or a position too far away.
    #[error(
        "vertex {vertex} (from 0) has a {what} that is not finite or beyond +-{MAX_COORDINATE:e}"
    )]
    BadNumber {
        /// `position`, `texture coordinate` or `sharpness`.
        what: &'static str,
        /// Index of the vertex, from 0.
        vertex: usize,
    },
}

impl Cage {
    /// Most triangles that are made: 16.7 million.
    pub const MAX_TRIANGLES: u64 = 1 << 24;

    /// Whether all faces are triangles.
    pub fn is_triangles(&self) -> bool {
        self.sizes.iter().all(|&n| n == 3)
    }

    /// Refines the cage `levels` times and moves all vertices to the limit surface.
    ///
    /// Edges whose faces turn by more than `crease_angle` (radians; pi: none) are infinitely sharp. So are edges of one face, of more than two, and of two
    /// that wind against one another. Where edges are infinitely sharp there is a normal for each side. Vertices stand in the order of
    /// the cage's, then of its edges and faces; the faces of a face stand together for Catmull-Clark.
    ///
    /// # Errors
    ///
    /// [`SubdivideError`]. Faces that have no area are taken like others.
    pub fn subdivide(
        &self,
        scheme: Scheme,
        levels: u32,
        crease_angle: f32,
    ) -> Result<Refined, SubdivideError> {
        self.validate(scheme, levels)?;
        let mut surface = self.surface();
        if surface.origins.is_empty() {
            return Err(SubdivideError::NoFaces);
        }
        surface.crease(self, crease_angle);
        let mut shape = surface.shape;
        let mut chart = surface.chart.map(|texcoords| shape.chart(&texcoords));
        let mut origins = surface.origins;
        for _ in 0..levels {
            let parents: Vec<u32> = match scheme {
                Scheme::CatmullClark => shape.face_of_corners().collect(),
                Scheme::Loop => {
                    let faces = 0..shape.faces() as u32;
                    shape.face_of_corners().chain(faces).collect()
                }
            };
            origins = parents.iter().map(|&f| origins[f as usize]).collect();
            shape = shape.refined(scheme);
            chart = chart.map(|chart| chart.refined(scheme));
        }
        debug_assert!(shape.is_regular(scheme));
        let mut refined = at_limit(&shape, chart.as_ref(), scheme);
        refined.origins = origins;
        refined.left_out = surface.left_out;
        Ok(refined)
    }

    fn validate(&self, scheme: Scheme, levels: u32) -> Result<(), SubdivideError> {
        if levels == 0 {
            return Err(SubdivideError::NoLevels);
        }
        let expected: u64 = self.sizes.iter().map(|&n| u64::from(n)).sum();
        let found = self.corners.len();
        if expected != found as u64 || self.sizes.iter().any(|&n| n < 3) {
            return Err(SubdivideError::WrongLength { found, expected });
        }
        let large = |&n: &u32| scheme == Scheme::Loop && n != 3;
        if let Some(face) = self.sizes.iter().position(large) {
            return Err(SubdivideError::NotATriangle {
                face,
                corners: self.sizes[face],
            });
        }
        let first = match scheme {
            Scheme::CatmullClark => 2 * expected,
            Scheme::Loop => 4 * self.sizes.len() as u64,
        };
        let triangles = 4_u64
            .checked_pow(levels - 1)
            .and_then(|more| first.checked_mul(more));
        let triangles = triangles.unwrap_or(u64::MAX);
        if triangles > Self::MAX_TRIANGLES {
            return Err(SubdivideError::TooLarge {
                levels,
                found: triangles,
                faces: self.sizes.len(),
                max: Self::MAX_TRIANGLES,
            });
        }
        let vertices = self.positions.len();
        let named = self.creases.iter().flat_map(|c| c.0);
        let named = named.chain(self.sharp_vertices.iter().map(|v| v.0));
        let mut named = named.chain(self.corners.iter().copied());
        if let Some(index) = named.find(|&i| i as usize >= vertices) {
            return Err(SubdivideError::IndexOutOfRange { index, vertices });
        }
        let bad = |what, vertex| Err(SubdivideError::BadNumber { what, vertex });
        let is_far = |p: &Vec3| !(p.is_finite() && p.abs().max_element() <= MAX_COORDINATE);
        if let Some(vertex) = self.positions.iter().position(is_far) {
            return bad("position", vertex);
        }
        let has_texcoords = self.texcoords.len() == vertices || self.texcoords.is_empty();
        let odd = self.texcoords.iter().position(|st| !st.is_finite());
        if let (false, _) | (_, Some(_)) = (has_texcoords, odd) {
            return bad("texture coordinate", odd.unwrap_or(self.texcoords.len()));
        }
        let mut sharpness = self.creases.iter().map(|c| (c.0[0], c.1));
        let mut more = self.sharp_vertices.iter().copied();
        let is_nan = |v: &(u32, f32)| v.1.is_nan();
        match sharpness.find(is_nan).or_else(|| more.find(is_nan)) {
            Some((vertex, _)) => bad("sharpness", vertex as usize),
            None => Ok(()),
        }
    }
}

/// Vertices at the limit: one for each point, pair of texture coordinates and normal.
fn at_limit(shape: &Level, chart: Option<&Level>, scheme: Scheme) -> Refined {
    let texcoords: Option<Vec<DVec2>> = chart.map(|chart| {
        let at_vertices = chart.corners_at_vertices();
        let all = 0..chart.points.len();
        let limit = |v| chart.limit_point(at_vertices.of(v), scheme).truncate();
        all.map(limit).collect()
    });
    let mut refined = Refined {
        corners: vec![0; shape.corners.len()],
        ..Refined::default()
    };
    let at_vertices = shape.corners_at_vertices();
    // Of a vertex: sector, value and corner.
    let mut keys: Vec<(usize, u32, u32)> = Vec::new();
    for vertex in 0..shape.points.len() {
        let corners = at_vertices.of(vertex);
        let limit = shape.limit(corners, scheme);
        let value = |corner: u32| chart.map_or(0, |chart| chart.corners[corner as usize]);
        keys.clear();
        let sectors = corners.iter().zip(&limit.sectors);
        keys.extend(sectors.map(|(&corner, &sector)| (sector, value(corner), corner)));
        keys.sort_unstable();
        for same in keys.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (sector, value, _) = same[0];
            let number = refined.positions.len() as u32;
            refined.positions.push(limit.point.as_vec3());
            refined.normals.push(limit.normals[sector].as_vec3());
            let st = texcoords.as_ref().map(|st| st[value as usize].as_vec2());
            refined.texcoords.extend(st);
            for &(.., corner) in same {
                refined.corners[corner as usize] = number;
            }
        }
    }
    refined
}

#[cfg(test)]
mod tests;
