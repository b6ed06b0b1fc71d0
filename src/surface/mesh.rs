//! The base mesh: indexed triangles with unit normals and texture coordinates, proven sound once.

use glam::{Affine3A, DVec3, Vec2, Vec3};
use thiserror::Error;

use super::normals;
use crate::ray::{Aabb, MAX_COORDINATE};

/// Why a mesh was refused. The loader that met it adds the file's name and the place.
#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    /// No triangle at all, or none with an area.
    #[error("no triangles: the mesh has {faces} faces and none of them has an area")]
    NoTriangles {
        /// Faces in the file.
        faces: usize,
    },
    /// More than 32-bit vertex indices can serve when every corner stands alone.
    #[error("the mesh has {found} {what}; at most {max} are supported")]
    TooLarge {
        /// `vertices` or `triangles`.
        what: &'static str,
        /// How many were given.
        found: usize,
        /// Most that are supported.
        max: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "triangle {triangle} refers to vertex {index}, but the mesh has {vertices} vertices (counted from 0)"
    )]
    IndexOutOfRange {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// Vertices in the mesh.
        vertices: usize,
    },
    /// A NaN or infinite coordinate.
    #[error("the {what} of vertex {vertex} (from 0) holds {value}; coordinates must be finite")]
    NotFinite {
        /// `position`, `normal` or `texture coordinate`.
        what: &'static str,
        /// Index of the vertex, from 0.
        vertex: usize,
        /// The first such coordinate.
        value: f32,
    },
    /// A position beyond [`MAX_COORDINATE`].
    #[error(
        "the position of vertex {vertex} (from 0) holds {value:?}; expected coordinates within +-{MAX_COORDINATE:e}, also after the mesh's transform"
    )]
    TooFar {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// The first such coordinate.
        value: f32,
    },
    /// A per-vertex array that is neither empty nor as long as the positions.
    #[error("{found} {what} for {vertices} vertices; expected one per vertex, or none")]
    WrongLength {
        /// `normals` or `texture coordinates`.
        what: &'static str,
        /// Entries given.
        found: usize,
        /// Vertices in the mesh.
        vertices: usize,
    },
    /// A crease angle that is NaN, infinite or negative.
    #[error("the crease angle is {found} rad; expected a number from 0 to pi")]
    BadCreaseAngle {
        /// What was found.
        found: f32,
    },
}

/// Where the vertex normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum NormalMode {
    /// The file's normals; computed as `Smooth { crease_angle: pi }` where it has none.
    #[default]
    File,
    /// Angle-weighted averages of the faces around a vertex; an edge whose faces differ by more than
    /// the crease angle (radians) is kept sharp by splitting its vertices. The file's normals are ignored.
    Smooth {
        /// Radians, 0 (flat shading: only coplanar neighbours share a normal) .. pi (no edge is sharp).
        crease_angle: f32,
    },
}

/// What `MeshBuilder::build` had to mend, for one warning line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Zero-area faces that were dropped.
    pub degenerate_dropped: usize,
    /// Whether any normal was computed.
    pub normals_computed: bool,
}

/// Raw polygons as a file has them, before validation.
#[derive(Clone, Debug, Default)]
pub struct MeshBuilder {
    /// Vertex positions, world units.
    pub positions: Vec<Vec3>,
    /// Per vertex, or empty. Normalised by `build`; a zero stands for a missing normal.
    pub normals: Vec<Vec3>,
    /// Per vertex, or empty; v points up.
    pub texcoords: Vec<Vec2>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// What a transform does to normals: its inverse transpose, signed so that outside stays outside where it mirrors.
pub(crate) struct NormalTransform {
    cofactors: [DVec3; 3],
    mirrors: bool,
}

impl NormalTransform {
    pub fn new(transform: &Affine3A) -> Self {
        let matrix = &transform.matrix3;
        let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let [x, y, z] = axes.map(|axis| Vec3::from(axis).as_dvec3());
        let mirrors = x.cross(y).dot(z) < 0.0;
        // The cofactor matrix is det * inverse transpose, and exists where the inverse does not.
        let sign = if mirrors { -1.0 } else { 1.0 };
        Self {
            cofactors: [y.cross(z), z.cross(x), x.cross(y)].map(|c| sign * c),
            mirrors,
        }
    }

    /// Whether the winding of triangles turns round.
    pub fn mirrors(&self) -> bool {
        self.mirrors
    }

    /// The transformed normal, of unit length, or zero.
    pub fn apply(&self, normal: Vec3) -> Vec3 {
        let [x, y, z] = self.cofactors;
        normals::unit(x * f64::from(normal.x) + y * f64::from(normal.y) + z * f64::from(normal.z))
    }
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
    /// Validates, computes what is missing, drops zero-area faces and the vertices nobody uses.
    ///
    /// The order of the remaining triangles and of their corners stays. A face has no area when its
    /// height over its longest edge is below 2^-23 of that edge: single precision knows no normal for it.
    /// Vertices at the same position (bit for bit; [`join`](Self::join) makes it so where rounding did not) get the same computed
    /// normal, bit for bit, unless a crease parts them; so a seam of the texture coordinates neither creases nor cracks.
    ///
    /// In [`NormalMode::File`] a zero normal is replaced by the computed one. Normals that point against
    /// their face are kept: they are the artist's.
    ///
    /// # Errors
    ///
    /// What [`MeshError`] lists; nothing else is checked or mended.
    pub fn build(mut self, mode: NormalMode) -> Result<(BaseMesh, MeshReport), MeshError> {
        self.validate()?;
        let faces = self.triangles.len();
        let positions = &self.positions;
        self.triangles
            .retain(|t| has_area(t.map(|i| positions[i as usize])));
        if self.triangles.is_empty() {
            return Err(MeshError::NoTriangles { faces });
        }
        let mut report = MeshReport {
            degenerate_dropped: faces - self.triangles.len(),
            normals_computed: false,
        };
        self.drop_unused_vertices();
        report.normals_computed = self.finish_normals(mode)?;
        let mesh = BaseMesh {
            positions: self.positions,
            normals: self.normals,
            texcoords: self.texcoords,
            triangles: self.triangles,
        };
        Ok((mesh, report))
    }

    /// The mesh moved by `transform`: normals go by its inverse transpose, and a mirroring transform
    /// turns the winding round, so that outside stays outside.
    ///
    /// A singular transform flattens the mesh; `build` then drops or refuses what lost its area.
    pub fn transformed(mut self, transform: &Affine3A) -> Self {
        for p in &mut self.positions {
            *p = transform.transform_point3(*p);
        }
        let normals = NormalTransform::new(transform);
        for n in self.normals.iter_mut().filter(|n| n.is_finite()) {
            *n = normals.apply(*n);
        }
        if normals.mirrors() {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
        self
    }

    /// Appends the faces of `other` after its own.
    ///
    /// Where only one of them has normals, the other's are left to `build`; where only one has texture
    /// coordinates, the result has none.
    pub fn append(&mut self, other: Self) {
        // A mesh too large for 32 bits wraps here and is refused by `build`.
        let base = self.positions.len() as u32;
        if self.positions.is_empty() {
            *self = other;
            return;
        }
        if self.normals.is_empty() != other.normals.is_empty() {
            self.normals.resize(self.positions.len(), Vec3::ZERO);
        }
        if self.texcoords.is_empty() || other.texcoords.is_empty() {
            self.texcoords.clear();
        } else {
            self.texcoords.extend(other.texcoords);
        }
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), Vec3::ZERO);
        }
        let shifted = other
            .triangles
            .into_iter()
            .map(|t| t.map(|i| i.wrapping_add(base)));
        self.triangles.extend(shifted);
    }

    pub(super) fn validate(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        let sizes = [
            ("vertices", vertices, u32::MAX as usize),
            ("triangles", self.triangles.len(), u32::MAX as usize / 3),
        ];
        for (what, found, max) in sizes {
            if found > max {
                return Err(MeshError::TooLarge { what, found, max });
            }
        }
        let lengths = [
            ("normals", self.normals.len()),
            ("texture coordinates", self.texcoords.len()),
        ];
        for (what, found) in lengths {
            if found != 0 && found != vertices {
                return Err(MeshError::WrongLength {
                    what,
                    found,
                    vertices,
                });
            }
        }
        all_finite("position", self.positions.iter().map(|p| p.to_array()))?;
        all_finite("normal", self.normals.iter().map(|n| n.to_array()))?;
        all_finite(
            "texture coordinate",
            self.texcoords.iter().map(|st| st.to_array()),
        )?;
        for (vertex, position) in self.positions.iter().enumerate() {
            let beyond = |x: &f32| x.abs() > MAX_COORDINATE;
            if let Some(value) = position.to_array().into_iter().find(beyond) {
                return Err(MeshError::TooFar { vertex, value });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::IndexOutOfRange {
                    triangle,
                    index,
                    vertices,
                });
            }
        }
        Ok(())
    }

    /// Keeps the order of those that are used. Bounds and memory are then the surface's own.
    fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.positions.len()];
        for &i in self.triangles.as_flattened() {
            used[i as usize] = true;
        }
        if used.iter().all(|&u| u) {
            return;
        }
        let mut next = 0;
        let new_index: Vec<u32> = used
            .iter()
            .map(|&u| {
                next += u32::from(u);
                next.wrapping_sub(1)
            })
            .collect();
        for i in self.triangles.as_flattened_mut() {
            *i = new_index[*i as usize];
        }
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.texcoords, &used);
    }

    /// Makes every normal a unit vector; true if any had to be computed.
    fn finish_normals(&mut self, mode: NormalMode) -> Result<bool, MeshError> {
        let crease_angle = match mode {
            NormalMode::Smooth { crease_angle } => crease_angle,
            NormalMode::File => std::f32::consts::PI,
        };
        if !(crease_angle.is_finite() && crease_angle >= 0.0) {
            return Err(MeshError::BadCreaseAngle {
                found: crease_angle,
            });
        }
        let keep_file = mode == NormalMode::File && !self.normals.is_empty();
        if keep_file && self.normals.iter().all(|&n| n != Vec3::ZERO) {
            for n in &mut self.normals {
                *n = normals::unit(n.as_dvec3());
            }
            return Ok(false);
        }
        let smooth = normals::smooth(&self.positions, &self.triangles, crease_angle);
        self.split_vertices(&smooth.copies);
        let given = std::mem::replace(&mut self.normals, smooth.normals);
        if keep_file {
            // Copies of split vertices came last, each with the file's normal of its original.
            for (n, &file) in self.normals.iter_mut().zip(&given) {
                if file != Vec3::ZERO {
                    *n = normals::unit(file.as_dvec3());
                }
            }
        }
        self.triangles = smooth.triangles;
        Ok(true)
    }

    /// Appends a copy of each named vertex.
    fn split_vertices(&mut self, originals: &[u32]) {
        for &i in originals {
            self.positions.push(self.positions[i as usize]);
            if !self.texcoords.is_empty() {
                self.texcoords.push(self.texcoords[i as usize]);
            }
            if !self.normals.is_empty() {
                self.normals.push(self.normals[i as usize]);
            }
        }
    }
}

/// Whether single precision can tell the face's normal.
pub(crate) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    DVec3::cross(b - a, c - a).length() > f64::from(f32::EPSILON) * longest
}

fn all_finite<const N: usize>(
    what: &'static str,
    values: impl Iterator<Item = [f32; N]>,
) -> Result<(), MeshError> {
    for (vertex, coordinates) in values.enumerate() {
        if let Some(&value) = coordinates.iter().find(|x| !x.is_finite()) {
            return Err(MeshError::NotFinite {
                what,
                vertex,
                value,
            });
        }
    }
    Ok(())
}

fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
    let mut flags = used.iter();
    values.retain(|_| flags.next().is_some_and(|&u| u));
}

impl BaseMesh {
    /// The same triangles over other vertices, as many, finite, normals of unit length. A triangle may have no area then.
    pub(super) fn with_vertices(&self, positions: Vec<Vec3>, normals: Vec<Vec3>) -> Self {
        debug_assert!(positions.len() == self.positions.len() && normals.len() == positions.len());
        Self {
            positions,
            normals,
            ..self.clone()
        }
    }

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

    /// The first corner of one triangle.
    #[inline]
    pub fn first_corner(&self, triangle: u32) -> Vec3 {
        self.positions[self.triangles[triangle as usize][0] as usize]
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

#[cfg(test)]
mod tests;
