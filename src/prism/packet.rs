//! Eight rays against a cluster, where they go the same way.
//!
//! First all eight prisms are held against the beam that the rays are in ([`met_by_beam`]), then each prism that is left
//! against the rays, one lane per ray: the set-up is that of one ray and eight prisms ([`exact`](super::exact)), with the
//! lanes turned. The arcs through a prism are then walked side by side ([`search_arcs`]).

use super::cluster::Cluster;
use super::march::exact::{CutArcs, Found, Search, Units, hit, search_arcs};
use super::ray_frame::{RayFrame, RayFrames, axes, share_axes};
use super::sight::{Sight, met_by_beam};
use super::simd::{LANES, Lanes};
use super::{Parts, PrismHit, Prisms};
use crate::ray::RayPacket;

/// Fewer rays than this are faster one by one.
const FEWEST: u32 = 5;

/// A ray's nearest crossing so far, and the cluster's lane that it is in.
type Nearest = Option<(Found, usize)>;

/// The first hits on a cluster, and the rays that were not looked at: these are to be asked one by one.
#[inline(always)]
pub fn intersect<L: Lanes>(
    prisms: &Prisms,
    index: u32,
    rays: &RayPacket,
    valid: u8,
    hits: &mut [Option<PrismHit>; LANES],
) -> u8 {
    let mut nearest = [None; LANES];
    let Some(cluster) = cluster(prisms, index, valid) else {
        return valid;
    };
    let looked_at = search::<L>(prisms, cluster, rays, valid, false, &mut nearest);
    for (out, nearest) in hits.iter_mut().zip(&nearest) {
        if let Some((found, lane)) = nearest {
            let problem = prisms.problem(cluster.1, *lane, [0.0; 2], false);
            *out = Some(hit::<L>(&problem, found));
        }
    }
    valid & !looked_at
}

/// The rays that hit a cluster at all, and those that were not looked at.
#[inline(always)]
pub fn occluded<L: Lanes>(prisms: &Prisms, index: u32, rays: &RayPacket, valid: u8) -> [u8; 2] {
    let mut nearest = [None; LANES];
    let Some(cluster) = cluster(prisms, index, valid) else {
        return [0, valid];
    };
    let looked_at = search::<L>(prisms, cluster, rays, valid, true, &mut nearest);
    let mut hit = 0;
    for (ray, nearest) in nearest.iter().enumerate() {
        hit |= u8::from(nearest.is_some()) << ray;
    }
    [hit, valid & !looked_at]
}

/// The cluster and its lanes with a prism; none where one ray after the other is as good.
#[inline(always)]
fn cluster(prisms: &Prisms, index: u32, valid: u8) -> Option<(u32, &Cluster)> {
    let Parts::Exact(exact) = &prisms.parts else {
        return None;
    };
    let cluster = &exact.clusters[index as usize];
    // Level of detail is decided on curves of f64, and walls are of single rays.
    let is_usual = prisms.spread() == 0.0 && !cluster.has_walls();
    (is_usual && valid.count_ones() >= FEWEST)
        .then(|| ((1 << exact.len(index as usize)) - 1, cluster))
}

/// Looks for crossings in all prisms; the rays that were looked at.
#[inline(always)]
fn search<L: Lanes>(
    prisms: &Prisms,
    (used, cluster): (u32, &Cluster),
    rays: &RayPacket,
    valid: u8,
    any: bool,
    nearest: &mut [Nearest; LANES],
) -> u8 {
    let axes = axes(&rays.ray(valid.trailing_zeros() as usize));
    let lanes = u32::from(valid) & share_axes::<L>(&rays.direction, axes);
    if lanes.count_ones() < FEWEST {
        return 0;
    }
    let anchor = cluster.anchor(axes[2]);
    let Some(frames) = RayFrames::new::<L>(rays, lanes, axes, anchor) else {
        return 0;
    };
    let (met, [nearest_depth, farthest_depth]) =
        met_by_beam(&cluster.lanes::<L>(axes), &frames.beam());
    let begins = if frames.is_forward() {
        nearest_depth
    } else {
        L::splat(0.0) - farthest_depth
    };
    let begins = begins.to_array();
    let mut company = Company {
        prisms,
        cluster,
        axes,
        rays: lanes,
        each: frames.each(),
        frames,
        tnear: rays.tnear,
        tfar: rays.tfar,
        any,
        nearest,
    };
    let mut waiting = met & used;
    while waiting != 0 && company.rays != 0 {
        let mut first = waiting.trailing_zeros() as usize;
        for lane in 0..LANES {
            if waiting >> lane & 1 != 0 && begins[lane] < begins[first] {
                first = lane;
            }
        }
        waiting &= !(1 << first);
        company.search_prism::<L>(first);
    }
    lanes as u8
}

/// A cluster, and the rays that are held against it side by side.
struct Company<'a> {
    prisms: &'a Prisms,
    cluster: &'a Cluster,
    axes: [usize; 3],
    /// Rays that look for a crossing.
    rays: u32,
    frames: RayFrames,
    each: [RayFrame; LANES],
    tnear: [f32; LANES],
    tfar: [f32; LANES],
    /// Whether any crossing will do.
    any: bool,
    nearest: &'a mut [Nearest; LANES],
}

impl Company<'_> {
    #[inline(always)]
    fn search_prism<L: Lanes>(&mut self, lane: usize) {
        let prism = self.cluster.splat::<L>(lane, self.axes);
        let rays = self.frames.lanes::<L>();
        let (sight, met) = Sight::new(&prism, &rays);
        let met = met & self.rays;
        if met == 0 {
            return;
        }
        let units = Units::new(&self.prisms.surface);
        let cut = CutArcs::new(&sight, &prism, &units, &rays);
        let arcs = cut.bounded(&units);
        let found = cut.found(&arcs, met, &rays);
        let (together, alone) = if self.cluster.is_ordered(lane) {
            (found.arcs, found.others)
        } else {
            (0, met)
        };
        let mut problems = [self.prisms.problem(self.cluster, lane, [0.0; 2], self.any); LANES];
        for (ray, problem) in problems.iter_mut().enumerate() {
            problem.interval = [self.tnear[ray], self.tfar[ray]];
        }
        let mut hits = [None; LANES];
        if together != 0 {
            hits = search_arcs::<L>(&problems, &self.each, &self.frames.times, &arcs, together);
        }
        for ray in 0..LANES {
            if alone >> ray & 1 != 0 {
                hits[ray] = L::outline(Search {
                    problem: &problems[ray],
                    frame: &self.each[ray],
                });
            }
            if let Some(found) = hits[ray] {
                self.take(ray, lane, found);
            }
        }
    }

    #[inline(always)]
    fn take(&mut self, ray: usize, lane: usize, found: Found) {
        if self.any {
            self.rays &= !(1 << ray);
        }
        // Of two at the same t the lower base triangle, whatever the order of the lanes.
        let beats = self.nearest[ray].is_none_or(|(best, of)| {
            let (new, old) = (found.t as f32, best.t as f32);
            new < old || new == old && self.cluster.prim(lane) < self.cluster.prim(of)
        });
        if beats {
            self.nearest[ray] = Some((found, lane));
            self.tfar[ray] = (found.t as f32).next_up().min(self.tfar[ray]);
            self.frames.end_at(ray, self.tfar[ray]);
        }
    }
}
