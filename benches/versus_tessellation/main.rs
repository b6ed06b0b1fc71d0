//! Prisms against tessellations of the same surface under Embree: `cargo bench --bench versus_tessellation`.
//!
//! The boulder of the other benches (1280 base triangles, a 16-bit map of rock) as prisms, as triangles
//! with one vertex per texel, and as Embree's grids of the same density. All engines trace the same rays in the
//! same rounds, one by one and as packets of eight, on one thread and on two. Tessellations get what is fastest for
//! them: scenes without Embree's robust flag, and a vertex set per base triangle without stitching.
//! Options after `--`: `--map TEXELS`, `--size PIXELS`, `--rounds N`, `--only TEXT` (engines whose name has it).
//! Prints Markdown tables.

#[path = "../common/mod.rs"]
mod common;
mod engines;
mod tessellation;

use std::sync::Arc;

use common::boulder;
use common::rays::{Packets, Rays};
use common::scene::displaced;
use common::timing::{RayTimes, Times, option, word};
use engines::{BASELINE, ENGINES, Engine};
use prismarch::embree::{Coherence, Memory, Scene};
use prismarch::ray::{Aabb, Ray, RayPacket};
use prismarch::surface::{DisplacedSurface, Texels};
use prismarch::trace::{Hit, Tracer};
use tessellation::Rect;

const THREADS: [usize; 2] = [1, 2];

/// How rays are handed to Embree.
#[derive(Clone, Copy, PartialEq)]
enum Manner {
    Single,
    Packets(Coherence),
}

const MANNERS: [(&str, Manner); 3] = [
    ("single", Manner::Single),
    ("packets, coherent", Manner::Packets(Coherence::Coherent)),
    (
        "packets, incoherent",
        Manner::Packets(Coherence::Incoherent),
    ),
];

struct Contestant {
    name: &'static str,
    engine: Box<dyn Engine>,
    build: f64,
    /// Embree's, after the build.
    memory: Memory,
    /// By manner and number of threads.
    times: [[RayTimes; THREADS.len()]; MANNERS.len()],
    edits: Times,
}

fn main() {
    let map = boulder::map(option("--map", 4096));
    let size = option("--size", 1024) as u32;
    let rounds = option("--rounds", 5);
    let only = word("--only").unwrap_or_default();
    let surface = displaced(&boulder::mesh(8, map.size().0), &map);

    let mut contestants: Vec<Contestant> = ENGINES
        .into_iter()
        .filter(|(name, _)| name.contains(&only))
        .map(|(name, build)| {
            let mut built = Times::default();
            let engine = built.time(|| build(&surface));
            Contestant {
                name,
                memory: engine.scene().device().memory(),
                engine,
                build: built.median(),
                times: Default::default(),
                edits: Times::default(),
            }
        })
        .collect();
    let Some(first) = contestants.first() else {
        panic!("--only {only}: no such engine");
    };
    let rays = Rays::new(size, &asked(first.engine.scene(), Coherence::Coherent));
    let packets = Packets::new(&rays);
    for _ in 0..rounds {
        for contestant in &mut contestants {
            contestant.round(&rays, &packets);
        }
    }
    let edited_in = edit_all(&surface, &mut contestants);

    print_rates(&contestants, &rays);
    print_costs(&contestants, edited_in);
}

impl Contestant {
    fn round(&mut self, rays: &Rays, packets: &Packets) {
        for ((_, manner), by_threads) in MANNERS.into_iter().zip(&mut self.times) {
            for (threads, times) in THREADS.into_iter().zip(by_threads) {
                match manner {
                    Manner::Single => {
                        let tracer = asked(self.engine.scene(), Coherence::Coherent);
                        times.round(&tracer, rays, threads);
                    }
                    Manner::Packets(coherence) => {
                        let tracer = asked(self.engine.scene(), coherence);
                        times.round_of_packets(&tracer, packets, threads);
                    }
                }
            }
        }
    }

    /// Rates of the fastest manner by kind of rays, for [`THREADS`]`[threads]` threads.
    fn fastest(&self, rays: &Rays, threads: usize) -> [f64; 3] {
        let rates = self.times.iter().map(|times| times[threads].rates(rays));
        rates.fold([0.0; 3], |a, b| {
            std::array::from_fn(|kind| a[kind].max(b[kind]))
        })
    }
}

/// Edits every engine's surface; the result is the median of the seconds that the edit of the map itself took.
fn edit_all(surface: &Arc<DisplacedSurface>, contestants: &mut [Contestant]) -> f64 {
    const EDITS: u16 = 3;
    let map = surface.map();
    let (width, height) = map.size();
    let rect = Rect {
        // In the middle of a rhombus of the boulder.
        start: (width * 3 / 8, height * 3 / 8),
        side: 64.min(width / 2).min(height / 2),
    };
    let mut map_times = Times::default();
    for edit in 1..=EDITS {
        let texels = Texels::U16(vec![edit * 1000; rect.side * rect.side]);
        map_times
            .time(|| map.update(rect.texels(), &texels))
            .expect("a rectangle of a map of 16 bits");
        for contestant in contestants.iter_mut() {
            let engine = &mut contestant.engine;
            contestant.edits.time(|| {
                engine.edit(surface, rect);
                let ray = Ray::new(2.0 * glam::Vec3::X, -glam::Vec3::X);
                engine.scene().intersect1(&ray)
            });
        }
    }
    map_times.median()
}

fn print_rates(contestants: &[Contestant], rays: &Rays) {
    println!("Mrays/s, and in brackets the ratio to the {BASELINE}' faster manner:\n");
    println!("| threads | engine | rays | primary | bounce | occlusion |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for (index, threads) in THREADS.into_iter().enumerate() {
        let baseline = contestants
            .iter()
            .find(|contestant| contestant.name == BASELINE)
            .map(|contestant| contestant.fastest(rays, index));
        for contestant in contestants {
            for ((manner, _), times) in MANNERS.iter().zip(&contestant.times) {
                let rates = times[index].rates(rays);
                let cells: Vec<String> = (0..3)
                    .map(|kind| match baseline {
                        Some(baseline) => {
                            format!("{:.2} ({:.2})", rates[kind], rates[kind] / baseline[kind])
                        }
                        None => format!("{:.2}", rates[kind]),
                    })
                    .collect();
                println!(
                    "| {threads} | {} | {manner} | {} |",
                    contestant.name,
                    cells.join(" | ")
                );
            }
        }
    }
}

/// Memory is what the method needs while it traces: Embree's part, counted by its monitor (as it is after the build,
/// and at most), and the buffers beside it. For prisms these are records, map (with its pyramid) and mesh; for
/// tessellations vertices and indices, without the map they were made from.
fn print_costs(contestants: &[Contestant], edited_in: f64) {
    println!("\nMemory in MB; an edit is 64 x 64 texels, until the first ray sees it:\n");
    println!("| engine | size | Embree | Embree, peak | buffers | peak | build | edit |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for contestant in contestants {
        let memory = contestant.memory;
        let megabytes = |bytes: usize| bytes as f64 / 1e6;
        let buffers = megabytes(contestant.engine.bytes());
        println!(
            "| {} | {} | {:.1} | {:.1} | {buffers:.1} | {:.1} | {:.2} s | {:.2} ms |",
            contestant.name,
            contestant.engine.size(),
            megabytes(memory.current),
            megabytes(memory.peak),
            megabytes(memory.peak) + buffers,
            contestant.build,
            contestant.edits.median() * 1e3,
        );
    }
    println!(
        "\nThe edit of the map itself, {:.3} ms, comes on top for all of them.",
        edited_in * 1e3
    );
}

/// A scene as a tracer whose packets are of one coherence.
struct Asked<'s> {
    scene: &'s Scene,
    coherence: Coherence,
}

fn asked(scene: &Scene, coherence: Coherence) -> Asked<'_> {
    Asked { scene, coherence }
}

impl Tracer for Asked<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.scene.intersect1(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded1(ray)
    }

    fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
        self.scene.intersect8(rays, self.coherence)
    }

    fn occluded8(&self, rays: &RayPacket) -> u8 {
        self.scene.occluded8(rays, self.coherence)
    }

    fn bounds(&self) -> Aabb {
        self.scene.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        self.scene.device().memory().current
    }

    fn name(&self) -> String {
        format!("embree {}", self.scene.device().version())
    }
}
