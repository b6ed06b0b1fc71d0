//! Vertices that Embree reads where they are, and what is made of them.

use std::sync::Arc;

use super::geometry::{Kind, count};
use super::{Device, EmbreeError, Geometry, sys};
use crate::surface::BaseMesh;

/// What a triangle or grid geometry keeps alive. Embree reads the vertices and elements in place.
pub(super) struct VertexBuffer {
    /// One more than there are: Embree loads 16 bytes for each.
    padded: Vec<[f32; 3]>,
    elements: Elements,
}

/// What is made of vertices; every index is in range.
pub(super) enum Elements {
    Mesh(Arc<BaseMesh>),
    Triangles(Vec<[u32; 3]>),
    Grids(Vec<sys::pm_grid>),
}

impl VertexBuffer {
    /// `positions` gets its padding; the caller has checked that `elements` fit it.
    fn new(mut positions: Vec<[f32; 3]>, elements: Elements) -> Self {
        positions.reserve_exact(1);
        positions.push([0.0; 3]);
        Self {
            padded: positions,
            elements,
        }
    }

    fn vertices(&self) -> &[[f32; 3]] {
        &self.padded[..self.padded.len() - 1]
    }
}

impl Geometry {
    /// A geometry of `elements` over `positions`.
    ///
    /// # Safety
    /// Every element reads only vertices that `positions` has.
    pub(super) unsafe fn over_vertices(
        device: &Device,
        positions: Vec<[f32; 3]>,
        elements: Elements,
    ) -> Result<Self, EmbreeError> {
        let vertex_count = count("vertices", positions.len())?;
        let element_count = match &elements {
            Elements::Mesh(mesh) => count("triangles", mesh.triangles().len())?,
            Elements::Triangles(triangles) => count("triangles", triangles.len())?,
            Elements::Grids(grids) => count("grids", grids.len())?,
        };
        let buffer = Arc::new(VertexBuffer::new(positions, elements));
        let vertices = buffer.padded.as_ptr().cast();
        let new_triangles = |triangles: &[[u32; 3]]| {
            // SAFETY: both arrays are as long as said (one vertex of padding besides) and kept with the geometry.
            unsafe {
                sys::pm_geometry_new_triangles(
                    device.raw(),
                    vertices,
                    vertex_count,
                    triangles.as_ptr().cast(),
                    element_count,
                )
            }
        };
        let make = || match &buffer.elements {
            Elements::Mesh(mesh) => new_triangles(mesh.triangles()),
            Elements::Triangles(triangles) => new_triangles(triangles),
            // SAFETY: as for triangles.
            Elements::Grids(grids) => unsafe {
                sys::pm_geometry_new_grids(
                    device.raw(),
                    vertices,
                    vertex_count,
                    grids.as_ptr(),
                    element_count,
                )
            },
        };
        // SAFETY: what `make` returns reads the buffer that is kept.
        unsafe { Self::from_raw(device, Kind::Mesh, buffer.clone(), make) }
    }

    /// Lets `change` move the vertices; needs a commit, and that the scene is not traced now.
    pub(super) fn move_vertices(
        &mut self,
        change: impl FnOnce(&mut [[f32; 3]]),
    ) -> Result<(), EmbreeError> {
        debug_assert_eq!(self.kind, Kind::Mesh);
        let raw = self.raw();
        let buffer = Arc::get_mut(&mut self.keep)
            .and_then(|keep| keep.downcast_mut::<VertexBuffer>())
            .expect("a mesh geometry is the only owner of its vertex buffer");
        let vertices = buffer.vertices().len();
        change(&mut buffer.padded[..vertices]);
        // SAFETY: the array that the geometry had, as long as it was; `count` allowed its length.
        self.device.guarded(|| unsafe {
            sys::pm_geometry_set_vertices(raw, buffer.padded.as_ptr().cast(), vertices as u32);
        })
    }
}

/// The first of `elements` whose largest vertex is none of `vertices`.
pub(super) fn check_indices(
    what: &'static str,
    largest: impl IntoIterator<Item = u64>,
    vertices: usize,
) -> Result<(), EmbreeError> {
    match largest
        .into_iter()
        .position(|vertex| vertex >= vertices as u64)
    {
        None => Ok(()),
        Some(index) => Err(EmbreeError::BadElement {
            what,
            index,
            vertices,
        }),
    }
}
