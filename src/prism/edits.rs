//! Prisms while their map is edited: ranges grow in place, and whoever keeps a tree over the bounds is told.

use std::sync::atomic::Ordering;

use super::exact::{ExactPrisms, Primitive};
use super::room::holds;
use super::touch::{Touch, around};
use super::uniform::UniformPrisms;
use super::{Parts, Prisms};
use crate::surface::TexelRect;

/// What an edit of the map has changed of the prisms over it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BoundsChange {
    /// Prisms that have texels of the edit under them; 0 where no edit within the map's range can matter
    /// ([`EditBounds::Range`](super::EditBounds::Range)).
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

/// What an edit has made grow.
#[derive(Default)]
pub(super) struct Growth {
    pub change: BoundsChange,
    /// Base triangles whose range of w has grown, ascending.
    pub widened: Vec<u32>,
}

impl Prisms {
    /// Takes note of an edit of the map's texels in `rect` ([`DisplacementMap::update`](crate::surface::DisplacementMap::update)); before the next ray, or that
    /// may miss what has grown. Prisms that do not hold the new heights are widened in place; those that do stay as they
    /// are, even if less would do by now.
    ///
    /// May run while rays are in flight and beside other edits, as `update` may. It takes time for what the rectangle touches, and
    /// very little for the rest of the mesh.
    pub fn map_edited(&self, rect: TexelRect) -> BoundsChange {
        self.grow(rect).change
    }

    /// [`Self::map_edited`], and more of what it found.
    pub(super) fn grow(&self, rect: TexelRect) -> Growth {
        let map = self.surface.map();
        let (low, high) = map.range();
        let has_room = |room: (f32, f32)| room.0 <= low && high <= room.1;
        if self.room.is_some_and(has_room) {
            return Growth::default();
        }
        // What is not in the map was never edited.
        let Ok(edited) = map.range_in(rect) else {
            return Growth::default();
        };
        let touch = Touch::new(map, rect);
        let growth = match &self.parts {
            Parts::Exact(exact) => {
                exact.take_heights(&self.surface, self.room);
                self.grow_exact(exact, &touch, rect, edited)
            }
            Parts::Uniform(uniform) => self.grow_uniform(uniform, &touch, rect, edited),
        };
        if growth.change.any() {
            self.growths.fetch_add(1, Ordering::Release);
        }
        growth
    }

    /// Takes the bounds of what edits have touched anew, as those of new prisms are: [`Self::map_edited`] only widens them, so that they also hold what is
    /// long edited away. For who makes a new tree; trees that are there already hold the surface nevertheless. Bounds only shrink by this: texels that
    /// [`Self::map_edited`] was not told of yet make none grow.
    ///
    /// May run while rays are in flight and beside edits.
    pub fn tighten(&self) {
        if let Parts::Exact(exact) = &self.parts {
            exact.tighten(&self.surface, self.room);
        }
    }

    fn grow_exact(
        &self,
        exact: &ExactPrisms,
        touch: &Touch,
        rect: TexelRect,
        edited: (f32, f32),
    ) -> Growth {
        let surface = &self.surface;
        let candidates = exact.touched_by(surface, touch);
        let mut triangles: Vec<u32> = candidates
            .iter()
            .map(|&primitive| exact.primitive(primitive).triangle())
            .collect();
        triangles.sort_unstable();
        triangles.dedup();
        triangles.retain(|&triangle| surface.overlaps(triangle, rect));
        let widens = |triangle: u32| {
            let (patch, record) = (surface.patch(triangle), exact.record(triangle));
            // There is room for all other texels: these alone decide, if all of them fit.
            let edited = patch.offsets_of(patch.displacements(edited));
            !holds(record.offsets(), edited)
                && record.widen(self.edit_bounds.offsets(surface, triangle))
        };
        let widened: Vec<u32> = triangles.iter().copied().filter(|&t| widens(t)).collect();
        // A block has its own texels' heights; the other primitives have their triangle's.
        let blocks = candidates.into_iter().filter(|&primitive| {
            matches!(exact.primitive(primitive), Primitive::Block(block)
                if triangles.binary_search(&block.triangle).is_ok())
        });
        let others = widened
            .iter()
            .flat_map(|&triangle| exact.others_of(triangle));
        let mut primitives = exact.widen(surface, self.room, blocks.chain(others));
        primitives.sort_unstable();
        Growth {
            change: BoundsChange {
                touched: triangles.len(),
                primitives,
            },
            widened,
        }
    }

    fn grow_uniform(
        &self,
        uniform: &UniformPrisms,
        touch: &Touch,
        rect: TexelRect,
        edited: (f32, f32),
    ) -> Growth {
        let (surface, map) = (&self.surface, self.surface.map());
        let mut change = BoundsChange::default();
        for prim in uniform.index.candidates(touch) {
            let patch = surface.patch(prim);
            if touch.misses(&around(patch.texels)) || !map.overlaps(patch.texels, rect) {
                continue;
            }
            change.touched += 1;
            let record = &uniform.records[prim as usize];
            if !record.holds(patch.displacements(edited))
                && record.widen(self.edit_bounds.range(surface, prim))
            {
                change.primitives.push(prim);
            }
        }
        Growth {
            widened: change.primitives.clone(),
            change,
        }
    }

    /// How often edits have made bounds grow: a tree made when the number was the same still holds the surface.
    pub fn growths(&self) -> u64 {
        self.growths.load(Ordering::Acquire)
    }
}

#[cfg(test)]
mod tests;
