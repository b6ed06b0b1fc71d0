//! From an edit of the map to the first ray that sees it: `cargo bench --bench edit`.
//!
//! The unit sphere of the other benches (1280 prisms, a 16-bit map of rock); an edit is 64 x 64 texels somewhere on the map. It
//! either stays within the heights that its prisms hold (the texels become their mean), or goes beyond (they become a hill up to the
//! map's largest height). Beside it, in the same rounds: all primary rays of a picture on two threads.
//! Options after `--`: `--map TEXELS`, `--size PIXELS`, `--rounds N`, `--cells N` (20 N^2 prisms). Prints Markdown tables.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::boulder;
use common::rays::Rays;
use common::scene::{displaced, random};
use common::timing::{RayTimes, Times, option};
use glam::Vec3;
use prismarch::bvh::BvhTracer;
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::prism::{EditBounds, March, PrismOptions, Prisms};
use prismarch::ray::Ray;
use prismarch::surface::{DisplacementMap, TexelRect, Texels};
use prismarch::trace::{Edited, Object, Placement, Shape, Tracer, World};

const SIDE: usize = 64;
const THREADS: usize = 2;

/// A tracer that can be told of edits.
trait Editable: Tracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited;
}

impl Editable for EmbreeTracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited {
        self.map_edited(world, map, rect).expect("Embree refits")
    }
}

impl Editable for BvhTracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited {
        self.map_edited(world, map, rect).expect("obvhs refits")
    }
}

struct Contestant {
    name: &'static str,
    prisms: Arc<Prisms>,
    world: World,
    tracer: Box<dyn Editable>,
    rays: RayTimes,
    /// By [`Edit`].
    edits: [Split; 2],
}

/// Where the time of an edit goes.
#[derive(Default)]
struct Split {
    texels: Times,
    bounds: Times,
    commit: Times,
    first_ray: Times,
    touched: usize,
    commits: usize,
    rounds: usize,
}

#[derive(Clone, Copy, Debug)]
enum Edit {
    Within,
    Beyond,
}

fn main() {
    let map = boulder::map(option("--map", 4096));
    let size = option("--size", 1024) as u32;
    let rounds = option("--rounds", 15) as u32;
    let mesh = boulder::mesh(option("--cells", 8), map.size().0);
    type Build = fn(&World) -> Box<dyn Editable>;
    let embree: Build = |world| build_embree(world, false);
    let editable: Build = |world| build_embree(world, true);
    let bvh: Build = |world| Box::new(BvhTracer::new(world).expect("obvhs builds the sphere"));
    let surface = displaced(&mesh, &map);
    let mut contestants = [
        ("embree, tight", embree, EditBounds::Tight),
        ("embree editable, tight", editable, EditBounds::Tight),
        ("embree, range", embree, EditBounds::Range),
        ("obvhs, tight", bvh, EditBounds::Tight),
    ]
    .map(|(name, build, edit_bounds)| {
        let options = PrismOptions {
            march: March::Exact,
            edit_bounds,
            ..PrismOptions::default()
        };
        let prisms = Arc::new(Prisms::new(surface.clone(), options).expect("no step"));
        let world = World::new(vec![Object {
            shape: Shape::Displaced(prisms.clone()),
            placement: Placement::World,
            mask: u32::MAX,
        }]);
        Contestant {
            name,
            tracer: build(&world),
            prisms,
            world,
            rays: RayTimes::default(),
            edits: Default::default(),
        }
    });
    let rays = Rays::new(size, &as_tracer(&*contestants[0].tracer));
    for round in 0..rounds {
        for contestant in &mut contestants {
            let tracer = as_tracer(&*contestant.tracer);
            contestant.rays.round(&tracer, &rays, THREADS);
        }
        for edit in [Edit::Within, Edit::Beyond] {
            for contestant in &mut contestants {
                contestant.edit(edit, &map, round);
            }
        }
    }
    print(&contestants, &rays);
}

fn build_embree(world: &World, editable: bool) -> Box<dyn Editable> {
    let options = EmbreeOptions {
        editable,
        ..EmbreeOptions::default()
    };
    Box::new(EmbreeTracer::new(world, &options).expect("Embree builds the sphere"))
}

impl Contestant {
    /// Edits, traces one ray, and puts the texels back.
    fn edit(&mut self, edit: Edit, map: &Arc<DisplacementMap>, round: u32) {
        let (width, height) = map.size();
        let place = |salt, n: usize| (random(7 * round + salt) * (n - SIDE) as f32) as usize;
        let rect = TexelRect {
            x: place(1, width),
            // Not at the poles, where every prism is thin.
            y: height / 4 + place(2, height / 2),
            width: SIDE,
            height: SIDE,
        };
        let old = map.read(rect).expect("inside the map");
        let new = edited(&old, edit);
        let split = &mut self.edits[edit as usize];
        split
            .texels
            .time(|| map.update(rect, &new))
            .expect("a rectangle of the map's kind");
        let change = split.bounds.time(|| self.prisms.map_edited(rect));
        split.touched += change.touched;
        split.rounds += 1;
        if change.any() {
            let tracer = &mut self.tracer;
            let edited = split.commit.time(|| tracer.edited(&self.world, map, rect));
            split.commits += usize::from(edited.committed);
        }
        let ray = Ray::new(2.0 * Vec3::X, -Vec3::X);
        split.first_ray.time(|| self.tracer.intersect(&ray));
        map.update(rect, &old).expect("what was there");
    }
}

fn edited(old: &Texels, edit: Edit) -> Texels {
    let Texels::U16(old) = old else {
        panic!("the map of rock has 16 bits");
    };
    Texels::U16(match edit {
        Edit::Within => {
            let sum: usize = old.iter().map(|&h| usize::from(h)).sum();
            vec![(sum / old.len()) as u16; old.len()]
        }
        Edit::Beyond => (0..SIDE * SIDE)
            .map(|i| {
                let from_middle = |i: usize| i.abs_diff(SIDE / 2) as f32 / (SIDE / 2) as f32;
                let slope = (1.0 - from_middle(i % SIDE)) * (1.0 - from_middle(i / SIDE));
                old[i].max((slope * 65535.0) as u16)
            })
            .collect(),
    })
}

/// A tracer by reference, as the benches' helpers take it.
fn as_tracer(tracer: &dyn Editable) -> impl Tracer + '_ {
    struct By<'t>(&'t dyn Editable);
    impl Tracer for By<'_> {
        fn intersect(&self, ray: &Ray) -> Option<prismarch::trace::Hit> {
            self.0.intersect(ray)
        }
        fn occluded(&self, ray: &Ray) -> bool {
            self.0.occluded(ray)
        }
        fn bounds(&self) -> prismarch::ray::Aabb {
            self.0.bounds()
        }
        fn bvh_bytes(&self) -> usize {
            self.0.bvh_bytes()
        }
        fn name(&self) -> String {
            self.0.name()
        }
    }
    By(tracer)
}

fn print(contestants: &[Contestant], rays: &Rays) {
    println!("An edit of {SIDE} x {SIDE} texels, microseconds (medians):\n");
    println!(
        "| tracer | edit | texels and pyramid | bounds | commit | first ray | all | prisms touched | commits |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let micro = |times: &Times| {
        let seconds = times.median();
        if seconds.is_nan() { 0.0 } else { seconds * 1e6 }
    };
    for contestant in contestants {
        for (edit, split) in ["within", "beyond"].into_iter().zip(&contestant.edits) {
            let parts = [
                &split.texels,
                &split.bounds,
                &split.commit,
                &split.first_ray,
            ]
            .map(micro);
            let cells = parts.map(|part| format!("{part:.1}")).join(" | ");
            let all: f64 = parts.iter().sum();
            println!(
                "| {} | {edit} | {cells} | {all:.1} | {:.1} | {} of {} |",
                contestant.name,
                split.touched as f64 / split.rounds as f64,
                split.commits,
                split.rounds,
            );
        }
    }
    println!(
        "\nRays on {THREADS} threads, and {} primary rays:\n",
        rays.primary.len()
    );
    println!("| tracer | primary, Mrays/s | bounce | occlusion | all primary rays |");
    println!("| --- | --- | --- | --- | --- |");
    for contestant in contestants {
        let [primary, ..] = contestant.rays.rates(rays);
        println!(
            "| {} | {} | {:.1} ms |",
            contestant.name,
            contestant.rays.cells(rays),
            rays.primary.len() as f64 / primary / 1e3
        );
    }
}
