//! The hit test of a block.

mod explain;

use glam::DVec2;

use super::cell::{Once, Verdict, judged};
use super::cull::met;
use super::leaf::{Leaf, Rows};
use super::middle::{Heights, Middle};
use super::newton::{Cell, Crossing, Whose, in_triangle, land};
use super::place::{PART, PARTS, Place, leaf_of, leaves_of};
use super::view::View;
use super::{Block, LEAF, Record};
use crate::prism::judge::{Cells, Found, Question, within};
use crate::prism::ray_frame::{RayFrame, axes};
use crate::prism::simd::{LANES, Lanes, Task};
use crate::ray::Ray;
use crate::surface::{Corners, DisplacedSurface, Patch};

pub use explain::told;

/// A block, and what is asked of it.
pub struct Ask<'a> {
    pub surface: &'a DisplacedSurface,
    pub heights: Heights,
    pub record: &'a Record,
    pub block: Block,
    /// Where the triangle's corners are, if not where the mesh has them.
    pub corners: Option<&'a Corners>,
    /// Whether any crossing will do.
    pub any: bool,
}

/// The nearest crossing of S in a block with t in the ray's interval, or any.
#[inline(always)]
pub fn nearest<L: Lanes>(ask: &Ask<'_>, ray: &Ray) -> Option<Crossing> {
    let frame = RayFrame::new(ray, axes(ray));
    let place = Place::new(ask.surface.map(), ask.record, ask.block);
    let heights = ask.heights;
    let mut search = Search {
        ask,
        frame: &frame,
        place: &place,
        interval: [ray.tnear, ray.tfar],
        nearest: None,
        asked: 0,
    };
    let middle = Middle::new::<L>(ask.record, ask.block, &heights);
    let mut view = View::new::<L>(ask.record, &middle, &frame, ray);
    if !view.is_sound {
        search.decide::<L>(place.all());
        return search.nearest;
    }
    let mut leaves = Leaves::new::<L>(&place, &view, &heights);
    while let Some(leaf) = leaves.first() {
        if leaves.begin(leaf) > view.interval[1] {
            break;
        }
        let rise = leaves.rise(leaf) * heights.scale.abs();
        if search.leaf::<L>(&mut view, leaves.place(leaf), rise) {
            break;
        }
    }
    search.nearest
}

/// The leaves that a ray may meet: eight for every two parts of the block that it may meet.
struct Leaves {
    begins: [[f32; LANES]; MOST_GROUPS],
    /// The range of their stored texels.
    range: [[[f32; LANES]; MOST_GROUPS]; 2],
    parts: [[u32; 2]; MOST_GROUPS],
    waiting: u32,
}

const MOST_GROUPS: usize = PARTS.len() / 2;

impl Leaves {
    /// First the parts of the map's second level are held against the ray, then their leaves.
    #[inline(always)]
    fn new<L: Lanes>(place: &Place<'_>, view: &View<'_>, heights: &Heights) -> Self {
        let mut leaves = Self {
            begins: [[0.0; LANES]; MOST_GROUPS],
            range: [[[0.0; LANES]; MOST_GROUPS]; 2],
            parts: [[0; 2]; MOST_GROUPS],
            waiting: 0,
        };
        let (bits, _) = met(view, heights, &place.parts::<L>(view.middle));
        let mut parts = bits & place.there(&PARTS, PART);
        for group in 0..MOST_GROUPS {
            if parts == 0 {
                break;
            }
            let one = parts.trailing_zeros();
            parts &= parts - 1;
            let (other, used) = if parts == 0 {
                (one, 0x0f)
            } else {
                (parts.trailing_zeros(), 0xff)
            };
            parts &= parts.wrapping_sub(1);
            let eight = place.leaves::<L>([one, other], view.middle);
            let (bits, begins) = met(view, heights, &eight);
            let bits = bits & used & place.there(&leaves_of([one, other]), LEAF);
            leaves.begins[group] = begins.to_array();
            leaves.range[0][group] = eight.range[0].to_array();
            leaves.range[1][group] = eight.range[1].to_array();
            leaves.parts[group] = [one, other];
            leaves.waiting |= bits << (LANES * group);
        }
        leaves
    }

    /// The ray parameter before which a leaf is not met.
    #[inline(always)]
    fn begin(&self, leaf: usize) -> f32 {
        self.begins.as_flattened()[leaf]
    }

    /// The range of a leaf's stored texels.
    #[inline(always)]
    fn rise(&self, leaf: usize) -> f32 {
        let [low, high] = &self.range;
        high.as_flattened()[leaf] - low.as_flattened()[leaf]
    }

    /// Where a leaf is among the block's.
    #[inline(always)]
    fn place(&self, leaf: usize) -> [u32; 2] {
        let lane = leaf % LANES;
        leaf_of(self.parts[leaf / LANES][lane / 4], lane as u32 % 4)
    }

    /// Takes the one that begins first.
    #[inline(always)]
    fn first(&mut self) -> Option<usize> {
        if self.waiting == 0 {
            return None;
        }
        let mut best = self.waiting.trailing_zeros() as usize;
        let mut rest = self.waiting & (self.waiting - 1);
        while rest != 0 {
            let index = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            if self.begin(index) < self.begin(best) {
                best = index;
            }
        }
        self.waiting &= !(1 << best);
        Some(best)
    }
}

/// The search for the nearest crossing.
struct Search<'a> {
    ask: &'a Ask<'a>,
    frame: &'a RayFrame,
    place: &'a Place<'a>,
    /// Of ray parameters, open; ends at the nearest crossing so far.
    interval: [f32; 2],
    nearest: Option<Crossing>,
    /// Cells that the judge has been asked about.
    asked: u32,
}

/// Cells of a block that the judge is asked about one by one. Where there are more, the surface is folded over and over, and the judge decides the rest of
/// the block at once.
const MOST_ASKED: u32 = 8;

impl<'a> Search<'a> {
    fn patch(&self) -> Patch<'a> {
        let Ask { surface, block, .. } = *self.ask;
        match self.ask.corners {
            Some(&corners) => surface.patch_over(block.triangle, corners),
            None => surface.patch(block.triangle),
        }
    }

    /// Looks at a leaf's cells; whether nothing more is wanted.
    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, view: &mut View<'_>, leaf: [u32; 2], rise: f32) -> bool {
        let (ask, place) = (self.ask, self.place);
        let [i, j] = [leaf[0] * LEAF[0], leaf[1] * LEAF[1]];
        let [s, t] = place.middle_of(view.middle, [i, j], LEAF);
        let Some(leaf) = Leaf::new(view, &ask.heights, s, t) else {
            self.decide::<L>(place.part(i, j));
            return self.ask.any && self.nearest.is_some();
        };
        match place.stored(i, j) {
            Some(texels) => self.cells::<L>(view, place, &leaf, rise, [i, j], &texels),
            None => {
                let texels = place.continued(i, j);
                self.cells::<L>(view, place, &leaf, rise, [i, j], &texels)
            }
        }
    }

    #[inline(always)]
    fn cells<L: Lanes>(
        &mut self,
        view: &mut View<'_>,
        place: &Place<'_>,
        leaf: &Leaf,
        rise: f32,
        [i, j]: [u32; 2],
        texels: &impl Rows,
    ) -> bool {
        let heights = &self.ask.heights;
        let mut cells = leaf.cells::<L>(view, heights, rise, texels) & place.mask(i, j);
        while cells != 0 {
            let bit = cells.trailing_zeros();
            cells &= cells - 1;
            let at = (bit & 7, bit >> 3);
            let stored = texels.corners(at);
            let [h00, h10, h01, h11] = stored;
            match judged(view, heights, leaf, at, [h00, h10, h11, h01]) {
                Verdict::Missed => {}
                Verdict::Hit { is_inside, .. } if is_inside && self.ask.any => {
                    self.nearest = Some(Crossing::ANY);
                    return true;
                }
                verdict => {
                    let cell = [
                        place.first[0] + i64::from(i + at.0),
                        place.first[1] + i64::from(j + at.1),
                    ];
                    L::outline(Look {
                        search: self,
                        verdict,
                        cell,
                        stored,
                    });
                    view.end_at(self.interval[1]);
                    if self.asked > MOST_ASKED || self.ask.any && self.nearest.is_some() {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Decides a rectangle of cells in f64.
    #[inline(always)]
    fn decide<L: Lanes>(&mut self, cells: Cells) {
        let patch = self.patch();
        let range = self.ask.record.offsets().map(f64::from);
        let question = Question {
            patch: &patch,
            range,
            frame: self.frame,
            interval: self.interval,
            any: self.ask.any,
        };
        if let Some(at) = within::<L>(&question, &cells) {
            self.take(Crossing { at, ng: None });
        }
    }

    /// Takes the one root near a place, if it is in the cell and in the triangle; whether that is beyond doubt.
    #[inline(always)]
    fn lands(&mut self, cell: [i64; 2], stored: [f32; 4], at: &Once) -> bool {
        let patch = self.patch();
        let per_unit = 1.0 / f64::from(patch.map.unit());
        let cell = Cell {
            corner: DVec2::new(cell[0] as f64, cell[1] as f64),
            heights: stored.map(|h| f64::from(h) * per_unit),
        };
        let Some(crossing) = land(&patch, self.frame, &cell, at) else {
            return false;
        };
        let Found { u, v, .. } = crossing.at;
        let (whose, of) = (cell.find(patch.texel(u, v)), in_triangle(u, v));
        if whose == Whose::Ours && of == Whose::Ours {
            self.take(crossing);
            return true;
        }
        whose == Whose::Others || of == Whose::Others
    }

    #[inline(always)]
    fn take(&mut self, crossing: Crossing) {
        let t = crossing.at.t as f32;
        if t > self.interval[0] && t < self.interval[1] {
            self.nearest = Some(crossing);
            self.interval[1] = t;
        }
    }
}

/// A cell that f32 cannot say "missed" of.
struct Look<'s, 'a> {
    search: &'s mut Search<'a>,
    verdict: Verdict,
    cell: [i64; 2],
    stored: [f32; 4],
}

impl<L: Lanes> Task<L> for Look<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { search, cell, .. } = self;
        let verdict = match self.verdict {
            Verdict::Folded(seen) => seen.in_quarters(),
            verdict => verdict,
        };
        let is_settled = match verdict {
            Verdict::Missed => true,
            Verdict::Hit { at, .. } | Verdict::Once(at) => search.lands(cell, self.stored, &at),
            Verdict::Folded(_) | Verdict::Unknown => false,
        };
        if is_settled {
            return;
        }
        search.asked += 1;
        let cells = if search.asked > MOST_ASKED {
            search.place.all()
        } else {
            let one = |k: usize| [cell[k]; 2];
            Cells {
                x: one(0),
                y: one(1),
            }
        };
        search.decide::<L>(cells);
    }
}
