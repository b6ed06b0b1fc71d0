//! The base mesh: indexed triangles with unit normals and texture coordinates, proven sound once.

use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::ray::Aabb;

/// Why a mesh was refused. The loader that met it adds the file's name and the place.
#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    // helper fills in: NoTriangles, IndexOutOfRange{triangle,index,vertices}, NotFinite{what,index}, MissingTexcoords ...
    /// No triangle at all, or none with an area.
    #[error("no triangles: the mesh has {faces} faces and none of them has an area")]
    NoTriangles {
        /// Faces in the file.
        faces: usize,
    },
}

/// Where the vertex normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum NormalMode {
    /// The file's normals; computed as `Smooth { crease_angle: pi }` where it has none.
    #[default]
    File,
    /// Angle-weighted averages of the faces around a vertex; an edge whose faces differ by more than
    /// the crease angle (radians) is kept sharp by splitting its vertices.
    Smooth {
        /// Radians, 0 .. pi.
        crease_angle: f32,
    },
}

/// What `MeshBuilder::build` had to mend, for one warning line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Zero-area faces that were dropped.
    pub degenerate_dropped: usize,
    /// Whether normals were computed.
    pub normals_computed: bool,
}

/// Raw polygons as a file has them, before validation.
#[derive(Clone, Debug, Default)]
pub struct MeshBuilder {
    /// Vertex positions, world units.
    pub positions: Vec<Vec3>,
    /// Per vertex, or empty. Normalised by `build`.
    pub normals: Vec<Vec3>,
    /// Per vertex, or empty; v points up.
    pub texcoords: Vec<Vec2>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A validated triangle mesh: every index in range, every number finite, every normal of unit length,
/// every face with an area.
#[derive(Clone, Debug)]
pub struct BaseMesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    texcoords: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl MeshBuilder {
    /// Validates, computes what is missing, drops zero-area faces.
    pub fn build(self, _normals: NormalMode) -> Result<(BaseMesh, MeshReport), MeshError> {
        todo!()
    }
}

impl BaseMesh {
    /// Vertex positions.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Unit normals, one per vertex.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Texture coordinates, one per vertex, or empty for a mesh without (it cannot be displaced).
    pub fn texcoords(&self) -> &[Vec2] {
        &self.texcoords
    }

    /// Vertex indices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of one triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// The unit vertex normals of one triangle.
    pub fn corner_normals(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.normals[i as usize])
    }

    /// The texture coordinates of one triangle; zeros for a mesh without.
    pub fn corner_texcoords(&self, triangle: u32) -> [Vec2; 3] {
        if self.texcoords.is_empty() {
            return [Vec2::ZERO; 3];
        }
        self.triangles[triangle as usize].map(|i| self.texcoords[i as usize])
    }

    /// The box over all positions.
    pub fn bounds(&self) -> Aabb {
        self.positions
            .iter()
            .fold(Aabb::EMPTY, |b, &p| b.including(p))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.texcoords[..])
            + size_of_val(&self.triangles[..])
    }
}
