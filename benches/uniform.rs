//! Rays per second of the uniform march under Embree: `cargo bench --bench uniform`.
//!
//! 1280 base triangles on a unit sphere, a 4096x4096 16-bit map of rock, range 0 .. 0.15, 1024x1024 primary rays.
//! Options after `--`: `--map TEXELS`, `--size PIXELS`, `--rounds N`. Prints a Markdown table.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::rays::Rays;
use common::scene::{prisms, rock_map, sphere};
use common::timing::{RayTimes, option};
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::prism::SimdLevel;
use prismarch::trace::{Object, Placement, Shape, World};

struct Contestant {
    texels: f32,
    simd: SimdLevel,
    tracer: EmbreeTracer,
    rays: Rays,
    /// By number of threads, as [`THREADS`].
    times: [RayTimes; THREADS.len()],
}

const THREADS: [usize; 2] = [1, 2];

fn main() {
    let map = rock_map(option("--map", 4096), 1);
    let size = option("--size", 1024) as u32;
    let rounds = option("--rounds", 5);
    let mesh = sphere(3);

    let mut contestants = Vec::new();
    for texels in [1.0, 4.0] {
        for simd in [SimdLevel::Baseline, SimdLevel::Avx2] {
            let Some(prisms) = prisms(&mesh, &map, texels).with_simd(simd) else {
                continue;
            };
            let world = World::new(vec![Object {
                shape: Shape::Displaced(Arc::new(prisms)),
                placement: Placement::World,
                mask: u32::MAX,
            }]);
            let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default())
                .expect("Embree builds the sphere");
            contestants.push(Contestant {
                texels,
                simd,
                rays: Rays::new(size, &tracer),
                tracer,
                times: Default::default(),
            });
        }
    }
    for _ in 0..rounds {
        for contestant in &mut contestants {
            for (times, threads) in contestant.times.iter_mut().zip(THREADS) {
                times.round(&contestant.tracer, &contestant.rays, threads);
            }
        }
    }

    println!("| step | kernel | threads | primary | bounce | occlusion |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for contestant in &contestants {
        for (times, threads) in contestant.times.iter().zip(THREADS) {
            println!(
                "| {} texels | {:?} | {threads} | {} |",
                contestant.texels,
                contestant.simd,
                times.cells(&contestant.rays),
            );
        }
    }
}
