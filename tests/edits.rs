//! Edits of a map in place: a tracer that was told traces what one built afterwards over the same prisms does, bit for bit,
//! and what one over new prisms does, up to rounding where those have narrower ranges.
#![cfg(feature = "bvh")]

#[path = "../benches/common/mod.rs"]
mod common;

use std::sync::Arc;

use common::scene::{RANGE, random, rock_map, sphere};
use glam::{Affine3A, Vec2, Vec3};
use prismarch::bvh::BvhTracer;
use prismarch::prism::{EditBounds, March, PrismOptions, Prisms};
use prismarch::ray::{Ray, RayPacket};
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, Seams, TexelRect, Texels, UvTransform, Wrap,
};
use prismarch::trace::{Edited, Follow, Hit, Object, Placement, Settling, Shape, Tracer, World};

const MAP: usize = 64;

const EVERYTHING: TexelRect = TexelRect {
    x: 0,
    y: 0,
    width: MAP,
    height: MAP,
};

/// A sphere in world space and two instances of another over the same map (more than once, and beyond its edges), a third over a map
/// that is never edited, one of few large triangles with closed seams, and one of triangles of less than a few texels.
struct Stage {
    map: Arc<DisplacementMap>,
    still: Arc<DisplacementMap>,
}

impl Stage {
    fn new(wrap: Wrap) -> Self {
        let rock = |seed| {
            let map = rock_map(MAP, seed);
            let texels = map.read(EVERYTHING).unwrap();
            Arc::new(DisplacementMap::new(MAP, MAP, texels, wrap).unwrap())
        };
        Self {
            map: rock(7),
            still: rock(8),
        }
    }

    fn world(&self, edit_bounds: EditBounds) -> World {
        let shape = |subdivisions, map: &Arc<DisplacementMap>, repeats: f32, seams| {
            let displacement = Displacement {
                uv: UvTransform {
                    scale: Vec2::new(repeats, 1.0),
                    offset: Vec2::new(0.3, 0.4) * (repeats - 1.0),
                    ..UvTransform::default()
                },
                ..Displacement::new(RANGE)
            };
            let surface = DisplacedSurface::new(sphere(subdivisions), map.clone(), displacement)
                .map(|surface| surface.with_seams(seams));
            let options = PrismOptions {
                march: March::Exact,
                edit_bounds,
                ..PrismOptions::default()
            };
            let prisms = Prisms::new(Arc::new(surface.unwrap()), options).unwrap();
            Shape::Displaced(Arc::new(prisms))
        };
        let object = |shape, placement| Object {
            shape,
            placement,
            mask: u32::MAX,
        };
        let at = |x: f32| Affine3A::from_translation(Vec3::X * x);
        let up = |z: f32| Affine3A::from_translation(Vec3::Z * z);
        World::new(vec![
            object(shape(2, &self.map, 1.0, Seams::Open), Placement::World),
            object(
                shape(1, &self.map, 2.0, Seams::Open),
                Placement::Instances(vec![at(3.0), at(-3.0)]),
            ),
            object(
                shape(1, &self.still, 1.0, Seams::Open),
                Placement::Instances(vec![at(6.0)]),
            ),
            object(
                shape(0, &self.map, 1.7, Seams::Closed),
                Placement::Instances(vec![at(-6.0)]),
            ),
            object(
                shape(3, &self.map, 0.5, Seams::Closed),
                Placement::Instances(vec![up(3.0)]),
            ),
        ])
    }

    /// Sets a random rectangle to random heights from `low` to `high`.
    fn edit(&self, number: u32, [low, high]: [u16; 2]) -> TexelRect {
        let random = |salt: u32| random(97 * number + salt);
        let start = |salt| (random(salt) * (MAP - 1) as f32) as usize;
        let (x, y) = (start(0), start(1));
        let side =
            |salt, start: usize| 1 + (random(salt).powi(2) * (MAP - start - 1) as f32) as usize;
        let rect = TexelRect {
            x,
            y,
            width: side(2, x),
            height: side(3, y),
        };
        let height = |i: usize| {
            let span = f32::from(high - low);
            low + (random(4 + i as u32) * span) as u16
        };
        let texels = Texels::U16((0..rect.width * rect.height).map(height).collect());
        self.map.update(rect, &texels).unwrap();
        rect
    }
}

fn rays(seed: u32) -> impl Iterator<Item = Ray> {
    (0..3000).map(move |i| {
        let number = |k: u32| 2.0 * random(seed ^ (i * 8 + k)) - 1.0;
        let origin = Vec3::new(8.0 * number(0), 5.0 * number(1), 5.0 * number(2));
        let target = match i % 5 {
            0 => Vec3::new(number(3), number(4), 3.0 + number(5)),
            _ => Vec3::new(7.0 * number(3), number(4), number(5)),
        };
        Ray::new(origin, target - origin)
    })
}

/// What a tracer of either backend must do; `told` takes an edit over.
fn law<T: Tracer>(
    wrap: Wrap,
    edit_bounds: EditBounds,
    build: impl Fn(&World) -> T,
    told: impl Fn(&mut T, &World, &Arc<DisplacementMap>, TexelRect) -> Edited,
) {
    let stage = Stage::new(wrap);
    let world = stage.world(edit_bounds);
    let mut tracer = build(&world);
    let mut commits = 0;
    for number in 0..8 {
        let rect = stage.edit(number, [0, u16::MAX]);
        let edited = told(&mut tracer, &world, &stage.map, rect);
        commits += u32::from(edited.committed);
        assert_same(&tracer, &build(&world), number);
        assert_like(
            &tracer,
            &build(&stage.world(edit_bounds)),
            edit_bounds,
            number,
        );
        // Told twice, it has nothing left to do.
        let nothing = told(&mut tracer, &world, &stage.map, rect);
        assert!(!nothing.committed);
    }
    match edit_bounds {
        EditBounds::Tight => assert!(commits > 0),
        EditBounds::Range => assert_eq!(commits, 0),
    }
}

/// Every texel at both ends, beside others at the other end, and then less: there is room, as long as nobody takes boxes anew.
fn room<T: Tracer>(
    wrap: Wrap,
    edit_bounds: EditBounds,
    build: impl Fn(&World) -> T,
    told: impl Fn(&mut T, &World, &Arc<DisplacementMap>, TexelRect) -> Edited,
) {
    let stage = Stage::new(wrap);
    let world = stage.world(edit_bounds);
    let mut tracer = build(&world);
    for parity in [0, 1] {
        let is_high = |i: usize| (i % MAP + i / MAP) % 2 == parity;
        let texels = (0..MAP * MAP).map(|i| if is_high(i) { u16::MAX } else { 0 });
        let texels = Texels::U16(texels.collect());
        stage.map.update(EVERYTHING, &texels).unwrap();
        told(&mut tracer, &world, &stage.map, EVERYTHING);
    }
    for number in 8..12 {
        let rect = stage.edit(number, [500, 65_000]);
        let edited = told(&mut tracer, &world, &stage.map, rect);
        assert!(!edited.committed);
        assert_eq!(edited.prims_touched > 0, edit_bounds == EditBounds::Tight);
        assert_same(&tracer, &build(&world), number);
        assert_like(
            &tracer,
            &build(&stage.world(edit_bounds)),
            edit_bounds,
            number,
        );
    }
}

fn bounds(world: &World) -> Vec<prismarch::ray::Aabb> {
    let of = |object: &Object| match &object.shape {
        Shape::Displaced(prisms) => (0..prisms.len() as u32).map(|p| prisms.bounds(p)).collect(),
        Shape::Triangles(_) => Vec::new(),
    };
    world.objects().iter().flat_map(of).collect()
}

/// `tracer` against one over new prisms. Where those have narrower ranges, roots are rounded from elsewhere.
fn assert_like(tracer: &impl Tracer, new: &impl Tracer, edit_bounds: EditBounds, seed: u32) {
    if edit_bounds == EditBounds::Range {
        return assert_same(tracer, new, seed);
    }
    let mut grazes = 0;
    for ray in rays(seed.wrapping_mul(0x1234_5677)) {
        match (tracer.intersect(&ray), new.intersect(&ray)) {
            (None, None) => {}
            (Some(a), Some(b)) if (a.t - b.t).abs() <= 2e-6 * b.t => {}
            _ => grazes += 1,
        }
    }
    assert!(grazes <= 1, "{grazes}");
}

/// The hits of `tracer` are those of `new`, but for the name of what is hit twice at the same t.
fn assert_same(tracer: &impl Tracer, new: &impl Tracer, seed: u32) {
    let mut hits = 0;
    for ray in rays(seed.wrapping_mul(0x1234_5677)) {
        let (a, b) = (tracer.intersect(&ray), new.intersect(&ray));
        let t = |hit: &Option<Hit>| hit.map(|hit| hit.t.to_bits());
        assert_eq!(t(&a), t(&b), "{ray:?}\n{a:?}\n{b:?}");
        if let (Some(a), Some(b)) = (a, b)
            && (a.prim, a.geom, a.inst) == (b.prim, b.geom, b.inst)
        {
            assert_eq!(a, b, "{ray:?}");
            hits += 1;
        }
        assert_eq!(tracer.occluded(&ray), a.is_some(), "{ray:?}");
    }
    assert!(hits > 500, "{hits}");
    let all: Vec<Ray> = rays(seed.wrapping_mul(0x1234_5677)).collect();
    for eight in all.chunks_exact(RayPacket::LANES) {
        let packet = RayPacket::from_rays(eight);
        let (found, occluded) = (tracer.intersect8(&packet), tracer.occluded8(&packet));
        for (lane, ray) in eight.iter().enumerate() {
            let t = |hit: Option<Hit>| hit.map(|hit| hit.t.to_bits());
            assert_eq!(t(found[lane]), t(tracer.intersect(ray)), "{ray:?}");
            assert_eq!(occluded >> lane & 1 == 1, found[lane].is_some(), "{ray:?}");
        }
    }
}

#[test]
fn edits_under_obvhs_are_as_good_as_a_new_tracer() {
    for (wrap, edit_bounds) in CASES {
        let build = |world: &World| BvhTracer::new(world).unwrap();
        let told = |tracer: &mut BvhTracer, world: &World, map: &Arc<DisplacementMap>, rect| {
            checked(world, || tracer.map_edited(world, map, rect).unwrap())
        };
        law(wrap, edit_bounds, build, told);
        room(wrap, edit_bounds, build, told);
    }
}

/// Whether a new one is made behind the edits or not.
#[test]
fn edits_of_a_settling_tracer_are_as_good_as_a_new_one() {
    settling_law(|world| BvhTracer::new(world).unwrap());
}

fn settling_law<T: Follow>(build: impl Fn(&World) -> T)
where
    T::Error: std::fmt::Debug,
{
    law(
        Wrap::Repeat,
        EditBounds::Tight,
        |world| Settling::new(build(world)),
        |tracer, world, map, rect| {
            let edited = tracer.map_edited(world, map, rect).unwrap();
            match rect.x % 3 {
                0 => tracer.settle(),
                // Some are made while nobody waits.
                1 => std::thread::sleep(std::time::Duration::from_millis(40)),
                _ => {}
            }
            edited
        },
    );
}

/// An edit commits where bounds have grown, and only there.
fn checked(world: &World, edit: impl FnOnce() -> Edited) -> Edited {
    let before = bounds(world);
    let edited = edit();
    assert_eq!(edited.committed, before != bounds(world));
    edited
}

const CASES: [(Wrap, EditBounds); 4] = [
    (Wrap::Repeat, EditBounds::Tight),
    (Wrap::Repeat, EditBounds::Range),
    (Wrap::Clamp, EditBounds::Tight),
    (Wrap::Mirror, EditBounds::Tight),
];

#[cfg(feature = "embree")]
mod embree {
    use super::*;
    use prismarch::embree::{
        Device, DeviceOptions, EmbreeOptions, EmbreeTracer, SceneBuilder, SceneOptions,
        UserGeometry,
    };
    use prismarch::prism::MovingPrisms;
    use prismarch::surface::{MovingSurface, TimeStep};

    #[test]
    fn edits_under_embree_are_as_good_as_a_new_tracer() {
        for (wrap, edit_bounds) in CASES {
            let build =
                |world: &World| EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap();
            let told =
                |tracer: &mut EmbreeTracer, world: &World, map: &Arc<DisplacementMap>, rect| {
                    checked(world, || tracer.map_edited(world, map, rect).unwrap())
                };
            law(wrap, edit_bounds, build, told);
            room(wrap, edit_bounds, build, told);
        }
    }

    #[test]
    fn edits_of_a_settling_tracer_are_as_good_as_a_new_one() {
        settling_law(|world| EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap());
    }

    /// An edit is taken back, and bounds become what they were when the large scene was built.
    #[test]
    fn what_has_shrunk_again_is_not_lost() {
        let stage = Stage::new(Wrap::Repeat);
        let world = stage.world(EditBounds::Tight);
        let build = || EmbreeTracer::new(&world, &EmbreeOptions::default()).unwrap();
        let mut tracer = build();
        let new = bounds(&world);
        let before = stage.map.read(EVERYTHING).unwrap();
        let mut commits = 0;
        for number in 0..4 {
            let rect = stage.edit(number, [0, u16::MAX]);
            tracer.map_edited(&world, &stage.map, rect).unwrap();
            stage.map.update(EVERYTHING, &before).unwrap();
            tracer.map_edited(&world, &stage.map, EVERYTHING).unwrap();
            world.tighten();
            let now = bounds(&world);
            let is_back = new.iter().zip(&now).filter(|(a, b)| a == b).count();
            assert!(is_back > new.len() / 2, "{is_back} of {}", new.len());
            // One more, so that the tracer looks at bounds again.
            let rect = stage.edit(number + 4, [0, u16::MAX]);
            let edited = tracer.map_edited(&world, &stage.map, rect).unwrap();
            commits += u32::from(edited.committed);
            assert_same(&tracer, &build(), number);
            stage.map.update(EVERYTHING, &before).unwrap();
            tracer.map_edited(&world, &stage.map, EVERYTHING).unwrap();
            world.tighten();
        }
        assert!(commits > 1, "{commits}");
    }

    /// Rays are asked of one scene again, without another edit.
    #[test]
    fn a_settling_tracer_settles() {
        let stage = Stage::new(Wrap::Repeat);
        let world = stage.world(EditBounds::Tight);
        let build = || EmbreeTracer::new(&world, &EmbreeOptions::default()).unwrap();
        let first = |tracer: &EmbreeTracer| -> Vec<_> {
            let hits = rays(3).map(|ray| tracer.scene().intersect1(&ray));
            hits.map(|hit| hit.map(|hit| hit.t.to_bits())).collect()
        };
        let mut tracer = Settling::new(build());
        tracer.settle();
        let mut commits = 0;
        for number in 0..4 {
            let rect = stage.edit(number, [0, u16::MAX]);
            let edited = tracer.map_edited(&world, &stage.map, rect).unwrap();
            commits += u32::from(edited.committed);
        }
        assert!(commits > 0);
        tracer.settle();
        assert_eq!(first(tracer.tracer()), first(&build()));
    }

    /// All is in one scene again, and the edits are in it.
    #[test]
    fn a_settled_tracer_is_as_good_as_a_new_one() {
        let stage = Stage::new(Wrap::Repeat);
        let world = stage.world(EditBounds::Tight);
        let build = |world: &World| EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap();
        let mut tracer = build(&world);
        let first = |scene: &prismarch::embree::Scene| -> Vec<_> {
            let hits = rays(3).map(|ray| scene.intersect1(&ray));
            hits.map(|hit| hit.map(|hit| hit.t.to_bits())).collect()
        };
        let mut commits = 0;
        for number in 0..4 {
            let rect = stage.edit(number, [0, u16::MAX]);
            let edited = tracer.map_edited(&world, &stage.map, rect).unwrap();
            commits += u32::from(edited.committed);
        }
        let new = build(&world);
        // What has grown is elsewhere, or there was nothing to settle.
        assert!(commits > 0 && first(tracer.scene()) != first(new.scene()));
        tracer.settle(&world).unwrap();
        assert_eq!(first(tracer.scene()), first(new.scene()));
        assert_same(&tracer, &new, 3);
    }

    /// A moving object's boxes are its triangles' ranges at every time step: those that an edit widens are told to Embree.
    #[test]
    fn edits_of_a_moving_object_are_as_good_as_a_new_scene() {
        let stage = Stage::new(Wrap::Repeat);
        let surface =
            DisplacedSurface::new(sphere(1), stage.map.clone(), Displacement::new(RANGE)).unwrap();
        let mesh = surface.mesh().clone();
        let moved = TimeStep {
            positions: mesh
                .positions()
                .iter()
                .map(|p| 1.5 * *p + Vec3::X)
                .collect(),
            normals: mesh.normals().to_vec(),
        };
        let moving = Arc::new(MovingSurface::new(Arc::new(surface), vec![moved]).unwrap());
        let device = Device::new(&DeviceOptions::default()).unwrap();
        let build = || {
            let prisms = Arc::new(MovingPrisms::new(moving.clone(), March::Exact).unwrap());
            let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
            builder
                .attach(UserGeometry::new(&device, prisms.clone()).unwrap())
                .unwrap();
            (prisms, builder.commit().unwrap())
        };
        let (prisms, mut scene) = build();
        let mut commits = 0;
        for number in 0..8 {
            let rect = stage.edit(number, [0, u16::MAX]);
            if prisms.map_edited(rect).any() {
                let mut builder = scene.reopen();
                builder.changed(0).unwrap();
                scene = builder.commit().unwrap();
                commits += 1;
            }
            let (_, new) = build();
            let (mut hits, mut grazes) = (0, 0);
            for (i, ray) in (0u32..).zip(rays(number)) {
                let ray = Ray {
                    time: random(i),
                    ..ray
                };
                match (scene.intersect1(&ray), new.intersect1(&ray)) {
                    (None, None) => {}
                    (Some(a), Some(b)) if (a.t - b.t).abs() <= 2e-6 * b.t => hits += 1,
                    _ => grazes += 1,
                }
            }
            assert!(hits > 100 && grazes <= 1, "{hits} {grazes}");
        }
        assert!(commits > 0);
    }

    /// The first to be told makes the bounds grow; the second must not take that for nothing new.
    #[test]
    fn two_tracers_of_the_same_prisms_both_follow() {
        let stage = Stage::new(Wrap::Repeat);
        let world = stage.world(EditBounds::Tight);
        let mut embree = EmbreeTracer::new(&world, &EmbreeOptions::default()).unwrap();
        let mut bvh = BvhTracer::new(&world).unwrap();
        let rect = TexelRect {
            x: 10,
            y: 20,
            width: 20,
            height: 20,
        };
        stage
            .map
            .update(rect, &Texels::U16(vec![u16::MAX; 400]))
            .unwrap();
        assert!(
            embree
                .map_edited(&world, &stage.map, rect)
                .unwrap()
                .committed
        );
        assert!(bvh.map_edited(&world, &stage.map, rect).unwrap().committed);
        assert_same(&bvh, &BvhTracer::new(&world).unwrap(), 3);
        // Instances round differently: the box will do.
        assert!((embree.bounds().max - bvh.bounds().max).abs().max_element() < 1e-4);
    }
}
