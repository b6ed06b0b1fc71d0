//! Plain triangles: undisplaced meshes in the same scene.

use std::sync::Arc;

use super::geometry::{Kind, count};
use super::{Device, EmbreeError, Geometry, sys};
use crate::surface::BaseMesh;

/// A triangle mesh, traced by Embree itself.
pub struct TriangleGeometry(Geometry);

impl From<TriangleGeometry> for Geometry {
    fn from(triangles: TriangleGeometry) -> Self {
        triangles.0
    }
}

/// What Embree reads: the mesh's indices as they are, its positions with the padding that 16-byte loads want.
struct Buffers {
    positions: Vec<[f32; 3]>,
    mesh: Arc<BaseMesh>,
}

impl TriangleGeometry {
    /// The triangles of `mesh`: its indices are shared, its positions copied.
    pub fn new(device: &Device, mesh: Arc<BaseMesh>) -> Result<Self, EmbreeError> {
        let vertices = count("vertices", mesh.positions().len())?;
        let triangles = count("triangles", mesh.triangles().len())?;
        let mut positions: Vec<[f32; 3]> = Vec::with_capacity(mesh.positions().len() + 1);
        positions.extend(mesh.positions().iter().map(|p| p.to_array()));
        positions.push([0.0; 3]);
        let buffers = Arc::new(Buffers { positions, mesh });
        // SAFETY: both arrays are as long as said (one vertex of padding besides) and kept with the geometry;
        // neither is ever written again.
        let geometry = unsafe {
            Geometry::from_raw(device, Kind::Triangles, buffers.clone(), || {
                sys::pm_geometry_new_triangles(
                    device.raw(),
                    buffers.positions.as_ptr().cast(),
                    vertices,
                    buffers.mesh.triangles().as_ptr().cast(),
                    triangles,
                )
            })
        };
        geometry.map(Self)
    }
}
