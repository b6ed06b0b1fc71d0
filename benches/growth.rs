//! How the time of a ray grows with the map and with the mesh: `cargo bench --bench growth`.
//!
//! The boulder of `common/boulder.rs` under Embree, one thread, exact march: maps from 64x64 to 8192x8192 over 1280 base
//! triangles, then 80 to 1.3 million base triangles under a 4096x4096 map. Options after `--`: `--size PIXELS`,
//! `--rounds N`. Prints two Markdown tables of nanoseconds per ray.

#[path = "common/mod.rs"]
mod common;

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
    name: String,
    tracer: EmbreeTracer,
    rays: Rays,
    times: RayTimes,
}

fn main() {
    let texels_per_triangle = |side: usize| {
        // A side of the square that holds as many.
        let texels = (side / 4 - 8) as f64 / 8.0 / 2f64.sqrt();
        format!("{side}x{side}: {texels:.0}^2 texels per triangle")
    };
    let maps = (6..=13).map(|power| {
        let size = 1 << power;
        let (mesh, map) = (boulder::mesh(8, size), boulder::map(size));
        case(texels_per_triangle(size), &mesh, &map)
    });
    print("map over 1280 base triangles", maps.collect());

    let map = boulder::map(4096);
    let meshes = (1..=8).map(|power| {
        let mesh = boulder::mesh(1 << power, 4096);
        case(mesh.triangles().len().to_string(), &mesh, &map)
    });
    print("base triangles under a 4096x4096 map", meshes.collect());
}

fn case(name: String, mesh: &Arc<BaseMesh>, map: &Arc<DisplacementMap>) -> Case {
    let world = World::new(vec![Object {
        shape: Shape::Displaced(Arc::new(prisms(mesh, map, March::Exact))),
        placement: Placement::World,
        mask: u32::MAX,
    }]);
    let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default()).expect("Embree builds");
    Case {
        name,
        rays: Rays::new(option("--size", 512) as u32, &tracer),
        tracer,
        times: RayTimes::default(),
    }
}

fn print(what: &str, mut cases: Vec<Case>) {
    for _ in 0..option("--rounds", 3) {
        for case in &mut cases {
            case.times.round(&case.tracer, &case.rays, 1);
        }
    }
    println!("| {what} | primary, ns | bounce, ns | occlusion, ns |");
    println!("| --- | --- | --- | --- |");
    for case in &cases {
        let [primary, bounce, occlusion] = case.times.rates(&case.rays).map(|rate| 1e3 / rate);
        println!(
            "| {} | {primary:.0} | {bounce:.0} | {occlusion:.0} |",
            case.name
        );
    }
    println!();
}
