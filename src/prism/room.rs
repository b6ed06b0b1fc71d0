//! Ranges and boxes with room for edits of the map: how much there is, and how they grow in place.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::surface::{DisplacedSurface, DisplacementMap, TexelKind};

/// How much room prisms have for edits of the map: tracing speed against the cost of an edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EditBounds {
    /// What the map holds under each prism. Rays are fastest (twice as fast as with the other, and more where heights vary much), and an
    /// edit beyond the heights that a prism has had so far makes its bounds grow: backends must take them again.
    #[default]
    Tight,
    /// All that the map's texels can say, 0 to 1, so that bounds never grow; for float maps what the whole map holds
    /// when the prisms are made, and bounds grow with edits beyond.
    Range,
}

impl EditBounds {
    /// `tight` or `range`, as in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tight => "tight",
            Self::Range => "range",
        }
    }

    /// The heights that every prism has room for, whatever is under it.
    pub fn room(self, map: &DisplacementMap) -> Option<(f32, f32)> {
        match (self, map.kind()) {
            (Self::Tight, _) => None,
            (Self::Range, TexelKind::U8 | TexelKind::U16) => Some((0.0, 1.0)),
            (Self::Range, TexelKind::F32) => Some(map.range()),
        }
    }

    /// The range of D of a prism and its walls, for the map as it is.
    pub fn range(self, surface: &DisplacedSurface, prim: u32) -> [f64; 2] {
        let Some(heights) = self.room(surface.map()) else {
            return surface.displacements(prim);
        };
        let [low, high] = surface.patch(prim).displacements(heights);
        // Walls may go down to the base.
        if surface.walls_of(prim).is_empty() {
            [low, high]
        } else {
            [low.min(0.0), high.max(0.0)]
        }
    }

    /// The same for w.
    pub fn offsets(self, surface: &DisplacedSurface, prim: u32) -> [f32; 2] {
        surface.patch(prim).offsets_of(self.range(surface, prim))
    }
}

/// Whether a range holds another.
pub fn holds([low, high]: [f32; 2], wanted: [f32; 2]) -> bool {
    low <= wanted[0] && wanted[1] <= high
}

/// Widens a range, kept as bits, to hold `wanted`; whether it did not.
pub fn widen([low, high]: [&AtomicU32; 2], wanted: [f32; 2]) -> bool {
    let exceeds = |bits: &AtomicU32, wanted: f32, beyond: fn(f32, f32) -> bool| {
        let grown = |old| beyond(wanted, f32::from_bits(old)).then_some(wanted.to_bits());
        bits.fetch_update(Ordering::Relaxed, Ordering::Relaxed, grown)
            .is_ok()
    };
    let lower = exceeds(low, wanted[0], |new, old| new < old);
    exceeds(high, wanted[1], |new, old| new > old) || lower
}
