//! How the time of a ray grows with the map and with the mesh: `cargo bench --bench growth`.
//!
//! The displaced unit sphere of `common/scene.rs` under Embree, one thread, exact march: maps from 64x64 to 8192x8192 over 1280 base
//! triangles, then 80 to 1.3 million base triangles under a 4096x4096 map. Options after `--`: `--size PIXELS`,
//! `--rounds N`. Prints two Markdown tables of nanoseconds per ray.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::rays::Rays;
use common::scene::{prisms, rock_map, sphere};
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
    let mesh = sphere(3);
    let texels_per_triangle = |side: usize| {
        let texels = side as f64 * side as f64 / mesh.triangles().len() as f64;
        // The side of the square that holds as many.
        format!("{side}x{side}: {:.0}^2 texels per triangle", texels.sqrt())
    };
    let maps = (6..=13).map(|power| {
        let map = rock_map(1 << power, 1);
        case(texels_per_triangle(1 << power), &mesh, &map)
    });
    print("map over 1280 base triangles", maps.collect());

    let map = rock_map(4096, 1);
    let meshes = (1..=8).map(|subdivisions| {
        let mesh = sphere(subdivisions);
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
