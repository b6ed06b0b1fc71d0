//! Prisms while their map is edited: ranges grow in place, and whoever keeps a tree over the bounds is told.

use std::sync::atomic::{AtomicU32, Ordering};

use super::touch::Touch;
use super::{Parts, Prisms};
use crate::surface::{DisplacedSurface, DisplacementMap, TexelKind, TexelRect};

/// How much room prisms have for edits of the map: tracing speed against the cost of an edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EditBounds {
    /// What the map holds under each prism. Rays are fastest (a third to a half over the other where heights vary much), and an
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
    pub(super) fn room(self, map: &DisplacementMap) -> Option<(f32, f32)> {
        match (self, map.kind()) {
            (Self::Tight, _) => None,
            (Self::Range, TexelKind::U8 | TexelKind::U16) => Some((0.0, 1.0)),
            (Self::Range, TexelKind::F32) => Some(map.range()),
        }
    }

    /// The range of D of a prism and its walls, for the map as it is.
    pub(super) fn range(self, surface: &DisplacedSurface, prim: u32) -> [f64; 2] {
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
    pub(super) fn offsets(self, surface: &DisplacedSurface, prim: u32) -> [f32; 2] {
        surface.patch(prim).offsets_of(self.range(surface, prim))
    }
}

/// What an edit of the map has changed of the prisms over it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BoundsChange {
    /// Prisms that have texels of the edit under them; 0 where no edit within the map's range can matter
    /// ([`EditBounds::Range`]).
    pub touched: usize,
    /// Primitives whose [`Prisms::bounds`] have grown, in ascending order.
    pub primitives: Vec<u32>,
}

impl BoundsChange {
    /// Whether any bounds have grown: trees over them must be refitted before the next ray.
    pub fn any(&self) -> bool {
        !self.primitives.is_empty()
    }
}

impl Prisms {
    /// Takes note of an edit of the map's texels in `rect` ([`DisplacementMap::update`]); before the next ray, or that
    /// may miss what has grown. Prisms that do not hold the new heights are widened in place; those that do stay as they
    /// are, even if less would do by now.
    ///
    /// May run while rays are in flight and beside other edits, as `update` may.
    pub fn map_edited(&self, rect: TexelRect) -> BoundsChange {
        let mut change = BoundsChange::default();
        let map = self.surface.map();
        let (low, high) = map.range();
        if self
            .room
            .is_some_and(|room| room.0 <= low && high <= room.1)
        {
            return change;
        }
        // What is not in the map was never edited.
        let Ok(edited) = map.range_in(rect) else {
            return change;
        };
        let touch = Touch::new(map, rect);
        match &self.parts {
            Parts::Exact(exact) => {
                exact.take_heights(&self.surface, self.room);
                let triangles = self.surface.mesh().triangles().len() as u32;
                for triangle in 0..triangles {
                    let corners = around(self.surface.corner_texcoords(triangle));
                    // Walls look at the map elsewhere too.
                    let has_walls = !self.surface.walls_of(triangle).is_empty();
                    if touch.misses(corners) && !has_walls || !self.surface.overlaps(triangle, rect)
                    {
                        continue;
                    }
                    change.touched += 1;
                    let patch = self.surface.patch(triangle);
                    let record = exact.record(triangle);
                    // There is room for all other texels: these alone decide, if all of them fit.
                    let edited = patch.offsets_of(patch.displacements(edited));
                    if !holds(record.offsets(), edited) {
                        record.widen(self.edit_bounds.offsets(&self.surface, triangle));
                    }
                    for primitive in exact.primitives_of(triangle) {
                        if exact.widen(&self.surface, self.room, primitive) {
                            change.primitives.push(primitive);
                        }
                    }
                }
                change.primitives.sort_unstable();
            }
            Parts::Uniform(uniform) => {
                for (prim, record) in (0u32..).zip(&uniform.records) {
                    if touch.misses(around(self.surface.corner_texcoords(prim))) {
                        continue;
                    }
                    let patch = self.surface.patch(prim);
                    if map.overlaps(patch.texels, rect) {
                        change.touched += 1;
                        if !record.holds(patch.displacements(edited))
                            && record.widen(self.edit_bounds.range(&self.surface, prim))
                        {
                            change.primitives.push(prim);
                        }
                    }
                }
            }
        }
        if change.any() {
            self.growths.fetch_add(1, Ordering::Release);
        }
        change
    }

    /// How often edits have made bounds grow: a tree made when the number was the same still holds the surface.
    pub fn growths(&self) -> u64 {
        self.growths.load(Ordering::Acquire)
    }
}

/// The box around the corners of one triangle; NaN where a coordinate is.
pub(super) fn around(st: [glam::Vec2; 3]) -> [[f32; 2]; 2] {
    [0, 1].map(|axis| {
        let [a, b, c] = st.map(|st| st[axis]);
        if (a + b + c).is_finite() {
            [a.min(b).min(c), a.max(b).max(c)]
        } else {
            [f32::NAN; 2]
        }
    })
}

/// Whether a range holds another.
pub(super) fn holds([low, high]: [f32; 2], wanted: [f32; 2]) -> bool {
    low <= wanted[0] && wanted[1] <= high
}

/// Widens a range, kept as bits, to hold `wanted`; whether it did not.
pub(super) fn widen([low, high]: [&AtomicU32; 2], wanted: [f32; 2]) -> bool {
    let exceeds = |bits: &AtomicU32, wanted: f32, beyond: fn(f32, f32) -> bool| {
        let grown = |old| beyond(wanted, f32::from_bits(old)).then_some(wanted.to_bits());
        bits.fetch_update(Ordering::Relaxed, Ordering::Relaxed, grown)
            .is_ok()
    };
    let lower = exceeds(low, wanted[0], |new, old| new < old);
    exceeds(high, wanted[1], |new, old| new > old) || lower
}

#[cfg(test)]
mod tests;
