//! Level of detail: hits are what they are without, and a minified map does not alias.
#![cfg(any(feature = "embree", feature = "bvh"))]

#[path = "../benches/common/mod.rs"]
mod common;
#[path = "exact/kinds.rs"]
mod kinds;
#[path = "exact/maps.rs"]
mod maps;
#[allow(dead_code)] // a part is used
#[path = "exact/meshes.rs"]
mod meshes;

use std::sync::Arc;

use common::numbers::Numbers;
use glam::{Affine3A, Vec3};
use kinds::{ray, surfaces};
use prismarch::prism::{EditBounds, Lod, March, MarchError, PrismOptions, Prisms, Step};
use prismarch::ray::{Cone, Ray};
use prismarch::render::{Picture, RenderInput, render};
use prismarch::scene::{Camera, Color, Film, Integrator, Light, Material, Scalar, ToneCurve};
use prismarch::surface::{DisplacedSurface, TexelRect, Texels, Wrap};
use prismarch::trace::{Hit, Object, Placement, Shape, Tracer, World};

const RAYS: usize = if cfg!(debug_assertions) { 300 } else { 6000 };
/// From a hundredth of a texel to a good part of the map.
const SPREADS: [f32; 4] = [1e-5, 1e-3, 0.02, 0.2];

fn prisms(surface: &Arc<DisplacedSurface>, lod: Lod) -> Arc<Prisms> {
    let options = PrismOptions {
        lod,
        ..PrismOptions::default()
    };
    Arc::new(Prisms::new(surface.clone(), options).unwrap())
}

fn world(prisms: &Arc<Prisms>, placement: Placement) -> World {
    World::new(vec![Object {
        shape: Shape::Displaced(prisms.clone()),
        placement,
        mask: u32::MAX,
    }])
}

fn tracers(world: &World) -> Vec<Box<dyn Tracer>> {
    vec![
        #[cfg(feature = "embree")]
        Box::new(
            prismarch::embree::EmbreeTracer::new(
                world,
                &prismarch::embree::EmbreeOptions::default(),
            )
            .unwrap(),
        ),
        #[cfg(feature = "bvh")]
        Box::new(prismarch::bvh::BvhTracer::new(world).unwrap()),
    ]
}

#[test]
fn hits_are_exact_whatever_the_spread() {
    for (name, surface) in surfaces() {
        let exact = world(&prisms(&surface, Lod::Off), Placement::World);
        let exact = tracers(&exact).remove(0);
        let placed = world(&prisms(&surface, Lod::Cone), Placement::World);
        let backends = tracers(&placed);
        let around = exact.bounds();
        for spread in SPREADS {
            placed.set_spread(spread);
            let mut numbers = Numbers::new(7);
            let mut hits = 0;
            for _ in 0..RAYS {
                let ray = ray(&mut numbers, &around);
                let expected = exact.intersect(&ray).map(bits);
                hits += usize::from(expected.is_some());
                for backend in &backends {
                    let found = backend.intersect(&ray).map(bits);
                    assert_eq!(found, expected, "{name} {spread} {ray:?}");
                    let occluded = backend.occluded(&ray);
                    assert_eq!(occluded, expected.is_some(), "{name} {spread} {ray:?}");
                }
            }
            assert!(hits > RAYS / 20, "{name}");
        }
    }
}

fn bits(hit: Hit) -> ([u32; 6], u32) {
    let Hit {
        t, u, v, ng, prim, ..
    } = hit;
    ([t, u, v, ng.x, ng.y, ng.z].map(f32::to_bits), prim)
}

#[test]
fn off_is_off() {
    let noise = maps::white(256, 256, Wrap::Repeat);
    let surface = meshes::displaced(meshes::flat(4), noise, 0.004, 0.0);
    let off = world(&prisms(&surface, Lod::Off), Placement::World);
    off.set_spread(0.1);
    let tracer = tracers(&off).remove(0);
    let cone = Cone::from_eye(0.1);
    let mut numbers = Numbers::new(11);
    let mut seen = 0;
    for _ in 0..RAYS {
        let ray = ray(&mut numbers, &tracer.bounds());
        if let Some(hit) = tracer.intersect(&ray) {
            assert_eq!(off.seen_point(&hit, &ray, &cone), off.surface_point(&hit));
            seen += 1;
        }
    }
    assert!(seen > RAYS / 20);
}

#[test]
fn instances_scale_what_is_seen_and_not_the_angle() {
    let surface = meshes::displaced(
        meshes::bent(4),
        maps::white(256, 256, Wrap::Repeat),
        0.01,
        0.5,
    );
    let cone = prisms(&surface, Lod::Cone);
    let transform = Affine3A::from_scale_rotation_translation(
        Vec3::splat(30.0),
        glam::Quat::from_rotation_y(0.7),
        Vec3::new(5.0, -80.0, 9.0),
    );
    let (here, there) = (
        world(&cone, Placement::World),
        world(&cone, Placement::Instances(vec![transform])),
    );
    here.set_spread(0.02);
    let (a, b) = (tracers(&here).remove(0), tracers(&there).remove(0));
    let mut numbers = Numbers::new(3);
    let mut seen = 0;
    for _ in 0..RAYS {
        let ray = ray(&mut numbers, &a.bounds());
        let far = Ray {
            origin: transform.transform_point3(ray.origin),
            direction: transform.transform_vector3(ray.direction),
            ..ray
        };
        let (Some(near), Some(other)) = (a.intersect(&ray), b.intersect(&far)) else {
            continue;
        };
        // Rounding may move a ray to the other side of an edge.
        if (near.t - other.t).abs() > 1e-5 * near.t {
            continue;
        }
        seen += 1;
        let eye = Cone::from_eye(0.02);
        let (p, q) = (
            here.seen_point(&near, &ray, &eye),
            there.seen_point(&other, &far, &eye),
        );
        let moved = transform.transform_point3(p.position);
        assert!(moved.distance(q.position) < 1e-3 * q.position.length());
        assert!((30.0 * p.tolerance / q.tolerance - 1.0).abs() < 1e-3);
        let turned = transform.transform_vector3(p.shading_normal).normalize();
        assert!(turned.dot(q.shading_normal) > 0.999, "{p:?} {q:?}");
    }
    assert!(seen > RAYS / 20);
}

#[test]
fn edits_are_seen() {
    // With room for all heights prisms, and so hits, do not depend on what was there before.
    let prisms = |surface: &Arc<DisplacedSurface>| {
        let options = PrismOptions {
            lod: Lod::Cone,
            edit_bounds: EditBounds::Range,
            ..PrismOptions::default()
        };
        Arc::new(Prisms::new(surface.clone(), options).unwrap())
    };
    let noise = maps::white(256, 256, Wrap::Repeat);
    let surface = meshes::displaced(meshes::flat(4), noise, 0.004, 0.0);
    let cone = prisms(&surface);
    let placed = world(&cone, Placement::World);
    placed.set_spread(0.03);
    let rect = TexelRect {
        x: 40,
        y: 70,
        width: 150,
        height: 100,
    };
    let slope = |i: usize| (i % rect.width * 400) as u16;
    let texels = Texels::U16((0..rect.width * rect.height).map(slope).collect());
    surface.map().update(rect, &texels).unwrap();
    cone.map_edited(rect);
    let whole = TexelRect {
        x: 0,
        y: 0,
        width: 256,
        height: 256,
    };
    let again = prismarch::surface::DisplacementMap::new(
        256,
        256,
        surface.map().read(whole).unwrap(),
        Wrap::Repeat,
    );
    let again = meshes::displaced(meshes::flat(4), again.unwrap(), 0.004, 0.0);
    let fresh = world(&prisms(&again), Placement::World);
    fresh.set_spread(0.03);
    let (edited, new) = (tracers(&placed).remove(0), tracers(&fresh).remove(0));
    let cone = Cone::from_eye(0.03);
    let mut numbers = Numbers::new(2);
    for _ in 0..RAYS {
        let ray = ray(&mut numbers, &new.bounds());
        let (a, b) = (edited.intersect(&ray), new.intersect(&ray));
        assert_eq!(a.map(bits), b.map(bits), "{ray:?}");
        if let (Some(a), Some(b)) = (a, b) {
            let (a, b) = (
                placed.seen_point(&a, &ray, &cone),
                fresh.seen_point(&b, &ray, &cone),
            );
            assert_eq!(a, b, "{ray:?}");
        }
    }
}

#[test]
fn the_uniform_march_has_none() {
    let surface = meshes::displaced(meshes::flat(1), maps::constant(0.5), 0.1, 0.0);
    let options = PrismOptions {
        march: March::Uniform {
            step: Step::Texels(1.0),
            jitter: false,
        },
        lod: Lod::Cone,
        ..PrismOptions::default()
    };
    assert_eq!(
        Prisms::new(surface, options).err(),
        Some(MarchError::LodNeedsExact)
    );
}

/// A plane under a map of white noise, some forty texels of which are in a pixel each way.
fn picture(surface: &Arc<DisplacedSurface>, lod: Lod, spp: u32) -> Picture {
    let camera = Camera {
        position: Vec3::new(0.5, -0.3, 1.1),
        target: Vec3::new(0.5, 0.45, 0.0),
        up: Vec3::Z,
        fov: 0.3,
        ..Camera::default()
    };
    let film = Film {
        width: 64,
        height: 64,
        spp,
        seed: 1,
        tone: ToneCurve::Standard,
        ..Film::default()
    };
    let placed = world(&prisms(surface, lod), Placement::World);
    placed.set_spread(camera.pixel_spread(film.width, film.height));
    let tracer = tracers(&placed).remove(0);
    let sun = Light::Sun {
        direction: Vec3::new(-0.5, 0.3, 0.6).normalize(),
        strength: 1.0,
    };
    let rough = Material {
        name: "rough".into(),
        base_color: Color::Constant(Vec3::splat(0.5)),
        roughness: Scalar::Constant(1.0),
        specular: Scalar::Constant(0.0),
        ..Material::default()
    };
    let input = RenderInput {
        tracer: &*tracer,
        surfaces: &placed,
        camera: &camera,
        film: &film,
        materials: &[rough],
        object_materials: &[0],
        lights: &[sun],
        integrator: &Integrator::Beauty,
    };
    render(&input, &|_| {})
}

/// Root of the mean square difference, as a part of the mean of `b`.
fn difference(a: &Picture, b: &Picture) -> f32 {
    let pairs = a.pixels.iter().zip(&b.pixels);
    let squares: f32 = pairs.map(|(a, b)| (a.y - b.y) * (a.y - b.y)).sum();
    let mean = b.pixels.iter().map(|p| p.y).sum::<f32>() / b.pixels.len() as f32;
    (squares / a.pixels.len() as f32).sqrt() / mean
}

/// The standard deviation of its pixels, as a part of their mean.
fn grain(picture: &Picture) -> f32 {
    let count = picture.pixels.len() as f32;
    let mean = picture.pixels.iter().map(|p| p.y).sum::<f32>() / count;
    let squares = picture.pixels.iter().map(|p| (p.y - mean) * (p.y - mean));
    (squares.sum::<f32>() / count).sqrt() / mean
}

#[test]
fn a_minified_map_does_not_alias() {
    const SIDE: usize = 4096;
    // Root mean square of the map's slopes, and the largest part of the difference that may be left: where slopes are steep,
    // shadows among texels and light that falls flat on their sides are missed, and the picture is a little too bright.
    let cases = [(0.04, 0.25), (0.1, 0.4), (0.3, 0.7)];
    let spp = if cfg!(debug_assertions) { 32 } else { 256 };
    for (slope, most) in cases {
        // Of central differences over white noise.
        let scale = slope / (0.204 * SIDE as f32);
        let noise = maps::white(SIDE, SIDE, Wrap::Repeat);
        let surface = meshes::displaced(meshes::flat(1), noise, scale, 0.5);
        let converged = picture(&surface, Lod::Off, spp);
        let (off, cone) = (
            picture(&surface, Lod::Off, 1),
            picture(&surface, Lod::Cone, 1),
        );
        let (without, with) = (difference(&off, &converged), difference(&cone, &converged));
        let [a, b] = [&off, &cone].map(grain);
        println!("slopes of {slope}: off {without:.4}, grain {a:.4}; cone {with:.4}, grain {b:.4}");
        assert!(with < most * without, "{slope}: {with} {without}");
        assert!(b < 0.1 * a, "{slope}: {b} {a}");
    }
}
