//! What [explaining](super::super::explain) tells of a block.

use glam::DVec2;

/// What became of a block, a part or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The ray surely passes it by, or it is surely outside the triangle or the ray's interval.
    Missed,
    /// The march looked into it.
    Entered,
    /// All of it was decided in f64.
    Judged,
    /// It begins behind the hit.
    Behind,
}

/// What f32 says of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellFate {
    /// The ray surely passes it by, or it is surely outside the triangle or the ray's interval.
    Missed,
    /// The ray surely meets it once, if it is inside the triangle there.
    Hit,
    /// Decided in f64.
    Judged,
}

/// A part of a block (16x8 cells), or a leaf (8x4): held against the ray by its range of heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartTold {
    /// Lowest and highest texel coordinates.
    pub texels: [DVec2; 2],
    /// The smallest and the largest height of the map there.
    pub heights: [f64; 2],
    /// What became of it.
    pub fate: Fate,
}

/// A cell whose widened box holds the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellTold {
    /// Across and up, from the leaf's first cell.
    pub cell: [usize; 2],
    /// What became of it, in the ray's interval as it was when its leaf was begun.
    pub fate: CellFate,
}

/// A leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafTold {
    /// Where it is.
    pub part: PartTold,
    /// If it was entered: its displaced texels as the ray sees them, five rows of nine. World units across the ray, which is at (0, 0); N' in the
    /// middle of the block is along the first axis.
    pub vertices: Vec<DVec2>,
    /// If it was entered: the cells whose widened boxes hold the ray. All others are missed.
    pub cells: Vec<CellTold>,
}

impl LeafTold {
    pub(in crate::prism) fn unseen(part: PartTold) -> Self {
        Self {
            part,
            vertices: Vec::new(),
            cells: Vec::new(),
        }
    }
}

/// A block of the base triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockTold {
    /// Lowest and highest texel coordinates.
    pub texels: [DVec2; 2],
    /// What became of it.
    pub fate: Fate,
    /// If it was entered: its parts.
    pub parts: Vec<PartTold>,
    /// The leaves of the parts that were entered: missed ones first, then the others in the order in which they were taken.
    pub leaves: Vec<LeafTold>,
}
