//! Rays per second of the marches under Embree: `cargo bench --bench march`.
//!
//! The boulder of `common/boulder.rs`: 1280 base triangles, a 4096x4096 16-bit map of rock, range 0 .. 0.15, 1024x1024 primary
//! rays. Options after `--`: `--map TEXELS`, `--cells N` (20 N^2 base triangles), `--size PIXELS`, `--rounds N`. Prints a
//! Markdown table.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::boulder;
use common::rays::{Packets, Rays};
use common::scene::{displaced, uniform};
use common::timing::{RayTimes, option};
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::prism::{Lod, March, PrismOptions, Prisms, SimdLevel};
use prismarch::trace::{Object, Placement, Shape, Tracer, World};

struct Contestant {
    march: March,
    lod: Option<f32>,
    simd: SimdLevel,
    tracer: EmbreeTracer,
    rays: Rays,
    packets: Packets,
    /// By number of threads, as [`THREADS`].
    times: [RayTimes; THREADS.len()],
    /// The same rays as packets.
    packet_times: [RayTimes; THREADS.len()],
}

const THREADS: [usize; 2] = [1, 2];

impl Contestant {
    /// Primary hits, and how many of them are not the same to the bit in packets.
    fn packets_against_single(&self) -> (usize, usize) {
        let packets = &self.packets.primary;
        let hits = packets
            .iter()
            .flat_map(|packet| self.tracer.intersect8(packet));
        let pairs = hits.zip(&self.rays.primary);
        pairs.fold((0, 0), |(hits, differ), (hit, ray)| {
            let single = self.tracer.intersect(ray);
            (
                hits + usize::from(single.is_some()),
                differ + usize::from(hit != single),
            )
        })
    }
}

fn main() {
    let map = boulder::map(option("--map", 4096));
    let size = option("--size", 1024) as u32;
    let rounds = option("--rounds", 5);
    let mesh = boulder::mesh(option("--cells", 8), map.size().0);

    let mut contestants = Vec::new();
    // Level of detail for pixels of so many times the size: as in a picture of so much fewer.
    let marches = [
        (March::Exact, None),
        (uniform(1.0), None),
        (uniform(4.0), None),
        (March::Exact, Some(1.0)),
        (March::Exact, Some(8.0)),
        (March::Exact, Some(64.0)),
    ];
    let surface = displaced(&mesh, &map);
    for (march, lod) in marches.into_iter().take(option("--marches", 6)) {
        for simd in [SimdLevel::Avx2, SimdLevel::Baseline]
            .into_iter()
            .take(option("--levels", 2))
        {
            let options = PrismOptions {
                march,
                lod: if lod.is_some() { Lod::Cone } else { Lod::Off },
                ..PrismOptions::default()
            };
            let prisms = Prisms::new(surface.clone(), options).expect("a step above zero");
            let Some(prisms) = prisms.with_simd(simd) else {
                continue;
            };
            prisms.set_spread(lod.unwrap_or(0.0) * Rays::pixel_spread(size));
            let world = World::new(vec![Object {
                shape: Shape::Displaced(Arc::new(prisms)),
                placement: Placement::World,
                mask: u32::MAX,
            }]);
            let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default())
                .expect("Embree builds the sphere");
            let rays = Rays::new(size, &tracer);
            contestants.push(Contestant {
                march,
                lod,
                simd,
                packets: Packets::new(&rays),
                rays,
                tracer,
                times: Default::default(),
                packet_times: Default::default(),
            });
        }
    }
    for _ in 0..rounds {
        for contestant in &mut contestants {
            for (times, threads) in contestant.times.iter_mut().zip(THREADS) {
                times.round(&contestant.tracer, &contestant.rays, threads);
            }
            for (times, threads) in contestant.packet_times.iter_mut().zip(THREADS) {
                times.round_of_packets(&contestant.tracer, &contestant.packets, threads);
            }
        }
    }

    for contestant in &contestants {
        let (hits, differ) = contestant.packets_against_single();
        println!(
            "{}, {}: {differ} of {hits} primary hits have other bits in packets",
            name(contestant.march, contestant.lod),
            contestant.simd.name(),
        );
    }
    println!();
    println!("| march | kernel | threads | primary | bounce | occlusion |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for contestant in &contestants {
        let name = name(contestant.march, contestant.lod);
        for (by, times) in [
            ("", &contestant.times),
            (", packets", &contestant.packet_times),
        ] {
            for (times, threads) in times.iter().zip(THREADS) {
                println!(
                    "| {name}{by} | {} | {threads} | {} |",
                    contestant.simd.name(),
                    times.cells(&contestant.rays),
                );
            }
        }
    }
}

fn name(march: March, lod: Option<f32>) -> String {
    match (march, lod) {
        (March::Exact, None) => "exact".to_owned(),
        (March::Exact, Some(pixels)) => format!("exact, lod of {pixels} pixels"),
        (March::Uniform { step, .. }, _) => format!("uniform, {step:?}"),
    }
}
