//! What a case is held to.
//!
//! A hit is *missed* when the oracle has one and the engine none, *extra* when it is on no crossing of the oracle's,
//! *wrong* when it is not on the first: |dt| > 1e-3 of the size, the diagonal of the base mesh's box ([`Case::same`]). None of the
//! three is allowed, unless a ray that is moved by less than what single precision resolves would have been answered
//! so: then the ray was at a silhouette or on the surface's rim, and is counted as *unsure*. The distances of the
//! others from the oracle's crossing are in parts of the size, the angles between the normals in degrees.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use prismarch::prism::{PrismHit, Prisms, SimdLevel};
use prismarch::ray::{Aabb, Ray, RayPacket};
use prismarch::surface::DisplacedSurface;
use prismarch::trace::{Hit, INVALID_ID, Tracer};

use super::common::march;
use super::common::numbers::Numbers;
use super::oracle::{Crossing, Crossings, EDGE, Line, Oracle};

/// Part of the size that single precision resolves: of numbers a few sizes large, a few roundings deep.
const RESOLVED: f64 = 3e-7;

/// How far a prism may reach beyond its triangle, barycentric, so that neighbours do not part.
const OVERLAP: f64 = 2e-6;

/// A surface and the rays that are shot at it.
pub struct Case {
    pub name: &'static str,
    pub surface: Arc<DisplacedSurface>,
    pub rays: Vec<Ray>,
    /// Farther from the oracle's crossing than this part of the size is another crossing.
    pub same: f64,
}

impl Case {
    pub fn new(name: &'static str, surface: &Arc<DisplacedSurface>, rays: Vec<Ray>) -> Self {
        Self {
            name,
            surface: surface.clone(),
            rays,
            same: 1e-3,
        }
    }
}

/// The most that a case may have.
const MEDIAN: f64 = 1e-6;
const P99: f64 = 1e-5;
const NORMAL_P99: f64 = 1.0;

#[derive(Default)]
struct Score {
    hits: usize,
    missed: usize,
    extra: usize,
    wrong: usize,
    unsure: usize,
    /// Rays whose occlusion query disagrees with their first hit.
    occlusion: usize,
    distances: Vec<f64>,
    angles: Vec<f64>,
    /// The first ray that was answered wrongly, and how.
    example: Option<String>,
}

/// Traces cases with all engines, prints a line for each.
///
/// # Panics
///
/// When an engine passes a limit in any of them.
pub fn judge(cases: impl IntoIterator<Item = Case>) {
    let faults: Vec<String> = cases.into_iter().flat_map(|case| faults(&case)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn faults(case: &Case) -> Vec<String> {
    let oracle = Oracle::new(&case.surface);
    let lines: Vec<Line> = case.rays.iter().map(Line::from).collect();
    let truths: Vec<Crossings> = lines.iter().map(|line| oracle.trace(line, EDGE)).collect();
    let court = Court::new(case, oracle);
    let mut faults = Vec::new();
    for (engine, tracer) in engines(&case.surface) {
        let mut score = Score::default();
        for ((ray, line), truth) in case.rays.iter().zip(&lines).zip(&truths) {
            let hit = tracer.intersect(ray);
            score.occlusion += usize::from(tracer.occluded(ray) != hit.is_some());
            court.weigh(line, truth, hit.as_ref(), &mut score);
        }
        faults.extend(score.report(case.name, engine, case.rays.len(), court.coarseness()));
    }
    faults
}

struct Court<'s> {
    oracle: Oracle<'s>,
    same: f64,
    size: f64,
    /// Rounding of a coordinate.
    ulp: f64,
}

impl<'s> Court<'s> {
    fn new(case: &Case, oracle: Oracle<'s>) -> Self {
        let bounds = case.surface.mesh().bounds();
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        Self {
            oracle,
            same: case.same,
            size: f64::from(bounds.diagonal()),
            ulp: f64::from(reach * f32::EPSILON),
        }
    }

    /// Rounding of a coordinate as a part of the size: large far from the origin.
    fn coarseness(&self) -> f64 {
        self.ulp / self.size
    }

    fn weigh(&self, line: &Line, truth: &Crossings, hit: Option<&Hit>, score: &mut Score) {
        let (t, first) = (hit.map(|hit| f64::from(hit.t)), truth.first(line));
        score.hits += usize::from(hit.is_some());
        if !self.is_answer(line, truth, t) {
            if truth.incomplete || self.is_excused(line, t) {
                score.unsure += 1;
                return;
            }
            let on_surface = |t: f64| truth.all.iter().any(|c| self.is_same(line, c, t));
            let count = match t {
                None => &mut score.missed,
                Some(t) if on_surface(t) => &mut score.wrong,
                Some(_) => &mut score.extra,
            };
            *count += 1;
            if t.is_some_and(|t| !on_surface(t)) {
                score.example = None; // the strangest fault is shown
            }
            score
                .example
                .get_or_insert_with(|| format!("{line:?}\n  answer {hit:?}\n  oracle {first:?}"));
        } else if let (Some(hit), Some(t)) = (hit, t)
            && let Some(c) = first.last().filter(|c| c.sure && self.is_same(line, c, t))
        {
            let distance = (t - c.t).abs() * line.direction.length() / self.size;
            score.distances.push(distance);
            let mut cos = cosine(truth, c.t, hit);
            if cos < NORMAL_P99.to_radians().cos() {
                // S is bent along edges: within the overlap the normal is either side's.
                cos = cosine(&self.oracle.trace(line, OVERLAP), c.t, hit);
            }
            score.angles.push(cos.min(1.0).acos().to_degrees());
        }
    }

    fn is_same(&self, line: &Line, crossing: &Crossing, t: f64) -> bool {
        (crossing.t - t).abs() * line.direction.length() <= self.same * self.size
    }

    /// Whether a first hit at `t`, or none, is right: crossings that are not sure may be there or not.
    fn is_answer(&self, line: &Line, truth: &Crossings, t: Option<f64>) -> bool {
        let first = truth.first(line);
        match t {
            None => first.last().is_none_or(|c| !c.sure),
            Some(t) => first.iter().any(|c| self.is_same(line, c, t)),
        }
    }

    fn is_excused(&self, line: &Line, t: Option<f64>) -> bool {
        if self.is_answer(line, &self.oracle.trace(line, OVERLAP), t) {
            return true;
        }
        let reach = RESOLVED * self.size + 2.0 * self.ulp;
        (0..27).filter(|k| *k != 13).any(|k| {
            let part = |k: i32| f64::from(k % 3 - 1);
            let shift = DVec3::new(part(k), part(k / 3), part(k / 9));
            let moved = Line {
                origin: line.origin + reach * shift.normalize(),
                ..*line
            };
            self.is_answer(&moved, &self.oracle.trace(&moved, EDGE), t)
        })
    }
}

/// Between the hit's normal and the nearest of the oracle's at `t`.
fn cosine(truth: &Crossings, t: f64, hit: &Hit) -> f64 {
    let here = |c: &&Crossing| (c.t - t).abs() <= 1e-5 * t.abs();
    let ng = hit.ng.as_dvec3().normalize_or_zero();
    let cosines = truth.all.iter().filter(here).map(|c| c.ng.dot(ng));
    cosines.fold(-1.0, f64::max)
}

impl Score {
    /// Prints the line; the fault if a limit is passed.
    fn report(mut self, name: &str, engine: &str, rays: usize, coarseness: f64) -> Option<String> {
        let [median, p99] = [0.5, 0.99].map(|part| percentile(&mut self.distances, part));
        let normal = percentile(&mut self.angles, 0.99);
        let Self {
            hits,
            missed,
            extra,
            wrong,
            unsure,
            occlusion,
            ..
        } = self;
        let line = format!(
            "{name:<34} {engine:<14} rays {rays:>4} hits {hits:>4} missed {missed} extra {extra} wrong {wrong} \
             unsure {unsure} occlusion {occlusion} median {median:.1e} p99 {p99:.1e} normal {normal:.3}",
        );
        println!("{line}");
        let idle = 10 * hits < rays;
        // An eighth of the rays may be at silhouettes, in the most spiky case; more would test nothing.
        let right = missed + extra + wrong + occlusion == 0 && 8 * unsure <= rays && !idle;
        let exact = median <= MEDIAN + coarseness && p99 <= P99 + 4.0 * coarseness;
        let fault = !(right && exact && normal <= NORMAL_P99);
        fault.then(|| format!("{line}\n  {}", self.example.unwrap_or_default()))
    }
}

fn percentile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (part * values.len() as f64) as usize;
    values
        .get(index.min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

fn engines(surface: &Arc<DisplacedSurface>) -> Vec<(&'static str, Box<dyn Tracer>)> {
    let prisms = || Prisms::new(surface.clone(), march::under_test()).unwrap();
    let mut engines: Vec<(&str, Box<dyn Tracer>)> = Vec::new();
    for level in [SimdLevel::Baseline, SimdLevel::Avx2] {
        if let Some(prisms) = prisms().with_simd(level) {
            let name = match level {
                SimdLevel::Baseline => "baseline, packets",
                SimdLevel::Avx2 => "avx2+fma, packets",
            };
            engines.push((name, Box::new(Bundled(Loop::new(prisms)))));
        }
        if let Some(prisms) = prisms().with_simd(level) {
            engines.push((level.name(), Box::new(Loop::new(prisms))));
        }
    }
    #[cfg(any(feature = "bvh", feature = "embree"))]
    let world = prismarch::trace::World::new(vec![prismarch::trace::Object {
        shape: prismarch::trace::Shape::Displaced(Arc::new(prisms())),
        placement: prismarch::trace::Placement::World,
        mask: u32::MAX,
    }]);
    #[cfg(feature = "bvh")]
    engines.push((
        "obvhs",
        Box::new(prismarch::bvh::BvhTracer::new(&world).unwrap()),
    ));
    #[cfg(feature = "embree")]
    {
        let options = prismarch::embree::EmbreeOptions::default();
        let tracer = prismarch::embree::EmbreeTracer::new(&world, &options).unwrap();
        engines.push(("embree", Box::new(tracer)));
    }
    engines
}

/// Every ray in a packet with seven others that go nearly the same way.
struct Bundled(Loop);

impl Bundled {
    /// The packet, and the lane of the ray.
    fn packet(ray: &Ray) -> (RayPacket, usize) {
        let mut numbers = Numbers::new(u64::from(ray.direction.x.to_bits()));
        let lane = numbers.below(RayPacket::LANES);
        // From as close as to be in one cell of the map to as far as to be in other prisms.
        let spread = 10f32.powf(numbers.between(-5.0, -1.0));
        let mut packet = RayPacket::EMPTY;
        for k in 0..RayPacket::LANES {
            let moved = spread * ray.direction.length() * numbers.direction();
            let near = Ray {
                direction: ray.direction + moved,
                tfar: ray.tfar * numbers.between(0.9, 1.1),
                ..*ray
            };
            packet.set(k, if k == lane { ray } else { &near });
        }
        (packet, lane)
    }
}

impl Tracer for Bundled {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let (packet, lane) = Self::packet(ray);
        let valid = packet.valid();
        let hits = self
            .0
            .candidates(ray)
            .filter_map(|p| self.0.prisms.intersect8(p, &packet, valid)[lane]);
        nearest(hits)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let (packet, lane) = Self::packet(ray);
        let valid = packet.valid();
        self.0
            .candidates(ray)
            .any(|p| self.0.prisms.occluded8(p, &packet, valid) >> lane & 1 != 0)
    }

    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        0
    }

    fn name(&self) -> String {
        "loop over packets".into()
    }
}

/// The nearest of some hits, as a tracer tells of it.
fn nearest(hits: impl Iterator<Item = PrismHit>) -> Option<Hit> {
    let PrismHit { prim, t, u, v, ng } = hits.min_by(|a, b| a.t.total_cmp(&b.t))?;
    Some(Hit {
        t,
        u,
        v,
        prim,
        geom: 0,
        inst: [INVALID_ID],
        ng,
    })
}

/// A loop over all prisms whose bounds the ray meets.
struct Loop {
    prisms: Prisms,
    bounds: Vec<Aabb>,
}

impl Loop {
    fn new(prisms: Prisms) -> Self {
        let bounds = (0..prisms.len() as u32).map(|p| prisms.bounds(p)).collect();
        Self { prisms, bounds }
    }

    fn candidates<'a>(&'a self, ray: &'a Ray) -> impl Iterator<Item = u32> + 'a {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
        (0u32..).zip(&self.bounds).filter_map(move |(prim, b)| {
            let middle = 0.5 * (b.min + b.max);
            let away = (middle.as_dvec3() - origin).cross(direction).length();
            (away <= f64::from(0.5 * b.diagonal()) * 1.001).then_some(prim)
        })
    }
}

impl Tracer for Loop {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hits = self
            .candidates(ray)
            .filter_map(|p| self.prisms.intersect(p, ray));
        nearest(hits)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.candidates(ray).any(|p| self.prisms.occluded(p, ray))
    }

    fn bounds(&self) -> Aabb {
        self.bounds
            .iter()
            .fold(Aabb::EMPTY, |bounds, b| bounds.union(*b))
    }

    fn bvh_bytes(&self) -> usize {
        0
    }

    fn name(&self) -> String {
        "loop".into()
    }
}

/// An exact offset surface has a closed form: `height` above the plane z = 0.
pub fn judge_plane(case: &Case, height: f64) {
    for (engine, tracer) in engines(&case.surface) {
        for ray in &case.rays {
            if let Some(hit) = tracer.intersect(ray) {
                let z = f64::from(ray.origin.z) + f64::from(hit.t) * f64::from(ray.direction.z);
                // t is single precision, and so is a coordinate some units large.
                assert!((z - height).abs() < 2e-6, "{engine} {ray:?} {hit:?} {z}");
                assert!(hit.ng.distance(Vec3::Z) < 1e-5, "{engine} {ray:?} {hit:?}");
            }
        }
    }
}
