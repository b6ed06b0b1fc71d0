//! Closed surfaces have no holes: `cargo bench --bench watertight`.
//!
//! Shoots random lines and rays from inside at closed displaced meshes through Embree on all cores and counts those
//! that break the laws of `common/closed.rs`. Options after `--`: `--lines N`, of both kinds and all meshes together.
//! Prints a Markdown table and up to three odd lines per mesh.
//!
//! *Tied* lines are odd ones which in exact arithmetic cross twice within four units in the last place of t, or touch
//! without crossing, as far as the oracle can tell: where two crossings have one t in single precision, a count by
//! restarting the ray there cannot see both.

#[path = "common/mod.rs"]
mod common;
#[path = "../tests/oracle/mod.rs"]
mod oracle;

use std::sync::Arc;
use std::time::Instant;

use common::closed;
use common::timing::option;
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::trace::{Object, Placement, Shape, World};

fn main() {
    let meshes = closed::all();
    let count = option("--lines", 10_000_000) / (2 * meshes.len());
    println!("| mesh | lines | odd | tied | inside rays | escaped | s |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for closed in &meshes {
        let world = World::new(vec![Object {
            shape: Shape::Displaced(Arc::new(closed.prisms())),
            placement: Placement::World,
            mask: u32::MAX,
        }]);
        let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default()).expect("Embree builds");
        let start = Instant::now();
        let faults = closed::faults(closed, &tracer, count, 1);
        let seconds = start.elapsed().as_secs_f64();
        let oracle = oracle::Oracle::new(&closed.surface);
        let (tied, odd): (Vec<_>, Vec<_>) =
            faults.odd.iter().partition(|line| oracle.is_tied(line));
        println!(
            "| {} | {count} | {} | {} | {count} | {} | {seconds:.1} |",
            closed.name,
            odd.len(),
            tied.len(),
            faults.escaped.len(),
        );
        for ray in odd
            .iter()
            .take(3)
            .copied()
            .chain(faults.escaped.iter().take(3))
        {
            println!("<!-- {:?} {:?} -->", ray.origin, ray.direction);
        }
    }
}
