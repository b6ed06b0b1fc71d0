//! Eight chords of eight rays, one lane each, walked cell by cell side by side.
//!
//! What is proven of a chord's cells is what [`cells`](super::cells) proves. There all cells of a chord are solved at once and
//! share the steepest slope; here a cell is weighed when the next one is known, by its own slope and those of the cells before and
//! behind: no other is within reach of the curve but at corners, where the same wide bound is taken.

use super::cells::{MOST_CELLS, NUDGE, may_cross, over_cell};
use crate::prism::simd::{Grid, LANES, Lanes};

/// As [`Chord`](super::cells::Chord), in lanes.
pub struct Chords<L> {
    /// (x, y, h) at both ends.
    pub from: [L; 3],
    pub to: [L; 3],
    /// How far the curve may be from the chord: in x and in y, in h.
    pub place: L,
    pub height: L,
    /// Largest minus smallest stored texel of all cells around.
    pub range: L,
}

/// What became of the chords.
pub struct Fates {
    /// Lanes in which nothing is crossed.
    pub clear: u32,
    /// Lanes whose first crossing is certain: signs at both ends of one cell that differ by more than f may be off.
    pub certain: u32,
    /// Where that cell begins on the chord, and how far it goes.
    pub start: [f32; LANES],
    pub length: [f32; LANES],
    /// f over it.
    pub f: [[f32; LANES]; 3],
}

/// A cell that waits to be weighed.
#[derive(Clone, Copy)]
struct Cell<L> {
    start: L,
    length: L,
    f: [L; 3],
    /// The steepest slope of this cell and of the one before.
    slope: L,
    /// Distance of its ends from corners.
    apart: L,
}

impl<L: Lanes> Chords<L> {
    /// Walks the chords in some lanes, each up to its first cell that is not surely clear.
    #[inline(always)]
    pub fn walk(&self, grid: &Grid<'_>, base: [f32; 2], lanes: u32) -> Fates {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let [x0, y0, h0] = self.from;
        let [x1, y1, h1] = self.to;
        let (dx, dy, dh) = (x1 - x0, y1 - y0, h1 - h0);
        let (i0, j0) = (x0.floor(), y0.floor());
        // Positions relative to the first cell: few digits before the point.
        let (x0, y0) = (x0 - i0, y0 - j0);
        let (per_x, per_y) = (one / not_zero(dx), one / not_zero(dy));
        let (step_x, step_y) = (
            dx.select_negative(zero - one, one),
            dy.select_negative(zero - one, one),
        );
        // The line of its cell through which a chord leaves: the right and upper one, or the left and lower one.
        let (ahead_x, ahead_y) = (step_x.max(zero), step_y.max(zero));
        let (column, row) = (i0 + L::splat(base[0]), j0 + L::splat(base[1]));
        let last = [
            x1.floor() + L::splat(base[0]),
            y1.floor() + L::splat(base[1]),
        ];
        let held = holds(grid, [column, row], last, lanes);
        let near = self.place + L::splat(NUDGE);
        let wide = (near + near).mul_add(self.range, self.height);

        let mut fates = Fates {
            clear: 0,
            certain: 0,
            start: [0.0; LANES],
            length: [0.0; LANES],
            f: [[0.0; LANES]; 3],
        };
        // The cell, from the first one; where the chord enters it, and how far from a corner.
        let (mut i, mut j, mut start) = (zero, zero, zero);
        let mut apart = x0.min(one - x0).min(y0.min(one - y0));
        let mut waiting = Cell {
            start,
            length: zero,
            f: [L::splat(f32::INFINITY), zero, zero],
            slope: zero,
            apart: one,
        };
        let mut last_slope = zero;
        let mut active = lanes;
        let mut ended = 0;
        for _ in 0..MOST_CELLS as usize + 2 {
            let leaves_x = (i + ahead_x - x0) * per_x;
            let leaves_y = (j + ahead_y - y0) * per_y;
            let leaves = leaves_x.min(leaves_y);
            let end = leaves.min(one);
            let length = (end - start).max(zero);
            let (fx, fy) = (start.mul_add(dx, x0) - i, start.mul_add(dy, y0) - j);
            let (mx, my) = (length * dx, length * dy);
            let corners = if held {
                L::cell_corners(grid, column + i, row + j)
            } else {
                grid.corners(column + i, row + j)
            };
            let h = start.mul_add(dh, h0);
            let (f, slope) = over_cell(corners, [fx, fy], [mx, my], [h, length * dh]);

            // The last cell can be weighed now.
            let next_slope = L::choose(ended, zero, slope);
            let off = waiting.slope.max(next_slope).mul_add(near, self.height);
            let off = (waiting.apart - (near + near)).select_negative(wide, off);
            let found = may_cross(waiting.f, off) & active;
            if found != 0 {
                let [f0, f1, f2] = waiting.f;
                let f1_end = f0 + f1 + f2;
                let unsure = (f0.abs() - off).sign_mask() | (f1_end.abs() - off).sign_mask();
                fates.certain |= found & !unsure & (f0.sign_mask() ^ f1_end.sign_mask());
                keep(&mut fates.start, waiting.start, found);
                keep(&mut fates.length, waiting.length, found);
                keep(&mut fates.f[0], f0, found);
                keep(&mut fates.f[1], f1, found);
                keep(&mut fates.f[2], f2, found);
            }
            active &= !found;
            fates.clear |= active & ended;
            active &= !ended;
            if active == 0 {
                break;
            }

            let (gone_x, gone_y) = (fx + mx, fy + my);
            let (apart_x, apart_y) = (gone_x.min(one - gone_x), gone_y.min(one - gone_y));
            let by_x = leaves_x - leaves_y;
            let goes_on = leaves - one;
            let apart_end = by_x.select_negative(apart_y, apart_x);
            let apart_end = goes_on.select_negative(apart_end, apart_x.min(apart_y));
            waiting = Cell {
                start,
                length,
                f,
                slope: slope.max(last_slope),
                apart: apart.min(apart_end),
            };
            ended = !goes_on.sign_mask();
            i = by_x.select_negative(i + step_x, i);
            j = by_x.select_negative(j, j + step_y);
            (start, apart, last_slope) = (end, apart_end, slope);
        }
        fates
    }
}

/// Stores some lanes.
#[inline(always)]
fn keep<L: Lanes>(row: &mut [f32; LANES], value: L, lanes: u32) {
    *row = L::choose(lanes, value, L::from_array(*row)).to_array();
}

#[inline(always)]
fn not_zero<L: Lanes>(d: L) -> L {
    const LEAST: f32 = 1e-12;
    let least = d.select_negative(L::splat(-LEAST), L::splat(LEAST));
    (d.abs() - L::splat(LEAST)).select_negative(least, d)
}

/// Whether the cells between two points of all `lanes` lie within the stored map.
#[inline(always)]
fn holds<L: Lanes>(grid: &Grid<'_>, from: [L; 2], to: [L; 2], lanes: u32) -> bool {
    let zero = L::splat(0.0);
    let (mut low, mut high) = ([0.0; 2], [0.0; 2]);
    for axis in 0..2 {
        let (a, b) = (
            L::choose(lanes, from[axis].min(to[axis]), L::splat(f32::INFINITY)),
            L::choose(
                lanes,
                from[axis].max(to[axis]),
                zero - L::splat(f32::INFINITY),
            ),
        );
        low[axis] = -(zero - a).max_lane();
        high[axis] = b.max_lane();
    }
    grid.holds(low, high)
}
