//! Level of detail: a search ends where it knows the first crossing to half a footprint.
//!
//! Children of a span that are wholly above or below the surface say on which side the ray is at their ends. If the ray is above
//! the surface before a run of other children and below it behind them, or the other way round, it crosses the surface in the run, and
//! for the first time: all before was looked at. Where the run is short enough and surely inside the prism its middle is the hit, and no
//! texel is read. So no ray is lost and none is caught. What cannot be told so is walked as exactly as ever, but for where in its cell a
//! crossing is that f32 is certain of.

use super::Found;
use super::children::{Ends, at};
use super::signs::Signs;
use super::span::Walker;
use crate::prism::simd::Quad;

/// Whether an arc begins and ends above the surface, where it begins or ends at the smallest or largest w of the prism: the whole
/// surface is between those, and an end that was rounded to beside them is none. What is before the ray's interval is not looked at, so that where that begins later, the beginning tells
/// nothing.
#[inline(always)]
pub fn caps(walker: &Walker<'_>) -> [Option<bool>; 2] {
    let problem = walker.problem;
    let [low, high] = problem.cluster.offsets(problem.lane);
    let high_is_above = problem.surface.displacement().scale > 0.0;
    let side = |s: f32, w: f32| {
        if !walker.is_inside(s, s) {
            None
        } else if w == high {
            Some(high_is_above)
        } else if w == low {
            Some(!high_is_above)
        } else {
            None
        }
    };
    let [w0, w1] = walker.offsets();
    let begin = side(0.0, w0).filter(|_| walker.times(0.0)[0] > f64::from(problem.interval[0]));
    [begin, side(1.0, w1)]
}

/// Ends the search on an arc that goes through all of the surface's range, if it is short enough.
#[inline(always)]
pub fn through<Q: Quad>(walker: &Walker<'_>, signs: &mut Signs<'_, Q>) -> bool {
    match walker.caps {
        [Some(before), Some(behind)] if before != behind => {
            ends_in(walker, [0.0, 1.0], 0.5, before, signs)
        }
        _ => false,
    }
}

/// Ends the search at a point of a part of an arc that is known to be crossed for the first time, coming from above or not, if that is as
/// good as the crossing.
#[inline(always)]
pub fn ends_in<Q: Quad>(
    walker: &Walker<'_>,
    [from, to]: [f32; 2],
    point: f32,
    above: bool,
    signs: &mut Signs<'_, Q>,
) -> bool {
    let problem = walker.problem;
    let ([start, _], [_, end]) = (walker.times(from), walker.times(to));
    let [low, high] = walker.times(point);
    let most = 0.5 * f64::from(problem.spread) * start;
    let is_good = problem.is_ordered()
        && start > f64::from(problem.interval[0])
        && (high - start).max(end - low) <= most
        && walker.is_inside(from, to);
    if is_good {
        let [u, v] = walker.uv(point);
        signs.end_with(Found {
            t: 0.5 * (low + high),
            u,
            v,
            above,
            ng: None,
        });
    }
    is_good
}

/// Ends the search in the first run of children that may meet the surface, if that is short enough and crosses it; or says that it does not.
#[inline(always)]
pub fn settle<Q: Quad>(
    walker: &Walker<'_>,
    ends: &Ends,
    alive: u32,
    span: [f32; 2],
    signs: &mut Signs<'_, Q>,
) -> bool {
    let apart = ends.above | ends.below;
    let first = apart.trailing_ones() as usize;
    // By the surface alone, not by the ray's interval: a hit must not depend on what was met before.
    if first >= ends.children || alive >> first & 1 == 0 {
        return false;
    }
    let last = first
        + (apart >> first)
            .trailing_zeros()
            .min((ends.children - first) as u32) as usize;
    let is_above = |child: usize| ends.above >> child & 1 != 0;
    let before = match first {
        // Nothing has been crossed since the last point, or since the arc began.
        0 => signs.is_above().or(walker.caps[0]),
        _ => Some(is_above(first - 1)),
    };
    let behind = if last < ends.children {
        Some(is_above(last))
    } else if span[1] == 1.0 {
        walker.caps[1]
    } else {
        None
    };
    let (Some(before), Some(behind)) = (before, behind) else {
        return false;
    };
    let run = [
        at(span, first, ends.children),
        at(span, last, ends.children),
    ];
    before != behind && ends_in(walker, run, 0.5 * (run[0] + run[1]), before, signs)
}
