//! How the time of a ray grows with the map and with the mesh: `cargo bench --bench growth`.
//!
//! The boulder of `common/boulder.rs` under Embree, one thread, exact march: maps from 64x64 to 8192x8192 over 20 base
//! triangles, then 80 to 1.3 million base triangles under a 4096x4096 map. Options after `--`: `--size PIXELS`,
//! `--rounds N`. Prints two Markdown tables of nanoseconds per ray, and draws them as docs/images/growth.svg where `--draw 1` is given.

#[path = "../common/mod.rs"]
mod common;
mod curve;

use std::sync::Arc;

use common::boulder;
use common::rays::Rays;
use common::scene::prisms;
use common::timing::{RayTimes, option};
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::prism::March;
use prismarch::surface::{BaseMesh, DisplacementMap};
use prismarch::trace::{Object, Placement, Shape, World};

struct Case {
    /// Texels along a triangle's side, or triangles.
    count: usize,
    tracer: EmbreeTracer,
    rays: Rays,
    times: RayTimes,
}

fn main() {
    let maps = (6..=13).map(|power| {
        let size = 1 << power;
        let (mesh, map) = (boulder::mesh(1, size), boulder::map(size));
        case(boulder::side(size), &mesh, &map)
    });
    let maps = measured("texels along a side of 20 base triangles", maps.collect());

    let map = boulder::map(4096);
    let meshes = (1..=8).map(|power| {
        let mesh = boulder::mesh(1 << power, 4096);
        case(mesh.triangles().len(), &mesh, &map)
    });
    let meshes = measured("base triangles under a 4096x4096 map", meshes.collect());
    if option("--draw", 0) != 0 {
        std::fs::write(PATH, curve::svg(&[maps, meshes])).expect("docs/images can be written");
        println!("{PATH}");
    }
}

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/images/growth.svg");

fn case(count: usize, mesh: &Arc<BaseMesh>, map: &Arc<DisplacementMap>) -> Case {
    let world = World::new(vec![Object {
        shape: Shape::Displaced(Arc::new(prisms(mesh, map, March::Exact))),
        placement: Placement::World,
        mask: u32::MAX,
    }]);
    let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default()).expect("Embree builds");
    Case {
        count,
        rays: Rays::new(option("--size", 512) as u32, &tracer),
        tracer,
        times: RayTimes::default(),
    }
}

/// Prints the times of all cases, traced in turns.
fn measured(what: &'static str, mut cases: Vec<Case>) -> curve::Panel {
    for _ in 0..option("--rounds", 3) {
        for case in &mut cases {
            case.times.round(&case.tracer, &case.rays, 1);
        }
    }
    println!("| {what} | primary, ns | bounce, ns | occlusion, ns |");
    println!("| --- | --- | --- | --- |");
    let mut points = Vec::new();
    for case in &cases {
        let times = case.times.rates(&case.rays).map(|rate| 1e3 / rate);
        let [primary, bounce, occlusion] = times;
        println!(
            "| {} | {primary:.0} | {bounce:.0} | {occlusion:.0} |",
            case.count
        );
        points.push((case.count as f64, times));
    }
    println!();
    curve::Panel { what, points }
}
