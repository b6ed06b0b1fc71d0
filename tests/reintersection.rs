//! Rays that leave a hit neither meet it again nor slip through it, at any scale and any place.
//!
//! In the spirit of pbrt-v4's shapes_test.cpp: random shapes with random exponents of scale and distance from the
//! origin. Rays start where `RayOffset` puts them. What happens within a few offsets of the hit is looked at: on
//! the normal's side there is nothing, on the other side the surface. Where the map or the mesh has a crease that
//! close the oracle decides; that is rare.
#![cfg(any(feature = "embree", feature = "bvh"))]

#[path = "../benches/common/mod.rs"]
mod common;
#[allow(dead_code)] // a part is used
#[path = "exact/maps.rs"]
mod maps;
#[allow(dead_code)] // a part is used
#[path = "exact/meshes.rs"]
mod meshes;
mod oracle;

use std::sync::Arc;

use common::march;
use common::numbers::Numbers;
use glam::{Affine3A, Quat, Vec3};
use oracle::{EDGE, Line, Oracle};
use prismarch::prism::Prisms;
use prismarch::ray::Ray;
use prismarch::surface::{DisplacedSurface, Wrap};
use prismarch::trace::{Object, Placement, RayOffset, Shape, Tracer, World};

const SHAPES: usize = if cfg!(debug_assertions) { 12 } else { 60 };
const HITS: usize = if cfg!(debug_assertions) { 40 } else { 400 };
/// Directions from each hit, to each side.
const DIRECTIONS: usize = 4;
/// "A few offsets": how far along the normal a ray is followed.
const FEW: f32 = 4.0;
/// Least |cos| between the normal and a ray that leaves. Nearer the tangent plane the next texel cell is soon met.
const STEEP: f32 = 0.3;

/// A torus with some random displacement, scale, turn and place.
fn shape(numbers: &mut Numbers) -> Arc<DisplacedSurface> {
    let scale = 10f32.powf(numbers.between(-4.0, 4.0));
    let away = scale * 10f32.powf(numbers.between(-1.0, 1.0));
    let turn = Quat::from_axis_angle(numbers.direction(), numbers.between(0.0, 3.0));
    let place = Affine3A::from_scale_rotation_translation(
        Vec3::splat(scale),
        turn,
        away * numbers.direction(),
    );
    let mut mesh = meshes::torus(16);
    if numbers.number() < 0.3 {
        mesh = meshes::leaning(mesh, 0.8, numbers.bits());
    }
    let height = numbers.between(0.02, 0.2) * scale;
    let signed = if numbers.number() < 0.5 {
        height
    } else {
        -height
    };
    let map = maps::waves(48, Wrap::Repeat);
    meshes::displaced(meshes::moved(mesh, place), map, signed, numbers.number())
}

struct Scene {
    world: World,
    tracer: Box<dyn Tracer>,
    offset: RayOffset,
}

impl Scene {
    fn new(surface: &Arc<DisplacedSurface>) -> Self {
        let prisms = Prisms::new(surface.clone(), march::under_test()).unwrap();
        let world = World::new(vec![Object {
            shape: Shape::Displaced(Arc::new(prisms)),
            placement: Placement::World,
            mask: u32::MAX,
        }]);
        let tracer = tracer(&world);
        let offset = RayOffset::for_scene(tracer.bounds().diagonal());
        Self {
            world,
            tracer,
            offset,
        }
    }
}

#[cfg(feature = "embree")]
fn tracer(world: &World) -> Box<dyn Tracer> {
    let options = prismarch::embree::EmbreeOptions::default();
    Box::new(prismarch::embree::EmbreeTracer::new(world, &options).unwrap())
}

#[cfg(not(feature = "embree"))]
fn tracer(world: &World) -> Box<dyn Tracer> {
    Box::new(prismarch::bvh::BvhTracer::new(world).unwrap())
}

/// Rays that started and how they fared.
#[derive(Debug, Default)]
struct Count {
    rays: usize,
    /// The oracle agrees that there is a crease.
    creases: usize,
    /// Met the surface again at once, going away from it.
    caught: Vec<String>,
    /// Did not meet the surface at once, going towards it.
    leaked: Vec<String>,
}

/// Sends rays from one hit to both sides.
fn leave(scene: &Scene, oracle: &Oracle<'_>, seen: &Ray, numbers: &mut Numbers, count: &mut Count) {
    let Some(hit) = scene.tracer.intersect(seen) else {
        return;
    };
    let position = scene.world.surface_point(&hit).position;
    let normal = hit.ng * -hit.ng.dot(seen.direction).signum();
    let origin = scene.offset.apply(position, normal);
    let step = origin.distance(position);
    for k in 0..2 * DIRECTIONS {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let anywhere = numbers.direction();
        let cos = anywhere.dot(normal);
        if cos.abs() < STEEP {
            continue;
        }
        let direction = anywhere * cos.signum() * side;
        let ray = Ray {
            tfar: FEW * step / cos.abs(),
            ..Ray::new(origin, direction)
        };
        count.rays += 1;
        let met = scene.tracer.occluded(&ray);
        if met == (side < 0.0) {
            continue;
        }
        // Beyond the place itself only: there the oracle's word is final.
        let found = oracle.trace(&Line::from(&ray), EDGE);
        let real = found.first(&Line::from(&ray));
        let apart = real.first().map_or(f64::INFINITY, |c| {
            let at = ray.origin.as_dvec3() + c.t * ray.direction.as_dvec3();
            at.distance(position.as_dvec3()) / f64::from(step)
        });
        if met != real.is_empty() && apart > 2.0 {
            count.creases += 1;
        } else if met {
            count
                .caught
                .push(format!("{ray:?}\n  from {hit:?}\n  oracle {real:?}"));
        } else {
            count
                .leaked
                .push(format!("{ray:?}\n  from {hit:?}\n  oracle {real:?}"));
        }
    }
}

#[test]
fn rays_leave_on_the_side_they_are_sent_to() {
    let mut numbers = Numbers::new(41);
    let mut count = Count::default();
    for _ in 0..SHAPES {
        let surface = shape(&mut numbers);
        let (scene, oracle) = (Scene::new(&surface), Oracle::new(&surface));
        let bounds = scene.tracer.bounds();
        let (middle, size) = (0.5 * (bounds.min + bounds.max), bounds.diagonal());
        for _ in 0..HITS {
            let origin = middle + size * numbers.direction();
            let target = middle + 0.3 * size * numbers.direction();
            // As well from inside, where the surface is met from behind.
            let part = if numbers.number() < 0.5 { 0.0 } else { 0.7 };
            let ray = Ray::new(origin + part * (target - origin), target - origin);
            leave(&scene, &oracle, &ray, &mut numbers, &mut count);
        }
    }
    let Count {
        rays,
        creases,
        caught,
        leaked,
    } = count;
    println!(
        "{rays} rays, {creases} at creases, {} caught, {} leaked",
        caught.len(),
        leaked.len()
    );
    assert!(rays > SHAPES * HITS && creases * 200 < rays);
    assert!(caught.is_empty(), "caught: {}", caught[0]);
    assert!(leaked.is_empty(), "leaked: {}", leaked.join("\n"));
}
