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
mod film;
mod filter;
mod integrator;
mod light;
mod material;
mod offset;
mod sampler;
mod shading;
mod tone;

use std::sync::Mutex;

use glam::Vec3;
use rayon::prelude::*;

pub use integrator::RayCounts;
pub use offset::RayOffset;
pub use tone::to_srgb8;

use crate::scene::{Camera, Film, Integrator, Light, Material};
use crate::surface::SurfacePoint;
use crate::trace::{Hit, PlacedObject, Tracer, World};
use camera::Eye;
use film::{TileGrid, TileRenderer};
use filter::PixelFilter;

/// Pixels along a tile's side: small enough that the last tiles keep all threads busy.
const TILE: u32 = 32;

/// What the renderer asks of a hit.
pub trait Surfaces: Sync {
    /// The surface there, in world space.
    fn point(&self, hit: &Hit) -> SurfacePoint;

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
    /// At which size and quality; neither width, height nor samples are 0.
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

/// The opaque object, if any, that the camera of `input` is inside of: its inner side is all that is seen in any
/// direction.
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

/// Renders a picture by the scene's integrator.
///
/// Runs on the current rayon pool. `progress` is called with (tiles done, tiles in all), once per finished tile
/// and in order, from any thread of the pool.
///
/// # Panics
/// When an object's material index is out of range, or a hit names an object the world does not have: a
/// loaded scene and its own tracer never do.
pub fn render(input: &RenderInput, progress: &(dyn Fn(usize, usize) + Sync)) -> Picture {
    render_tiled(input, TILE, progress)
}

fn render_tiled(
    input: &RenderInput,
    tile_size: u32,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Picture {
    let film = input.film;
    let integrator = integrator::prepare(input);
    let renderer = TileRenderer {
        camera: Eye::new(input.camera, film.width, film.height),
        filter: PixelFilter::blackman_harris(),
        integrator: &*integrator,
        film,
    };
    let grid = TileGrid::new(film.width, film.height, tile_size);
    let assembly = Mutex::new(Assembly::new(film));
    (0..grid.len())
        .into_par_iter()
        .with_max_len(1)
        .for_each(|index| {
            let tile = grid.tile(index);
            let result = renderer.render(tile);
            // A poisoned lock means that another tile panicked: the panic is on its way to the caller.
            if let Ok(mut assembly) = assembly.lock() {
                assembly.place(tile, &result);
                progress(assembly.done, grid.len());
            }
        });
    assembly
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
        .picture
}

/// A picture while its tiles come in.
struct Assembly {
    picture: Picture,
    done: usize,
}

impl Assembly {
    fn new(film: &Film) -> Self {
        Self {
            picture: Picture {
                width: film.width,
                height: film.height,
                pixels: vec![Vec3::ZERO; film.width as usize * film.height as usize],
                stats: RenderStats::default(),
            },
            done: 0,
        }
    }

    fn place(&mut self, tile: film::Tile, result: &film::TileResult) {
        let columns = (tile.end.x - tile.start.x) as usize;
        for (y, row) in (tile.start.y..).zip(result.pixels.chunks_exact(columns)) {
            let start = y as usize * self.picture.width as usize + tile.start.x as usize;
            self.picture.pixels[start..start + columns].copy_from_slice(row);
        }
        self.picture.stats.rays += result.rays;
        self.picture.stats.dropped_samples += result.dropped;
        self.done += 1;
    }
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
