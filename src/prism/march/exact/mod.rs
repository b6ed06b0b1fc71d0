//! The exact march: the first crossing of the ray and S, without a step.
//!
//! The ray's curve through a prism ([`curve`](crate::prism::curve)) is cut into spans. A span whose box in the map lies
//! wholly above or below the surface's range there, by the map's min/max pyramid, is done with; one that does not is cut
//! again, until it is a few texel cells long, and then each cell is solved ([`cells`]). Fast paths are in f32 lanes and
//! only ever *exclude*: every box, every cell is widened by a proven bound of what the f32 path may be off
//! ([`span::Bounds`]). What is left is decided in f64 on S itself ([`signs`]): the signs of
//! g(s) = w |N'| - D at the ends of what is left say where a root is, and a bracketed Newton iteration finds it. So a spike one texel wide
//! is found, and the number of crossings in a prism has the parity of the signs at its ends, which neighbours share.

mod cells;
mod pieces;
mod signs;
mod span;
mod walls;

use glam::DVec3;

use super::polish::Root;
use crate::prism::curve::{Curve, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Grid, Lanes, Quad, Task};
use crate::surface::Patch;
use pieces::Piece;
use signs::Signs;
use span::Walker;
pub use walls::Walls;

/// The prism, the map, and what is asked of them.
pub struct Problem<'a> {
    /// The prism in f64.
    pub patch: &'a Patch<'a>,
    /// The map as the kernels see it.
    pub grid: &'a Grid<'a>,
    /// Smallest and largest w of the surface.
    pub offsets: [f64; 2],
    /// Whether t is monotone in w: not so in folded prisms, where all crossings are looked for and the nearest kept.
    pub ordered: bool,
    /// Whether any crossing will do.
    pub any: bool,
    /// The open interval of ray parameters.
    pub interval: [f32; 2],
}

impl Problem<'_> {
    fn accepts(&self, t: f64) -> bool {
        let t = t as f32;
        t > self.interval[0] && t < self.interval[1]
    }
}

/// A crossing.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Ray parameter.
    pub t: f64,
    /// Barycentric coordinate of vertex 1.
    pub u: f64,
    /// Barycentric coordinate of vertex 2.
    pub v: f64,
}

/// The first crossing inside a prism, or any.
#[inline(always)]
pub fn search<L: Lanes>(problem: &Problem<'_>, frame: &RayFrame) -> Option<Found> {
    let reach = problem.offsets[0].abs().max(problem.offsets[1].abs());
    let view = View::<L::Quad>::new(problem.patch, frame, reach);
    if pieces::is_edge_on(&view, problem.offsets) {
        return L::outline(EdgeOn { problem, frame });
    }
    let stretches = view.stretches(problem.offsets);
    let mut nearest: Option<Found> = None;
    // A loop, not an iterator: lanes must not pass through functions that lack the kernel's instruction set.
    for stretch in stretches.as_slice() {
        let curve = Curve::new(&view, problem.patch, stretch, frame);
        let found = along::<L>(problem, frame, &curve, &view);
        nearest = nearer(nearest, found);
        if problem.any && nearest.is_some() {
            break;
        }
    }
    nearest
}

#[inline(always)]
fn nearer(a: Option<Found>, b: Option<Found>) -> Option<Found> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.t < a.t { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Looks for the surface along one stretch of the curve.
#[inline(always)]
fn along<L: Lanes>(
    problem: &Problem<'_>,
    frame: &RayFrame,
    curve: &Curve<L::Quad>,
    view: &View<L::Quad>,
) -> Option<Found> {
    let ends = [curve.t(0.0), curve.t(1.0)];
    if problem.ordered
        && (ends[1] as f32 <= problem.interval[0] || ends[0] as f32 >= problem.interval[1])
    {
        return None;
    }
    if pieces::is_even(curve, problem.patch) {
        let mut signs = Signs::new(problem);
        Walker::<L>::new(problem, curve, ends).walk(&mut signs);
        return signs.nearest();
    }
    L::outline(Uneven {
        problem,
        frame,
        curve,
        view,
    })
}

/// As [`along`], where A changes so much that no one span can be bounded: piece by piece.
struct Uneven<'a, Q> {
    problem: &'a Problem<'a>,
    frame: &'a RayFrame,
    curve: &'a Curve<Q>,
    view: &'a View<Q>,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Uneven<'_, Q> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        let Self { problem, frame, .. } = self;
        let mut signs = Signs::new(problem);
        let mut pieces = pieces::Pieces::new(self.curve, self.view);
        while let Some(piece) = pieces.next() {
            let part = match piece {
                Piece::Even(part) => Some(part),
                Piece::Flat(w) => pieces::flat(problem.patch, frame, w),
            };
            if let Some(part) = part {
                let ends = [part.t(0.0), part.t(1.0)];
                Walker::<L>::new(problem, &part, ends).walk(&mut signs);
            }
            if signs.is_done() {
                break;
            }
        }
        signs.nearest()
    }
}

/// The ray lies in the planes of the prism's triangles: it meets them at the one or few w whose plane holds it.
struct EdgeOn<'a> {
    problem: &'a Problem<'a>,
    frame: &'a RayFrame,
}

impl<L: Lanes> Task<L> for EdgeOn<'_> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        let Self { problem, frame } = self;
        let (heights, count) = pieces::planes_that_hold(problem.patch, frame, problem.offsets);
        let mut nearest = None;
        for &w in &heights[..count] {
            if let Some(part) = pieces::flat::<L::Quad>(problem.patch, frame, w) {
                let ends = [part.t(0.0), part.t(1.0)];
                let mut signs = Signs::new(problem);
                Walker::<L>::new(problem, &part, ends).walk(&mut signs);
                nearest = nearer(nearest, signs.nearest());
            }
        }
        nearest
    }
}

/// The hit on S at a crossing.
#[inline(always)]
pub fn root(patch: &Patch<'_>, found: &Found) -> Root {
    let point = patch.point(found.u, found.v);
    let ng: DVec3 = point.du.cross(point.dv);
    Root {
        t: found.t,
        u: found.u,
        v: found.v,
        ng,
    }
}
