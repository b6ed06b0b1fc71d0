//! The box of a block: of what S may be over each of its leaves, by the bounds that rays are held against, along the axes of space.

use super::cull::{Offsets, above, beyond};
use super::middle::{Heights, Middle};
use super::place::{PARTS, Place, leaves_of};
use super::view::rounding;
use super::{Block, LEAF, Record, SIDE};
use crate::prism::exact::hull;
use crate::prism::simd::{LANES, Lanes, Portable};
use crate::ray::Aabb;
use crate::surface::DisplacedSurface;

/// Holds S over a block, for the map as it is and for heights of `room`; empty where no leaf reaches the triangle.
pub fn outline(
    surface: &DisplacedSurface,
    record: &Record,
    block: Block,
    room: Option<(f32, f32)>,
) -> Aabb {
    type L = Portable;
    let heights = Heights::new(surface).with_room(room, surface.map().unit());
    let place = Place::new(surface.map(), record, block);
    let middle = Middle::new::<L>(record, block, &heights);
    if !middle.is_tame() {
        return hull(&surface.patch(block.triangle), [0, 1, 2], record.offsets());
    }
    let axes = [0, 1, 2].map(|axis| middle.axis(record.along(axis)));
    let far = axes.iter().map(|axis| axis.p.c.abs()).sum::<f32>();
    let noise = rounding(middle.size + far);
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
        let used = place.there(&leaves_of(two), LEAF) & !outside;
        if used == 0 {
            continue;
        }
        let offsets = Offsets::new(&parts, &heights, &middle.k, middle.k_off);
        for axis in 0..3 {
            let [middle, off] = offsets.along(&parts, &axes[axis], noise).map(L::to_array);
            for lane in (0..LANES).filter(|lane| used >> lane & 1 != 0) {
                bounds.min[axis] = bounds.min[axis].min(middle[lane] - off[lane]);
                bounds.max[axis] = bounds.max[axis].max(middle[lane] + off[lane]);
            }
        }
    }
    bounds
}
