//! The box of a block: of its displaced texels, and what bounds S between them.

use super::cull::{Offsets, Parts, above, beyond};
use super::leaf::{Leaf, Rows};
use super::middle::{Axis, Heights, Middle};
use super::place::{PARTS, Place, leaves_of};
use super::view::rounding;
use super::{Block, LEAF, Record};
use crate::prism::simd::{LANES, Lanes};
use crate::ray::Aabb;
use crate::surface::DisplacedSurface;

/// [`outline`] for one instruction set.
pub type Outline = fn(&DisplacedSurface, &Record, Block, Option<(f32, f32)>) -> Aabb;

/// Holds S over a block, for the map as it is and for heights of `room`; empty where no leaf reaches the triangle.
#[inline(always)]
pub fn outline<L: Lanes>(
    surface: &DisplacedSurface,
    record: &Record,
    block: Block,
    room: Option<(f32, f32)>,
) -> Aabb {
    let heights = Heights::new(surface).with_room(room, surface.map().unit());
    let place = Place::new(surface.map(), record, block);
    let middle = Middle::new::<L>(record, block, &heights);
    if !middle.is_tame() {
        return surface
            .patch(block.triangle)
            .hull([0, 1, 2], record.offsets());
    }
    let axes = [
        middle.axis(record.along(0)),
        middle.axis(record.along(1)),
        middle.axis(record.along(2)),
    ];
    let far = axes[0].p.c.abs() + axes[1].p.c.abs() + axes[2].p.c.abs();
    let frame = Frame {
        place: &place,
        middle: &middle,
        heights: &heights,
        axes: &axes,
        noise: rounding(middle.size + far),
    };
    let mut bounds = Aabb::EMPTY;
    for group in 0..PARTS.len() as u32 / 2 {
        let two = [2 * group, 2 * group + 1];
        let mut parts = place.leaves::<L>(two, &middle);
        if let Some((low, high)) = room {
            let unit = surface.map().unit();
            let [a, b] = parts.range;
            parts.range = [a.min(L::splat(low * unit)), b.max(L::splat(high * unit))];
        }
        let outside = above(beyond(&parts, &middle.b));
        let places = leaves_of(two);
        let used = place.there(&places, LEAF) & !outside;
        if used == 0 {
            continue;
        }
        if room.is_some() {
            bounds = bounds.union(frame.of_ranges(&parts, used));
            continue;
        }
        let rise = (parts.range[1] - parts.range[0]).to_array();
        for lane in 0..LANES {
            if used >> lane & 1 != 0 {
                let rise = rise[lane] * heights.scale.abs();
                bounds = bounds.union(match frame.of_texels::<L>(places[lane], rise) {
                    Some(leaf) => leaf,
                    None => frame.of_ranges(&parts, 1 << lane),
                });
            }
        }
    }
    bounds
}

/// A block in space.
struct Frame<'a> {
    place: &'a Place<'a>,
    middle: &'a Middle,
    heights: &'a Heights,
    axes: &'a [Axis; 3],
    noise: f32,
}

impl Frame<'_> {
    /// Of the vertices of a leaf; `None` where the normal turns too much for their series.
    #[inline(always)]
    fn of_texels<L: Lanes>(&self, leaf: [u32; 2], rise: f32) -> Option<Aabb> {
        let [i, j] = [leaf[0] * LEAF[0], leaf[1] * LEAF[1]];
        let [s, t] = self.place.middle_of(self.middle, [i, j], LEAF);
        let leaf = Leaf::over(self.middle, self.heights, s, t)?;
        Some(match self.place.stored(i, j) {
            Some(rows) => self.of_rows::<L>(&leaf, rise, [i, j], &rows),
            None => self.of_rows::<L>(&leaf, rise, [i, j], &self.place.continued(i, j)),
        })
    }

    #[inline(always)]
    fn of_rows<L: Lanes>(
        &self,
        leaf: &Leaf,
        rise: f32,
        [i, j]: [u32; 2],
        rows: &impl Rows,
    ) -> Aabb {
        let [across, up] = self.place.count();
        let count = [across - i, up - j];
        let Self {
            middle,
            axes,
            heights,
            ..
        } = *self;
        let found = leaf.bounds::<L>(middle, axes, heights, rows, count);
        if !found.is_valid() {
            return found;
        }
        let off = self.noise + leaf.off + 0.5 * leaf.beta(rise, heights.most);
        Aabb {
            min: found.min - off,
            max: found.max + off,
        }
    }

    /// Of the ranges of heights of some leaves.
    #[inline(always)]
    fn of_ranges<L: Lanes>(&self, parts: &Parts<L>, used: u32) -> Aabb {
        let Middle { k, k_off, .. } = self.middle;
        let offsets = Offsets::new(parts, self.heights, k, *k_off);
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            let [middle, off] = offsets.along(parts, &self.axes[axis], self.noise);
            let (low, high) = ((middle - off).to_array(), (middle + off).to_array());
            for lane in 0..LANES {
                if used >> lane & 1 != 0 {
                    bounds.min[axis] = bounds.min[axis].min(low[lane]);
                    bounds.max[axis] = bounds.max[axis].max(high[lane]);
                }
            }
        }
        bounds
    }
}
