//! Plain triangles: undisplaced meshes in the same scene, and tessellations to compare with.

use std::sync::Arc;

use super::vertices::{Elements, check_indices};
use super::{Device, EmbreeError, Geometry};
use crate::surface::BaseMesh;

/// A triangle mesh, traced by Embree itself.
pub struct TriangleGeometry(Geometry);

impl From<TriangleGeometry> for Geometry {
    fn from(triangles: TriangleGeometry) -> Self {
        triangles.0
    }
}

impl TriangleGeometry {
    /// The triangles of `mesh`: its indices are shared, its positions copied.
    pub fn new(device: &Device, mesh: Arc<BaseMesh>) -> Result<Self, EmbreeError> {
        // Embree loads 16 bytes for each vertex, which a mesh has not got after its last.
        let positions = mesh.positions().iter().map(|p| p.to_array()).collect();
        // SAFETY: the indices of a mesh are in range.
        unsafe { Geometry::over_vertices(device, positions, Elements::Mesh(mesh)) }.map(Self)
    }

    /// Triangles as they are, counter-clockwise from outside. Nothing is copied.
    ///
    /// # Errors
    ///
    /// [`EmbreeError::BadElement`] for an index that is no vertex's.
    pub fn from_buffers(
        device: &Device,
        positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, EmbreeError> {
        let largest = triangles.iter().map(|&[a, b, c]| a.max(b).max(c).into());
        check_indices("triangle", largest, positions.len())?;
        // SAFETY: just checked.
        unsafe { Geometry::over_vertices(device, positions, Elements::Triangles(triangles)) }
            .map(Self)
    }
}
