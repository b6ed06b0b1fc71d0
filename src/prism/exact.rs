//! Prisms for the exact march: clusters of eight, and the hit test of one cluster.

use super::cluster::{Cluster, MOST_PRISMS, groups};
use super::cull::Pairs;
use super::detail::turned;
use super::edits::EditBounds;
use super::march::exact::{Found, Problem, root, search, walls};
use super::ray_frame::{RayFrame, RayLanes, axes};
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
    let (cluster, axes) = (&exact.clusters[index as usize], axes(ray));
    let mut alive = meeting::<L>(cluster, ray, axes) & ((1 << exact.len(index as usize)) - 1);
    if alive == 0 {
        return None;
    }
    let frame = RayFrame::new(ray, axes);
    let mut interval = [ray.tnear, ray.tfar];
    let mut nearest: Option<(Found, usize)> = None;
    let mut wall: Option<PrismHit> = None;
    while alive != 0 {
        let lane = alive.trailing_zeros() as usize;
        alive &= alive - 1;
        if let Some(found) = search::<L>(&prisms.problem(cluster, lane, interval, false), &frame) {
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
            && let Some(found) = walls::<L>(&prisms.problem(cluster, lane, interval, false), &frame)
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
    let problem = prisms.problem(cluster, lane, interval, false);
    let hit = root::<L>(&problem, &found).to_hit(cluster.prim(lane));
    if problem.spread == 0.0 {
        return Some(hit);
    }
    // What is below the map's heights is inside, unless those go inward.
    let outside = found.above == (prisms.surface.displacement().scale > 0.0);
    let along = ray.direction.normalize();
    let ng = turned(hit.ng, if outside { -along } else { along });
    Some(PrismHit { ng, ..hit })
}

/// Whether a cluster is hit at all.
#[inline(always)]
pub fn occluded<L: Lanes>(prisms: &Prisms, index: u32, ray: &Ray) -> bool {
    let Parts::Exact(exact) = &prisms.parts else {
        return false;
    };
    let (cluster, axes) = (&exact.clusters[index as usize], axes(ray));
    let mut alive = meeting::<L>(cluster, ray, axes) & ((1 << exact.len(index as usize)) - 1);
    if alive == 0 {
        return false;
    }
    let frame = RayFrame::new(ray, axes);
    while alive != 0 {
        let lane = alive.trailing_zeros() as usize;
        alive &= alive - 1;
        let problem = prisms.problem(cluster, lane, [ray.tnear, ray.tfar], true);
        if search::<L>(&problem, &frame).is_some()
            || cluster.walls(lane) != 0 && walls::<L>(&problem, &frame).is_some()
        {
            return true;
        }
    }
    false
}

/// The lanes whose prisms the ray may meet.
#[inline(always)]
fn meeting<L: Lanes>(cluster: &Cluster, ray: &Ray, axes: [usize; 3]) -> u32 {
    let (vertices, normals, offsets) = cluster.lanes::<L>(axes);
    Pairs {
        vertices,
        normals,
        offsets,
        ray: RayLanes::splat(ray, axes),
    }
    .may_meet()
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
