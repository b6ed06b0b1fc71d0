//! What lies along one curve: parts between cuts, and of long curves only those near the surface.

use glam::DVec2;

use super::cuts::{Cuts, Lines, MOST_LINES};
use super::hull::Hull;
use super::roots::{crossing, dip, height};
use super::{Cells, Found, Question};
use crate::prism::curve::Curve;
use crate::prism::simd::{Lanes, Quad, Task};

/// Texels of slack around what is bounded, against rounding of texel coordinates.
const SLACK: f64 = 1e-3;

/// Parts of a curve that reach no further are looked at cell by cell, texels.
const SHORT: f64 = 2.0;

/// Halvings at most: no curve that is shorter than 2^50 texels needs more.
const DEPTH: usize = 50;

/// Parts of its curve that one ray may look at in one prism, some millions of texels: reached only where texture coordinates repeat a
/// map thousands of times over a triangle. What is behind is not looked for, so that no ray hangs.
const PATIENCE: u32 = 1 << 16;

/// What has been found so far.
pub struct Search<'a> {
    pub question: &'a Question<'a>,
    /// The first and the last cell along each axis.
    cells: [[f64; 2]; 2],
    nearest: Option<Found>,
    done: bool,
    patience: u32,
}

/// What to do with a part of a curve.
enum Fate {
    /// Nothing is there that is asked for.
    Nothing,
    /// It is to be halved.
    Long,
    /// It is in cells between these lines.
    Short(Lines),
}

impl<'a> Search<'a> {
    #[inline(always)]
    pub fn new(question: &'a Question<'a>, cells: &Cells) -> Self {
        Self {
            question,
            cells: [cells.x, cells.y].map(|ends| ends.map(|cell| cell as f64)),
            nearest: None,
            done: false,
            patience: PATIENCE,
        }
    }

    /// The nearest crossing.
    #[inline(always)]
    pub fn nearest(&self) -> Option<Found> {
        self.nearest
    }

    /// Whether nothing more is wanted.
    #[inline(always)]
    pub fn is_done(&self) -> bool {
        self.done
    }

    /// Where one piece of a curve ends and another begins their signs may differ by rounding, or by what a flat piece leaves out: a crossing then, of the cell
    /// that the second begins in.
    #[inline(always)]
    pub fn joint<Q: Quad>(&mut self, before: &Curve<Q>, behind: &Curve<Q>) {
        let patch = self.question.patch;
        if self.holds(behind, 0.0)
            && (height(patch, before, 1.0).g > 0.0) != (height(patch, behind, 0.0).g > 0.0)
        {
            self.take(Found::at(behind, 0.0));
        }
    }

    /// Whether the curve is in one of the cells at s.
    #[inline(always)]
    fn holds<Q: Quad>(&self, curve: &Curve<Q>, s: f64) -> bool {
        let [x, y, ..] = curve.at(s).0.to_array();
        let [base_x, base_y] = curve.texel_base;
        let (x, y) = (x.floor() + base_x, y.floor() + base_y);
        let [[x0, x1], [y0, y1]] = self.cells;
        x >= x0 && x <= x1 && y >= y0 && y <= y1
    }

    /// Whether a part of a curve is in none of the cells, or not where the ray is, or behind what was found.
    #[inline(always)]
    fn leaves_out<Q: Quad>(&self, hull: &Hull<Q>, [base_x, base_y]: [f64; 2]) -> bool {
        let [low, high] = hull.texels();
        let [[x0, x1], [y0, y1]] = self.cells;
        if low.x > x1 - base_x + (1.0 + SLACK)
            || low.y > y1 - base_y + (1.0 + SLACK)
            || high.x < x0 - base_x - SLACK
            || high.y < y0 - base_y - SLACK
        {
            return true;
        }
        let times = hull.times();
        self.question.is_outside(times) || self.nearest.is_some_and(|n| times[0] > n.t)
    }

    /// Looks at a part of a curve.
    #[inline(always)]
    fn look<Q: Quad>(&self, curve: &Curve<Q>, ends: [f64; 2]) -> Fate {
        let Some(hull) = Hull::new(curve, ends) else {
            return Fate::Long;
        };
        if self.leaves_out(&hull, curve.texel_base) {
            return Fate::Nothing;
        }
        let [low, high] = hull.texels();
        let base = DVec2::from(curve.texel_base);
        let patch = self.question.patch;
        if hull.is_clear_of(patch, patch.map.range_in_box(low + base, high + base)) {
            return Fate::Nothing;
        }
        if (high - low).max_element() > SHORT {
            return Fate::Long;
        }
        let (first, last) = ((low - SLACK).floor(), (high + SLACK).floor() + 1.0);
        Fate::Short([[first.x, last.x], [first.y, last.y]])
    }

    /// Counts something looked at; ends the search where there was too much.
    #[inline(always)]
    fn count(&mut self) {
        self.patience = self.patience.saturating_sub(1);
        self.done |= self.patience == 0;
    }

    /// Halves a curve until its parts are short.
    #[inline(always)]
    fn walk<Q: Quad>(&mut self, curve: &Curve<Q>) {
        // Ends of parts to come, the next one last.
        let mut ahead = [1.0; DEPTH + 2];
        let (mut count, mut from, mut judged) = (1, 0.0, 0.0);
        while count > 0 {
            self.count();
            let to = ahead[count - 1];
            match self.look(curve, [from, to]) {
                Fate::Long if count <= DEPTH => {
                    ahead[count] = 0.5 * (from + to);
                    count += 1;
                    continue;
                }
                Fate::Short(lines) => self.parts(curve, &lines, [from, to], &mut judged),
                Fate::Nothing | Fate::Long => {}
            }
            if self.done {
                return;
            }
            from = to;
            count -= 1;
        }
    }

    /// The parts between cuts that reach into [from, to], but for those before `judged`. `lines` are all around the cells there.
    #[inline(always)]
    fn parts<Q: Quad>(
        &mut self,
        curve: &Curve<Q>,
        lines: &Lines,
        [from, to]: [f64; 2],
        judged: &mut f64,
    ) {
        let cuts = Cuts::new(curve, lines);
        let mut start = 0.0;
        for &end in &cuts.as_slice()[1..] {
            let part = [start, end];
            start = end;
            if part[0] == end || end <= from || end <= *judged {
                continue;
            }
            if part[0] >= to {
                break;
            }
            *judged = end;
            if self.holds(curve, 0.5 * (part[0] + end)) {
                self.part(curve, part);
                if self.done {
                    return;
                }
            }
        }
    }

    /// A part within one cell: straight piece by straight piece, in each of which g has one turning point at most.
    #[inline(always)]
    fn part<Q: Quad>(&mut self, curve: &Curve<Q>, [mut from, to]: [f64; 2]) {
        /// Halvings at most: of a curve around a point where opposed normals cancel there is no end.
        const DEPTH: usize = 12;
        let patch = self.question.patch;
        let mut ahead = [to; DEPTH + 1];
        let mut count = 1;
        let mut before = height(patch, curve, from).g;
        while count > 0 && !self.done {
            self.count();
            let end = ahead[count - 1];
            // No closure: lanes must not pass through functions that lack the kernel's instruction set.
            let is_straight = match Hull::new(curve, [from, end]) {
                Some(hull) => hull.is_straight(patch),
                None => false,
            };
            if count <= DEPTH && !is_straight {
                ahead[count] = 0.5 * (from + end);
                count += 1;
                continue;
            }
            let behind = height(patch, curve, end).g;
            self.straight(curve, [from, end], [before, behind]);
            (from, before) = (end, behind);
            count -= 1;
        }
    }

    /// A piece between two values of g.
    #[inline(always)]
    fn straight<Q: Quad>(&mut self, curve: &Curve<Q>, [from, to]: [f64; 2], g: [f64; 2]) {
        let patch = self.question.patch;
        let above = g[0] > 0.0;
        if above != (g[1] > 0.0) {
            let guess = from + (to - from) * (g[0] / (g[0] - g[1]));
            self.take(crossing(patch, curve, [from, to], guess, above));
        } else if let Some(dip) = dip(patch, curve, [from, to], above) {
            self.take(crossing(patch, curve, [from, dip], dip, above));
            if !self.done {
                self.take(crossing(patch, curve, [dip, to], dip, !above));
            }
        }
    }

    /// Keeps a crossing if it is wanted.
    #[inline(always)]
    fn take(&mut self, found: Found) {
        if self.question.accepts(found.t) && self.nearest.is_none_or(|n| found.t < n.t) {
            self.nearest = Some(found);
            self.done |= self.question.any;
        }
    }
}

/// Looks for the surface along one curve.
pub struct Along<'s, 'a, Q> {
    pub search: &'s mut Search<'a>,
    pub curve: &'s Curve<Q>,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Along<'_, '_, Q> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { search, curve } = self;
        if !is_finite(curve) {
            return;
        }
        let [[x0, x1], [y0, y1]] = search.cells;
        // One more line than cells.
        const MOST_CELLS: f64 = MOST_LINES as f64 - 1.0;
        if (x1 - x0).max(y1 - y0) >= MOST_CELLS {
            return search.walk(curve);
        }
        let whole = [0.0, 1.0];
        let [x, y] = curve.texel_base;
        let is_left_out = match Hull::new(curve, whole) {
            Some(hull) => search.leaves_out(&hull, [x, y]),
            None => false,
        };
        if !is_left_out {
            let lines = [[x0 - x, x1 - x + 1.0], [y0 - y, y1 - y + 1.0]];
            search.parts(curve, &lines, whole, &mut 0.0);
        }
    }
}

/// Whether a curve's numbers are.
#[inline(always)]
fn is_finite<Q: Quad>(curve: &Curve<Q>) -> bool {
    let [p0, p1, p2] = curve.place;
    let [d0, d1, d2] = curve.depth;
    let [x, y, u, v] = (p0 + p1 + p2).to_array();
    let [a, z, n, _] = (d0 + d1 + d2).to_array();
    ((x + y + u + v) + (a + z + n)).is_finite()
}
