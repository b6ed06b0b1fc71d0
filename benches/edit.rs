//! From an edit of the map to the first ray that sees it, and what a stroke of edits leaves of the speed of rays:
//! `cargo bench --bench edit`.
//!
//! The unit sphere of the other benches (a 16-bit map of rock); an edit is 64 x 64 texels somewhere on the map. It either stays within
//! the heights that are there (texels become the lower of two neighbours; tight boxes grow by little, but most do), or goes beyond (they become a hill
//! up to the map's largest height). A stroke is 60 such edits in a row, each a bump 12 texels on from the last; then rays at the stroke are timed against
//! those of a tracer built anew, on one thread, in turns.
//! Options after `--`: `--map TEXELS`, `--rays THOUSANDS`, `--rounds N`, `--cells N` (20 N^2 base triangles), `--only NAME`.
//! Prints Markdown tables.

#[path = "common/mod.rs"]
mod common;

use std::sync::Arc;

use common::boulder;
use common::scene::{displaced, random};
use common::timing::{Query, Times, option, trace, word};
use glam::{Vec2, Vec3};
use prismarch::bvh::BvhTracer;
use prismarch::embree::{EmbreeOptions, EmbreeTracer};
use prismarch::prism::{EditBounds, March, PrismOptions, Prisms};
use prismarch::ray::Ray;
use prismarch::surface::{BaseMesh, DisplacedSurface, DisplacementMap, TexelRect, Texels};
use prismarch::trace::{Edited, Follow, Object, Placement, Settling, Shape, Tracer, World};

const SIDE: usize = 64;
const DABS: usize = 60;
/// Texels from dab to dab.
const SPACING: usize = 12;

/// A tracer that can be told of edits.
trait Editable: Tracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited;
}

impl Editable for EmbreeTracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited {
        self.map_edited(world, map, rect).expect("Embree follows")
    }
}

impl Editable for BvhTracer {
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited {
        self.map_edited(world, map, rect).expect("obvhs refits")
    }
}

impl<T: Follow> Editable for Settling<T>
where
    T::Error: std::fmt::Debug,
{
    fn edited(&mut self, world: &World, map: &Arc<DisplacementMap>, rect: TexelRect) -> Edited {
        self.map_edited(world, map, rect).expect("a tracer follows")
    }
}

type Build = fn(&World) -> Box<dyn Editable>;

#[derive(Clone, Copy)]
struct Contestant {
    name: &'static str,
    build: Build,
    edit_bounds: EditBounds,
}

fn contestants() -> Vec<Contestant> {
    let embree: Build =
        |world| Box::new(EmbreeTracer::new(world, &EmbreeOptions::default()).expect("a tree"));
    let bvh: Build = |world| Box::new(BvhTracer::new(world).expect("a tree"));
    let settling_embree: Build = |world| {
        let tracer = EmbreeTracer::new(world, &EmbreeOptions::default());
        Box::new(Settling::new(tracer.expect("a tree")))
    };
    let settling_bvh: Build =
        |world| Box::new(Settling::new(BvhTracer::new(world).expect("a tree")));
    let all = [
        ("embree, tight", embree, EditBounds::Tight),
        ("embree, range", embree, EditBounds::Range),
        ("obvhs, tight", bvh, EditBounds::Tight),
        ("embree, settling", settling_embree, EditBounds::Tight),
        ("obvhs, settling", settling_bvh, EditBounds::Tight),
    ];
    let only = word("--only").unwrap_or_default();
    all.into_iter()
        .filter(|(name, ..)| name.contains(&only))
        .map(|(name, build, edit_bounds)| Contestant {
            name,
            build,
            edit_bounds,
        })
        .collect()
}

/// A contestant's tracer over prisms of its own.
struct Stage {
    prisms: Arc<Prisms>,
    world: World,
    tracer: Box<dyn Editable>,
    built: f64,
}

impl Contestant {
    fn stage(&self, surface: &Arc<DisplacedSurface>) -> Stage {
        let options = PrismOptions {
            march: March::Exact,
            edit_bounds: self.edit_bounds,
            ..PrismOptions::default()
        };
        let prisms = Arc::new(Prisms::new(surface.clone(), options).expect("no step"));
        let world = World::new(vec![Object {
            shape: Shape::Displaced(prisms.clone()),
            placement: Placement::World,
            mask: u32::MAX,
        }]);
        let mut built = Times::default();
        let tracer = built.time(|| (self.build)(&world));
        Stage {
            prisms,
            world,
            tracer,
            built: built.median(),
        }
    }
}

/// Where the time of edits goes.
#[derive(Default)]
struct Split {
    texels: Times,
    boxes: Times,
    commit: Times,
    first_ray: Times,
    all: Times,
    touched: usize,
    commits: usize,
    edits: usize,
}

impl Split {
    /// Texels, boxes, tree, and one ray at what was edited.
    fn edit(&mut self, stage: &mut Stage, rect: TexelRect, new: &Texels, ray: &Ray) {
        let map = stage.prisms.surface().map().clone();
        let mut all = Times::default();
        all.time(|| {
            let update = self.texels.time(|| map.update(rect, new));
            update.expect("a rectangle of the map's kind");
            let change = self.boxes.time(|| stage.prisms.map_edited(rect));
            self.touched += change.touched;
            if change.any() {
                let Stage { tracer, world, .. } = &mut *stage;
                let edited = self.commit.time(|| tracer.edited(world, &map, rect));
                self.commits += usize::from(edited.committed);
            }
            self.first_ray.time(|| stage.tracer.intersect(ray));
        });
        self.all.time_of(&all);
        self.edits += 1;
    }

    fn print(&self, name: &str, edit: &str) {
        let micro = |seconds: f64| if seconds.is_nan() { 0.0 } else { seconds * 1e6 };
        let cells = [
            &self.texels,
            &self.boxes,
            &self.commit,
            &self.first_ray,
            &self.all,
        ]
        .map(|times| format!("{:.0}", micro(times.median())))
        .join(" | ");
        println!(
            "| {name} | {edit} | {cells} | {:.0} | {:.1} | {} of {} |",
            micro(self.all.most()),
            self.touched as f64 / self.edits as f64,
            self.commits,
            self.edits,
        );
    }
}

#[derive(Clone, Copy, Debug)]
enum Edit {
    Within,
    Beyond,
}

fn main() {
    let map = boulder::map(option("--map", 4096));
    let rounds = option("--rounds", 15) as u32;
    let mesh = boulder::mesh(option("--cells", 8), map.size().0);
    let surface = displaced(&mesh, &map);
    let contestants = contestants();

    println!("An edit of {SIDE} x {SIDE} texels, microseconds (medians; `most` is the worst):\n");
    println!(
        "| tracer | edit | texels and leaf ranges | boxes | commit | first ray | all | most | triangles touched | commits |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut strokes = Vec::new();
    for contestant in &contestants {
        let mut stage = contestant.stage(&surface);
        for edit in [Edit::Within, Edit::Beyond] {
            let mut split = Split::default();
            for round in 0..rounds {
                single(&mut split, &mut stage, edit, round);
            }
            split.print(contestant.name, &format!("{edit:?}"));
        }
        strokes.push(Stroke::new(contestant, &surface, rounds));
    }
    println!(
        "\nRays at the stroke, Mrays/s on one thread, after the stroke and for a tracer built anew:\n"
    );
    println!(
        "| tracer | primitives | build, ms | after | anew | ratio | occlusion after | anew | ratio |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for stroke in strokes {
        println!("{stroke}");
    }
}

/// Edits somewhere, traces one ray, and puts the texels back.
fn single(split: &mut Split, stage: &mut Stage, edit: Edit, round: u32) {
    let surface = stage.prisms.surface().clone();
    let map = surface.map();
    let (width, height) = map.size();
    let mut salt = 0;
    // Where there is rock.
    let (rect, ray) = loop {
        let place = |salt, n: usize| (random(7 * round + salt) * (n - SIDE) as f32) as usize;
        let rect = square(place(salt + 1, width), place(salt + 2, height));
        if let Some(ray) = ray_at(surface.mesh(), middle(rect, map)) {
            break (rect, ray);
        }
        salt += 1000;
    };
    let old = map.read(rect).expect("inside the map");
    split.edit(stage, rect, &edited(&old, rect.x, edit), &ray);
    map.update(rect, &old).expect("what was there");
}

fn square(x: usize, y: usize) -> TexelRect {
    TexelRect {
        x,
        y,
        width: SIDE,
        height: SIDE,
    }
}

/// Texture coordinates of a rectangle's middle.
fn middle(rect: TexelRect, map: &DisplacementMap) -> Vec2 {
    let (width, height) = map.size();
    let at = |first: usize, n: usize| (first + SIDE / 2) as f32 / n as f32;
    Vec2::new(at(rect.x, width), at(rect.y, height))
}

/// A ray straight down to where the base mesh has these texture coordinates.
fn ray_at(mesh: &BaseMesh, st: Vec2) -> Option<Ray> {
    (0..mesh.triangles().len() as u32).find_map(|triangle| {
        let [a, b, c] = mesh.corner_texcoords(triangle);
        let area = (b - a).perp_dot(c - a);
        let u = (st - a).perp_dot(c - a) / area;
        let v = (b - a).perp_dot(st - a) / area;
        let [p, q, r] = mesh.corners(triangle);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| {
            let at = p + u * (q - p) + v * (r - p);
            Ray::new(2.0 * at, -at.normalize())
        })
    })
}

fn edited(old: &Texels, x: usize, edit: Edit) -> Texels {
    let Texels::U16(old) = old else {
        panic!("the map of rock has 16 bits");
    };
    Texels::U16(match edit {
        Edit::Within => {
            // Texels of one leaf become the lower of themselves and of their neighbours in it.
            let lower = |i: usize| match (x + i % SIDE) % 8 {
                0 | 7 => old[i],
                _ => old[i].min(old[(i + 1).min(i / SIDE * SIDE + SIDE - 1)]),
            };
            (0..old.len()).map(lower).collect()
        }
        Edit::Beyond => old
            .iter()
            .zip(bump())
            .map(|(&old, bump)| old.max((bump * 65535.0) as u16))
            .collect(),
    })
}

/// A hill over a square, 0 to 1.
fn bump() -> impl Iterator<Item = f32> {
    (0..SIDE * SIDE).map(|i| {
        let from_middle = |i: usize| i.abs_diff(SIDE / 2) as f32 / (SIDE / 2) as f32;
        (1.0 - from_middle(i % SIDE)) * (1.0 - from_middle(i / SIDE))
    })
}

/// What dabs have left.
struct Stroke {
    name: &'static str,
    primitives: usize,
    built: f64,
    /// Mrays/s of first hits and of occlusion, after the stroke and anew.
    rates: [[f64; 2]; 2],
}

impl Stroke {
    fn new(contestant: &Contestant, surface: &Arc<DisplacedSurface>, rounds: u32) -> Self {
        let map = surface.map();
        let mut stage = contestant.stage(surface);
        // In the middle of the sixth rhombus, slanting.
        let cell = map.size().0 / 4;
        let places: Vec<TexelRect> = (0..DABS)
            .map(|dab| {
                let along = (SPACING * dab * cell / 1024) % (cell - 2 * SIDE);
                square(cell + SIDE / 2 + along, cell + cell / 4 + along / 3)
            })
            .collect();
        let all = TexelRect {
            x: 0,
            y: 0,
            width: map.size().0,
            height: map.size().1,
        };
        let before = map.read(all).expect("the map");
        let mut split = Split::default();
        for &rect in &places {
            let Ok(Texels::U16(old)) = map.read(rect) else {
                panic!("the map of rock has 16 bits");
            };
            let raised = old.iter().zip(bump()).map(|(&old, bump)| {
                let height = f32::from(old) + 6000.0 * bump;
                height.min(65535.0) as u16
            });
            let new = Texels::U16(raised.collect());
            let ray = ray_at(surface.mesh(), middle(rect, map)).expect("on a rhombus");
            split.edit(&mut stage, rect, &new, &ray);
        }
        split.print(contestant.name, &format!("{DABS} dabs"));
        let anew = contestant.stage(surface);
        let rays = rays_at(&places, surface);
        let tracers: [&dyn Tracer; 2] = [&as_tracer(&*stage.tracer), &as_tracer(&*anew.tracer)];
        let mut times: [[Times; 2]; 2] = Default::default();
        for _ in 0..rounds {
            for (query, times) in [Query::Intersect, Query::Occluded]
                .into_iter()
                .zip(&mut times)
            {
                for (tracer, times) in tracers.iter().zip(times) {
                    times.time_on(1, || trace(*tracer, &rays, query, 1));
                }
            }
        }
        map.update(all, &before).expect("what was there");
        Self {
            name: contestant.name,
            primitives: stage.prisms.len(),
            built: anew.built,
            rates: times.map(|times| times.map(|times| rays.len() as f64 / times.median() / 1e6)),
        }
    }
}

impl std::fmt::Display for Stroke {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            name,
            primitives,
            built,
            rates,
        } = self;
        write!(f, "| {name} | {primitives} | {:.1} |", built * 1e3)?;
        for [after, anew] in rates {
            write!(f, " {after:.2} | {anew:.2} | {:.3} |", after / anew)?;
        }
        Ok(())
    }
}

/// Rays from around the stroke's middle, some way up, to points all along it.
fn rays_at(places: &[TexelRect], surface: &DisplacedSurface) -> Vec<Ray> {
    let mesh = surface.mesh();
    let feet: Vec<Vec3> = places
        .iter()
        .filter_map(|&rect| ray_at(mesh, middle(rect, surface.map())))
        .map(|ray| ray.origin / 2.0)
        .collect();
    let eye = 1.8 * feet[feet.len() / 2];
    (0..1000 * option("--rays", 60) as u32)
        .map(|i| {
            let number = |k| 2.0 * random(8 * i + k) - 1.0;
            let any = |k| Vec3::new(number(k), number(k + 1), number(k + 2));
            let foot = feet[(random(8 * i) * feet.len() as f32) as usize];
            let from = eye + 0.5 * any(1);
            Ray::new(from, (foot + 0.05 * any(4) - from).normalize())
        })
        .collect()
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
