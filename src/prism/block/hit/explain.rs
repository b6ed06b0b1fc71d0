//! The hit test of a block, told: by its own functions, with what they find kept.

use glam::{DVec2, Vec4};

use super::{Ask, Leaves, Search};
use crate::prism::block::LEAF;
use crate::prism::block::cell::{Verdict, judged};
use crate::prism::block::cull::met;
use crate::prism::block::leaf::{Leaf, Rows};
use crate::prism::block::middle::{Axis, Heights, Middle};
use crate::prism::block::place::{PART, PARTS, Place};
use crate::prism::block::told::{BlockTold, CellFate, CellTold, Fate, LeafTold, PartTold};
use crate::prism::block::view::View;
use crate::prism::judge::{Cells, Found};
use crate::prism::ray_frame::{RayFrame, axes};
use crate::prism::simd::{LANES, Lanes};
use crate::ray::Ray;

/// What [`nearest`](super::nearest) does, and finds.
pub fn told<L: Lanes>(ask: &Ask<'_>, ray: &Ray) -> (BlockTold, Option<Found>) {
    let map = ask.surface.map();
    let frame = RayFrame::new(ray, axes(ray));
    let place = Place::new(map, ask.record, ask.block);
    let heights = ask.heights;
    let mut search = Search {
        ask,
        frame: &frame,
        place: &place,
        interval: [ray.tnear, ray.tfar],
        nearest: None,
        asked: 0,
    };
    let mut told = BlockTold {
        texels: texels(place.all()),
        fate: Fate::Entered,
        parts: Vec::new(),
        leaves: Vec::new(),
    };
    let middle = Middle::new::<L>(ask.record, ask.block, &heights);
    let mut view = View::new::<L>(ask.record, &middle, &frame, ray);
    if !view.is_sound {
        search.decide::<L>(place.all());
        told.fate = Fate::Judged;
        return (told, search.nearest.map(|crossing| crossing.at));
    }

    let parts = place.parts::<L>(view.middle);
    let (bits, _) = met(&view, &heights, &parts);
    let ranges = parts.range.map(L::to_array);
    let are_there = place.there(&PARTS, PART);
    let per_unit = 1.0 / f64::from(map.unit());
    for (k, at) in PARTS.iter().enumerate() {
        if are_there >> k & 1 != 0 {
            let is_met = bits >> k & 1 != 0;
            told.parts.push(PartTold {
                texels: texels(place.rectangle([at[0] * PART[0], at[1] * PART[1]], PART)),
                heights: ranges.map(|range| f64::from(range[k]) * per_unit),
                fate: if is_met { Fate::Entered } else { Fate::Missed },
            });
        }
    }

    let mut leaves = Leaves::new::<L>(&place, &view, &heights);
    let part_told = |leaves: &Leaves, leaf: usize, fate: Fate| {
        let [i, j] = leaves.place(leaf);
        PartTold {
            texels: texels(place.part(i * LEAF[0], j * LEAF[1])),
            heights: [0, 1]
                .map(|k: usize| f64::from(leaves.range[k].as_flattened()[leaf]) * per_unit),
            fate,
        }
    };
    // Four of each part that was met.
    for leaf in 0..4 * (bits & are_there).count_ones() as usize {
        let is_there = place.there(&[leaves.place(leaf); LANES], LEAF) != 0;
        if is_there && leaves.waiting >> leaf & 1 == 0 {
            let part = part_told(&leaves, leaf, Fate::Missed);
            told.leaves.push(LeafTold::unseen(part));
        }
    }
    let mut is_settled = false;
    while let Some(leaf) = leaves.first() {
        let mut leaf_told = LeafTold::unseen(part_told(&leaves, leaf, Fate::Behind));
        if is_settled {
            leaf_told.part.fate = Fate::Judged;
        } else if leaves.begin(leaf) <= view.interval[1] {
            let at = leaves.place(leaf);
            let rise = leaves.rise(leaf) * heights.scale.abs();
            leaf_told.part.fate = Fate::Judged;
            seen::<L>(&view, &heights, &place, at, rise, &mut leaf_told);
            is_settled = search.leaf::<L>(&mut view, at, rise);
        }
        told.leaves.push(leaf_told);
    }
    (told, search.nearest.map(|crossing| crossing.at))
}

/// Lowest and highest texel coordinates.
fn texels(Cells { x, y }: Cells) -> [DVec2; 2] {
    [
        DVec2::new(x[0] as f64, y[0] as f64),
        DVec2::new(x[1] as f64 + 1.0, y[1] as f64 + 1.0),
    ]
}

/// A leaf as the ray sees it; untouched where the judge has it.
fn seen<L: Lanes>(
    view: &View<'_>,
    heights: &Heights,
    place: &Place<'_>,
    at: [u32; 2],
    rise: f32,
    told: &mut LeafTold,
) {
    let [i, j] = [at[0] * LEAF[0], at[1] * LEAF[1]];
    let [s, t] = place.middle_of(view.middle, [i, j], LEAF);
    let Some(leaf) = Leaf::new(view, heights, s, t) else {
        return;
    };
    told.part.fate = Fate::Entered;
    let rows = place.continued(i, j);
    for row in 0..=LEAF[1] {
        for column in 0..=LEAF[0] {
            // The vertex at the lower left of a cell; of the last ones, another.
            let cell = (column.min(LEAF[0] - 1), row.min(LEAF[1] - 1));
            let corner = (column - cell.0) + 2 * (row - cell.1);
            let stored = rows.corners(cell)[corner as usize];
            told.vertices
                .push(vertex(view, heights, &leaf, [column, row], stored));
        }
    }
    let mut cells = leaf.cells::<L>(view, heights, rise, &rows) & place.mask(i, j);
    while cells != 0 {
        let bit = cells.trailing_zeros();
        cells &= cells - 1;
        let at = (bit & 7, bit >> 3);
        let [h00, h10, h01, h11] = rows.corners(at);
        let verdict = judged(view, heights, &leaf, at, [h00, h10, h11, h01]);
        told.cells.push(CellTold {
            cell: [at.0 as usize, at.1 as usize],
            fate: match verdict {
                Verdict::Missed => CellFate::Missed,
                Verdict::Hit { .. } => CellFate::Hit,
                Verdict::Once(_) | Verdict::Folded(_) | Verdict::Unknown => CellFate::Judged,
            },
        });
    }
}

/// Where a displaced texel of a leaf is seen.
fn vertex(view: &View<'_>, heights: &Heights, leaf: &Leaf, [i, j]: [u32; 2], stored: f32) -> DVec2 {
    let [s, t] = [i as f32 - 4.0, j as f32 - 2.0];
    let k = leaf.k(Vec4::splat(s), Vec4::splat(t)).x;
    let w = (stored * heights.scale + heights.offset) * k;
    let (s, t) = (s + leaf.s, t + leaf.t);
    let along = |axis: &Axis| f64::from(axis.p.at(s, t) + w * axis.n.at(s, t));
    DVec2::new(along(&view.x), along(&view.y))
}
