//! Tiles: parts of the picture that are made independently and put together in any order.

use glam::{DVec3, UVec2, Vec2, Vec3};

use super::camera::Eye;
use super::filter::PixelFilter;
use super::integrator::{Integrator, RayCounts};
use super::sampler::{Dimension, Purpose, Sampler};
use crate::scene::Film;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Top left pixel.
    pub start: UVec2,
    /// One past the bottom right pixel.
    pub end: UVec2,
}

/// A finished tile.
#[derive(Clone, Debug)]
pub struct TileResult {
    /// Linear radiance, row by row from the top.
    pub pixels: Vec<Vec3>,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were NaN or infinite and left out.
    pub dropped: u64,
}

/// All that turns a tile into pixels.
pub struct TileRenderer<'a> {
    /// Where rays start.
    pub camera: Eye,
    /// Where on a pixel.
    pub filter: PixelFilter,
    /// What they bring.
    pub integrator: &'a dyn Integrator,
    /// How many, and under which seed.
    pub film: &'a Film,
}

impl TileRenderer<'_> {
    /// Renders one tile. A pixel's value depends on nothing but the pixel.
    pub fn render(&self, tile: Tile) -> TileResult {
        let size = tile.end - tile.start;
        let mut result = TileResult {
            pixels: Vec::with_capacity(size.x as usize * size.y as usize),
            rays: RayCounts::default(),
            dropped: 0,
        };
        for y in tile.start.y..tile.end.y {
            for x in tile.start.x..tile.end.x {
                let radiance = self.pixel(UVec2::new(x, y), &mut result);
                result.pixels.push(radiance);
            }
        }
        result
    }

    /// The mean of a pixel's finite samples; black if there is none.
    fn pixel(&self, pixel: UVec2, tally: &mut TileResult) -> Vec3 {
        let dimension = Dimension::new(0, Purpose::Film);
        let centre = pixel.as_vec2() + Vec2::splat(0.5);
        let mut sum = DVec3::ZERO;
        let mut kept = 0_u32;
        for index in 0..self.film.spp {
            let sampler = Sampler::new(pixel, index, self.film.seed);
            let offset = self.filter.offset(sampler.point(dimension));
            let lens = sampler.point(Dimension::new(0, Purpose::Lens));
            let mut ray = self.camera.ray(centre + offset, lens);
            ray.key = sampler.ray_key(dimension);
            let radiance = self.integrator.radiance(&ray, &sampler, &mut tally.rays);
            if radiance.is_finite() {
                sum += radiance.as_dvec3();
                kept += 1;
            } else {
                tally.dropped += 1;
            }
        }
        (sum / f64::from(kept.max(1))).as_vec3()
    }
}

/// The grid of tiles over a picture.
#[derive(Clone, Copy, Debug)]
pub struct TileGrid {
    picture: UVec2,
    tile: u32,
}

impl TileGrid {
    /// Tiles of `tile` x `tile` pixels (at least 1) over a picture; those at its end are smaller.
    pub fn new(width: u32, height: u32, tile: u32) -> Self {
        Self {
            picture: UVec2::new(width, height),
            tile,
        }
    }

    /// Number of tiles.
    pub fn len(&self) -> usize {
        self.columns() * self.picture.y.div_ceil(self.tile) as usize
    }

    /// The tile of this index: row by row from the top.
    pub fn tile(&self, index: usize) -> Tile {
        // Both are below the number of pixels along a side, which is a u32.
        let column = (index % self.columns()) as u32;
        let row = (index / self.columns()) as u32;
        let start = UVec2::new(column, row) * self.tile;
        Tile {
            start,
            end: start
                .saturating_add(UVec2::splat(self.tile))
                .min(self.picture),
        }
    }

    fn columns(&self) -> usize {
        self.picture.x.div_ceil(self.tile) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;
    use crate::scene::{Camera, ToneCurve};

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height, size) in [(1, 1, 32), (33, 64, 32), (100, 7, 16), (5, 5, 1)] {
            let grid = TileGrid::new(width, height, size);
            let mut seen = vec![0; (width * height) as usize];
            for tile in (0..grid.len()).map(|i| grid.tile(i)) {
                for y in tile.start.y..tile.end.y {
                    for x in tile.start.x..tile.end.x {
                        seen[(y * width + x) as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
        }
    }

    /// Radiance 1, but NaN for a part of the rays.
    struct Broken;

    impl Integrator for Broken {
        fn radiance(&self, ray: &Ray, _: &Sampler, rays: &mut RayCounts) -> Vec3 {
            rays.camera += 1;
            match ray.key % 3 {
                0 => Vec3::new(1.0, f32::NAN, 1.0),
                1 => Vec3::new(1.0, 1.0, f32::INFINITY),
                _ => Vec3::ONE,
            }
        }
    }

    #[test]
    fn a_broken_sample_is_counted_and_never_spreads() {
        let film = Film {
            width: 8,
            height: 8,
            spp: 32,
            seed: 3,
            exposure: 0.0,
            tone: ToneCurve::Standard,
        };
        let camera = Camera {
            fov: 1.0,
            ..Camera::default()
        };
        let renderer = TileRenderer {
            camera: Eye::new(&camera, 8, 8),
            filter: PixelFilter::blackman_harris(),
            integrator: &Broken,
            film: &film,
        };
        let result = renderer.render(TileGrid::new(8, 8, 8).tile(0));
        assert!(result.pixels.iter().all(|&p| p == Vec3::ONE));
        assert_eq!(result.rays.camera, 8 * 8 * 32);
        let expected = 8.0 * 8.0 * 32.0 * 2.0 / 3.0;
        assert!((result.dropped as f64 / expected - 1.0).abs() < 0.1);
    }
}
