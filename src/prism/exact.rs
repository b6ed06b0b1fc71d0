//! Prisms for the exact march: clusters of eight, and the hit test of one cluster.

use super::cluster::{Cluster, MOST_PRISMS, groups};
use super::cull::Pairs;
use super::march::exact::{Found, Problem, Walls, root, search};
use super::ray_frame::RayFrame;
use super::simd::{Grid, LANES, Lanes};
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
    pub fn new(surface: &DisplacedSurface) -> Result<Self, MarchError> {
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
        let offsets = |prim| surface.offsets(prim);
        Ok(Self {
            clusters: groups(&centroids)
                .chunks(LANES)
                .map(|prims| Cluster::new(surface, prims, offsets))
                .collect(),
            prims,
        })
    }

    /// Prisms in a cluster: its first lanes.
    #[inline(always)]
    pub fn len(&self, cluster: usize) -> usize {
        (self.prims - cluster * LANES).min(LANES)
    }
}

/// The first hit on a cluster.
#[inline(always)]
pub fn intersect<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray) -> Option<PrismHit> {
    let Parts::Exact(exact) = &prisms.parts else {
        return None;
    };
    let (cluster, frame) = (&exact.clusters[index as usize], RayFrame::new(ray));
    let mut interval = frame.interval;
    let mut alive = meeting::<L>(cluster, &frame) & ((1 << exact.len(index as usize)) - 1);
    let mut nearest: Option<(Found, usize)> = None;
    let mut wall: Option<PrismHit> = None;
    while alive != 0 {
        let lane = alive.trailing_zeros() as usize;
        alive &= alive - 1;
        if let Some(found) = prisms.search::<L>(cluster, lane, &frame, interval, false) {
            // Of two at the same t the lower base triangle, whatever the order of the lanes.
            let beats = nearest.is_none_or(|(best, of)| {
                let (new, old) = (found.t as f32, best.t as f32);
                new < old || new == old && cluster.prim(lane) < cluster.prim(of)
            });
            if beats {
                nearest = Some((found, lane));
                interval[1] = (found.t as f32).next_up().min(frame.interval[1]);
            }
        }
        if cluster.walls(lane) != 0
            && let Some(found) = prisms.walls::<L>(cluster, lane, &frame, interval, false)
            && wall.is_none_or(|best| found.is_before(&best))
        {
            wall = Some(found);
            interval[1] = found.t.next_up().min(frame.interval[1]);
        }
    }
    // Of two at the same t the surface.
    if let Some(wall) = wall
        && nearest.is_none_or(|(found, _)| wall.t < found.t as f32)
    {
        return Some(wall);
    }
    let (found, lane) = nearest?;
    let member = prisms.member(cluster, lane);
    Some(root(&member.patch, &found).to_hit(member.prim))
}

/// Whether a cluster is hit at all.
#[inline(always)]
pub fn occluded<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray) -> bool {
    let Parts::Exact(exact) = &prisms.parts else {
        return false;
    };
    let (cluster, frame) = (&exact.clusters[index as usize], RayFrame::new(ray));
    let mut alive = meeting::<L>(cluster, &frame) & ((1 << exact.len(index as usize)) - 1);
    while alive != 0 {
        let lane = alive.trailing_zeros() as usize;
        alive &= alive - 1;
        if prisms
            .search::<L>(cluster, lane, &frame, frame.interval, true)
            .is_some()
        {
            return true;
        }
        if cluster.walls(lane) != 0
            && prisms
                .walls::<L>(cluster, lane, &frame, frame.interval, true)
                .is_some()
        {
            return true;
        }
    }
    false
}

/// The lanes whose prisms the ray may meet.
#[inline(always)]
fn meeting<L: Lanes>(cluster: &Cluster, frame: &RayFrame) -> u32 {
    let (vertices, normals, offsets) = cluster.lanes::<L>(frame.axes);
    let (origin, shear, per_depth, interval) = frame.splat::<L>();
    Pairs {
        vertices,
        normals,
        offsets,
        origin,
        shear,
        per_depth,
        interval,
    }
    .may_meet()
}

impl Prisms {
    #[inline(always)]
    fn member(&self, cluster: &Cluster, lane: usize) -> super::cluster::Member<'_> {
        let displacement = self.surface.displacement();
        cluster.member(
            lane,
            self.surface.map(),
            f64::from(displacement.scale),
            f64::from(displacement.midlevel),
        )
    }

    #[inline(always)]
    fn search<L: Lanes>(
        &self,
        cluster: &Cluster,
        lane: usize,
        frame: &RayFrame,
        interval: [f32; 2],
        any: bool,
    ) -> Option<Found> {
        let member = self.member(cluster, lane);
        let problem = Problem {
            patch: &member.patch,
            grid: &Grid::new(self.surface.map()),
            offsets: member.offsets,
            ordered: !member.folded,
            any,
            interval,
        };
        search::<L>(&problem, frame)
    }

    /// The first wall of a prism that has some.
    #[inline(always)]
    fn walls<L: Lanes>(
        &self,
        cluster: &Cluster,
        lane: usize,
        frame: &RayFrame,
        interval: [f32; 2],
        any: bool,
    ) -> Option<PrismHit> {
        let member = self.member(cluster, lane);
        let problem = Problem {
            patch: &member.patch,
            grid: &Grid::new(self.surface.map()),
            offsets: member.offsets,
            ordered: !member.folded,
            any,
            interval,
        };
        L::outline(Walls {
            problem: &problem,
            frame,
            surface: &self.surface,
            prim: member.prim,
            sides: cluster.walls(lane),
        })
    }
}
