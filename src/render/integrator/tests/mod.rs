//! Pictures by the path tracer of scenes whose answer is known, through the real tracer.

use std::sync::Arc;

use glam::{UVec2, Vec2, Vec3};

use super::path::{Options, Path};
use super::*;
use crate::bvh::BvhTracer;
use crate::prism::{PrismOptions, Prisms};
use crate::render::Surfaces;
use crate::render::testing::Random;
use crate::scene::{Camera, Color, Film, Light, Material, PathLimits, Scalar};
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Seams, SurfacePoint,
    Texels, Wrap,
};
use crate::trace::{Hit, Object, PlacedObject, Placement, Shape, World};

mod glass;
mod lights;
mod setting;
mod shapes;

use setting::Scene;
use shapes::{ball, built, displaced, displaced_ball, quad, quad_mesh, slab, waves};

/// A lamp that shines nothing: without any, the world would be white.
fn dark_room() -> Vec<Light> {
    vec![Light::Point {
        position: Vec3::Z * 50.0,
        intensity: Vec3::ZERO,
        range: f32::INFINITY,
    }]
}

fn long() -> Options {
    Options::global(PathLimits {
        diffuse: 200,
        glossy: 200,
        transmission: 200,
        roulette: 8,
    })
}

/// A ray from above that meets the unit ball at every angle.
fn at_ball(u: Vec2) -> Ray {
    let at = 0.97 * u.y.sqrt() * Vec2::from_angle(u.x * std::f32::consts::TAU);
    Ray::new(at.extend(5.0), Vec3::NEG_Z)
}

fn white() -> Material {
    Material {
        base_color: Color::Constant(Vec3::ONE),
        ..Material::default()
    }
}

fn glass(roughness: f32) -> Material {
    Material {
        transmission: Scalar::Constant(1.0),
        roughness: Scalar::Constant(roughness),
        ..white()
    }
}

fn emissive(radiance: Vec3) -> Material {
    Material {
        base_color: Color::Constant(Vec3::ZERO),
        specular: Scalar::Constant(0.0),
        emission: Color::Constant(radiance),
        ..Material::default()
    }
}

#[test]
fn white_bodies_vanish_in_a_white_world() {
    let metal = |roughness| Material {
        metallic: Scalar::Constant(1.0),
        roughness: Scalar::Constant(roughness),
        ..white()
    };
    let materials = [
        (
            "plastic",
            Material {
                roughness: Scalar::Constant(0.4),
                ..white()
            },
        ),
        ("chalk", white()),
        ("mirror", metal(0.0)),
        ("rough metal", metal(0.7)),
        ("glass", glass(0.0)),
        ("rough glass", glass(0.5)),
    ];
    for (name, material) in materials {
        for displaced in [false, true] {
            let shape = if displaced {
                displaced_ball(0.9, 0.1, waves)
            } else {
                Shape::Triangles(built(ball(1.0)))
            };
            let mut scene = Scene::new(vec![(shape, material.clone())], vec![]);
            // 20000 samples with a spread of at most 0.3 per sample: 4 standard deviations within 0.009.
            for (facetted, least) in [(true, 0.99), (false, 0.97)] {
                scene.facetted = facetted;
                let mean = scene.mean(long(), 20_000, at_ball);
                assert!(
                    mean.min_element() > least && mean.max_element() < 1.01,
                    "{name}, displaced: {displaced}, facetted: {facetted}: {mean}"
                );
            }
        }
    }
}

#[test]
fn constant_displacement_is_a_bigger_ball() {
    let lights = || {
        vec![Light::Directional {
            direction: Vec3::new(0.28, 0.0, 0.96),
            irradiance: Vec3::ONE,
        }]
    };
    let grown = Scene::new(
        vec![(displaced_ball(0.75, 0.25, |_, _| 1.0), white())],
        lights(),
    );
    let big = Scene::new(
        vec![(displaced_ball(1.0, 0.25, |_, _| 0.0), white())],
        lights(),
    );
    let options = Options::global(PathLimits::default());
    for (x, y) in [(0.0, 0.0), (0.3, 0.2), (-0.7, 0.1), (0.2, -0.8), (0.9, 0.3)] {
        let ray = |_| Ray::new(Vec3::new(x, y, 5.0), Vec3::NEG_Z);
        let [a, b] = [&grown, &big].map(|s| s.mean(options, 1, ray));
        // The base triangles are chords: 0.25 further out they deviate less than at full size.
        assert!(a.abs_diff_eq(b, 0.01), "at {x} {y}: {a} {b}");
    }
}

#[test]
fn a_displaced_lamp_lights_as_the_sphere_it_is() {
    // Irradiance of a sphere of radiance 1 and radius r at a distance d: pi (r / d)^2.
    let lamp = displaced_ball(0.5, 0.5, |_, _| 1.0);
    let floor = quad(Vec3::new(-1.0, -1.0, -4.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let lambert = Material {
        specular: Scalar::Constant(0.0),
        ..white()
    };
    let radiance = Vec3::new(16.0, 8.0, 4.0);
    let scene = Scene::new(vec![(lamp, emissive(radiance)), (floor, lambert)], vec![]);
    let at_floor = |_| Ray::new(Vec3::new(0.0, 0.0, -3.0), Vec3::NEG_Z);
    let expected = radiance / 16.0;
    let once = PathLimits {
        diffuse: 1,
        ..PathLimits::default()
    };
    for (name, heuristic) in [
        ("lights", lights_only as fn(f32, f32) -> [f32; 2]),
        ("material", material_only),
    ] {
        let options = Options::global(once).weighed(heuristic);
        let mean = scene.mean(options, 8000, at_floor);
        assert!(
            (mean / expected - 1.0).abs().max_element() < 0.05,
            "{name}: {mean} {expected}"
        );
    }
    let mean = scene.mean(Options::global(once), 4000, at_floor);
    assert!(
        (mean / expected - 1.0).abs().max_element() < 0.03,
        "{mean} {expected}"
    );
}

fn lights_only(_: f32, _: f32) -> [f32; 2] {
    [1.0, 0.0]
}

fn material_only(_: f32, _: f32) -> [f32; 2] {
    [0.0, 1.0]
}

/// The Cornell box, 2 units wide, open to the front, with a lamp that hangs and a glossy ball.
fn cornell(lamp: Result<Shape, Light>) -> Scene {
    let wall = |color: Vec3| Material {
        base_color: Color::Constant(color),
        ..Material::default()
    };
    let (grey, red, green) = (
        wall(Vec3::splat(0.73)),
        wall(Vec3::new(0.65, 0.05, 0.05)),
        wall(Vec3::new(0.12, 0.45, 0.15)),
    );
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    let corner = Vec3::splat(-1.0);
    let ball = ball(0.4).transformed(&glam::Affine3A::from_translation(Vec3::new(0.3, -0.6, 0.0)));
    let metal = Material {
        metallic: Scalar::Constant(1.0),
        roughness: Scalar::Constant(0.5),
        ..wall(Vec3::splat(0.9))
    };
    let mut objects = vec![
        (quad(corner, z, x), grey.clone()),
        (quad(corner + y, x, z), grey.clone()),
        (quad(corner, x, y), grey),
        (quad(corner, y, z), red),
        (quad(corner + x, z, y), green),
        (Shape::Triangles(built(ball)), metal),
    ];
    let mut lights = Vec::new();
    match lamp {
        Ok(shape) => objects.push((shape, emissive(Vec3::splat(10.0)))),
        Err(light) => lights.push(light),
    }
    Scene::new(objects, lights)
}

#[test]
fn three_estimators_agree_in_the_cornell_box() {
    let (corner, a, b) = (Vec3::new(-0.4, 0.5, -0.4), 0.8 * Vec3::X, 0.8 * Vec3::Z);
    let light = Light::Rectangle {
        corner,
        edges: [a, b],
        radiance: Vec3::splat(10.0),
    };
    let lamps = [Ok(quad(corner, a, b)), Err(light)];
    let into_box = |u: Vec2| {
        let at = (1.6 * u - 0.8).extend(0.99);
        Ray::new(
            Vec3::new(0.0, 0.0, 4.0),
            (at - Vec3::new(0.0, 0.0, 4.0)).normalize(),
        )
    };
    for lamp in lamps {
        let scene = cornell(lamp);
        let options = Options::global(PathLimits::default());
        let both = scene.mean(options, 10_000, into_box);
        let by_lights = scene.mean(options.weighed(lights_only), 10_000, into_box);
        let by_material = scene.mean(options.weighed(material_only), 24_000, into_box);
        for (name, other) in [("lights", by_lights), ("material", by_material)] {
            assert!(
                (other / both - 1.0).abs().max_element() < 0.06,
                "{name}: {other} against {both}"
            );
        }
    }
}

#[test]
fn holes_let_light_and_looks_through() {
    let holed = Material {
        opacity: Scalar::Constant(0.25),
        base_color: Color::Constant(Vec3::ZERO),
        specular: Scalar::Constant(0.0),
        ..Material::default()
    };
    let sheet = quad(Vec3::new(-3.0, -3.0, 1.0), 6.0 * Vec3::X, 6.0 * Vec3::Y);
    let lambert = Material {
        specular: Scalar::Constant(0.0),
        ..white()
    };
    let floor = quad(Vec3::new(-3.0, -3.0, 0.0), 6.0 * Vec3::X, 6.0 * Vec3::Y);
    let sun = Light::Directional {
        direction: Vec3::Z,
        irradiance: Vec3::splat(std::f32::consts::PI),
    };
    let scene = Scene::new(vec![(sheet, holed), (floor, lambert)], vec![sun]);
    let none = PathLimits {
        diffuse: 0,
        glossy: 0,
        ..PathLimits::default()
    };
    let mean = scene.mean(Options::global(none), 4000, |_| {
        Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z)
    });
    // Down and up through the sheet: 0.75 each way.
    assert!((mean.x - 0.5625).abs() < 0.02, "{mean}");
}

#[test]
fn what_is_below_a_cutoff_is_a_hole_and_nothing_else_is() {
    let sheet = |opacity: f32, cutoff: f32| {
        let material = Material {
            opacity: Scalar::Constant(opacity),
            opacity_cutoff: Some(cutoff),
            ..emissive(Vec3::ONE)
        };
        let sheet = quad(Vec3::new(-3.0, -3.0, 1.0), 6.0 * Vec3::X, 6.0 * Vec3::Y);
        let scene = Scene::new(vec![(sheet, material)], dark_room());
        let seen = Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z);
        scene
            .mean(Options::global(PathLimits::default()), 8, |_| seen)
            .x
    };
    for (opacity, cutoff, expected) in [(0.5, 0.5, 1.0), (0.49, 0.5, 0.0), (1.0, 1.1, 0.0)] {
        assert_eq!(sheet(opacity, cutoff), expected, "{opacity} {cutoff}");
    }
}
