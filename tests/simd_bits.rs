//! Kernels of every SIMD level give the same hits, bit for bit: pictures may be put together from any machines.

#[path = "../benches/common/mod.rs"]
mod common;
#[path = "exact/kinds.rs"]
mod kinds;
#[path = "exact/maps.rs"]
mod maps;
#[allow(dead_code)] // a part is used
#[path = "exact/meshes.rs"]
mod meshes;

use std::sync::Arc;

use common::numbers::Numbers;
use glam::Vec3;
use kinds::{ray, surfaces};
use prismarch::prism::{Lod, March, PrismHit, PrismOptions, Prisms, SimdLevel, Step};
use prismarch::ray::{Aabb, Footprint, Ray, RayPacket};
use prismarch::surface::{DisplacedSurface, Seams};

/// Primary rays per surface and march; as many again are from their hits, and as many packets.
const RAYS: usize = if cfg!(debug_assertions) { 10 } else { 1000 };

/// Exact hits, and cones from a hundredth of a texel wide to a good part of the map.
const SPREADS: [f32; 5] = [0.0, 1e-5, 1e-3, 0.02, 0.2];

const MARCHES: [March; 3] = [
    March::Exact,
    March::Uniform {
        step: Step::Texels(1.0),
        jitter: false,
    },
    March::Uniform {
        step: Step::World(0.02),
        jitter: true,
    },
];

/// The same prisms at both levels; `None` where the machine knows only one.
fn both(surface: &Arc<DisplacedSurface>, march: March) -> Option<[Prisms; 2]> {
    let at = |level| {
        let options = PrismOptions {
            march,
            lod: match march {
                March::Exact => Lod::Cone,
                March::Uniform { .. } => Lod::Off,
            },
            ..PrismOptions::default()
        };
        let prisms = Prisms::new(surface.clone(), options).unwrap();
        prisms.with_simd(level)
    };
    Some([at(SimdLevel::Baseline)?, at(SimdLevel::Avx2)?])
}

fn bounds(prisms: &Prisms) -> Aabb {
    (0..prisms.len() as u32).fold(Aabb::EMPTY, |all, k| all.union(prisms.bounds(k)))
}

fn bits(hit: PrismHit) -> [u32; 7] {
    let PrismHit { prim, t, u, v, ng } = hit;
    let [t, u, v, x, y, z] = [t, u, v, ng.x, ng.y, ng.z].map(f32::to_bits);
    [prim, t, u, v, x, y, z]
}

/// What each of all primitives says of a ray, in bits; and its first hit.
fn asked(prisms: &Prisms, ray: &Ray) -> (Vec<Option<[u32; 7]>>, Vec<bool>, Option<PrismHit>) {
    let all = 0..prisms.len() as u32;
    let hits: Vec<_> = all.clone().map(|k| prisms.intersect(k, ray)).collect();
    let occluded = all.map(|k| prisms.occluded(k, ray)).collect();
    let first = hits.iter().flatten().min_by(|a, b| a.t.total_cmp(&b.t));
    let first = first.copied();
    (
        hits.into_iter().map(|hit| hit.map(bits)).collect(),
        occluded,
        first,
    )
}

/// The same of a packet's rays.
fn asked8(prisms: &Prisms, rays: &RayPacket) -> Vec<([Option<[u32; 7]>; 8], u8)> {
    let all = 0..prisms.len() as u32;
    let valid = rays.valid();
    all.map(|k| {
        let hits = prisms.intersect8(k, rays, valid);
        (
            hits.map(|hit| hit.map(bits)),
            prisms.occluded8(k, rays, valid),
        )
    })
    .collect()
}

/// What a shader sees of a hit.
fn seen(prisms: &Prisms, hit: &PrismHit, ray: &Ray) -> [u32; 9] {
    let footprint = Footprint {
        width: prisms.spread() * hit.t * ray.direction.length(),
        direction: ray.direction,
    };
    let point = prisms.seen_point(hit, &footprint);
    let (p, n, g) = (point.position, point.shading_normal, point.geometric_normal);
    [p.x, p.y, p.z, n.x, n.y, n.z, g.x, g.y, g.z].map(f32::to_bits)
}

/// A ray from a hit: to anywhere, or almost along the surface.
fn onward(numbers: &mut Numbers, ray: &Ray, hit: &PrismHit) -> Ray {
    let mut direction = numbers.direction();
    if numbers.number() < 0.5 {
        direction -= hit.ng * direction.dot(hit.ng) * numbers.between(0.98, 1.0);
    }
    let mut onward = Ray::new(ray.origin + hit.t * ray.direction, direction);
    onward.tnear = 1e-4;
    onward
}

/// A ray and seven that go nearly the same way: from as close as to be in one texel to as far as to be in other prisms.
fn packet(numbers: &mut Numbers, ray: &Ray) -> RayPacket {
    let spread = 10f32.powf(numbers.between(-5.0, -1.0)) * ray.direction.length();
    let mut packet = RayPacket::EMPTY;
    for k in 0..RayPacket::LANES {
        let moved: Vec3 = spread * numbers.direction();
        let near = Ray {
            direction: ray.direction + moved,
            ..*ray
        };
        packet.set(k, &near);
    }
    packet
}

/// All that is seen of some rays at both levels; how many hits there were.
fn compare(name: &str, levels: &[Prisms; 2], around: &Aabb) -> usize {
    let mut numbers = Numbers::new(23);
    let mut hits = 0;
    for _ in 0..RAYS {
        let first = ray(&mut numbers, around);
        let mut next = Some(first);
        for _ in 0..2 {
            let Some(ray) = next.take() else { break };
            let [(hits_of_a, occluded_of_a, a), (hits_of_b, occluded_of_b, b)] =
                [0, 1].map(|k| asked(&levels[k], &ray));
            assert_eq!(hits_of_a, hits_of_b, "{name} {ray:?}");
            assert_eq!(occluded_of_a, occluded_of_b, "{name} {ray:?}");
            if let (Some(a), Some(b)) = (a, b) {
                let [seen_by_a, seen_by_b] =
                    [(0, a), (1, b)].map(|(k, hit)| seen(&levels[k], &hit, &ray));
                assert_eq!(seen_by_a, seen_by_b, "{name} {ray:?}");
                next = Some(onward(&mut numbers, &ray, &a));
                hits += 1;
            }
            let packet = packet(&mut numbers, &ray);
            let [a, b] = [0, 1].map(|k| asked8(&levels[k], &packet));
            assert_eq!(a, b, "{name} {packet:?}");
        }
    }
    hits
}

#[test]
fn baseline_and_avx2_hit_alike() {
    for (name, surface) in surfaces() {
        let closed = Arc::new((*surface).clone().with_seams(Seams::Closed));
        let open = MARCHES.map(|march| (march, &surface));
        for (march, surface) in open.into_iter().chain([(March::Exact, &closed)]) {
            let Some(levels) = both(surface, march) else {
                return;
            };
            let around = bounds(&levels[0]);
            let spreads = match march {
                March::Exact => &SPREADS[..],
                March::Uniform { .. } => &SPREADS[..1],
            };
            for &spread in spreads {
                levels.iter().for_each(|prisms| prisms.set_spread(spread));
                let name = format!("{name} {march:?} {spread}");
                let hits = compare(&name, &levels, &around);
                assert!(hits > RAYS / 20, "{name}: {hits}");
            }
        }
    }
}
