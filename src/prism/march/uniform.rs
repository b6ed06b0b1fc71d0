//! The paper's march: equal steps along the ray (its Section 4), eight at once.
//!
//! The samples are the entry, then every step from `entry + R step`, then the exit; R = 1, or random in (0, 1]
//! with thin-feature sampling. Where the height above the surface changes sign between two samples, in either
//! direction, there is a root; it is cut down by eight samples more, then polished on S. A crossing that turns out
//! to be beyond the base triangle, or out of the ray's interval, does not end the march.

use glam::{DVec3, Vec3};

use super::Step;
use super::polish::Crossing;
use crate::prism::path::{HeightUnits, Path};
use crate::prism::simd::{Grid, LANES, Lanes};

/// No march takes more steps in one prism than this, however small the step.
const MOST_STEPS: f32 = 1_048_576.0;

/// What is marched: the path, and the heights it is compared with.
pub struct Field<'a> {
    /// The ray's path.
    pub path: &'a Path,
    /// Units of height.
    pub heights: &'a HeightUnits,
    /// The map.
    pub grid: &'a Grid<'a>,
    /// |n_i - n_j|^2, see [`Path::above`].
    pub spread: Vec3,
}

/// Where the samples lie.
pub struct Stepping {
    /// Step length.
    pub step: Step,
    /// Length of the ray's direction.
    pub speed: f32,
    /// R, in (0, 1].
    pub first: f32,
    /// No sample is needed well beyond this parameter of the path.
    pub limit: f32,
}

/// Heights above the surface at eight parameters.
struct Batch<L> {
    s: L,
    u: L,
    v: L,
    above: L,
}

impl Field<'_> {
    /// Looks for crossings in `[from, to]`, in order, until `accept` takes one.
    #[inline(always)]
    pub fn march<L: Lanes, H>(
        &self,
        [from, to]: [f32; 2],
        stepping: &Stepping,
        mut accept: impl FnMut(Crossing) -> Option<H>,
    ) -> Option<H> {
        let steps = self.steps::<L>(from, to, stepping);
        let step = (to - from) / steps;
        // Sample k is at from + (k - 1 + R) step, held to the interval: sample 0 is the entry, the last the exit.
        let last = if stepping.first < 1.0 {
            steps + 1.0
        } else {
            steps
        };
        let mut before: Option<(f32, bool)> = None;
        let mut k = 0.0;
        // Polishing may end up to a step before the bracket.
        let wanted =
            |before: Option<(f32, bool)>| before.is_none_or(|(s, _)| s - step <= stepping.limit);
        while k <= last && wanted(before) {
            let s = (lane_numbers::<L>() + L::splat(k - 1.0 + stepping.first))
                .mul_add(L::splat(step), L::splat(from))
                .max(L::splat(from))
                .min(L::splat(to));
            let batch = self.batch(s);
            let below = batch.above.sign_mask();
            let carry = before.map_or(below & 1, |(_, below)| u32::from(below));
            let mut changes = (below ^ (below << 1 | carry)) & 0xff;
            if changes != 0 {
                let s = s.to_array();
                while changes != 0 {
                    let lane = changes.trailing_zeros() as usize;
                    changes &= changes - 1;
                    let s0 = if lane > 0 {
                        s[lane - 1]
                    } else {
                        before.map_or(from, |(s, _)| s)
                    };
                    if let Some(hit) = accept(self.narrow::<L>(s0, s[lane])) {
                        return Some(hit);
                    }
                }
            }
            let end = k + (LANES - 1) as f32;
            before = Some((
                (end - 1.0 + stepping.first).mul_add(step, from).min(to),
                below >> 7 != 0,
            ));
            k += LANES as f32;
        }
        None
    }

    /// Number of steps over `[from, to]`.
    #[inline(always)]
    fn steps<L: Lanes>(&self, from: f32, to: f32, stepping: &Stepping) -> f32 {
        let steps = match stepping.step {
            Step::World(length) => (to - from) * self.path.dt * stepping.speed / length,
            Step::Texels(length) => {
                let samples = self.path.sample(spaced::<L>(from, to));
                let (x, y) = self.path.texel(samples.u, samples.v);
                (LANES - 1) as f32 * longest_leg(x, y) / length
            }
        };
        // NaN too becomes 1.
        if steps > 1.0 {
            steps.ceil().min(MOST_STEPS)
        } else {
            1.0
        }
    }

    #[inline(always)]
    fn batch<L: Lanes>(&self, s: L) -> Batch<L> {
        let samples = self.path.sample(s);
        let above = self
            .path
            .above(samples, self.heights, self.grid, self.spread);
        Batch {
            s,
            u: samples.u,
            v: samples.v,
            above,
        }
    }

    /// Cuts a crossing down to a seventh, and guesses where it is by the secant.
    #[inline(always)]
    fn narrow<L: Lanes>(&self, s0: f32, s1: f32) -> Crossing {
        let batch = self.batch(spaced::<L>(s0, s1));
        let below = batch.above.sign_mask();
        let changes = (below ^ (below >> 1)) & 0x7f;
        // Rounding may have moved the crossing beyond an end: then the whole stretch is the bracket.
        let (a, b) = match changes {
            0 => (0, LANES - 1),
            _ => (
                changes.trailing_zeros() as usize,
                changes.trailing_zeros() as usize + 1,
            ),
        };
        let (s, u, v) = (batch.s.to_array(), batch.u.to_array(), batch.v.to_array());
        let above = batch.above.to_array();
        let part = above[a] / (above[a] - above[b]);
        let part = if part.is_finite() {
            part.clamp(0.0, 1.0)
        } else {
            0.5
        };
        let between = |x: [f32; LANES]| f64::from(x[a] + part * (x[b] - x[a]));
        let t = |s: f64| f64::from(self.path.t0) + s * f64::from(self.path.dt);
        Crossing {
            t: [t(s[a].into()), t(s[b].into())],
            guess: DVec3::new(between(u), between(v), t(between(s))),
        }
    }
}

#[inline(always)]
fn lane_numbers<L: Lanes>() -> L {
    L::from_array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
}

/// Eight parameters, both ends among them.
#[inline(always)]
fn spaced<L: Lanes>(from: f32, to: f32) -> L {
    let step = (to - from) / (LANES - 1) as f32;
    lane_numbers::<L>()
        .mul_add(L::splat(step), L::splat(from))
        .min(L::splat(to))
}

/// The longest of the seven legs between eight points.
#[inline(always)]
fn longest_leg<L: Lanes>(x: L, y: L) -> f32 {
    let (dx, dy) = (x.next() - x, y.next() - y);
    dx.mul_add(dx, dy * dy).max_lane().sqrt()
}
