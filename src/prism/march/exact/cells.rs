//! The texel cells under a short chord of the curve, one lane each, solved in closed form.
//!
//! Along a chord (x, y, h) is linear, and in one cell the surface is bilinear in (x, y): f = h - D is a quadratic in the
//! chord's parameter. Lane 0 is the cell in which the chord starts; every other lane is the cell entered by one crossing of a
//! texel line, in no order: it leaves at the next line. A lane in which |f| provably stays above what the chord may be
//! off is done with; f64 looks at the others, in order.

use super::lod;
use super::signs::{Side, Signs};
use super::span::Walker;
use crate::prism::simd::{Grid, LANES, Lanes};

/// Registers of lanes.
const BATCHES: usize = 2;

/// Most cells of a chord: one lane each.
pub const MOST_CELLS: f32 = (BATCHES * LANES) as f32;

/// A chord that is this close to a texel line, in texels, has crossed it: so that a corner between two lanes, each off by a
/// rounding, is in both rather than in none.
pub const NUDGE: f32 = 1.0 / 8192.0;

/// A straight piece of the curve over at most [`MOST_CELLS`] cells.
pub struct Chord {
    /// (x, y, h) at both ends; x, y relative to the curve's base, h in stored texel units.
    pub from: [f32; 3],
    pub to: [f32; 3],
    /// The cells that both ends are in.
    pub cells: [[f32; 2]; 2],
    /// The curve's parameter there.
    pub s: [f32; 2],
    pub off: Off,
}

/// How far the curve may be from a chord.
#[derive(Clone, Copy)]
pub struct Off {
    /// In x and in y, texels.
    pub place: f32,
    /// In h, stored texel units.
    pub height: f32,
    /// Largest minus smallest stored texel of all cells around.
    pub range: f32,
}

/// One number for every lane of every batch.
type Row = [[f32; LANES]; BATCHES];

/// The lanes' stretches and quadratics.
struct Cells {
    /// The chord's parameter where the lane begins, and how far it goes.
    start: Row,
    length: Row,
    /// f over the lane's own parameter in [0, 1].
    f: [Row; 3],
    /// How far f may be off.
    off: Row,
}

const ZEROS: Row = [[0.0; LANES]; BATCHES];

impl Chord {
    /// Reports the cells that may be crossed.
    #[inline(always)]
    pub fn walk<L: Lanes>(
        &self,
        grid: &Grid<'_>,
        base: [f32; 2],
        walker: &Walker<'_>,
        signs: &mut Signs<'_, L::Quad>,
    ) {
        let [[i0, j0], [i1, j1]] = self.cells;
        let (nx, ny) = ((i1 - i0).abs(), (j1 - j0).abs());
        if nx + ny < LANES as f32 {
            self.walk_in::<L, 1>([nx, ny], grid, base, walker, signs);
        } else {
            self.walk_in::<L, BATCHES>([nx, ny], grid, base, walker, signs);
        }
    }

    /// In so many batches: `[nx, ny]` are the lines of x and of y that are crossed.
    #[inline(always)]
    fn walk_in<L: Lanes, const R: usize>(
        &self,
        [nx, ny]: [f32; 2],
        grid: &Grid<'_>,
        base: [f32; 2],
        walker: &Walker<'_>,
        signs: &mut Signs<'_, L::Quad>,
    ) {
        let [x0, y0, h0] = self.from;
        let [x1, y1, h1] = self.to;
        let [[i0, j0], [i1, j1]] = self.cells;
        let (dx, dy, dh) = (x1 - x0, y1 - y0, h1 - h0);
        // Positions relative to the first cell: few digits before the point.
        let (x0, y0) = (x0 - i0, y0 - j0);
        let inverse = |d: f32| {
            1.0 / if d.abs() < 1e-12 {
                1e-12f32.copysign(d)
            } else {
                d
            }
        };
        let (per_x, per_y) = (inverse(dx), inverse(dy));
        let (step_x, step_y) = (1f32.copysign(dx), 1f32.copysign(dy));
        // The line of its cell through which the chord leaves: the right and upper one, or the left and lower one.
        let (ahead_x, ahead_y) = (step_x.max(0.0), step_y.max(0.0));

        let count = nx + ny + 1.0;
        let held = grid.holds([i0 + base[0], j0 + base[1]], [i1 + base[0], j1 + base[1]]);
        let zero = L::splat(0.0);
        let one = L::splat(1.0);
        // The chord is off by as much, and a cell may be taken for its neighbour within `NUDGE`.
        let near = self.off.place + NUDGE;
        let mut steepest = zero;
        let (mut starts, mut lengths, mut apart) = ([zero; R], [zero; R], [zero; R]);
        let mut quadratics = [[zero; 3]; R];
        for batch in 0..R {
            let first = (batch * LANES) as f32;
            let numbers = L::from_array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) + L::splat(first);
            // Lanes 1 to nx: crossings of x lines; then ny crossings of y lines.
            let line_x = numbers.mul_add(L::splat(step_x), L::splat(ahead_x - step_x));
            let line_y =
                (numbers - L::splat(nx)).mul_add(L::splat(step_y), L::splat(ahead_y - step_y));
            let by_x = (line_x - L::splat(x0)) * L::splat(per_x);
            let by_y = (line_y - L::splat(y0)) * L::splat(per_y);
            let at_x_line = numbers - L::splat(nx + 0.5);
            let begins = at_x_line.select_negative(by_x, by_y);
            let is_first = numbers - L::splat(0.5);
            let start = is_first.select_negative(zero, begins);

            let x = start.mul_add(L::splat(dx), L::splat(x0));
            let y = start.mul_add(L::splat(dy), L::splat(y0));
            let i = (x + L::splat(step_x * NUDGE)).floor();
            let j = (y + L::splat(step_y * NUDGE)).floor();
            let leaves_x = (i + L::splat(ahead_x) - L::splat(x0)) * L::splat(per_x);
            let leaves_y = (j + L::splat(ahead_y) - L::splat(y0)) * L::splat(per_y);
            let leaves = leaves_x.min(leaves_y);
            let length = (leaves.min(one) - start).max(zero);

            let (column, row) = (i + L::splat(i0 + base[0]), j + L::splat(j0 + base[1]));
            let corners = if held {
                L::cell_corners(grid, column, row)
            } else {
                grid.corners(column, row)
            };
            let (fx, fy) = (x - i, y - j);
            let (mx, my) = (length * L::splat(dx), length * L::splat(dy));
            let h = start.mul_add(L::splat(dh), L::splat(h0));
            let (f, slope) = over_cell(corners, [fx, fy], [mx, my], [h, length * L::splat(dh)]);

            // How far the ends are from corners of the cell: see below.
            let (gone_x, gone_y) = (fx + mx, fy + my);
            let (apart_x, apart_y) = (fx.min(one - fx), fy.min(one - fy));
            let begin = at_x_line.select_negative(apart_y, apart_x);
            let begin = is_first.select_negative(apart_x.min(apart_y), begin);
            let (apart_x, apart_y) = (gone_x.min(one - gone_x), gone_y.min(one - gone_y));
            let end = (leaves_x - leaves_y).select_negative(apart_y, apart_x);
            let end = (leaves - one).select_negative(end, apart_x.min(apart_y));
            let unused = L::splat(count - 0.5) - numbers;
            steepest = steepest.max(unused.select_negative(zero, slope));
            (starts[batch], lengths[batch]) = (start, length);
            quadratics[batch] = f;
            apart[batch] = begin.min(end);
        }
        // The curve is in a lane's cell, or in the next or last one, as far as it is from the chord. Where the chord passes a
        // corner closely it may touch cells of which no lane knows.
        let off = L::splat(steepest.max_lane() * near + self.off.height);
        let wide = L::splat(2.0 * near * self.off.range + self.off.height);
        let mut possible = 0;
        let mut offs = apart;
        for batch in 0..R {
            offs[batch] = (apart[batch] - L::splat(2.0 * near)).select_negative(wide, off);
            possible |= may_cross(quadratics[batch], offs[batch]) << (batch * LANES);
        }
        possible &= ((1u64 << count as u32) - 1) as u32;
        if possible == 0 {
            return;
        }
        let mut cells = Cells {
            start: ZEROS,
            length: ZEROS,
            f: [ZEROS; 3],
            off: ZEROS,
        };
        for batch in 0..R {
            cells.start[batch] = starts[batch].to_array();
            cells.length[batch] = lengths[batch].to_array();
            for (row, f) in cells.f.iter_mut().zip(quadratics[batch]) {
                row[batch] = f.to_array();
            }
            cells.off[batch] = offs[batch].to_array();
        }
        self.report::<L>(possible, &cells, walker, signs);
    }

    #[inline(always)]
    fn report<L: Lanes>(
        &self,
        mut possible: u32,
        cells: &Cells,
        walker: &Walker<'_>,
        signs: &mut Signs<'_, L::Quad>,
    ) {
        let (s0, s1) = (f64::from(self.s[0]), f64::from(self.s[1]));
        let s = |tau: f32| s0 + f64::from(tau).clamp(0.0, 1.0) * (s1 - s0);
        while possible != 0 {
            let lane = first(possible, &cells.start);
            possible &= !(1 << lane);
            let (start, length) = (of(&cells.start, lane), of(&cells.length, lane));
            let [f0, f1, f2] = [
                of(&cells.f[0], lane),
                of(&cells.f[1], lane),
                of(&cells.f[2], lane),
            ];
            let end = f0 + f1 + f2;
            // Signs at both ends that differ by more than f may be off: one crossing, whatever else. In all other lanes
            // f64 looks, from where the lane begins to where it ends: what is proven of lanes is proven up to there.
            let sure = |f: f32| f.abs() > of(&cells.off, lane);
            let certain = sure(f0) && sure(end) && (f0 > 0.0) != (end > 0.0);
            let (from, to) = (s(start), s(start + length));
            let root = s(start + length * root(f0, f1, f2));
            // Where exactly in a cell that is smaller than half a footprint is not asked.
            if certain
                && walker.problem.spread > 0.0
                && signs.comes_from(f0 > 0.0)
                && lod::ends_in(
                    walker,
                    [from as f32, to as f32],
                    root as f32,
                    f0 > 0.0,
                    signs,
                )
            {
                return;
            }
            if certain && let Some(times) = walker.surely_within(from as f32, to as f32) {
                if signs.any_will_do() {
                    return signs.found_any();
                }
                if signs.land::<L>(&walker.guess(root as f32, times, f0 > 0.0)) {
                    return;
                }
            }
            // Between the last point and this lane nothing is crossed: only the first lane needs its beginning.
            if signs.is_fresh() {
                let side = if certain { Side::of(f0) } else { Side::Unknown };
                let begin = signs.look::<L>(from, side);
                signs.point::<L>(begin, from);
            }
            if certain {
                signs.point::<L>((to, end > 0.0), root);
            } else {
                signs.look_closely::<L>([from, to], root);
            }
            if signs.is_done() {
                return;
            }
        }
    }
}

/// h - D over a stretch of a cell with these corners, as coefficients of 1, s, s^2 with s from 0 to 1; and the steepest that D
/// is in the cell. The stretch begins at (x, y) in it, with a height, and moves by as much.
#[inline(always)]
pub fn over_cell<L: Lanes>(
    [h00, h10, h01, h11]: [L; 4],
    [x, y]: [L; 2],
    [dx, dy]: [L; 2],
    [h, dh]: [L; 2],
) -> ([L; 3], L) {
    let (bottom, left) = (h10 - h00, h01 - h00);
    let twist = (h11 - h01) - bottom;
    let slope_x = twist.mul_add(y, bottom);
    let slope_y = twist.mul_add(x, left);
    let surface = y.mul_add(left, x.mul_add(slope_x, h00));
    let f1 = slope_y.neg_mul_add(dy, slope_x.neg_mul_add(dx, dh));
    let f2 = (twist * dx).neg_mul_add(dy, L::splat(0.0));
    let slope = bottom.abs().max((bottom + twist).abs()) + left.abs().max((left + twist).abs());
    ([h - surface, f1, f2], slope)
}

/// The lanes in which a quadratic on [0, 1] may come within `off` of 0.
#[inline(always)]
pub fn may_cross<L: Lanes>([f0, f1, f2]: [L; 3], off: L) -> u32 {
    let zero = L::splat(0.0);
    // With the sign at the start made positive.
    let g0 = f0.abs() - off;
    let g1 = f0.select_negative(zero - f1, f1);
    let g2 = f0.select_negative(zero - f2, f2);
    let at_end = g0 + g1 + g2;
    let discriminant = (g0 * L::splat(4.0)).neg_mul_add(g2, g1 * g1);
    let crosses = g0.sign_mask() | at_end.sign_mask();
    // The parabola turns between the ends, upward, and has a root.
    let turns = g1.sign_mask() & !(g1 + g2 + g2).sign_mask() & !discriminant.sign_mask();
    crosses | turns
}

/// The root of f0 + f1 r + f2 r^2 in (0, 1], about, where there is one.
#[inline(always)]
pub fn root(f0: f32, f1: f32, f2: f32) -> f32 {
    let root = (f1 * f1 - 4.0 * f0 * f2).max(0.0).sqrt();
    let q = -0.5 * (f1 + root.copysign(f1));
    let (a, b) = (q / f2, f0 / q);
    if (0.0..=1.0).contains(&a) { a } else { b }
}

#[inline(always)]
fn of(row: &Row, lane: usize) -> f32 {
    row.as_flattened()[lane % (BATCHES * LANES)]
}

/// The lane among `possible` that begins first.
#[inline(always)]
fn first(possible: u32, start: &Row) -> usize {
    let mut best = possible.trailing_zeros() as usize;
    let mut rest = possible & (possible - 1);
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        if of(start, lane) < of(start, best) {
            best = lane;
        }
    }
    best
}
