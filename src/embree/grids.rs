//! Embree's grids: a compact form of tessellations, to compare with.

use super::vertices::{Elements, check_indices};
use super::{Device, EmbreeError, Geometry, sys};

/// A regular grid of vertices; each of its cells is two triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Index of the first vertex.
    pub first: u32,
    /// Vertices from one row to the next.
    pub stride: u32,
    /// Vertices per row, 2 .. [`Grid::MAX_SIDE`].
    pub width: u16,
    /// Rows, 2 .. [`Grid::MAX_SIDE`].
    pub height: u16,
}

impl Grid {
    /// Most vertices along a side.
    pub const MAX_SIDE: u16 = 32767;

    /// The largest vertex of a sound grid; beyond all vertices for others.
    fn largest(&self) -> u64 {
        let sides = 2..=Self::MAX_SIDE;
        if !(sides.contains(&self.width) && sides.contains(&self.height)) {
            return u64::MAX;
        }
        let rows = u64::from(self.height - 1);
        u64::from(self.first) + rows * u64::from(self.stride) + u64::from(self.width - 1)
    }

    fn raw(&self) -> sys::pm_grid {
        sys::pm_grid {
            first: self.first,
            stride: self.stride,
            width: self.width,
            height: self.height,
        }
    }
}

/// A set of grids, traced by Embree itself. A hit's primitive is the grid; u and v run over it from 0 to 1.
pub struct GridGeometry(Geometry);

impl From<GridGeometry> for Geometry {
    fn from(grids: GridGeometry) -> Self {
        grids.0
    }
}

impl GridGeometry {
    /// Grids over `positions`, which are not copied.
    ///
    /// # Errors
    ///
    /// [`EmbreeError::BadElement`] for a grid with a side out of range or with an index that is no vertex's.
    pub fn from_buffers(
        device: &Device,
        positions: Vec<[f32; 3]>,
        grids: &[Grid],
    ) -> Result<Self, EmbreeError> {
        check_indices("grid", grids.iter().map(Grid::largest), positions.len())?;
        let grids = Elements::Grids(grids.iter().map(Grid::raw).collect());
        // SAFETY: just checked.
        unsafe { Geometry::over_vertices(device, positions, grids) }.map(Self)
    }
}
