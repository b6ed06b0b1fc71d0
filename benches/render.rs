//! Samples per second, and where their time goes: `cargo bench --bench render`.
//!
//! The demos under Embree, by the `beauty` and the `path` integrator. Options after `--`: `--size PIXELS` across (640;
//! three quarters of that down), `--spp N` (4), `--map TEXELS` (as the demo has it), `--rounds N` (3), `--demo NAME`.
//! Prints a Markdown table.
//!
//! Samples per second are those of a whole picture on all cores; those on one core and the shares are of a picture of
//! half the width and height on one thread, by its CPU time, so that other programs on the machine do not count. All
//! its rays are recorded and traced again, alone: what that takes less than the picture is shading (camera, sampling,
//! surfaces, textures, materials, lights, film). Then they are traced through the same scene with hollow prisms, which
//! have the same boxes and reject every ray at once, each ray ending where it had hit: that is Embree's traversal with
//! its callbacks, and what it takes less than the rays is prisms. Rays traced alone have warmer caches than in the
//! picture, so that shading comes out rather too large than too small.

#[path = "common/mod.rs"]
mod common;

use std::sync::{Arc, Mutex};
use std::time::Instant;

use common::timing::{Query, Times, option, trace, word};
use prismarch::demo::{DEMOS, Demo, WriteOptions};
use prismarch::embree::{
    Device, DeviceOptions, EmbreeError, EmbreeOptions, EmbreeTracer, Geometry, HitTest, Instance,
    Scene, SceneBuilder, SceneOptions, TriangleGeometry, UserGeometry,
};
use prismarch::prism::{PrismHit, Prisms};
use prismarch::ray::{Aabb, Ray};
use prismarch::render::film::{Frame, Objects};
use prismarch::render::{Control, RenderInput, render_frame};
use prismarch::scene::{AovSet, Film, Integrator, Loaded, PathLimits};
use prismarch::trace::{Hit, Object, Placement, Shape, Tracer, World};

fn main() {
    println!(
        "| demo | integrator | samples/s | on one core | rays per sample | Embree | prisms | shading |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let only = word("--demo");
    for demo in DEMOS {
        if only.as_ref().is_none_or(|only| only == demo.name) {
            let folder = tempfile::tempdir().expect("a folder for the demo");
            let mut loaded = load(demo, folder.path());
            for integrator in [Integrator::Beauty, Integrator::Path(PathLimits::default())] {
                loaded.scene.integrator = integrator;
                bench(demo, &loaded);
            }
        }
    }
}

fn load(demo: &Demo, folder: &std::path::Path) -> Loaded {
    let options = WriteOptions {
        map_size: option("--map", demo.map_size),
        force: false,
        picture: false,
    };
    let scene = demo.write(folder, options);
    let scene = scene.expect("the demo can be written");
    Loaded::from_file(&scene).expect("the demo is a scene")
}

fn bench(demo: &Demo, loaded: &Loaded) {
    let world = loaded.scene.world().expect("a demo's march is sound");
    let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default()).expect("Embree builds");
    let size = option("--size", 640) as u32;
    let whole = film(&loaded.scene.film, size);
    let start = Instant::now();
    let samples = picture(loaded, &world, &tracer, &whole);
    let rate = samples as f64 / start.elapsed().as_secs_f64();

    let small = film(&whole, size / 2);
    let recorder = Recorder {
        tracer: &tracer,
        rays: Mutex::default(),
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one_thread = one_thread.expect("a thread");
    let samples = one_thread.install(|| picture(loaded, &world, &recorder, &small));
    let [firsts, anys] = recorder.rays.into_inner().expect("no panic");
    let count = firsts.rays.len() + anys.rays.len();
    let hollow = hollow(&world).expect("Embree builds");
    let [mut all, mut rays, mut traversal] = [(); 3].map(|()| Times::default());
    for _ in 0..option("--rounds", 3) {
        one_thread.install(|| {
            all.time_on(1, || picture(loaded, &world, &tracer, &small) as usize);
        });
        rays.time_on(1, || {
            trace(&tracer, &firsts.rays, Query::Intersect, 1)
                + trace(&tracer, &anys.rays, Query::Occluded, 1)
        });
        traversal.time_on(1, || firsts.cross(&hollow) + anys.cross(&hollow));
    }
    let percent = |seconds: f64| 100.0 * seconds / all.median();
    println!(
        "| {} | {} | {:.0} k | {:.0} k | {:.2} | {:.0} % | {:.0} % | {:.0} % |",
        demo.name,
        loaded.scene.integrator.name(),
        rate / 1e3,
        samples as f64 / all.median() / 1e3,
        count as f64 / samples as f64,
        percent(traversal.median()),
        percent(rays.median() - traversal.median()),
        percent(all.median() - rays.median()),
    );
}

fn film(film: &Film, width: u32) -> Film {
    Film {
        width,
        height: width * 3 / 4,
        crop: None,
        spp: option("--spp", 4) as u32,
        aovs: AovSet::NONE,
        ..*film
    }
}

/// Renders and returns the number of samples.
fn picture(loaded: &Loaded, world: &World, tracer: &dyn Tracer, film: &Film) -> u64 {
    let scene = &loaded.scene;
    let object_materials: Vec<usize> = scene.objects.iter().map(|o| o.material).collect();
    let mut frame = Frame::new(film, 0..film.spp, Objects::default());
    let input = RenderInput {
        tracer,
        surfaces: world,
        camera: &scene.camera,
        film,
        materials: &scene.materials,
        object_materials: &object_materials,
        lights: &scene.lights,
        integrator: &scene.integrator,
    };
    render_frame(&input, &mut frame, Control::default());
    frame.taken()
}

/// Rays of one kind, and the same ending where they hit.
#[derive(Default)]
struct Recorded {
    rays: Vec<Ray>,
    ended: Vec<Ray>,
}

impl Recorded {
    fn add(&mut self, ray: &Ray, hit: Option<Hit>) {
        self.rays.push(*ray);
        self.ended.push(Ray {
            tfar: hit.map_or(ray.tfar, |hit| hit.t),
            ..*ray
        });
    }

    /// Traces the rays that end where they hit, through a scene without anything to hit but plain triangles.
    fn cross(&self, scene: &Scene) -> usize {
        let hits = self.ended.iter().filter_map(|ray| scene.intersect1(ray));
        hits.count()
    }
}

/// Remembers first hits and any hits.
struct Recorder<'a> {
    tracer: &'a dyn Tracer,
    rays: Mutex<[Recorded; 2]>,
}

impl Tracer for Recorder<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.tracer.intersect(ray);
        self.rays.lock().expect("no panic")[0].add(ray, hit);
        hit
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let hit = self.tracer.intersect(ray);
        self.rays.lock().expect("no panic")[1].add(ray, hit);
        hit.is_some()
    }

    fn bounds(&self) -> Aabb {
        self.tracer.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        self.tracer.bvh_bytes()
    }

    fn name(&self) -> String {
        self.tracer.name()
    }
}

/// Boxes of prisms without anything inside.
struct Hollow(Arc<Prisms>);

impl HitTest for Hollow {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.0.bounds(prim)
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<PrismHit> {
        None
    }
}

/// The world with hollow prisms.
fn hollow(world: &World) -> Result<Scene, EmbreeError> {
    let device = Device::new(&DeviceOptions::default())?;
    let options = SceneOptions {
        robust: true,
        ..SceneOptions::default()
    };
    let geometry = |object: &Object| -> Result<Geometry, EmbreeError> {
        Ok(match &object.shape {
            Shape::Displaced(prisms) => {
                UserGeometry::new(&device, Arc::new(Hollow(prisms.clone())))?.into()
            }
            Shape::Triangles(mesh) => TriangleGeometry::new(&device, mesh.clone())?.into(),
        })
    };
    let mut builder = SceneBuilder::new(&device, options)?;
    for object in world.objects() {
        let geometry = geometry(object)?.with_mask(object.mask);
        match &object.placement {
            Placement::World => {
                builder.attach(geometry)?;
            }
            Placement::Instances(transforms) => {
                let mut inner = SceneBuilder::new(&device, options)?;
                inner.attach(geometry)?;
                let prototype = builder.add_prototype(inner.commit()?)?;
                for &transform in transforms {
                    builder.attach_instance(&Instance {
                        prototype,
                        transform,
                        mask: object.mask,
                    })?;
                }
            }
        }
    }
    builder.commit()
}
