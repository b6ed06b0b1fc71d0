//! A picture that grows in steps while its camera, its size and its surfaces may change.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::film::{Frame, Objects};
use super::plan::Plan;
use super::run::{Control, Tables, run};
use super::{Picture, RayCounts, RenderInput};
use crate::scene::{Camera, Film, Scene};
use crate::trace::{Tracer, World};

/// A scene and a picture of it that grows in steps: what any front end shows.
///
/// Tables (of lights, materials, the pixel filter) are made once, by [`Renderer::new`]. What a step needs beyond them is the tracer, which the
/// caller keeps: it may follow edits of displacement maps between two steps, as [`Settling`](crate::trace::Settling) does.
///
/// Samples are taken in passes over the whole picture, 1, 1, 2, 4, 8 ... of every pixel, and no pass begins before the last one has ended: after the
/// first no pixel has more than twice the samples of another (where sampling is adaptive, of another that is to get more). A picture that is complete has
/// the bits of [`render()`](super::render()), whatever the steps were.
///
/// ```
/// # use prismarch::scene::{Film, Integrator, Material, ObjectShape, SceneObject};
/// # use prismarch::surface::{MeshBuilder, NormalMode};
/// use std::time::Duration;
///
/// use glam::Vec3;
/// use prismarch::bvh::BvhTracer;
/// use prismarch::render::{Budget, Renderer};
/// use prismarch::scene::{Camera, Scene};
///
/// # fn scene() -> Result<Scene, Box<dyn std::error::Error>> {
/// # let floor = MeshBuilder {
/// #     positions: vec![Vec3::NEG_X - Vec3::Z, Vec3::Z, Vec3::X - Vec3::Z],
/// #     triangles: vec![[0, 1, 2]],
/// #     ..MeshBuilder::default()
/// # };
/// # Ok(Scene {
/// #     path: "floor.toml".into(),
/// #     camera: Camera { position: Vec3::new(0.0, 2.0, 4.0), target: Vec3::ZERO, ..Camera::default() },
/// #     film: Film { width: 32, height: 24, spp: 8, ..Film::default() },
/// #     objects: vec![SceneObject {
/// #         name: "floor".into(),
/// #         shape: ObjectShape::Plain(floor.build(NormalMode::File)?.0.into()),
/// #         instances: vec![],
/// #         mask: u32::MAX,
/// #         material: 0,
/// #     }],
/// #     materials: vec![Material::default()],
/// #     lights: vec![],
/// #     integrator: Integrator::Beauty,
/// # })
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let show = |picture: prismarch::render::Picture| assert!(picture.samples.contains(&1));
/// let scene = scene()?; // from a file: Loaded::from_file
/// let world = scene.world()?;
/// let tracer = BvhTracer::new(&world)?;
/// let mut renderer = Renderer::new(scene, world, &tracer);
///
/// // One sample of every pixel, then as many as there is time for.
/// renderer.step(&tracer, Budget::Samples(32 * 24));
/// show(renderer.snapshot());
/// renderer.step(&tracer, Budget::Time(Duration::from_millis(10)));
///
/// // From elsewhere, to the end.
/// renderer.set_camera(Camera {
///     position: Vec3::new(2.0, 2.0, 2.0),
///     ..renderer.scene().camera
/// });
/// while !renderer.step(&tracer, Budget::Time(Duration::from_millis(10))).is_complete {}
/// let picture = renderer.snapshot();
/// assert!(picture.samples.iter().all(|&samples| samples == 8));
/// # Ok(()) }
/// ```
pub struct Renderer {
    subject: Subject,
    tables: Tables,
    frame: Frame,
    plan: Plan,
    /// Behind the frame.
    rays: RayCounts,
}

/// What is to be seen, and how.
struct Subject {
    scene: Scene,
    world: World,
    object_materials: Vec<usize>,
}

/// How much a step does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// About so long, and at least one sample.
    Time(Duration),
    /// So many samples, over all pixels.
    Samples(u64),
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Rays that it traced.
    pub rays: RayCounts,
    /// Samples that it took, over all pixels.
    pub samples: u64,
    /// Whether the picture now has all its samples.
    pub is_complete: bool,
}

impl Renderer {
    /// Makes the tables of `scene`; no sample is taken yet. `world` is the [scene's](Scene::world), and `tracer` one of it.
    ///
    /// The film's `spp` are what a complete picture has, as many as a `u32` holds where it is to grow without end; its `aovs` cost memory
    /// and time, and `progressive` is taken to be set. Level of detail is that of the scene's camera ([`World::set_spread`]).
    pub fn new(scene: Scene, world: World, tracer: &dyn Tracer) -> Self {
        let subject = Subject {
            object_materials: scene.objects.iter().map(|object| object.material).collect(),
            scene,
            world,
        };
        subject.set_spread();
        let frame = subject.frame();
        Self {
            tables: Tables::new(&subject.input(tracer)),
            plan: plan(&frame),
            frame,
            rays: RayCounts::default(),
            subject,
        }
    }

    /// The scene, with the camera and film of now.
    pub fn scene(&self) -> &Scene {
        &self.subject.scene
    }

    /// The world: what tracers are told that follow edits.
    pub fn world(&self) -> &World {
        &self.subject.world
    }

    /// Another view: sampling begins again, with the level of detail of this camera. No table is made.
    pub fn set_camera(&mut self, camera: Camera) {
        self.subject.scene.camera = camera;
        self.subject.set_spread();
        self.restart();
    }

    /// Another size or other sampling, within what [`RenderInput::film`] says: sampling begins again. No table is made but the pixel filter's.
    pub fn set_film(&mut self, film: Film) {
        self.subject.scene.film = film;
        self.subject.set_spread();
        self.tables.set_film(&film);
        self.frame = self.subject.frame();
        self.restart();
    }

    /// Sampling begins again: after an edit of heights that the tracer has followed.
    ///
    /// Tables stay as they are. Where a displaced surface shines, the choice among its triangles goes by their areas and powers as they were when
    /// the renderer was made, and so does that among lights, which knows the size of the scene: the picture stays right, but has other bits, and after large
    /// edits more noise, than that of a new renderer.
    pub fn restart(&mut self) {
        self.frame.clear();
        self.plan = plan(&self.frame);
        self.rays = RayCounts::default();
    }

    /// Goes on with the picture, on the current rayon pool. A step may end within a pass and within a tile; the next one goes on there.
    /// `tracer` is of the renderer's world, as it is now.
    ///
    /// # Panics
    /// As [`render()`](super::render()).
    pub fn step(&mut self, tracer: &dyn Tracer, budget: Budget) -> Step {
        let rays = match budget {
            Budget::Time(time) => {
                // None where the clock does not go so far.
                let deadline = Instant::now().checked_add(time);
                let has_begun = AtomicBool::new(false);
                self.run(tracer, &|| {
                    if !has_begun.load(Ordering::Relaxed) {
                        has_begun.store(true, Ordering::Relaxed);
                        return false;
                    }
                    deadline.is_some_and(|deadline| Instant::now() >= deadline)
                })
            }
            Budget::Samples(samples) => {
                let left = AtomicU64::new(samples);
                let take = |left: u64| left.checked_sub(1);
                self.run(tracer, &|| {
                    let taken = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take);
                    taken.is_err()
                })
            }
        };
        Step {
            rays,
            samples: rays.camera,
            is_complete: self.is_complete(),
        }
    }

    fn run(&mut self, tracer: &dyn Tracer, stop: &(dyn Fn() -> bool + Sync)) -> RayCounts {
        let control = Control {
            stop,
            ..Control::default()
        };
        let input = self.subject.input(tracer);
        let (frame, plan) = (&mut self.frame, &mut self.plan);
        let rays = run(&input, &self.tables, frame, plan, control).rays;
        self.rays += rays;
        rays
    }

    /// Whether the picture has all its samples.
    pub fn is_complete(&self) -> bool {
        self.plan.is_done()
    }

    /// The picture as it is: the means of the samples so far. Takes a copy of the radiance.
    pub fn snapshot(&self) -> Picture {
        Picture::new(&self.frame, self.rays)
    }

    /// The same with all that the film keeps beside radiance, not copied.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }
}

/// In passes.
fn plan(frame: &Frame) -> Plan {
    Plan::new(frame, true, None)
}

impl Subject {
    fn input<'a>(&'a self, tracer: &'a dyn Tracer) -> RenderInput<'a> {
        RenderInput {
            tracer,
            surfaces: &self.world,
            camera: &self.scene.camera,
            film: &self.scene.film,
            materials: &self.scene.materials,
            object_materials: &self.object_materials,
            lights: &self.scene.lights,
            integrator: &self.scene.integrator,
        }
    }

    fn frame(&self) -> Frame {
        let film = &self.scene.film;
        let names = self.scene.objects.iter().map(|object| &object.name[..]);
        Frame::new(film, 0..film.spp, Objects::new(names))
    }

    fn set_spread(&self) {
        let Film { width, height, .. } = self.scene.film;
        self.world
            .set_spread(self.scene.camera.pixel_spread(width, height));
    }
}
