//! Prisms for the exact march: clusters of eight, and the hit test of one cluster.

use super::cluster::{Cluster, MOST_PRISMS, groups};
use super::detail::turned;
use super::edits::EditBounds;
use super::march::exact::{
    Arcs, CutArcs, Found, FoundArcs, Problem, Search, Units, hit, search_arc, walls,
};
use super::ray_frame::{Anchored, RayFrame, axes};
use super::sight::Sight;
use super::simd::{LANES, Lanes};
use super::{MarchError, Parts, PrismHit, Prisms};
use crate::ray::Ray;
use crate::surface::DisplacedSurface;

/// One cluster per eight base triangles.
pub struct ExactPrisms {
    pub clusters: Vec<Cluster>,
    /// Base triangles.
    prims: usize,
}

impl ExactPrisms {
    pub fn new(surface: &DisplacedSurface, bounds: EditBounds) -> Result<Self, MarchError> {
        let prims = surface.mesh().triangles().len();
        if prims > MOST_PRISMS {
            return Err(MarchError::TooManyTriangles {
                found: prims,
                max: MOST_PRISMS,
            });
        }
        let centroids: Vec<_> = (0..prims as u32)
            .map(|prim| {
                let [a, b, c] = surface.mesh().corners(prim).map(|p| p.as_dvec3());
                a + b + c
            })
            .collect();
        let offsets = |prim| bounds.offsets(surface, prim);
        Ok(Self {
            clusters: groups(&centroids)
                .chunks(LANES)
                .map(|prims| Cluster::new(surface, prims, offsets))
                .collect(),
            prims,
        })
    }

    /// One cluster of as many prisms.
    pub fn of_one(cluster: Cluster, prims: usize) -> Self {
        Self {
            clusters: vec![cluster],
            prims,
        }
    }

    /// Prisms in a cluster: its first lanes.
    #[inline(always)]
    pub fn len(&self, cluster: usize) -> usize {
        (self.prims - cluster * LANES).min(LANES)
    }
}

/// A cluster, and a ray in its frame, from a point beside the cluster.
struct Approach<'a> {
    prisms: &'a Prisms,
    cluster: &'a Cluster,
    /// Lanes with a prism.
    used: u32,
    frame: RayFrame,
    ray: Anchored,
}

impl<'a> Approach<'a> {
    #[inline(always)]
    fn new(prisms: &'a Prisms, index: u32, ray: &Ray) -> Option<Self> {
        let Parts::Exact(exact) = &prisms.parts else {
            return None;
        };
        let cluster = &exact.clusters[index as usize];
        let frame = RayFrame::new(ray, axes(ray));
        Some(Self {
            prisms,
            cluster,
            used: (1 << exact.len(index as usize)) - 1,
            ray: frame.anchored(cluster.anchor(frame.axes[2]), ray),
            frame,
        })
    }

    /// The prisms, as the ray sees them, and the lanes that it may meet.
    #[inline(always)]
    fn sight<L: Lanes>(&self) -> (Sight<L>, u32) {
        let prisms = self.cluster.lanes::<L>(self.ray.axes);
        let (sight, met) = Sight::new(&prisms, &self.ray.splat());
        (sight, met & self.used)
    }

    /// Their arcs.
    #[inline(always)]
    fn cut<L: Lanes>(&self, sight: &Sight<L>) -> (CutArcs<L>, Units) {
        let prisms = self.cluster.lanes::<L>(self.ray.axes);
        let units = Units::new(&self.prisms.surface);
        let cut = CutArcs::new(sight, &prisms, &units, &self.ray.splat());
        (cut, units)
    }

    /// The arcs that are to be walked in the lanes `met`.
    #[inline(always)]
    fn meeting<'s, L: Lanes>(&'s self, cut: &CutArcs<L>, arcs: &'s Arcs, met: u32) -> Meeting<'s> {
        let found = cut.found(arcs, met, &self.ray.splat());
        let others = if self.ray.is_usual {
            found.others | met & self.cluster.folded::<L>()
        } else {
            met
        };
        Meeting {
            prisms: self.prisms,
            cluster: self.cluster,
            frame: &self.frame,
            ray: &self.ray,
            arcs,
            found: FoundArcs {
                arcs: found.arcs & !others,
                others,
            },
        }
    }
}

/// A cluster with the arcs of a ray through it.
struct Meeting<'s> {
    prisms: &'s Prisms,
    cluster: &'s Cluster,
    frame: &'s RayFrame,
    ray: &'s Anchored,
    arcs: &'s Arcs,
    found: FoundArcs,
}

impl Meeting<'_> {
    /// The ray parameter, from the anchor, at which a lane's arc begins; before all others where that is not known.
    #[inline(always)]
    fn begin(&self, lane: usize) -> f32 {
        if self.found.arcs >> lane & 1 != 0 {
            self.arcs.ends[0][lane] - self.arcs.time_off[lane]
        } else {
            f32::NEG_INFINITY
        }
    }

    /// The lane among `alive` that begins first.
    #[inline(always)]
    fn first(&self, alive: u32) -> usize {
        let mut best = alive.trailing_zeros() as usize;
        let mut rest = alive & (alive - 1);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            if self.begin(lane) < self.begin(best) {
                best = lane;
            }
        }
        best
    }

    /// Whether nothing in a lane is before ray parameter `t`.
    #[inline(always)]
    fn begins_behind(&self, lane: usize, t: f32) -> bool {
        let t = (f64::from(t) - self.ray.time) as f32;
        self.begin(lane) > t + t.abs() * f32::EPSILON
    }

    /// The first crossing in a prism, or any.
    #[inline(always)]
    fn search<L: Lanes>(&self, problem: &Problem<'_>) -> Option<Found> {
        if self.found.arcs >> problem.lane & 1 != 0 {
            search_arc::<L>(problem, self.frame, self.arcs, self.ray.time)
        } else {
            L::outline(Search {
                problem,
                frame: self.frame,
            })
        }
    }

    #[inline(always)]
    fn problem(&self, lane: usize, interval: [f32; 2], any: bool) -> Problem<'_> {
        self.prisms.problem(self.cluster, lane, interval, any)
    }
}

/// The first hit on a cluster.
#[inline(always)]
pub fn intersect<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray, out: &mut PrismHit) -> bool {
    out.put(first_hit::<L>(prisms, index, ray))
}

#[inline(always)]
fn first_hit<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray) -> Option<PrismHit> {
    let approach = Approach::new(prisms, index, ray)?;
    let (sight, met) = approach.sight::<L>();
    if met == 0 {
        return None;
    }
    let (cut, units) = approach.cut(&sight);
    let arcs = cut.bounded(&units);
    let meeting = approach.meeting(&cut, &arcs, met);
    let cluster = meeting.cluster;
    let mut interval = [ray.tnear, ray.tfar];
    let mut nearest: Option<(Found, usize)> = None;
    let mut wall: Option<PrismHit> = None;
    let mut alive = meeting.found.arcs | meeting.found.others;
    while alive != 0 {
        let lane = meeting.first(alive);
        alive &= !(1 << lane);
        if meeting.begins_behind(lane, interval[1]) {
            continue;
        }
        if let Some(found) = meeting.search::<L>(&meeting.problem(lane, interval, false)) {
            // Of two at the same t the lower base triangle, whatever the order of the lanes.
            let beats = nearest.is_none_or(|(best, of)| {
                let (new, old) = (found.t as f32, best.t as f32);
                new < old || new == old && cluster.prim(lane) < cluster.prim(of)
            });
            if beats {
                nearest = Some((found, lane));
                interval[1] = (found.t as f32).next_up().min(ray.tfar);
            }
        }
        if cluster.walls(lane) != 0
            && let Some(found) = walls::<L>(&meeting.problem(lane, interval, false), meeting.frame)
            && wall.is_none_or(|best| found.is_before(&best))
        {
            wall = Some(found);
            interval[1] = found.t.next_up().min(ray.tfar);
        }
    }
    // Of two at the same t the surface.
    if let Some(wall) = wall
        && nearest.is_none_or(|(found, _)| wall.t < found.t as f32)
    {
        return Some(wall);
    }
    let (found, lane) = nearest?;
    let problem = meeting.problem(lane, interval, false);
    let hit = hit::<L>(&problem, &found);
    if problem.spread == 0.0 {
        return Some(hit);
    }
    // What is below the map's heights is inside, unless those go inward.
    let outside = found.above == (prisms.surface.displacement().scale > 0.0);
    // In f64: the length of a tiny direction is 0 in f32.
    let along = ray.direction.as_dvec3().normalize().as_vec3();
    let ng = turned(hit.ng, if outside { -along } else { along });
    Some(PrismHit { ng, ..hit })
}

/// Whether a cluster is hit at all.
#[inline(always)]
pub fn occluded<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray) -> bool {
    let Some(approach) = Approach::new(prisms, index, ray) else {
        return false;
    };
    let (sight, met) = approach.sight::<L>();
    if met == 0 {
        return false;
    }
    let (cut, units) = approach.cut(&sight);
    let arcs = cut.bounded(&units);
    let meeting = approach.meeting(&cut, &arcs, met);
    let mut alive = meeting.found.arcs | meeting.found.others;
    while alive != 0 {
        let lane = alive.trailing_zeros() as usize;
        alive &= alive - 1;
        let problem = meeting.problem(lane, [ray.tnear, ray.tfar], true);
        if meeting.search::<L>(&problem).is_some()
            || meeting.cluster.walls(lane) != 0 && walls::<L>(&problem, meeting.frame).is_some()
        {
            return true;
        }
    }
    false
}

impl Prisms {
    #[inline(always)]
    pub(super) fn problem<'a>(
        &'a self,
        cluster: &'a Cluster,
        lane: usize,
        interval: [f32; 2],
        any: bool,
    ) -> Problem<'a> {
        Problem {
            surface: &self.surface,
            cluster,
            lane,
            any,
            interval,
            spread: self.spread(),
        }
    }
}
