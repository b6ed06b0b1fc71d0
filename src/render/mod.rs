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
mod sampler;
mod shading;
mod status;
mod terminator;

use std::ops::Range;
use std::sync::Mutex;

use glam::Vec3;
use rayon::prelude::*;

pub use film::to_srgb8;
pub use integrator::RayCounts;
pub use status::Status;

use crate::ray::{Cone, Ray};
use crate::scene::{Camera, Film, Integrator, Light, Material};
use crate::surface::SurfacePoint;
use crate::trace::{Hit, PlacedObject, Tracer, World};
use film::{Frame, Objects, TileGrid, TileRenderer};

/// Most pixels along a tile's side.
const TILE: u32 = 32;
/// Most samples of a tile: the last tiles keep all threads busy.
const TILE_SAMPLES: u32 = TILE * TILE * 16;

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

/// A finished picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear radiance, finite, row by row from the top left. Exposure and tone curve are not applied.
    pub pixels: Vec<Vec3>,
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
    Picture::new(&frame, &outcome)
}

impl Picture {
    fn new(frame: &Frame, outcome: &Outcome) -> Self {
        let size = frame.window().size();
        Self {
            width: size.x,
            height: size.y,
            pixels: frame.radiance(),
            stats: RenderStats {
                rays: outcome.rays,
                dropped_samples: frame.dropped(),
            },
        }
    }
}

/// How a run is watched and stopped.
pub struct Control<'a> {
    /// Called once per finished tile and in order, from any thread; no other tile is put into the picture meanwhile.
    pub progress: &'a (dyn Fn(&Status) + Sync),
    /// Called with every tile, finished or stopped, before it is put into the picture, from any thread and in no order.
    pub tile_done: &'a (dyn Fn(&Frame) + Sync),
    /// Asked before every sample, from any thread; what is done stays when it says true.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Called between two passes.
    pub pass: Option<&'a mut dyn FnMut(&Frame)>,
    /// Pixels along a tile's side, instead of what keeps all threads busy; at least 1.
    pub tile: Option<u32>,
}

impl Default for Control<'_> {
    /// Neither watched nor stopped.
    fn default() -> Self {
        Self {
            progress: &|_| (),
            tile_done: &|_| (),
            stop: &|| false,
            pass: None,
            tile: None,
        }
    }
}

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Rays traced.
    pub rays: RayCounts,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// Gives the pixels of `frame` the samples that they still lack. The frame's bits depend neither on the threads nor on
/// the tiles nor on stops between. Runs on the current rayon pool.
///
/// # Panics
/// As [`render()`].
pub fn render_frame(input: &RenderInput, frame: &mut Frame, mut control: Control) -> Outcome {
    let integrator = integrator::prepare(input);
    let renderer = TileRenderer::new(input.camera, input.film, input.tracer, &*integrator);
    let passes = passes(frame.samples(), input.film.progressive);
    let grids = passes.iter().map(|pass| {
        let side = control.tile.unwrap_or_else(|| tile_side(pass.len() as u32));
        TileGrid::new(frame.window(), side)
    });
    let grids: Vec<TileGrid> = grids.collect();
    let total = frame.lacks(frame.samples());
    let mut outcome = Outcome {
        rays: RayCounts::default(),
        stopped: false,
    };
    let mut done = 0;
    for (number, (pass, grid)) in (1..).zip(passes.iter().zip(&grids)) {
        let (progress, tile_done, stop) = (control.progress, control.tile_done, control.stop);
        let assembly = Mutex::new((&mut *frame, &mut outcome, &mut done));
        (0..grid.len())
            .into_par_iter()
            .with_max_len(1)
            .for_each(|index| {
                // A poisoned lock means that another tile panicked: the panic is on its way to the caller.
                let Ok(mut tile) = assembly.lock().map(|a| a.0.part(grid.tile(index))) else {
                    return;
                };
                let lacked = tile.lacks(pass);
                let result = renderer.render(&mut tile, pass.end, stop);
                tile_done(&tile);
                if let Ok(mut assembly) = assembly.lock() {
                    let (frame, outcome, done) = &mut *assembly;
                    frame.place(&tile);
                    outcome.rays += result.rays;
                    outcome.stopped |= result.stopped;
                    if !result.stopped {
                        **done += lacked;
                        progress(&Status {
                            frame,
                            done: **done,
                            total,
                            pass: number,
                            passes: passes.len(),
                            rays: outcome.rays,
                        });
                    }
                }
            });
        if outcome.stopped {
            break;
        }
        if let Some(pass) = control.pass.as_mut().filter(|_| number < passes.len()) {
            pass(frame);
        }
    }
    outcome
}

/// The runs of samples that are taken one after the other: all at once, or each as long as all before.
fn passes(samples: &Range<u32>, progressive: bool) -> Vec<Range<u32>> {
    let mut passes = Vec::new();
    let mut start = samples.start;
    while start < samples.end {
        let done = start - samples.start;
        let end = if progressive {
            start.saturating_add(done.max(1))
        } else {
            samples.end
        };
        passes.push(start..end.min(samples.end));
        start = end;
    }
    passes
}

/// Pixels along the side of tiles that take so many samples per pixel.
fn tile_side(spp: u32) -> u32 {
    (TILE_SAMPLES / spp.max(1)).isqrt().clamp(1, TILE)
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
