//! From a scene and a tracer to a picture.
//!
//! ```text
//! film point -> camera ray -> integrator -> radiance -> pixel -> tile -> picture -> tone -> 8 bits
//!   sampler     camera        light, material, shading   film              tone
//! ```
//!
//! All randomness is a function of (pixel, sample, dimension, seed), so a picture is the same to the bit
//! whatever the number of threads and the order of tiles. Radiance is linear RGB with Rec. 709 primaries.

mod basis;
mod bsdf;
mod camera;
mod detail;
pub mod film;
mod integrator;
mod light;
mod material;
mod plan;
mod renderer;
mod run;
mod sampler;
mod shading;
mod status;
mod terminator;

use glam::Vec3;

pub use film::to_srgb8;
pub use integrator::RayCounts;
pub use renderer::{Budget, Renderer, Step};
pub use run::{Control, Outcome};
pub use status::Status;

use crate::ray::{Cone, Ray};
use crate::scene::{Camera, Film, Integrator, Light, Material};
use crate::surface::SurfacePoint;
use crate::trace::{Hit, PlacedObject, Tracer, World};
use film::{Frame, Objects};
use plan::Plan;
use run::{Tables, run};

/// What the renderer asks of a hit.
pub trait Surfaces: Sync {
    /// The surface there, in world space.
    fn point(&self, hit: &Hit) -> SurfacePoint;

    /// The same as the cone around `ray` sees it, which made the hit.
    fn seen_point(&self, hit: &Hit, ray: &Ray, cone: &Cone) -> SurfacePoint {
        let _ = (ray, cone);
        self.point(hit)
    }

    /// Index of the object that was hit.
    fn object(&self, hit: &Hit) -> usize;

    /// Every object once per place where it stands, by rising top-level ids: where light may come from.
    fn placed(&self) -> Vec<PlacedObject>;

    /// |dS/du x dS/dv| there, square world units; `None` where (u, v) are no barycentric coordinates.
    fn area_element(&self, hit: &Hit) -> Option<f32>;

    /// dP/ds and dP/dt of the undisplaced surface along its texture coordinates, world space; `None` where it has
    /// none.
    fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]>;
}

impl Surfaces for World {
    fn point(&self, hit: &Hit) -> SurfacePoint {
        self.surface_point(hit)
    }

    fn seen_point(&self, hit: &Hit, ray: &Ray, cone: &Cone) -> SurfacePoint {
        World::seen_point(self, hit, ray, cone)
    }

    fn object(&self, hit: &Hit) -> usize {
        self.resolve(hit).object
    }

    fn placed(&self) -> Vec<PlacedObject> {
        World::placed(self)
    }

    fn area_element(&self, hit: &Hit) -> Option<f32> {
        World::area_element(self, hit)
    }

    fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        World::tangents(self, hit)
    }
}

/// All that a picture is made of.
#[derive(Clone, Copy)]
pub struct RenderInput<'a> {
    /// Finds hits.
    pub tracer: &'a dyn Tracer,
    /// Tells what was hit: the [`World`] that the tracer was built from.
    pub surfaces: &'a dyn Surfaces,
    /// From where.
    pub camera: &'a Camera,
    /// At which size and quality; neither width, height nor samples are 0, and the crop window is inside.
    pub film: &'a Film,
    /// Materials.
    pub materials: &'a [Material],
    /// Per object of the world an index into `materials`.
    pub object_materials: &'a [usize],
    /// Lights; none at all, not even a shining surface, is a white world.
    pub lights: &'a [Light],
    /// What is computed for a camera ray.
    pub integrator: &'a Integrator,
}

/// The opaque closed object, if any, that the camera of `input` is inside of and would see nothing for: it is left once more than it is
/// entered in any direction, and either all light comes from outside of the scene, or its inner side is all that is seen.
pub fn enclosing_object(input: &RenderInput) -> Option<usize> {
    integrator::enclosing_object(input)
}

/// A picture, finished or as it is.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear radiance, finite, row by row from the top left. Exposure and tone curve are not applied.
    pub pixels: Vec<Vec3>,
    /// Samples behind each pixel; where there are none the pixel is black, and that means nothing.
    pub samples: Vec<u32>,
    /// What it took.
    pub stats: RenderStats,
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderStats {
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that came out NaN or infinite and were left out of their pixel's mean.
    pub dropped_samples: u64,
}

/// Renders the film's crop window by the scene's integrator, all samples.
///
/// Runs on the current rayon pool. `progress` is called once per finished tile and in order, from any thread of the pool.
///
/// # Panics
/// When an object's material index is out of range, or a hit names an object the world does not have: a
/// loaded scene and its own tracer never do.
pub fn render(input: &RenderInput, progress: &(dyn Fn(&Status) + Sync)) -> Picture {
    let film = input.film;
    let mut frame = Frame::new(film, 0..film.spp, Objects::default());
    let control = Control {
        progress,
        ..Control::default()
    };
    let outcome = render_frame(input, &mut frame, control);
    Picture::new(&frame, outcome.rays)
}

impl Picture {
    fn new(frame: &Frame, rays: RayCounts) -> Self {
        let size = frame.window().size();
        Self {
            width: size.x,
            height: size.y,
            pixels: frame.radiance(),
            samples: frame.sample_counts(),
            stats: RenderStats {
                rays,
                dropped_samples: frame.dropped(),
            },
        }
    }
}

/// Gives the pixels of `frame` the samples that they still lack. The frame's bits depend neither on the threads nor on
/// the tiles nor on stops between. Runs on the current rayon pool.
///
/// # Panics
/// As [`render()`].
pub fn render_frame(input: &RenderInput, frame: &mut Frame, control: Control) -> Outcome {
    let tables = Tables::new(input);
    let mut plan = Plan::new(frame, input.film.progressive, control.tile);
    run(input, &tables, frame, &mut plan, control)
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
