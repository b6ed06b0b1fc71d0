//! Whole pictures of shapes whose answers are known.

mod film;
#[cfg(feature = "bvh")]
mod renderer;
mod run;

use std::ops::Range;
use std::sync::Mutex;

use glam::{Vec2, Vec3};

use super::*;
use crate::ray::{Aabb, Ray};
use crate::scene::{Color, PathLimits, Scalar};
use crate::trace::INVALID_ID;

/// The plane y = 0 (object 0) and perhaps a unit sphere at height 1 (object 1). A hit carries its point and normal.
struct Shapes {
    sphere: bool,
}

const SPHERE_CENTRE: Vec3 = Vec3::new(0.0, 1.5, 0.0);

impl Shapes {
    fn plane(ray: &Ray) -> Option<f32> {
        let t = -ray.origin.y / ray.direction.y;
        (t > ray.tnear && t < ray.tfar).then_some(t)
    }

    fn sphere(ray: &Ray) -> Option<f32> {
        let from_centre = ray.origin - SPHERE_CENTRE;
        let b = from_centre.dot(ray.direction);
        let discriminant = b * b - from_centre.length_squared() + 1.0;
        if discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        [-b - root, -b + root]
            .into_iter()
            .find(|&t| t > ray.tnear && t < ray.tfar)
    }
}

impl Tracer for Shapes {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let plane = Self::plane(ray).map(|t| (t, 0));
        let sphere = Self::sphere(ray).filter(|_| self.sphere).map(|t| (t, 1));
        let (t, object) = [plane, sphere]
            .into_iter()
            .flatten()
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let position = ray.at(t);
        Some(Hit {
            t,
            u: position.x,
            v: position.z,
            prim: position.y.to_bits(),
            geom: object,
            inst: [INVALID_ID],
            ng: if object == 0 {
                Vec3::Y
            } else {
                position - SPHERE_CENTRE
            },
        })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_some()
    }

    fn bounds(&self) -> Aabb {
        Aabb {
            min: Vec3::splat(-10.0),
            max: Vec3::splat(10.0),
        }
    }

    fn bvh_bytes(&self) -> usize {
        0
    }

    fn name(&self) -> String {
        "analytic shapes".into()
    }
}

impl Surfaces for Shapes {
    fn point(&self, hit: &Hit) -> SurfacePoint {
        let position = Vec3::new(hit.u, f32::from_bits(hit.prim), hit.v);
        SurfacePoint {
            position,
            base_position: position,
            base_normal: hit.ng.normalize(),
            geometric_normal: hit.ng.normalize(),
            shading_normal: hit.ng.normalize(),
            texcoord: Vec2::ZERO,
            displacement: 0.0,
            tolerance: 0.0,
        }
    }

    fn object(&self, hit: &Hit) -> usize {
        hit.geom as usize
    }

    fn placed(&self) -> Vec<PlacedObject> {
        Vec::new()
    }

    fn area_element(&self, _: &Hit) -> Option<f32> {
        None
    }

    fn tangents(&self, _: &Hit) -> Option<[Vec3; 2]> {
        None
    }
}

fn material(metallic: f32, roughness: f32, specular: f32) -> Material {
    Material {
        name: "white".into(),
        base_color: Color::Constant(Vec3::ONE),
        metallic: Scalar::Constant(metallic),
        roughness: Scalar::Constant(roughness),
        specular: Scalar::Constant(specular),
        ..Material::default()
    }
}

/// A scene of `Shapes`, looked down upon.
struct Setup {
    shapes: Shapes,
    camera: Camera,
    film: Film,
    materials: Vec<Material>,
    lights: Vec<Light>,
    integrator: Integrator,
}

impl Setup {
    fn new(sphere: bool, white: Material, lights: Vec<Light>) -> Self {
        Self {
            shapes: Shapes { sphere },
            camera: Camera {
                position: Vec3::new(0.0, 4.0, 3.0),
                target: Vec3::ZERO,
                fov: 0.6,
                ..Camera::default()
            },
            film: Film {
                width: 45,
                height: 30,
                spp: 4,
                seed: 1,
                ..Film::default()
            },
            materials: vec![white],
            lights,
            integrator: Integrator::Beauty,
        }
    }

    fn input(&self) -> RenderInput<'_> {
        RenderInput {
            tracer: &self.shapes,
            surfaces: &self.shapes,
            camera: &self.camera,
            film: &self.film,
            materials: &self.materials,
            object_materials: &[0, 0],
            lights: &self.lights,
            integrator: &self.integrator,
        }
    }

    /// Gives `frame` what it lacks, in tiles of this size.
    fn go_on(&self, frame: &mut Frame, tile: u32) -> Outcome {
        let control = Control {
            tile: Some(tile),
            ..Control::default()
        };
        render_frame(&self.input(), frame, control)
    }

    /// The film's window with the samples of these numbers.
    fn frame(&self, samples: Range<u32>) -> Frame {
        let mut frame = Frame::new(&self.film, samples, Objects::new(["plane", "sphere"]));
        self.go_on(&mut frame, 16);
        frame
    }

    fn render_tiled(&self, tile: u32) -> Picture {
        let mut frame = Frame::new(&self.film, 0..self.film.spp, Objects::default());
        let outcome = self.go_on(&mut frame, tile);
        Picture::new(&frame, outcome.rays)
    }

    fn mean(&self) -> Vec3 {
        let picture = self.render_tiled(16);
        picture.pixels.iter().sum::<Vec3>() / picture.pixels.len() as f32
    }
}

fn sun(elevation_degrees: f32) -> Light {
    let (sin, cos) = elevation_degrees.to_radians().sin_cos();
    Light::Sun {
        direction: Vec3::new(cos, sin, 0.0),
        strength: 1.0,
    }
}

fn uniform_environment() -> Light {
    Light::Environment {
        image: std::sync::Arc::new(crate::image::EnvironmentImage {
            width: 16,
            height: 8,
            pixels: vec![Vec3::ONE; 128],
        }),
        rotation: 0.3,
        strength: 1.0,
    }
}

#[test]
fn a_white_plane_in_a_white_world_is_white() {
    let scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![]);
    for pixel in scene.render_tiled(16).pixels {
        assert!(pixel.abs_diff_eq(Vec3::ONE, 1e-5), "{pixel}");
    }
}

#[test]
fn a_white_plane_under_a_white_picture_is_white_on_average() {
    let mut scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![uniform_environment()]);
    scene.film.spp = 64;
    assert!(
        scene.mean().abs_diff_eq(Vec3::ONE, 0.01),
        "{}",
        scene.mean()
    );
}

#[test]
fn a_white_mirror_in_a_white_world_is_white_by_both_estimates_together() {
    for roughness in [0.0, 0.2] {
        for lights in [vec![], vec![uniform_environment()]] {
            let mut scene = Setup::new(false, material(1.0, roughness, 0.5), lights);
            scene.film.spp = 32;
            let mean = scene.mean();
            assert!(mean.abs_diff_eq(Vec3::ONE, 0.01), "{roughness} {mean}");
        }
    }
}

#[test]
fn the_sun_lights_a_plane_by_the_cosine_law() {
    let radiance = |elevation: f32| {
        // The air dims a low sun: divide by what a surface facing it would receive.
        let Light::Sun { direction, .. } = sun(elevation) else {
            unreachable!()
        };
        let facing = light::Sun::new(direction, 3.0, 1.0);
        let sample = light::InfiniteLight::sample(&facing, Vec3::Y, Vec2::ZERO);
        let scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![sun(elevation)]);
        scene.mean() / (sample.radiance / sample.pdf)
    };
    for elevation in [15.0_f32, 40.0, 90.0] {
        let expected = elevation.to_radians().sin() * std::f32::consts::FRAC_1_PI;
        let measured = radiance(elevation);
        assert!(
            measured.abs_diff_eq(Vec3::splat(expected), 1e-3),
            "{elevation} {measured} {expected}"
        );
    }
}

#[test]
fn a_sphere_casts_a_shadow() {
    let mut scene = Setup::new(true, material(0.0, 1.0, 0.0), vec![sun(45.0)]);
    // Straight down on the plane, where the sphere is in the sun's way but not in the camera's.
    scene.camera.position = Vec3::new(-1.5, 6.0, 0.0);
    scene.camera.target = Vec3::new(-1.5, 0.0, 0.0);
    scene.camera.up = Vec3::Z;
    scene.camera.fov = 0.02;
    assert_eq!(scene.mean(), Vec3::ZERO);
}

#[test]
fn the_sky_exposes_well_at_exposure_zero() {
    let lights = vec![
        sun(40.0),
        Light::Sky {
            sun_direction: Vec3::new(0.766, 0.643, 0.0),
            turbidity: 3.0,
            strength: 1.0,
        },
    ];
    let mut scene = Setup::new(false, material(0.0, 1.0, 0.0), lights);
    scene.film.spp = 32;
    let white = scene.mean();
    assert!(
        white.min_element() > 0.4 && white.max_element() < 1.2,
        "{white}"
    );
}

#[test]
fn the_same_bits_for_any_tiling_and_any_number_of_threads() {
    let lights = vec![sun(30.0), uniform_environment()];
    let mut scene = Setup::new(true, material(0.3, 0.3, 0.5), lights);
    for integrator in [Integrator::Beauty, Integrator::Path(PathLimits::default())] {
        scene.integrator = integrator;
        same_bits(&scene);
    }
}

fn same_bits(scene: &Setup) {
    let bits = |threads, tile_size| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let picture = pool.unwrap().install(|| scene.render_tiled(tile_size));
        let pixels: Vec<_> = picture
            .pixels
            .iter()
            .map(|p| p.to_array().map(f32::to_bits))
            .collect();
        (pixels, picture.stats)
    };
    let expected = bits(1, 16);
    assert!(expected.1.rays.reflection > 0 && expected.1.rays.shadow > 0);
    for (threads, tile_size) in [(2, 16), (2, 7), (3, 64), (1, 1)] {
        assert_eq!(bits(threads, tile_size), expected, "{threads} {tile_size}");
    }
}

#[test]
fn seeds_differ() {
    let mut scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![uniform_environment()]);
    let first = scene.render_tiled(16).pixels;
    scene.film.seed = 2;
    assert_ne!(first, scene.render_tiled(16).pixels);
}

#[test]
fn progress_counts_the_samples_of_every_tile_in_order() {
    let scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![]);
    let seen = Mutex::new(Vec::new());
    let picture = render(&scene.input(), &|status| {
        seen.lock().unwrap().push((
            status.done,
            status.total,
            status.rays.camera,
            status.frame.taken(),
        ));
    });
    let tiles = [32 * 30 * 4, 13 * 30 * 4];
    let whole: u64 = tiles.iter().sum();
    let seen = seen.into_inner().unwrap();
    assert!(tiles.contains(&seen[0].0));
    assert_eq!(seen[1].0, whole);
    assert!(seen.iter().all(|&(done, total, camera, taken)| {
        total == whole && done == camera && done == taken
    }));
    assert_eq!((picture.width, picture.height), (45, 30));
    assert_eq!(picture.stats.rays.camera, whole);
}
