//! Embree and obvhs side by side: `cargo bench --bench backends`.
//!
//! The same unit sphere as prisms (1280 base triangles, a 16-bit map of rock, the exact march) and as
//! plain triangles (327 680 of them, undisplaced). One thread traces; Embree builds on all cores, obvhs on one.
//! Options after `--`: `--map TEXELS`, `--size PIXELS`, `--rounds N`. Prints a Markdown table.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::boulder;
use common::rays::Rays;
use common::scene::{prisms, sphere};
use common::timing::{RayTimes, Times, option};
use prismarch::bvh::BvhTracer;
use prismarch::embree::{
    BuildQuality, Device, DeviceOptions, EmbreeOptions, EmbreeTracer, Scene, SceneBuilder,
    SceneOptions, UserGeometry,
};
use prismarch::prism::{March, Prisms};
use prismarch::trace::{Object, Placement, Shape, Tracer, World};

struct Case {
    name: String,
    world: World,
    rays: Rays,
    embree: Contestant<EmbreeTracer>,
    bvh: Contestant<BvhTracer>,
    /// For Embree's refit, which needs a scene of low build quality; triangles are not edited.
    edited: Option<Scene>,
}

struct Contestant<T> {
    tracer: T,
    build: Times,
    refit: Times,
    rays: RayTimes,
}

impl<T: Tracer> Contestant<T> {
    fn new(build: impl FnOnce() -> T) -> Self {
        let mut times = Times::default();
        Self {
            tracer: times.time(build),
            build: times,
            refit: Times::default(),
            rays: RayTimes::default(),
        }
    }

    fn rebuild(&mut self, build: impl FnOnce() -> T) {
        self.tracer = self.build.time(build);
    }

    fn print(&self, case: &Case) {
        println!(
            "| {} | {} | {} | {:.1} ms | {} | {:.2} MB |",
            case.name,
            self.tracer.name(),
            self.rays.cells(&case.rays),
            self.build.median() * 1e3,
            match self.refit.median() {
                seconds if seconds.is_nan() => "-".to_owned(),
                seconds => format!("{:.2} ms", seconds * 1e3),
            },
            self.tracer.bvh_bytes() as f64 / 1e6,
        );
    }
}

fn main() {
    let map = boulder::map(option("--map", 4096));
    let size = option("--size", 1024) as u32;
    let rounds = option("--rounds", 5);
    let base = boulder::mesh(8, map.size().0);
    let fine = sphere(7);

    let displaced = Shape::Displaced(Arc::new(prisms(&base, &map, March::default())));
    let mut cases = [
        case(
            format!("{} prisms", base.triangles().len()),
            displaced,
            size,
        ),
        case(
            format!("{} triangles", fine.triangles().len()),
            Shape::Triangles(fine),
            size,
        ),
    ];
    for _ in 0..rounds {
        for case in &mut cases {
            round(case);
        }
    }

    println!("| scene | backend | primary | bounce | occlusion | build | refit | BVH |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for case in &cases {
        case.embree.print(case);
        case.bvh.print(case);
    }
}

fn case(name: String, shape: Shape, size: u32) -> Case {
    let edited = match &shape {
        Shape::Displaced(prisms) => Some(refittable(prisms)),
        Shape::Triangles(_) => None,
    };
    let world = World::new(vec![Object {
        shape,
        placement: Placement::World,
        mask: u32::MAX,
    }]);
    let embree = Contestant::new(|| embree(&world));
    Case {
        name,
        rays: Rays::new(size, &embree.tracer),
        embree,
        bvh: Contestant::new(|| bvh(&world)),
        world,
        edited,
    }
}

fn round(case: &mut Case) {
    case.embree.rays.round(&case.embree.tracer, &case.rays, 1);
    case.bvh.rays.round(&case.bvh.tracer, &case.rays, 1);
    case.embree.rebuild(|| embree(&case.world));
    case.bvh.rebuild(|| bvh(&case.world));
    if let Some(scene) = case.edited.take() {
        case.edited = Some(case.embree.refit.time(|| refit(scene)));
    }
    let bvh = &mut case.bvh;
    bvh.refit
        .time(|| bvh.tracer.refit(&case.world))
        .expect("the world that was built");
}

fn embree(world: &World) -> EmbreeTracer {
    EmbreeTracer::new(world, &EmbreeOptions::default()).expect("Embree builds the sphere")
}

fn bvh(world: &World) -> BvhTracer {
    BvhTracer::new(world).expect("obvhs builds the sphere")
}

/// A scene of the quality at which Embree refits instead of building anew; it must be dynamic too, or every commit drops the
/// trees that there are.
fn refittable(prisms: &Arc<Prisms>) -> Scene {
    let build = || {
        let device = Device::new(&DeviceOptions::default())?;
        let options = SceneOptions {
            quality: BuildQuality::Low,
            dynamic: true,
            ..SceneOptions::default()
        };
        let mut builder = SceneBuilder::new(&device, options)?;
        builder.attach(UserGeometry::new(&device, prisms.clone())?)?;
        builder.commit()
    };
    build().expect("Embree builds the sphere")
}

fn refit(scene: Scene) -> Scene {
    let mut builder = scene.reopen();
    builder.changed(0).expect("the only geometry");
    builder.commit().expect("Embree refits the sphere")
}
