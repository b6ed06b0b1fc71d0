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

/// A world with one material per object.
struct Scene {
    world: World,
    tracer: BvhTracer,
    materials: Vec<Material>,
    object_materials: Vec<usize>,
    lights: Vec<Light>,
    camera: Camera,
    film: Film,
    /// Whether the shading normal is taken to be the geometric one.
    facetted: bool,
}

impl Surfaces for Scene {
    fn point(&self, hit: &Hit) -> SurfacePoint {
        let point = self.world.surface_point(hit);
        if self.facetted {
            return SurfacePoint {
                shading_normal: point.geometric_normal,
                ..point
            };
        }
        point
    }

    fn object(&self, hit: &Hit) -> usize {
        self.world.resolve(hit).object
    }

    fn placed(&self) -> Vec<PlacedObject> {
        self.world.placed()
    }

    fn area_element(&self, hit: &Hit) -> Option<f32> {
        self.world.area_element(hit)
    }

    fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        self.world.tangents(hit)
    }
}

impl Scene {
    fn new(objects: Vec<(Shape, Material)>, lights: Vec<Light>) -> Self {
        let (shapes, materials): (Vec<_>, Vec<_>) = objects.into_iter().unzip();
        let object = |shape| Object {
            shape,
            placement: Placement::World,
            mask: u32::MAX,
        };
        let world = World::new(shapes.into_iter().map(object).collect());
        Self {
            tracer: BvhTracer::new(&world).unwrap(),
            world,
            object_materials: (0..materials.len()).collect(),
            materials,
            lights,
            camera: Camera {
                position: Vec3::new(0.0, 0.0, 10.0),
                target: Vec3::ZERO,
                ..Camera::default()
            },
            film: Film::default(),
            facetted: false,
        }
    }

    /// The mean of `n` paths along rays that `ray` makes of uniform points.
    fn mean(&self, options: Options, n: u32, ray: impl Fn(Vec2) -> Ray) -> Vec3 {
        let integrator = scene::Integrator::Beauty;
        let input = RenderInput {
            tracer: &self.tracer,
            surfaces: self,
            camera: &self.camera,
            film: &self.film,
            materials: &self.materials,
            object_materials: &self.object_materials,
            lights: &self.lights,
            integrator: &integrator,
        };
        let path = Path::new(&input, options);
        let mut random = Random::new(3);
        let mut counts = RayCounts::default();
        let sum: Vec3 = (0..n)
            .map(|i| {
                let sampler = Sampler::new(UVec2::new(5, 9), i, 1);
                path.radiance(&ray(random.point()), &sampler, &mut counts)
            })
            .sum();
        sum / n as f32
    }
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

/// A ball of this radius around the origin, of 32 x 16 quads with smooth normals.
fn ball(radius: f32) -> MeshBuilder {
    let (columns, rows) = (32, 16);
    let mut mesh = MeshBuilder::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let st = Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32);
            let (sin, cos) = (std::f32::consts::PI * st.y).sin_cos();
            // The last column is the first, to the bit.
            let turns = (column % columns) as f32 / columns as f32;
            let (y, x) = (std::f32::consts::TAU * turns).sin_cos();
            let sin = if row % rows == 0 { 0.0 } else { sin };
            let normal = Vec3::new(sin * x, sin * y, -cos);
            mesh.positions.push(radius * normal);
            mesh.normals.push(normal);
            mesh.texcoords.push(st);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            if row > 0 {
                mesh.triangles.push([a, a + 1, b + 1]);
            }
            if row + 1 < rows {
                mesh.triangles.push([a, b + 1, b]);
            }
        }
    }
    mesh
}

fn built(mesh: MeshBuilder) -> Arc<crate::surface::BaseMesh> {
    Arc::new(mesh.build(NormalMode::File).unwrap().0)
}

/// A displaced ball; `height` is of (s, t).
fn displaced_ball(radius: f32, scale: f32, height: impl Fn(f32, f32) -> f32) -> Shape {
    let side = 64;
    let texel = |i: usize| (i as f32 + 0.5) / side as f32;
    let texels = (0..side * side).map(|i| height(texel(i % side), texel(i / side)));
    let map = DisplacementMap::new(side, side, Texels::F32(texels.collect()), Wrap::Repeat);
    let displacement = Displacement::new(scale);
    let surface =
        DisplacedSurface::new(built(ball(radius)), Arc::new(map.unwrap()), displacement).unwrap();
    let surface = Arc::new(surface.with_seams(Seams::Closed));
    Shape::Displaced(Arc::new(
        Prisms::new(surface, PrismOptions::default()).unwrap(),
    ))
}

/// Waves that are 0 at the poles, where the map is drawn together.
fn waves(s: f32, t: f32) -> f32 {
    let tau = std::f32::consts::TAU;
    (std::f32::consts::PI * t).sin().powi(2)
        * (0.5 + 0.5 * (6.0 * tau * s).sin() * (4.0 * tau * t).cos())
}

/// A quad from a corner along two edges, its front where `a x b` points to.
fn quad(corner: Vec3, a: Vec3, b: Vec3) -> Shape {
    let mesh = MeshBuilder {
        positions: vec![corner, corner + a, corner + a + b, corner + b],
        normals: vec![a.cross(b).normalize(); 4],
        texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    Shape::Triangles(built(mesh))
}

/// A box from `min` to `max`, its front outside.
fn slab(min: Vec3, max: Vec3) -> MeshBuilder {
    let d = max - min;
    let [x, y, z] = [Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z];
    let sides = [
        (min, y, x),
        (min + z, x, y),
        (min, z, y),
        (min + x, y, z),
        (min, x, z),
        (min + y, z, x),
    ];
    let mut mesh = MeshBuilder::default();
    for (corner, a, b) in sides {
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([corner, corner + a, corner + a + b, corner + b]);
        mesh.normals.extend([a.cross(b).normalize(); 4]);
        mesh.texcoords
            .extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        mesh.triangles
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
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
            scene.facetted = true;
            let mean = scene.mean(long(), 1500, at_ball);
            // 1500 samples with a spread of at most 0.3 per sample: 4 standard deviations, and the tables' 1 %.
            assert!(
                mean.abs_diff_eq(Vec3::ONE, 0.03),
                "{name}, displaced: {displaced}: {mean}"
            );
        }
    }
}

#[test]
fn the_smooth_normal_darkens_a_white_body_by_little() {
    let scene = Scene::new(vec![(displaced_ball(0.9, 0.1, waves), white())], vec![]);
    let mean = scene.mean(long(), 1500, at_ball);
    assert!(
        mean.min_element() > 0.9 && mean.max_element() < 1.03,
        "{mean}"
    );
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
fn a_slab_of_glass_follows_fresnel_and_beer() {
    let tinted = Material {
        attenuation_color: Vec3::new(0.5, 0.8, 1.0),
        attenuation_distance: 0.5,
        ..glass(0.0)
    };
    let body = slab(Vec3::new(-3.0, -3.0, -1.0), Vec3::new(3.0, 3.0, 0.0));
    let backdrop = quad(
        Vec3::new(-20.0, -20.0, -3.0),
        40.0 * Vec3::X,
        40.0 * Vec3::Y,
    );
    let dark_room = vec![Light::Point {
        position: Vec3::Z * 50.0,
        intensity: Vec3::ZERO,
    }];
    let scene = Scene::new(
        vec![
            (Shape::Triangles(built(body)), tinted),
            (backdrop, emissive(Vec3::ONE)),
        ],
        dark_room,
    );
    let angle = 0.6_f32;
    let ray = |_| {
        Ray::new(
            Vec3::new(-0.7, 0.0, 1.0),
            Vec3::new(angle.sin(), 0.0, -angle.cos()),
        )
    };
    let mean = scene.mean(long(), 20_000, ray);
    // The way inside by Snell, what is left by Beer, and all reflections inside: T = (1 - r)^2 a / (1 - r^2 a^2).
    let cos_inside = (1.0 - (angle.sin() / 1.5).powi(2)).sqrt();
    let r = 0.5
        * (((angle.cos() - 1.5 * cos_inside) / (angle.cos() + 1.5 * cos_inside)).powi(2)
            + ((1.5 * angle.cos() - cos_inside) / (1.5 * angle.cos() + cos_inside)).powi(2));
    let a = Vec3::new(0.5, 0.8, 1.0).powf(1.0 / cos_inside / 0.5);
    let expected = (1.0 - r).powi(2) * a / (1.0 - r * r * a * a);
    assert!(mean.abs_diff_eq(expected, 0.01), "{mean} {expected}");
}

#[test]
fn a_prism_deviates_by_snell_and_reflects_totally() {
    // A right-angled prism: a ray into its short side is turned by 90 degrees at the long one.
    let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::Y);
    let depth = Vec3::Z * 4.0;
    let mut mesh = MeshBuilder::default();
    let mut face = |corners: &[Vec3]| {
        let first = mesh.positions.len() as u32;
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        mesh.positions.extend(corners);
        mesh.normals.extend(vec![normal; corners.len()]);
        mesh.texcoords.extend(vec![Vec2::ZERO; corners.len()]);
        for i in 1..corners.len() as u32 - 1 {
            mesh.triangles.push([first, first + i, first + i + 1]);
        }
    };
    let (a0, b0, c0) = (a - 0.5 * depth, b - 0.5 * depth, c - 0.5 * depth);
    let (a1, b1, c1) = (a0 + depth, b0 + depth, c0 + depth);
    face(&[a1, b1, c1]);
    face(&[a0, c0, b0]);
    face(&[a0, b0, b1, a1]);
    face(&[a0, a1, c1, c0]);
    face(&[b0, c0, c1, b1]);
    // Below, where the ray leaves after the reflection, the world shines; elsewhere it is dark.
    let below = quad(Vec3::new(-2.0, -1.0, -2.0), 4.0 * Vec3::X, 4.0 * Vec3::Z);
    let dark_room = vec![Light::Point {
        position: Vec3::Z * 50.0,
        intensity: Vec3::ZERO,
    }];
    let scene = Scene::new(
        vec![
            (Shape::Triangles(built(mesh)), glass(0.0)),
            (below, emissive(Vec3::ONE)),
        ],
        dark_room,
    );
    let mean = scene.mean(long(), 4000, |_| {
        Ray::new(Vec3::new(-1.0, 0.3, 0.0), Vec3::X)
    });
    // In and out through the short sides: (1 - 0.04)^2, and a little that comes back after more reflections.
    assert!((mean.x - 0.9216).abs() < 0.02, "{mean}");
}

#[test]
fn water_in_glass_has_no_gap_and_no_double_boundary() {
    // A slab of water that overlaps two panes: with priorities the boundaries are glass-water and nothing else.
    let pane = |z: f32, material: Material| {
        let body = slab(Vec3::new(-3.0, -3.0, z), Vec3::new(3.0, 3.0, z + 1.0));
        (Shape::Triangles(built(body)), material)
    };
    let firm = Material {
        priority: 1,
        ..glass(0.0)
    };
    let water = Material {
        ior: 1.33,
        ..glass(0.0)
    };
    let overlapping = slab(Vec3::new(-3.0, -3.0, -2.5), Vec3::new(3.0, 3.0, 0.5));
    let backdrop = quad(
        Vec3::new(-20.0, -20.0, -9.0),
        40.0 * Vec3::X,
        40.0 * Vec3::Y,
    );
    let dark_room = vec![Light::Point {
        position: Vec3::Z * 50.0,
        intensity: Vec3::ZERO,
    }];
    let scene = Scene::new(
        vec![
            pane(0.0, firm.clone()),
            (Shape::Triangles(built(overlapping)), water),
            pane(-3.0, firm),
            (backdrop, emissive(Vec3::ONE)),
        ],
        dark_room,
    );
    let mean = scene.mean(long(), 20_000, |_| {
        Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z)
    });
    // Incoherent stack of interfaces with reflectances r1 r2 r2 r1: R/(1-R) = sum of r/(1-r), here of 1/T - 1.
    let r = |n: f32| ((n - 1.0) / (n + 1.0)).powi(2);
    let (r1, r2) = (r(1.5), r(1.5 / 1.33));
    let resistance = 2.0 * (r1 / (1.0 - r1) + r2 / (1.0 - r2));
    let expected = 1.0 / (1.0 + resistance);
    assert!((mean.x - expected).abs() < 0.01, "{mean} {expected}");
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
fn a_camera_in_glass_knows_it() {
    let scene = Scene::new(
        vec![(Shape::Triangles(built(ball(1.0))), glass(0.0))],
        vec![],
    );
    let integrator = scene::Integrator::Beauty;
    let bodies = |position| {
        let input = RenderInput {
            tracer: &scene.tracer,
            surfaces: &scene,
            camera: &scene.camera,
            film: &scene.film,
            materials: &scene.materials,
            object_materials: &scene.object_materials,
            lights: &scene.lights,
            integrator: &integrator,
        };
        stage::Stage::new(&input).bodies_at(position)
    };
    assert_eq!(bodies(Vec3::new(0.0, -3.0, 0.1)), bodies::Bodies::default());
    assert_ne!(bodies(Vec3::new(0.2, 0.1, 0.1)), bodies::Bodies::default());
}
