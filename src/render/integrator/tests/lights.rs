//! All lights of a scene together: which is chosen, and where on it, against the density that the path tracer weighs by.

use super::*;
use crate::render::light::{LightTables, Lights, Receiver};
use crate::render::testing::{Cap, Fineness};
use crate::trace::RayOffset;

/// Samples from the origin, one light per point, against the sum of the densities of all that lies in a direction.
fn follows(what: &str, scene: &Scene, cap: Cap) {
    let fineness = Fineness {
        samples: 200_000,
        cells: [16, 10],
        points: 24,
    };
    let receiver = Receiver {
        position: Vec3::ZERO,
        normal: Vec3::Z,
    };
    scene.with_input(|input| {
        let tables = LightTables::new(input, false);
        let lights = Lights::new(&tables, input);
        assert_eq!(lights.samples(), 1);
        cap.assert_samples_follow(
            what,
            fineness,
            |random| {
                let sample = lights.sample(0, &receiver, random.point());
                (sample.pdf > 0.0).then_some(sample.direction)
            },
            |direction| density(input, &lights, &receiver, direction),
        );
    });
}

/// The density of a direction: of every surface behind another as well, since sampling asks about no visibility.
fn density(input: &RenderInput, lights: &Lights, receiver: &Receiver, direction: Vec3) -> f32 {
    let mut sum = 0.0;
    let mut ray = Ray::new(receiver.position, direction);
    lights.meet(&ray, f32::INFINITY, Some(receiver), |_, _, pdf| sum += pdf);
    let offset = RayOffset::for_scene(input.tracer.bounds().diagonal());
    while let Some(hit) = input.tracer.intersect(&ray) {
        let point = input.surfaces.point(&hit);
        sum += lights.surface_pdf(&hit, &point, receiver);
        let normal = point.geometric_normal;
        let side = normal.dot(direction).signum();
        ray.origin = offset.apply(point.position, side * normal);
    }
    sum
}

/// A square 2 wide over the origin, its front down, in bumps.
fn bumpy_square(height: f32) -> Shape {
    let tau = std::f32::consts::TAU;
    displaced(
        quad_mesh(Vec3::new(-1.0, -1.0, height), 2.0 * Vec3::Y, 2.0 * Vec3::X),
        0.15,
        |s, t| 0.5 + 0.5 * (tau * s).sin() * (2.0 * tau * t).cos(),
    )
}

#[test]
fn shining_surfaces_are_sampled_with_their_density_by_chi_square() {
    let plain = quad(Vec3::new(-1.0, -1.0, 1.5), 2.0 * Vec3::Y, 2.0 * Vec3::X);
    let behind = quad(Vec3::new(-2.0, -1.0, 2.5), 3.0 * Vec3::Y, 2.0 * Vec3::X);
    let one = |shape| vec![(shape, emissive(Vec3::ONE))];
    let two = vec![
        (bumpy_square(1.5), emissive(Vec3::ONE)),
        (behind, emissive(Vec3::new(0.0, 3.0, 0.0))),
    ];
    for (what, objects) in [
        ("plain", one(plain)),
        ("displaced", one(bumpy_square(1.5))),
        ("one behind another", two),
    ] {
        let scene = Scene::new(objects, vec![]);
        follows(what, &scene, Cap::around(Vec3::Z, 0.9));
    }
}

#[test]
fn lights_are_chosen_by_their_power_and_sampled_with_their_density_by_chi_square() {
    let lights = vec![
        Light::Sphere {
            center: Vec3::new(2.0, 0.0, 2.0),
            radius: 0.8,
            radiance: Vec3::splat(4.0),
        },
        Light::Disk {
            center: Vec3::new(-1.5, -1.0, 1.0),
            normal: Vec3::new(0.6, 0.0, -0.8),
            radius: 1.0,
            radiance: Vec3::splat(2.0),
        },
        Light::Sky {
            sun_direction: Vec3::new(0.0, 0.6, 0.8),
            turbidity: 3.0,
            strength: 1.0,
        },
    ];
    let lamp = vec![(bumpy_square(3.0), emissive(Vec3::splat(2.0)))];
    let scene = Scene::new(lamp, lights);
    follows("all together", &scene, Cap::sphere(Vec3::Z));
}
