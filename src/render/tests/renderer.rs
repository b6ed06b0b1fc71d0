//! Pictures that grow in steps, against those made in one go.

use std::sync::Arc;
use std::time::Duration;

use glam::{UVec2, Vec2, Vec3};

use super::uniform_environment;
use crate::bvh::BvhTracer;
use crate::prism::{Lod, PrismOptions};
use crate::render::film::{Frame, Objects};
use crate::render::{Budget, Control, Picture, RenderInput, Renderer, render_frame};
use crate::scene::{
    Adaptive, Camera, Color, Film, Filter, FilterShape, Integrator, Light, Material, ObjectShape,
    PathLimits, Scene, SceneObject, View, Window,
};
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, TexelRect, Texels,
    Wrap,
};
use crate::trace::World;

/// Texels along the sides of the maps.
const SIDE: usize = 32;

fn waves() -> Vec<f32> {
    let wave = |i: usize| (i as f32 * std::f32::consts::TAU / 8.0).sin();
    let texels = (0..SIDE * SIDE).map(|i| 0.5 + 0.25 * (wave(i % SIDE) + wave(i / SIDE)));
    texels.collect()
}

/// A square in waves over the plane of this height, seen with level of detail.
fn square(name: &str, size: f32, height: f32, material: usize) -> SceneObject {
    let corners = [
        Vec2::NEG_ONE,
        Vec2::new(-1.0, 1.0),
        Vec2::ONE,
        Vec2::new(1.0, -1.0),
    ];
    let position = |at: &Vec2| Vec3::new(size * at.x, height, size * at.y);
    let mesh = MeshBuilder {
        positions: corners.iter().map(position).collect(),
        normals: vec![Vec3::Y; 4],
        texcoords: corners.map(|at| 0.5 * (at + 1.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let mesh = Arc::new(mesh.build(NormalMode::File).unwrap().0);
    let map = DisplacementMap::new(SIDE, SIDE, Texels::F32(waves()), Wrap::Repeat).unwrap();
    let surface = DisplacedSurface::new(mesh, Arc::new(map), Displacement::new(0.2)).unwrap();
    let options = PrismOptions {
        lod: Lod::Cone,
        ..PrismOptions::default()
    };
    SceneObject {
        name: name.into(),
        shape: ObjectShape::Displaced(Arc::new(surface), options),
        instances: vec![],
        mask: u32::MAX,
        material,
    }
}

/// A square with a lamp over it, displaced both, under a sky.
fn scene() -> Scene {
    let lamp = Material {
        emission: Color::Constant(Vec3::splat(4.0)),
        ..Material::default()
    };
    Scene {
        path: "squares.toml".into(),
        camera: Camera {
            position: Vec3::new(0.0, 1.5, 3.0),
            target: Vec3::ZERO,
            ..Camera::default()
        },
        film: Film {
            width: 36,
            height: 35,
            spp: 9,
            filter: Filter::of(FilterShape::Mitchell),
            ..Film::default()
        },
        objects: vec![square("floor", 1.0, 0.0, 0), square("lamp", 0.2, 0.8, 1)],
        materials: vec![Material::default(), lamp],
        lights: vec![
            uniform_environment(),
            Light::Sky {
                sun_direction: Vec3::new(0.6, 0.8, 0.0),
                turbidity: 3.0,
                strength: 1.0,
            },
        ],
        integrator: Integrator::Path(PathLimits::default()),
    }
}

/// A renderer that has done nothing yet.
fn begin(scene: &Scene) -> (Renderer, BvhTracer) {
    let world = scene.world().unwrap();
    let tracer = BvhTracer::new(&world).unwrap();
    (Renderer::new(scene.clone(), world, &tracer), tracer)
}

/// The samples below `until` in one go.
fn whole(scene: &Scene, until: u32) -> Frame {
    let world = scene.world().unwrap();
    let object_materials: Vec<usize> = scene.objects.iter().map(|o| o.material).collect();
    let names = scene.objects.iter().map(|object| &object.name[..]);
    let mut frame = Frame::new(&scene.film, 0..until, Objects::new(names));
    let input = RenderInput {
        tracer: &BvhTracer::new(&world).unwrap(),
        surfaces: &world,
        camera: &scene.camera,
        film: &scene.film,
        materials: &scene.materials,
        object_materials: &object_materials,
        lights: &scene.lights,
        integrator: &scene.integrator,
    };
    render_frame(&input, &mut frame, Control::default());
    frame
}

/// Steps to the end.
fn finish(renderer: &mut Renderer, tracer: &BvhTracer) -> Frame {
    assert!(
        renderer
            .step(tracer, Budget::Time(Duration::MAX))
            .is_complete
    );
    renderer.frame().clone()
}

#[test]
fn steps_of_any_budget_are_the_whole_to_the_bit() {
    let mut scene = scene();
    for adaptive in [
        None,
        Some(Adaptive {
            threshold: 0.3,
            min_spp: 4,
        }),
    ] {
        scene.film.adaptive = adaptive;
        let whole = whole(&scene, 9);
        let budgets = [
            Budget::Samples(37),
            Budget::Samples(5000),
            Budget::Time(Duration::from_micros(300)),
            Budget::Time(Duration::MAX),
        ];
        for budget in budgets {
            let (mut renderer, tracer) = begin(&scene);
            let mut samples = 0;
            while !renderer.is_complete() {
                let step = renderer.step(&tracer, budget);
                assert_eq!(
                    (step.samples, step.is_complete),
                    (step.rays.camera, renderer.is_complete())
                );
                if let Budget::Samples(most) = budget {
                    assert!(step.samples == most || step.is_complete && step.samples < most);
                }
                samples += step.samples;
                if adaptive.is_none() {
                    assert_even(&renderer.snapshot());
                }
            }
            assert!(*renderer.frame() == whole, "{budget:?}");
            let picture = renderer.snapshot();
            assert_eq!(
                (picture.stats.rays.camera, whole.taken()),
                (samples, samples)
            );
            // There is nothing left to do.
            assert_eq!(renderer.step(&tracer, budget).samples, 0);
        }
    }
}

fn assert_even(picture: &Picture) {
    let (least, most) = (picture.samples.iter().min(), picture.samples.iter().max());
    let (least, most) = (*least.unwrap(), *most.unwrap());
    assert!(most <= (2 * least).max(1), "{least} {most}");
}

#[test]
fn a_step_without_time_takes_a_sample() {
    let (mut renderer, tracer) = begin(&scene());
    let step = renderer.step(&tracer, Budget::Time(Duration::ZERO));
    assert!((1..100).contains(&step.samples) && !step.is_complete);
    assert_eq!(renderer.step(&tracer, Budget::Samples(0)).samples, 0);
}

#[test]
fn a_snapshot_is_the_mean_of_the_samples_so_far() {
    let scene = scene();
    let (mut renderer, tracer) = begin(&scene);
    let means: Vec<Vec<Vec3>> = (0..=4)
        .map(|until| whole(&scene, until).radiance())
        .collect();
    for seen in [1..=2, 2..=4, 2..=4] {
        renderer.step(&tracer, Budget::Samples(36 * 35 + 17));
        let picture = renderer.snapshot();
        assert_eq!((picture.width, picture.height), (36, 35));
        for (index, (pixel, &count)) in picture.pixels.iter().zip(&picture.samples).enumerate() {
            assert!(seen.contains(&count), "{count}");
            assert_eq!(*pixel, means[count as usize][index]);
        }
    }
}

#[test]
fn what_has_no_sample_says_so() {
    let (mut renderer, tracer) = begin(&scene());
    assert!(renderer.snapshot().samples.iter().all(|&count| count == 0));
    renderer.step(&tracer, Budget::Samples(100));
    let picture = renderer.snapshot();
    assert_eq!(picture.samples.iter().sum::<u32>(), 100);
    let unseen = picture
        .samples
        .iter()
        .zip(&picture.pixels)
        .filter(|(count, _)| **count == 0);
    assert!(
        unseen
            .map(|(_, pixel)| pixel)
            .all(|&pixel| pixel == Vec3::ZERO)
    );
}

#[test]
fn another_camera_and_another_film_are_those_of_a_new_renderer() {
    let mut scene = scene();
    let (mut renderer, tracer) = begin(&scene);
    renderer.step(&tracer, Budget::Samples(2000));
    // Nearer, with other level of detail.
    scene.camera.position = Vec3::new(0.4, 0.7, 1.0);
    renderer.set_camera(scene.camera);
    assert_eq!(renderer.snapshot().samples.iter().sum::<u32>(), 0);
    assert_eq!(renderer.snapshot().stats.rays.total(), 0);
    assert!(finish(&mut renderer, &tracer) == whole(&scene, 9));
    scene.film = Film {
        width: 50,
        height: 20,
        spp: 3,
        seed: 8,
        crop: Some(Window {
            start: UVec2::new(3, 4),
            end: UVec2::new(50, 13),
        }),
        filter: Filter::of(FilterShape::Box),
        ..scene.film
    };
    renderer.set_film(scene.film);
    assert!(finish(&mut renderer, &tracer) == whole(&scene, 3));
    assert_eq!(
        (renderer.scene().film, renderer.snapshot().width),
        (scene.film, 47)
    );
}

#[test]
fn after_an_edit_the_picture_is_that_of_a_new_renderer() {
    let mut scene = scene();
    // One light: which is chosen does not depend on how large the scene is.
    scene.objects.truncate(1);
    scene.lights.truncate(1);
    let (mut renderer, mut tracer) = begin(&scene);
    let before = finish(&mut renderer, &tracer);
    let ObjectShape::Displaced(surface, _) = &scene.objects[0].shape else {
        unreachable!()
    };
    let rect = TexelRect {
        x: 8,
        y: 8,
        width: 16,
        height: 16,
    };
    surface
        .map()
        .update(rect, &Texels::F32(vec![1.5; 256]))
        .unwrap();
    tracer
        .map_edited(renderer.world(), surface.map(), rect)
        .unwrap();
    renderer.restart();
    let after = finish(&mut renderer, &tracer);
    assert!(after != before);
    assert!(after.radiance() == whole(&scene, 9).radiance());
}

#[test]
fn every_integrator_grows() {
    let mut scene = scene();
    for integrator in [
        Integrator::Beauty,
        Integrator::Ao { distance: 1.0 },
        Integrator::View(View::Normal),
    ] {
        scene.integrator = integrator;
        let (mut renderer, tracer) = begin(&scene);
        renderer.step(&tracer, Budget::Samples(1500));
        assert!(
            finish(&mut renderer, &tracer) == whole(&scene, 9),
            "{integrator:?}"
        );
    }
}

#[test]
fn it_goes_to_any_thread() {
    fn assert_sent<T: Send + Sync>() {}
    assert_sent::<Renderer>();
    assert_sent::<World>();
}
