use std::f32::consts::PI;

use super::point::Cone;
use super::*;
use crate::render::testing::{Cap, Fineness, Random};

/// The law of every light: the mean of radiance * cos / pdf over samples is the irradiance that a fine
/// grid of directions finds, and the density of a sample is what `pdf` says, but for samples on the
/// border of two cells.
#[test]
fn sampled_irradiance_is_the_integral_of_radiance() {
    let direction = Vec3::new(0.3, 0.8, 0.1).normalize();
    let sky = Sky::new(direction, 4.0, 1.0);
    let normal = Vec3::new(0.2, 0.9, -0.3).normalize();
    let grid = 600;
    let mut expected = Vec3::ZERO;
    for row in 0..grid {
        for column in 0..2 * grid {
            let uv = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / grid as f32;
            let theta = std::f32::consts::PI * uv.y;
            let d = latlong::direction(Vec2::new(0.5 * uv.x, theta.cos()));
            let solid_angle = (std::f32::consts::PI / grid as f32).powi(2) * theta.sin();
            expected += sky.radiance(d) * d.dot(normal).max(0.0) * solid_angle;
        }
    }
    let n = 40_000;
    let mut sum = Vec3::ZERO;
    let mut on_borders = 0;
    for i in 0..n {
        let u = Vec2::new(i as f32 / n as f32, (i as f32 * 0.618_034).fract());
        let s = sky.sample(normal, u);
        on_borders += u32::from((s.pdf - sky.pdf(normal, s.direction)).abs() > 1e-3 * s.pdf);
        sum += s.radiance * s.direction.dot(normal).max(0.0) / s.pdf;
    }
    assert!(on_borders < n / 500, "{on_borders}");
    let measured = sum / n as f32;
    assert!(
        (measured / expected - 1.0).abs().max_element() < 0.01,
        "{measured} {expected}"
    );
}

/// The mean of radiance * cos / pdf over samples, at `position` with `normal`.
fn irradiance(light: &dyn LocalLight, position: Vec3, normal: Vec3) -> Vec3 {
    let n = 20_000;
    let mut random = Random::new(5);
    let sum: Vec3 = (0..n)
        .map(|_| {
            let s = light.sample(position, random.point());
            if s.pdf <= 0.0 {
                return Vec3::ZERO;
            }
            let other = light.pdf(position, s.direction);
            // Rims apart, where rounding decides whether a ray still meets the shape.
            assert!(s.is_delta || other == 0.0 || (s.pdf / other - 1.0).abs() < 2e-3);
            s.radiance * s.direction.dot(normal).max(0.0) / s.pdf
        })
        .sum();
    sum / n as f32
}

#[test]
fn shapes_light_by_their_analytic_irradiance() {
    let radiance = Vec3::new(3.0, 2.0, 1.0);
    let close = |found: Vec3, factor: f32, what: &str| {
        let expected = factor * radiance;
        assert!(
            (found / expected - 1.0).abs().max_element() < 0.01,
            "{what}: {found} {expected}"
        );
    };
    let position = Vec3::new(0.3, -0.2, 0.1);
    // A sphere: pi sin^2 of its angular radius, times the cosine to its middle, as long as all of it is above.
    for (distance, tilt) in [(3.0, 0.0_f32), (1.2, 0.3), (40.0, 1.0)] {
        let (sin, cos) = tilt.sin_cos();
        let sphere = SphereLight {
            center: position + distance * Vec3::new(sin, 0.0, cos),
            radius: 0.7,
            radiance,
        };
        let expected = PI * (0.7_f32 / distance).powi(2) * cos;
        close(irradiance(&sphere, position, Vec3::Z), expected, "sphere");
    }
    // A parallel disk on the axis: pi r^2 / (r^2 + d^2).
    let disk = FlatLight::disk(position + 2.0 * Vec3::Z, Vec3::NEG_Z, 1.5, radiance);
    close(
        irradiance(&disk, position, Vec3::Z),
        PI * 2.25 / 6.25,
        "disk",
    );
    // Lambert's polygon formula for a rectangle over one corner of which the point stands.
    let (a, b, h) = (1.5_f32, 0.8_f32, 0.9_f32);
    let corner = position + h * Vec3::Z;
    let rectangle = FlatLight::rectangle(corner, [b * Vec3::Y, a * Vec3::X], radiance);
    let part = |x: f32, y: f32| x / (x * x + h * h).sqrt() * (y / (x * x + h * h).sqrt()).atan();
    close(
        irradiance(&rectangle, position, Vec3::Z),
        0.5 * (part(a, b) + part(b, a)),
        "rectangle",
    );
    let behind = irradiance(&rectangle, position + 2.0 * Vec3::Z, Vec3::NEG_Z);
    assert_eq!(behind, Vec3::ZERO, "the back of a rectangle is dark");
    // Points: I cos / d^2.
    let cone = Cone {
        axis: Vec3::NEG_Z,
        cos_outer: 0.5,
        cos_inner: 0.8,
    };
    let spot = PointLight {
        position: position + 2.0 * Vec3::Z,
        intensity: radiance,
        range: f32::INFINITY,
        cone: Some(cone),
    };
    close(irradiance(&spot, position, Vec3::Z), 0.25, "spot");
    let fading = |range: f32| PointLight { range, ..spot };
    let faded = irradiance(&fading(4.0), position, Vec3::Z);
    close(faded, 0.25 * 15.0 / 16.0, "half way to its range");
    let beyond = irradiance(&fading(1.5), position, Vec3::Z);
    assert_eq!(beyond, Vec3::ZERO, "beyond its range it is dark");
    let beside = irradiance(&spot, position + 5.0 * Vec3::X, Vec3::Z);
    assert_eq!(beside, Vec3::ZERO, "outside of the cone it is dark");
}

#[test]
fn rays_meet_shapes_where_they_are() {
    let sphere = SphereLight {
        center: Vec3::new(0.0, 0.0, 5.0),
        radius: 1.0,
        radiance: Vec3::ONE,
    };
    assert!(
        sphere
            .meet(Vec3::ZERO, Vec3::Z)
            .is_some_and(|(t, _)| (t - 4.0).abs() < 1e-5)
    );
    assert_eq!(sphere.meet(Vec3::new(0.0, 0.0, 5.2), Vec3::Z), None);
    assert_eq!(sphere.meet(Vec3::ZERO, Vec3::NEG_Z), None);
    let skewed = [Vec3::new(1.0, 1.0, 0.0), Vec3::new(2.0, 0.0, 0.0)];
    let flat = FlatLight::rectangle(Vec3::new(-1.0, 0.0, 2.0), skewed, Vec3::ONE);
    let at = |x: f32, y: f32| flat.meet(Vec3::new(x, y, 0.0), Vec3::Z).map(|(t, _)| t);
    // From the dark side nothing is met: the normal is -Z, and this ray comes from below.
    assert_eq!(at(0.5, 0.5), Some(2.0));
    assert_eq!(at(-0.9, 0.5), None);
    assert_eq!(flat.meet(Vec3::new(0.5, 0.5, 4.0), Vec3::NEG_Z), None);
}

const FINE: Fineness = Fineness {
    samples: 40_000,
    cells: [16, 12],
    points: 32,
};

#[test]
fn shapes_are_sampled_with_their_density_by_chi_square() {
    let position = Vec3::new(0.3, -0.2, 0.1);
    let towards = Vec3::new(0.48, 0.6, 0.64);
    let sphere = |distance: f32, radius: f32| SphereLight {
        center: position + distance * towards,
        radius,
        radiance: Vec3::ONE,
    };
    let disk = |normal: Vec3| {
        FlatLight::disk(position + 2.0 * towards, normal.normalize(), 1.5, Vec3::ONE)
    };
    let corner = position + towards - Vec3::new(0.7, 0.4, 0.0);
    let skewed = [Vec3::new(0.2, 0.9, 0.1), Vec3::new(1.4, 0.3, -0.2)];
    let lights: [(&str, Box<dyn LocalLight>); 6] = [
        ("sphere", Box::new(sphere(3.0, 0.7))),
        ("sphere near by", Box::new(sphere(1.01, 1.0))),
        ("sphere far away", Box::new(sphere(500.0, 1.0))),
        ("disk", Box::new(disk(-towards))),
        (
            "disk from the side",
            Box::new(disk(Vec3::new(-0.9, 0.1, 0.0))),
        ),
        (
            "rectangle",
            Box::new(FlatLight::rectangle(corner, skewed, Vec3::ONE)),
        ),
    ];
    for (name, light) in lights {
        // A little more than the light covers.
        let drop = match name {
            "sphere far away" => 4e-6,
            "sphere" => 0.04,
            _ => 2.0,
        };
        Cap::around(towards, drop).assert_samples_follow(
            name,
            FINE,
            |random| {
                let sample = light.sample(position, random.point());
                (sample.pdf > 0.0).then_some(sample.direction)
            },
            |direction| light.pdf(position, direction),
        );
    }
}

#[test]
fn what_is_far_is_sampled_with_its_density_by_chi_square() {
    let direction = Vec3::new(0.48, 0.6, 0.64);
    let normal = Vec3::new(0.2, 0.9, -0.3).normalize();
    let image = crate::image::EnvironmentImage {
        width: 16,
        height: 8,
        pixels: (0..128)
            .map(|i| Vec3::splat((i * 37 % 16) as f32))
            .collect(),
    };
    let lights: [(&str, Box<dyn InfiniteLight>, Cap); 4] = [
        (
            "sun",
            Box::new(Sun::new(direction, 3.0, 1.0)),
            Cap::around(direction, 1.4e-5),
        ),
        (
            "sky",
            Box::new(Sky::new(direction, 4.0, 1.0)),
            Cap::sphere(Vec3::Y),
        ),
        (
            "environment",
            Box::new(Environment::new(image.into(), 0.7, 2.0)),
            Cap::sphere(Vec3::Y),
        ),
        ("white world", Box::new(WhiteWorld), Cap::sphere(normal)),
    ];
    for (name, light, cap) in lights {
        cap.assert_samples_follow(
            name,
            FINE,
            |random| Some(light.sample(normal, random.point()).direction),
            |direction| light.pdf(normal, direction),
        );
    }
}
