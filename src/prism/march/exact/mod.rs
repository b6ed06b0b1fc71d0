//! The exact march: the first crossing of the ray and S, without a step.
//!
//! The ray's curves through the prisms of a cluster ([`curve`](crate::prism::curve)) are set up in f32 lanes ([`arcs`]) and cut into spans. A span whose box in the map lies
//! wholly above or below the surface's range there, by the map's min/max pyramid, is done with; one that does not is cut
//! again, until it is a few texel cells long, and then each cell is solved ([`cells`]). Fast paths are in f32 lanes and
//! only ever *exclude*: every box, every cell is widened by a proven bound of what the f32 path may be off
//! ([`arcs`]). What is left is decided in f64 on S itself ([`signs`]): the signs of
//! g(s) = w |N'| - D at the ends of what is left say where a root is, and a bracketed Newton iteration finds it. So a spike one texel wide
//! is found, and the number of crossings in a prism has the parity of the signs at its ends, which neighbours share.

mod abreast;
mod arcs;
mod cells;
mod children;
mod chords;
mod explain;
mod landing;
mod lod;
mod pieces;
mod roots;
mod signs;
mod span;
mod walls;

use glam::{DVec3, Vec3};

use super::polish::Root;
use crate::prism::PrismHit;
use crate::prism::cluster::Cluster;
use crate::prism::curve::{Curve, Cut, Stretch, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Lanes, Quad, Task};
use crate::surface::{DisplacedSurface, Patch};
pub use abreast::search_arcs;
pub use arcs::{Arcs, Cut as CutArcs, Found as FoundArcs, Units};
pub use explain::explain;
use pieces::Piece;
use signs::Signs;
use span::Walker;
pub use walls::walls;

/// One prism of a cluster, and what is asked of it.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    pub surface: &'a DisplacedSurface,
    pub cluster: &'a Cluster,
    pub lane: usize,
    /// Whether any crossing will do.
    pub any: bool,
    /// The open interval of ray parameters.
    pub interval: [f32; 2],
    /// Twice how far a hit may be off, as a part of its t; 0 where it must be exact.
    pub spread: f32,
}

impl<'a> Problem<'a> {
    /// The prism in f64.
    #[inline(always)]
    fn patch(&self) -> Patch<'a> {
        self.cluster.patch(self.lane, self.surface)
    }

    /// Whether t is monotone in w: not so in folded prisms, where all crossings are looked for and the nearest kept.
    #[inline(always)]
    fn is_ordered(&self) -> bool {
        self.cluster.is_ordered(self.lane)
    }

    #[inline(always)]
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
    /// Whether the ray comes from above.
    pub above: bool,
    /// dS/du x dS/dv, where that has been asked for already.
    pub ng: Option<DVec3>,
}

impl Found {
    /// A crossing of which no one asks where it is.
    const ANY: Self = Self {
        t: 0.0,
        u: 0.0,
        v: 0.0,
        above: true,
        ng: None,
    };
}

/// The first crossing on an arc that f32 set up, or any.
#[inline(always)]
pub fn search_arc<L: Lanes>(
    problem: &Problem<'_>,
    frame: &RayFrame,
    arcs: &Arcs,
    time: f64,
) -> Option<Found> {
    let lane = problem.lane;
    let mut signs = Signs::new(problem, frame);
    signs.set_arc([arcs.w[0][lane].into(), arcs.w[1][lane].into()]);
    let texel = problem.cluster.first_texel(lane, problem.surface.map());
    Walker::new(problem, arcs, lane, texel.to_array(), time).walk_here::<L>(&mut signs);
    if signs.is_near_side() {
        return L::outline(Search { problem, frame });
    }
    signs.nearest()
}

/// [`search`] in a function of its own.
pub struct Search<'a> {
    pub problem: &'a Problem<'a>,
    pub frame: &'a RayFrame,
}

impl<L: Lanes> Task<L> for Search<'_> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        search::<L>(self.problem, self.frame)
    }
}

/// The first crossing inside a prism, or any, with all of its curve in f64.
#[inline(always)]
pub fn search<L: Lanes>(problem: &Problem<'_>, frame: &RayFrame) -> Option<Found> {
    let [low, high] = problem.cluster.offsets(problem.lane);
    let range = [f64::from(low), f64::from(high)];
    let reach = low.abs().max(high.abs());
    let corners = problem.cluster.corners::<L::Quad>(problem.lane, frame.axes);
    let view = View::new(&corners, frame, reach.into());
    match view.cut(range) {
        Cut::One(stretch) => along::<L>(problem, frame, &stretch, &view),
        Cut::None if !pieces::is_edge_on(&view, range) => None,
        _ => L::outline(Rare {
            problem,
            frame,
            view: &view,
            range,
        }),
    }
}

/// The few rays that are inside a prism more than once, or lie in the planes of its triangles.
struct Rare<'a, Q> {
    problem: &'a Problem<'a>,
    frame: &'a RayFrame,
    view: &'a View<Q>,
    range: [f64; 2],
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Rare<'_, Q> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        let Self { problem, frame, .. } = self;
        if pieces::is_edge_on(self.view, self.range) {
            return edge_on::<L>(problem, frame, self.view, self.range);
        }
        let mut nearest = None;
        // A loop, not an iterator: lanes must not pass through functions that lack the kernel's instruction set.
        for stretch in self.view.stretches(self.range).as_slice() {
            nearest = nearer(nearest, along::<L>(problem, frame, stretch, self.view));
        }
        nearest
    }
}

/// The ray lies in the planes of the prism's triangles: it meets them at the one or few w whose plane holds it.
#[inline(always)]
fn edge_on<L: Lanes>(
    problem: &Problem<'_>,
    frame: &RayFrame,
    view: &View<L::Quad>,
    range: [f64; 2],
) -> Option<Found> {
    let patch = problem.patch();
    let (heights, count) = pieces::planes_that_hold(&patch, frame, range);
    let mut nearest = None;
    for &w in &heights[..count] {
        if let Some(part) = pieces::flat::<L::Quad>(&patch, frame, w) {
            let mut signs = Signs::new(problem, frame);
            walk_curve::<L>(problem, &part, view, &mut signs);
            nearest = nearer(nearest, signs.nearest());
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
    stretch: &Stretch,
    view: &View<L::Quad>,
) -> Option<Found> {
    let texels = problem.cluster.texels(problem.lane, problem.surface.map());
    let curve = Curve::new(view, &texels, stretch, frame);
    let ends = curve.ends();
    if problem.is_ordered()
        && curve.is_wide
        && (ends[1] as f32 <= problem.interval[0] || ends[0] as f32 >= problem.interval[1])
    {
        return None;
    }
    if problem.cluster.is_short(problem.lane) && pieces::is_even(&curve) {
        let mut signs = Signs::new(problem, frame);
        walk_curve::<L>(problem, &curve, view, &mut signs);
        return signs.nearest();
    }
    L::outline(Uneven {
        problem,
        frame,
        curve: &curve,
        view,
    })
}

/// Walks a curve, or a piece of one.
#[inline(always)]
fn walk_curve<L: Lanes>(
    problem: &Problem<'_>,
    curve: &Curve<L::Quad>,
    view: &View<L::Quad>,
    signs: &mut Signs<'_, L::Quad>,
) {
    let start = curve.ends()[0];
    let arcs = Arcs::of_curve::<L>(problem, curve, view, start);
    signs.set_curve(*curve);
    Walker::new(problem, &arcs, 0, curve.texel_base, start).walk::<L>(signs);
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
        let [low, high] = problem.cluster.offsets(problem.lane);
        let range = [low.into(), high.into()];
        if pieces::is_edge_on(self.view, range) {
            return edge_on::<L>(problem, frame, self.view, range);
        }
        let mut signs = Signs::new(problem, frame);
        let mut pieces = pieces::Pieces::new(self.curve, self.view);
        while let Some(piece) = pieces.next() {
            let part = match piece {
                Piece::Even(part) => Some(part),
                Piece::Flat(w) => pieces::flat(&problem.patch(), frame, w),
            };
            if let Some(part) = part {
                walk_curve::<L>(problem, &part, self.view, &mut signs);
            }
            if signs.is_done() {
                break;
            }
        }
        signs.nearest()
    }
}

/// The hit on S at a crossing.
#[inline(always)]
pub fn hit<L: Lanes>(problem: &Problem<'_>, found: &Found) -> PrismHit {
    let Found { t, u, v, ng, .. } = *found;
    let ng = match ng {
        Some(ng) => ng,
        None => L::outline(Normal { problem, found }),
    };
    let mut hit = Root { t, u, v, ng }.to_hit(problem.cluster.prim(problem.lane));
    if hit.ng == Vec3::ZERO {
        hit.ng = normal_without_surface(&problem.patch());
    }
    hit
}

struct Normal<'a> {
    problem: &'a Problem<'a>,
    found: &'a Found,
}

impl<L: Lanes> Task<L> for Normal<'_> {
    type Output = DVec3;

    #[inline(always)]
    fn run(self) -> DVec3 {
        self.problem.patch().point(self.found.u, self.found.v).ng
    }
}

/// What stands for the normal where opposed vertex normals cancel, or the surface shrinks to a line: the base triangle's, and a
/// vertex normal where that has no area.
#[cold]
fn normal_without_surface(patch: &Patch<'_>) -> Vec3 {
    let face = patch.face_normal();
    if face.is_finite() {
        face
    } else {
        patch.normals[0]
    }
    .as_vec3()
}
