//! Both backends against a loop over all primitives, and against each other.
//!
//! What is promised: under obvhs the hits on prisms are those of the loop, bit for bit, ties included (the lower
//! top-level id and primitive). Embree runs the same kernels on the same rays, so objects that stand in world space
//! give the same t, but of two hits at the same t Embree reports the one it meets first; its instances transform rays
//! with roundings of their own, and it has a triangle test of its own, so there t agrees to a tolerance.
#![cfg(feature = "bvh")]

#[path = "../benches/common/mod.rs"]
mod common;

use std::f32::consts::TAU;
use std::sync::Arc;

use common::scene::{prisms, random, rock_map, sphere};
use glam::{Affine3A, DVec3, Quat, Vec3};
use prismarch::bvh::{BvhError, BvhTracer};
use prismarch::prism::{March, PrismHit};
use prismarch::ray::Ray;
use prismarch::surface::BaseMesh;
use prismarch::trace::{Hit, INVALID_ID, Object, Placement, Shape, Tracer, World, WorldError};

/// Numbers in a fixed order, different for every seed.
struct Random(u32);

impl Random {
    fn number(&mut self) -> f32 {
        self.0 += 1;
        random(self.0)
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.number()
    }

    fn in_cube(&mut self, half: f32) -> Vec3 {
        Vec3::from_array([0; 3].map(|_| self.between(-half, half)))
    }

    fn rotation(&mut self) -> Quat {
        let axis = self.in_cube(1.0).try_normalize().unwrap_or(Vec3::X);
        Quat::from_axis_angle(axis, self.between(0.0, TAU))
    }

    /// Rotated, moved, and scaled by 0.2 .. 2 along each axis, mirrored now and then.
    fn transform(&mut self) -> Affine3A {
        let scale = Vec3::from_array([0; 3].map(|_| {
            let size = self.between(0.2, 2.0);
            if self.number() < 0.2 { -size } else { size }
        }));
        Affine3A::from_scale_rotation_translation(scale, self.rotation(), self.in_cube(3.0))
    }

    /// A ray through the middle of things, with any length of direction and now and then limits, a mask
    /// or a direction along an axis.
    fn ray(&mut self) -> Ray {
        let origin = self.in_cube(6.0);
        let mut direction = self.in_cube(2.5) - origin;
        if self.number() < 0.1 {
            direction = Vec3::AXES[(self.number() * 3.0) as usize] * direction;
        }
        let unit = 10f32.powf(self.between(-5.0, 5.0));
        let mut ray = Ray::new(origin, direction * unit);
        if self.number() < 0.3 {
            ray.tnear = self.number() / unit;
            ray.tfar = ray.tnear + self.number() / unit;
        }
        if self.number() < 0.3 {
            ray.mask = 1 << (self.number() * 3.0) as u32;
        }
        ray
    }
}

fn displaced(subdivisions: u32) -> Shape {
    Shape::Displaced(Arc::new(prisms(
        &sphere(subdivisions),
        &rock_map(64, 7),
        March::default(),
    )))
}

fn in_world(shape: Shape, mask: u32) -> Object {
    Object {
        shape,
        placement: Placement::World,
        mask,
    }
}

fn instanced(shape: Shape, random: &mut Random, count: usize, mask: u32) -> Object {
    Object {
        shape,
        placement: Placement::Instances((0..count).map(|_| random.transform()).collect()),
        mask,
    }
}

/// A world of these kinds of objects: two of them instanced, one in world space.
fn world(shapes: [Shape; 3], seed: u32) -> World {
    let random = &mut Random(seed);
    let [a, b, c] = shapes;
    World::new(vec![
        instanced(a, random, 4, 0b011),
        in_world(b, 0b101),
        instanced(c, random, 3, u32::MAX),
    ])
}

/// The first hit by a loop over everything; of equal t the lower (top-level id, primitive).
fn by_loop(world: &World, ray: &Ray) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for (top, &(object, instance)) in (0u32..).zip(world.top_level()) {
        let Object {
            shape,
            placement,
            mask,
        } = &world.objects()[object as usize];
        if ray.mask & mask == 0 {
            continue;
        }
        let mut local = *ray;
        let (mut geom, mut inst) = (top, INVALID_ID);
        if let (Placement::Instances(transforms), Some(k)) = (placement, instance) {
            let to_object = transforms[k as usize].inverse();
            local.origin = to_object.transform_point3(ray.origin);
            local.direction = to_object.transform_vector3(ray.direction);
            (geom, inst) = (0, top);
        }
        let count = match shape {
            Shape::Displaced(prisms) => prisms.len(),
            Shape::Triangles(mesh) => mesh.triangles().len(),
        };
        for prim in 0..count as u32 {
            let hit = match shape {
                Shape::Displaced(prisms) => prisms.intersect(prim, &local),
                Shape::Triangles(mesh) => triangle(mesh, prim, &local),
            };
            if let Some(PrismHit { prim, t, u, v, ng }) = hit
                && best.is_none_or(|best| t < best.t)
            {
                best = Some(Hit {
                    t,
                    u,
                    v,
                    prim,
                    geom,
                    inst: [inst],
                    ng,
                });
            }
        }
    }
    best
}

/// Moller and Trumbore's test, in f64.
fn triangle(mesh: &BaseMesh, prim: u32, ray: &Ray) -> Option<PrismHit> {
    let [v0, v1, v2] = mesh.corners(prim).map(|p| p.as_dvec3());
    let (origin, direction): (DVec3, DVec3) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, s) = (v1 - v0, v2 - v0, origin - v0);
    let p = direction.cross(e2);
    let q = s.cross(e1);
    let determinant = p.dot(e1);
    let [t, u, v] = [q.dot(e2), p.dot(s), q.dot(direction)].map(|x| x / determinant);
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    let (t, u, v) = (t as f32, u as f32, v as f32);
    (inside && ray.tnear < t && t < ray.tfar).then(|| PrismHit {
        prim,
        t,
        u,
        v,
        ng: e1.cross(e2).normalize().as_vec3(),
    })
}

/// Fails unless `a` and `b` are the same hit up to rounding.
#[track_caller]
fn assert_close(ray: &Ray, a: &Hit, b: &Hit) {
    // A ray's numbers are some units across.
    let tolerance = 1e-3 / ray.direction.length();
    assert!((a.t - b.t).abs() < tolerance, "{ray:?}\n{a:?}\n{b:?}");
    if (a.prim, a.geom, a.inst) == (b.prim, b.geom, b.inst) {
        let normals_agree = a.ng.dot(b.ng) > 0.99;
        assert!(normals_agree, "{ray:?}\n{a:?}\n{b:?}");
        assert!(
            (a.u - b.u).abs() < 0.02 && (a.v - b.v).abs() < 0.02,
            "{ray:?}\n{a:?}\n{b:?}"
        );
    }
    assert!((a.ng.length() - 1.0).abs() < 1e-5);
}

/// Compares up to rounding; a ray that grazes may be decided differently, once in a thousand.
fn compare_closely(rays: &[Ray], a: &dyn Fn(&Ray) -> Option<Hit>, b: &dyn Fn(&Ray) -> Option<Hit>) {
    let mut hits = 0;
    let mut grazes = 0;
    for ray in rays {
        match (a(ray), b(ray)) {
            (Some(a), Some(b)) => {
                let far_apart = (a.t - b.t).abs() * ray.direction.length() > 1e-3;
                if far_apart {
                    grazes += 1;
                } else {
                    assert_close(ray, &a, &b);
                    hits += 1;
                }
            }
            (None, None) => {}
            _ => grazes += 1,
        }
    }
    assert!(
        hits * 5 > rays.len(),
        "only {hits} of {} rays hit",
        rays.len()
    );
    assert!(
        grazes * 1000 <= rays.len(),
        "{grazes} of {} rays",
        rays.len()
    );
}

fn rays(count: usize, seed: u32) -> Vec<Ray> {
    let mut random = Random(seed);
    (0..count).map(|_| random.ray()).collect()
}

#[test]
fn prisms_under_obvhs_are_those_of_a_loop_bit_for_bit() {
    let world = world([displaced(1), displaced(0), displaced(1)], 1);
    let tracer = BvhTracer::new(&world).unwrap();
    let mut hits = 0;
    for ray in rays(6000, 2) {
        let hit = tracer.intersect(&ray);
        assert_eq!(hit, by_loop(&world, &ray), "{ray:?}");
        assert_eq!(tracer.occluded(&ray), hit.is_some(), "{ray:?}");
        hits += usize::from(hit.is_some());
    }
    assert!(hits > 1000);
}

#[test]
fn triangles_under_obvhs_are_those_of_a_loop() {
    let plain = |n| Shape::Triangles(sphere(n));
    let world = world([plain(2), plain(1), displaced(0)], 3);
    let tracer = BvhTracer::new(&world).unwrap();
    let rays = rays(6000, 4);
    compare_closely(&rays, &|r| tracer.intersect(r), &|r| by_loop(&world, r));
    for ray in &rays {
        assert_eq!(
            tracer.occluded(ray),
            tracer.intersect(ray).is_some(),
            "{ray:?}"
        );
    }
}

#[test]
fn a_tie_goes_to_the_lower_ids() {
    let twice = || in_world(Shape::Triangles(sphere(1)), u32::MAX);
    let here = Object {
        placement: Placement::Instances(vec![Affine3A::IDENTITY]),
        ..twice()
    };
    let ray = Ray::new(Vec3::new(0.1, 0.2, 5.0), -Vec3::Z);
    for objects in [vec![twice(), here.clone()], vec![here, twice()]] {
        let hit = BvhTracer::new(&World::new(objects))
            .unwrap()
            .intersect(&ray)
            .unwrap();
        let top = if hit.inst[0] == INVALID_ID {
            hit.geom
        } else {
            hit.inst[0]
        };
        assert_eq!(top, 0);
    }
}

#[test]
fn a_refit_is_as_good_as_a_new_build() {
    let shapes = || [displaced(1), displaced(0), displaced(1)];
    let (before, after) = (world(shapes(), 5), world(shapes(), 6));
    let mut tracer = BvhTracer::new(&before).unwrap();
    tracer.refit(&after).unwrap();
    let new = BvhTracer::new(&after).unwrap();
    assert_eq!(tracer.bounds(), new.bounds());
    for ray in rays(3000, 7) {
        assert_eq!(tracer.intersect(&ray), new.intersect(&ray), "{ray:?}");
    }
}

#[test]
fn a_refit_refuses_another_world_and_changes_nothing() {
    let before = world([displaced(0), displaced(0), displaced(0)], 8);
    let mut tracer = BvhTracer::new(&before).unwrap();
    let bounds = tracer.bounds();
    let others = [
        world([displaced(0), displaced(1), displaced(0)], 8),
        world([displaced(0), Shape::Triangles(sphere(0)), displaced(0)], 8),
        World::new(before.objects()[..2].to_vec()),
        World::default(),
    ];
    for other in &others {
        let refused = tracer.refit(other);
        assert!(
            matches!(refused, Err(BvhError::Changed { .. })),
            "{refused:?}"
        );
        assert_eq!(tracer.bounds(), bounds);
    }
}

#[test]
fn nothing_and_nonsense_hit_nothing() {
    let empty = BvhTracer::new(&World::default()).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert!(empty.intersect(&ray).is_none() && !empty.occluded(&ray));
    let tracer =
        BvhTracer::new(&World::new(vec![in_world(Shape::Triangles(sphere(0)), 1)])).unwrap();
    for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        let ray = Ray::new(Vec3::ZERO, direction);
        assert!(tracer.intersect(&ray).is_none() && !tracer.occluded(&ray));
    }
    let origin = Ray::new(Vec3::NAN, Vec3::X);
    assert!(tracer.intersect(&origin).is_none());
}

#[test]
fn a_transform_without_an_inverse_is_refused() {
    let flat = Object {
        shape: Shape::Triangles(sphere(0)),
        placement: Placement::Instances(vec![
            Affine3A::IDENTITY,
            Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)),
        ]),
        mask: 1,
    };
    let refused = BvhTracer::new(&World::new(vec![flat])).err().unwrap();
    assert!(
        matches!(
            refused,
            BvhError::World {
                source: WorldError::Transform {
                    object: 0,
                    instance: 1,
                    ..
                }
            }
        ),
        "{refused}"
    );
}

#[cfg(feature = "embree")]
mod embree {
    use prismarch::demo::{DEMOS, WriteOptions};
    use prismarch::embree::{EmbreeOptions, EmbreeTracer};
    use prismarch::scene::{Camera, Loaded};
    use rayon::prelude::*;

    use super::*;

    fn both(world: &World) -> (BvhTracer, EmbreeTracer) {
        let embree = EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap();
        (BvhTracer::new(world).unwrap(), embree)
    }

    /// The same bits, but for ties.
    #[test]
    fn prisms_in_world_space_are_the_same_bit_for_bit() {
        let objects = [0, 1, 2].map(|n| in_world(displaced(n), 0b111 & !(1 << n)));
        let world = World::new(objects.to_vec());
        let (bvh, embree) = both(&world);
        let mut ties = 0;
        for ray in rays(20_000, 11) {
            let (a, b) = (bvh.intersect(&ray), embree.intersect(&ray));
            assert_eq!(
                a.map(|hit| hit.t.to_bits()),
                b.map(|hit| hit.t.to_bits()),
                "{ray:?}"
            );
            assert_eq!(embree.occluded(&ray), b.is_some(), "{ray:?}");
            if let (Some(a), Some(b)) = (a, b) {
                let ids = |hit: &Hit| (hit.geom, hit.prim);
                if ids(&a) == ids(&b) {
                    assert_eq!(a, b, "{ray:?}");
                } else {
                    assert!(ids(&a) < ids(&b), "{ray:?}");
                    ties += 1;
                }
            }
        }
        assert!(ties < 20, "{ties} ties");
    }

    #[test]
    fn instances_and_triangles_agree_closely() {
        let plain = |n| Shape::Triangles(sphere(n));
        for (seed, shapes) in [
            (21, [plain(2), plain(1), plain(3)]),
            (22, [displaced(2), displaced(1), displaced(2)]),
            (23, [plain(2), displaced(2), displaced(0)]),
        ] {
            let world = world(shapes, seed);
            let (bvh, embree) = both(&world);
            compare_closely(&rays(10_000, seed), &|r| bvh.intersect(r), &|r| {
                embree.intersect(r)
            });
        }
    }

    /// Every demo's camera rays, and from every hit a ray to the sky.
    #[test]
    fn demos_look_the_same() {
        DEMOS.par_iter().for_each(|demo| {
            let folder = tempfile::tempdir().unwrap();
            let options = WriteOptions {
                map_size: 512,
                force: false,
                picture: false,
            };
            let scene = demo.write(folder.path(), options).unwrap();
            let scene = Loaded::from_file(&scene).unwrap().scene;
            let world = scene.world().unwrap();
            let (bvh, embree) = both(&world);
            let camera = camera_rays(&scene.camera, 160, 120);
            let to_sky: Vec<Ray> = camera
                .iter()
                .filter_map(|ray| {
                    let hit = bvh.intersect(ray)?;
                    let up = Vec3::new(0.3, 0.9, 0.2) * ray.direction.length();
                    Some(Ray {
                        tnear: 1e-3,
                        ..Ray::new(ray.at(hit.t), up)
                    })
                })
                .collect();
            for ray in camera.iter().chain(&to_sky) {
                let (a, b) = (bvh.intersect(ray), embree.intersect(ray));
                if let (Some(a), Some(b)) = (a, b)
                    && (a.prim, a.geom, a.inst) == (b.prim, b.geom, b.inst)
                    && a.inst[0] == INVALID_ID
                    && is_displaced(&world, &a)
                {
                    assert_eq!(a, b, "{}: {ray:?}", demo.name);
                }
            }
            compare_closely(&camera, &|r| bvh.intersect(r), &|r| embree.intersect(r));
        });
    }

    fn is_displaced(world: &World, hit: &Hit) -> bool {
        let object = &world.objects()[world.resolve(hit).object];
        matches!(object.shape, Shape::Displaced(_))
    }

    fn camera_rays(camera: &Camera, width: u32, height: u32) -> Vec<Ray> {
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let down = forward.cross(right);
        let pixel = 2.0 * (0.5 * camera.fov).tan() / height as f32;
        let on_film = |i: u32, count: u32| (i as f32 + 0.5 - 0.5 * count as f32) * pixel;
        (0..width * height)
            .map(|i| {
                let (x, y) = (on_film(i % width, width), on_film(i / width, height));
                Ray::new(camera.position, forward + x * right + y * down)
            })
            .collect()
    }
}
