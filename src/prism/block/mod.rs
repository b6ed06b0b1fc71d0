//! Blocks of texels: what a backend traces of the exact march's surface.
//!
//! Texture coordinates are affine in the barycentrics; so over one base triangle P and N' are affine in *texel coordinates*, and
//! S = P + D N'/|N'| over a grid of texels is a grid of displaced vertices. A **block** is up to 32x32 texel cells of one base
//! triangle, a primitive with a tight box. A ray that enters the box sees the block in its own frame ([`view`]); the
//! block's **leaves**, 8x4 cells each, are held against the ray eight at a time by the map's min/max table ([`cull`]); the texels of a leaf that is left are
//! displaced and projected in lanes ([`leaf`]); and cells whose outline may hold the ray are judged one by one ([`cell`]).
//!
//! Everything here is f32 and only ever *excludes* by bounds that are proven (docs/exact.md), or *accepts* what they leave no doubt of. A hit that is
//! accepted is found by Newton's method in f64 on S itself ([`newton`]); what is neither is decided in f64 by the [judge](super::judge).

#[cfg(test)]
mod bounds_tests;
mod cell;
mod cull;
mod cut;
mod hit;
mod leaf;
mod middle;
mod newton;
mod outline;
mod place;
mod record;
#[cfg(test)]
mod tests;
mod told;
mod view;

pub use cut::Cutter;
pub use hit::{Ask, nearest, told};
pub use middle::Heights;
pub use newton::Crossing;
pub use outline::{Outline, outline};
pub use record::{Block, Record};
pub use told::{BlockTold, CellFate, CellTold, Fate, LeafTold, PartTold};

/// Cells across and up of a leaf: a register of the map's finest entries.
pub const LEAF: [u32; 2] = [8, 4];

/// Cells across and up of a block, at most.
pub const SIDE: u32 = 32;

/// The unit roundoff of f32.
const ROUNDING: f32 = 0.5 * f32::EPSILON;
