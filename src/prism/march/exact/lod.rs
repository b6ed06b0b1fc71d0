//! Level of detail: a search ends where it knows the first crossing to half a footprint.
//!
//! Children of a span that are wholly above or below the surface say on which side the ray is at their ends. If the ray is above
//! the surface before a run of other children and below it behind them, or the other way round, it crosses the surface in the run, and
//! for the first time: all before was looked at. Where the run is short enough its middle is the hit, and no texel is read. So no ray
//! is lost and none is caught, and what cannot be told so is walked as exactly as ever.

use super::children::{Ends, at};
use super::signs::Signs;
use super::{Found, Problem};
use crate::prism::curve::{Curve, End, Stretch};
use crate::prism::simd::Quad;

/// Whether the curve begins and ends above the surface, where a stretch begins or ends at the smallest or largest w of the prism: the whole
/// surface is between those. `t` is the ray's parameter at both ends; what is before the ray's interval is not looked at, so that
/// where that begins later, the beginning tells nothing.
#[inline(always)]
pub fn caps<Q: Quad>(
    problem: &Problem<'_>,
    stretch: &Stretch,
    curve: &Curve<Q>,
    t: [f64; 2],
) -> [Option<bool>; 2] {
    let high_is_above = problem.surface.displacement().scale > 0.0;
    let side = |k: usize| match stretch.ends[k] {
        End::Cap => Some((k == 1) == high_is_above),
        End::Side(_) => None,
    };
    // The curve runs in the order of t, the stretch in that of w.
    let [begin, end] = if curve.w[1] > 0.0 {
        [side(0), side(1)]
    } else {
        [side(1), side(0)]
    };
    [begin.filter(|_| t[0] > f64::from(problem.interval[0])), end]
}

/// The hit on a curve that goes through all of the surface's range, if it is short enough.
#[inline(always)]
pub fn through<Q: Quad>(
    problem: &Problem<'_>,
    curve: &Curve<Q>,
    caps: [Option<bool>; 2],
) -> Option<Found> {
    match caps {
        [Some(before), Some(behind)] if before != behind && problem.is_ordered() => {
            middle(problem, curve, [0.0, 1.0], before)
        }
        _ => None,
    }
}

/// The middle of a part of a curve that is known to cross the surface, coming from above or not, if that is as good as the crossing.
#[inline(always)]
fn middle<Q: Quad>(
    problem: &Problem<'_>,
    curve: &Curve<Q>,
    [from, to]: [f64; 2],
    above: bool,
) -> Option<Found> {
    let ([start, ..], [end, ..]) = (curve.seen(from), curve.seen(to));
    let [t, u, v] = curve.seen(0.5 * (from + to));
    let most = 0.5 * f64::from(problem.spread) * start;
    let is_good = start > f64::from(problem.interval[0]) && (t - start).max(end - t) <= most;
    is_good.then_some(Found {
        t,
        u,
        v,
        above,
        ng: None,
    })
}

/// Ends the search in the first run of children that may meet the surface, if that is short enough and crosses it; or says that it does not.
#[inline(always)]
pub fn settle<Q: Quad>(
    problem: &Problem<'_>,
    caps: [Option<bool>; 2],
    ends: &Ends,
    alive: u32,
    span: [f32; 2],
    signs: &mut Signs<'_, Q>,
) -> bool {
    let apart = ends.above | ends.below;
    let first = apart.trailing_ones() as usize;
    // By the surface alone, not by the ray's interval: a hit must not depend on what was met before.
    if first >= ends.children || alive >> first & 1 == 0 || !problem.is_ordered() {
        return false;
    }
    let last = first
        + (apart >> first)
            .trailing_zeros()
            .min((ends.children - first) as u32) as usize;
    let is_above = |child: usize| ends.above >> child & 1 != 0;
    let before = match first {
        // Nothing has been crossed since the last point, or since the curve began.
        0 => signs.is_above().or(caps[0]),
        _ => Some(is_above(first - 1)),
    };
    let behind = if last < ends.children {
        Some(is_above(last))
    } else if span[1] == 1.0 {
        caps[1]
    } else {
        None
    };
    let (Some(before), Some(behind)) = (before, behind) else {
        return false;
    };
    if before == behind {
        return false;
    }
    let from = f64::from(at(span, first, ends.children));
    let to = f64::from(at(span, last, ends.children));
    match middle(problem, &signs.curve(), [from, to], before) {
        Some(found) => {
            signs.end_with(found);
            true
        }
        None => false,
    }
}
