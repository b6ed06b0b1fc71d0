//! Eight arcs of eight rays through one prism, walked side by side.
//!
//! Every lane goes along its own arc by steps of its own: a step whose box lies wholly above or below the surface's range
//! is done with, one that does not is cut, until it is a chord. Chords are [walked](super::chords) cell by cell, up to the
//! first that may be crossed. So far nothing is decided, only excluded; what is left is decided as for single rays.

use super::arcs::{Arcs, Places};
use super::cells::{Chord, MOST_CELLS, Off, root};
use super::chords::{Chords, Fates};
use super::landing::{Guess, land_four};
use super::signs::Signs;
use super::span::{CLOSE, SHORTEST, Walker};
use super::{Found, Problem, Search};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Grid, LANES, Lanes, Task};

/// Rounds of steps. Who is not done by then goes on alone.
const MOST_ROUNDS: u32 = 256;

/// The first step, and what a step that does not exclude is cut to.
const SMALLER: f32 = 0.25;

/// How many times longer the next step is behind two that exclude.
const LARGER: f32 = 2.0;

/// The first crossings on the arcs in some lanes, or any. Every lane has its problem, its ray's frame, and the ray parameter that is its
/// arc's point of reference.
#[inline(always)]
pub fn search_arcs<L: Lanes>(
    problems: &[Problem<'_>; LANES],
    frames: &[RayFrame; LANES],
    times: &[f64; LANES],
    arcs: &Arcs,
    lanes: u32,
) -> [Option<Found>; LANES] {
    L::outline(Abreast {
        problems,
        frames,
        times,
        arcs,
        lanes,
    })
}

struct Abreast<'a> {
    problems: &'a [Problem<'a>; LANES],
    frames: &'a [RayFrame; LANES],
    times: &'a [f64; LANES],
    arcs: &'a Arcs,
    lanes: u32,
}

impl<L: Lanes> Task<L> for Abreast<'_> {
    type Output = [Option<Found>; LANES];

    #[inline(always)]
    fn run(self) -> [Option<Found>; LANES] {
        let Self {
            problems,
            frames,
            times,
            arcs,
            lanes,
        } = self;
        let first = lanes.trailing_zeros() as usize % LANES;
        let map = problems[0].surface.map();
        let texel = problems[0]
            .cluster
            .first_texel(problems[0].lane, map)
            .to_array();
        let walker = |lane: usize| Walker::new(&problems[lane], arcs, lane, texel, times[lane]);
        let mut walkers = [walker(first); LANES];
        for (lane, own) in walkers.iter_mut().enumerate().skip(first + 1) {
            if lanes >> lane & 1 != 0 {
                *own = walker(lane);
            }
        }
        let mut whole = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            [whole[0][lane], whole[1][lane]] = walkers[lane].whole;
        }
        let Walker {
            origin,
            base,
            midlevel,
            grid,
            ..
        } = walkers[0];
        let reference = [L::splat(origin[0]), L::splat(origin[1]), L::splat(midlevel)];
        let places = arcs.places::<L>();
        let (from, to) = (L::from_array(whole[0]), L::from_array(whole[1]));
        let at = places.at(from, reference);
        let mut team = Team {
            problems,
            frames,
            arcs,
            walkers,
            grid,
            base,
            reference,
            places,
            bend: L::from_array(arcs.bend),
            height_bend: L::from_array(arcs.height_bend),
            rounding: L::from_array(arcs.rounding),
            height_rounding: L::from_array(arcs.height_rounding),
            to,
            s: from,
            at,
            step: (to - from) * L::splat(SMALLER),
            end: from,
            at_end: at,
            range: from,
            signs: [None; LANES],
            found: [None; LANES],
            guesses: [None; LANES],
            walking: lanes,
            cleared: 0,
            rounds: 0,
        };
        while team.walking != 0 {
            let ready = team.step_to_chords();
            team.walk_chords(ready);
        }
        team.land_all();
        team.found
    }
}

/// Eight walks.
struct Team<'a, L: Lanes> {
    problems: &'a [Problem<'a>; LANES],
    frames: &'a [RayFrame; LANES],
    arcs: &'a Arcs,
    walkers: [Walker<'a>; LANES],
    grid: Grid<'a>,
    base: [f32; 2],
    reference: [L; 3],
    places: Places<L>,
    bend: L,
    height_bend: L,
    rounding: L,
    height_rounding: L,
    /// Where arcs end.
    to: L,
    /// Up to where nothing is crossed, and (x, y, h) there.
    s: L,
    at: [L; 3],
    /// What is to be looked at next.
    step: L,
    /// The end of the last step, (x, y, h) there, and the largest minus the smallest stored texel around the step.
    end: L,
    at_end: [L; 3],
    range: L,
    signs: [Option<Signs<'a, L::Quad>>; LANES],
    found: [Option<Found>; LANES],
    /// Crossings that are certain, of lanes that are done.
    guesses: [Option<Guess>; LANES],
    /// Lanes that are not done.
    walking: u32,
    /// Lanes whose last step was clear.
    cleared: u32,
    rounds: u32,
}

impl<'a, L: Lanes> Team<'a, L> {
    /// Goes on until every lane that is not done has a chord as its next step: these lanes.
    #[inline(always)]
    fn step_to_chords(&mut self) -> u32 {
        let (base_x, base_y) = (L::splat(self.base[0]), L::splat(self.base[1]));
        let base_off = L::splat(4.0 * f32::EPSILON * self.base[0].abs().max(self.base[1].abs()));
        let mut ready = 0;
        // Lanes that are ready stay where they are, and do the same again.
        while self.walking & !ready != 0 && self.rounds < MOST_ROUNDS {
            self.rounds += 1;
            let end = (self.s + self.step).min(self.to);
            let [x0, y0, h0] = self.at;
            let [x1, y1, h1] = self.places.at(end, self.reference);
            let length = end - self.s;
            let squared = length * length;
            let off = self.bend.mul_add(squared, self.rounding) + base_off;
            let height_off = self.height_bend.mul_add(squared, self.height_rounding);
            let (left, right) = (x0.min(x1) - off, x0.max(x1) + off);
            let (bottom, top) = (y0.min(y1) - off, y0.max(y1) + off);
            let [low, high] = self.grid.block_ranges(
                (right - left).max(top - bottom) + base_off,
                [base_x + left, base_x + right],
                [base_y + bottom, base_y + top],
            );
            let above = (high - (h0.min(h1) - height_off)).sign_mask();
            let below = ((h0.max(h1) + height_off) - low).sign_mask();
            let cells = (x1.floor() - x0.floor()).abs() + (y1.floor() - y0.floor()).abs();
            let is_chord = !(L::splat(CLOSE) - self.bend * squared).sign_mask()
                & !(L::splat(MOST_CELLS - 1.0) - cells).sign_mask();
            let is_least = (length - L::splat(SHORTEST)).sign_mask();
            let clear = (above | below) & self.walking & !ready;
            ready |= self.walking & !clear & (is_chord | is_least);
            let smaller = self.walking & !clear & !ready;
            // What two steps in a row have shown to be clear is likely to go on.
            let larger = clear & self.cleared;
            self.cleared = clear;
            let next = L::choose(larger, length * L::splat(LARGER), self.step);
            self.step = L::choose(smaller, length * L::splat(SMALLER), next);
            (self.end, self.at_end, self.range) = (end, [x1, y1, h1], high - low);
            self.pass(clear);
        }
        ready
    }

    /// Takes some lanes to the end of their step.
    #[inline(always)]
    fn pass(&mut self, lanes: u32) {
        for axis in 0..3 {
            self.at[axis] = L::choose(lanes, self.at_end[axis], self.at[axis]);
        }
        self.s = L::choose(lanes, self.end, self.s);
        self.walking &= !(lanes & !(self.end - self.to).sign_mask());
    }

    /// Walks the chords of some lanes. Lanes that have not come to a chord by now go on alone.
    #[inline(always)]
    fn walk_chords(&mut self, ready: u32) {
        let length = self.end - self.s;
        let short = (length - L::splat(SHORTEST)).sign_mask();
        let at_chord = ready & !short;
        self.each_alone(self.walking & !at_chord);
        if at_chord == 0 {
            return;
        }
        let squared = length * length;
        let chords = Chords {
            from: self.at,
            to: self.at_end,
            place: self.bend.mul_add(squared, self.rounding),
            height: self.height_bend.mul_add(squared, self.height_rounding),
            range: self.range,
        };
        let fates = chords.walk(&self.grid, self.base, at_chord);
        let mut waiting = at_chord & !fates.clear;
        if waiting != 0 {
            let rows = Rows {
                s: [self.s.to_array(), self.end.to_array()],
                from: rows3(self.at),
                to: rows3(self.at_end),
                off: rows3([chords.place, chords.height, chords.range]),
            };
            while waiting != 0 {
                let lane = waiting.trailing_zeros() as usize % LANES;
                waiting &= waiting - 1;
                if !(fates.certain >> lane & 1 != 0 && self.land(lane, &rows, &fates)) {
                    self.look(lane, &rows.chord(lane));
                }
            }
        }
        self.pass(at_chord);
    }

    /// Ends a lane at a crossing that is certain, where it can: it is [landed](Self::land_all) with the others.
    #[inline(always)]
    fn land(&mut self, lane: usize, rows: &Rows, fates: &Fates) -> bool {
        if self.signs[lane].is_some() {
            return false;
        }
        let (walker, problem) = (&self.walkers[lane], &self.problems[lane]);
        let (start, length) = (fates.start[lane], fates.length[lane]);
        let f = [fates.f[0][lane], fates.f[1][lane], fates.f[2][lane]];
        let [from, to] = [rows.s[0][lane], rows.s[1][lane]];
        let s = |tau: f32| from + tau.clamp(0.0, 1.0) * (to - from);
        let Some(times) = walker.surely_within(s(start), s(start + length)) else {
            return false;
        };
        if problem.any {
            self.end_with(lane, Some(Found::ANY));
            return true;
        }
        let guess = walker.guess(
            s(start + length * root(f[0], f[1], f[2])),
            times,
            f[0] > 0.0,
        );
        self.guesses[lane] = Some(guess);
        self.end_with(lane, None);
        true
    }

    /// Lands at all crossings that are certain.
    #[inline(always)]
    fn land_all(&mut self) {
        let patch = self.problems[0].patch();
        let (frames, guesses) = (self.frames.as_chunks().0, self.guesses.as_chunks().0);
        for half in 0..LANES / 4 {
            let landed = land_four::<L::Quad>(&patch, &frames[half], &guesses[half]);
            for k in 0..4 {
                let lane = 4 * half + k;
                if self.guesses[lane].is_none() {
                    continue;
                }
                let problem = &self.problems[lane];
                self.found[lane] = match landed[k] {
                    Some(landed) => problem.accepts(landed.t).then_some(landed),
                    None => L::outline(Search {
                        problem,
                        frame: &self.frames[lane],
                    }),
                };
            }
        }
    }

    /// Ends a lane.
    #[inline(always)]
    fn end_with(&mut self, lane: usize, found: Option<Found>) {
        self.found[lane] = found;
        self.walking &= !(1 << lane);
    }

    /// Looks at a lane's chord as for a single ray.
    #[inline(always)]
    fn look(&mut self, lane: usize, chord: &Chord) {
        let mut signs = self.signs_of(lane);
        chord.walk::<L>(&self.grid, self.base, &self.walkers[lane], &mut signs);
        self.signs[lane] = Some(signs);
        if signs.is_near_side() || signs.is_done() {
            self.settle(lane, &signs);
        }
    }

    /// Walks the rest of some arcs as for single rays.
    #[inline(always)]
    fn each_alone(&mut self, mut lanes: u32) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let mut walker = self.walkers[lane];
            walker.whole[0] = self.s.to_array()[lane];
            let mut signs = self.signs_of(lane);
            walker.walk::<L>(&mut signs);
            self.settle(lane, &signs);
        }
    }

    /// What has been seen along a lane's arc.
    #[inline(always)]
    fn signs_of(&self, lane: usize) -> Signs<'a, L::Quad> {
        if let Some(signs) = self.signs[lane] {
            return signs;
        }
        let mut signs = Signs::new(&self.problems[lane], &self.frames[lane]);
        let [from, to] = &self.arcs.w;
        signs.set_arc([from[lane].into(), to[lane].into()]);
        signs
    }

    /// Ends a lane with what has been seen.
    #[inline(always)]
    fn settle(&mut self, lane: usize, signs: &Signs<'a, L::Quad>) {
        let found = if signs.is_near_side() {
            L::outline(Search {
                problem: &self.problems[lane],
                frame: &self.frames[lane],
            })
        } else {
            signs.nearest()
        };
        self.end_with(lane, found);
    }
}

/// Chords lane by lane.
struct Rows {
    /// Parameters, and (x, y, h), at both ends.
    s: [[f32; LANES]; 2],
    from: [[f32; LANES]; 3],
    to: [[f32; LANES]; 3],
    /// As in [`Off`].
    off: [[f32; LANES]; 3],
}

impl Rows {
    #[inline(always)]
    fn chord(&self, lane: usize) -> Chord {
        let point = |[x, y, h]: &[[f32; LANES]; 3]| [x[lane], y[lane], h[lane]];
        let (from, to) = (point(&self.from), point(&self.to));
        let [place, height, range] = point(&self.off);
        Chord {
            from,
            to,
            cells: [
                [from[0].floor(), from[1].floor()],
                [to[0].floor(), to[1].floor()],
            ],
            s: [self.s[0][lane], self.s[1][lane]],
            off: Off {
                place,
                height,
                range,
            },
        }
    }
}

#[inline(always)]
fn rows3<L: Lanes>([a, b, c]: [L; 3]) -> [[f32; LANES]; 3] {
    [a.to_array(), b.to_array(), c.to_array()]
}
