//! Tiles: parts of the picture that are made independently and put together in any order.

use glam::{UVec2, Vec2, Vec3};

use super::filter::PixelFilter;
use super::frame::{Frame, pixels};
use super::pixel::Pixel;
use super::sample::FirstHit;
use crate::ray::{Ray, RayPacket};
use crate::render::camera::Eye;
use crate::render::integrator::{CameraRay, Integrator, RayCounts};
use crate::render::sampler::{Dimension, Purpose, Sampler};
use crate::scene::{Camera, Film, Projection, Window};
use crate::trace::{Hit, Tracer};

/// All that turns a tile into pixels.
pub struct TileRenderer<'a> {
    camera: Eye,
    eye: Vec3,
    /// Depth is measured along this from the eye; from a panorama it is the distance.
    view: Option<Vec3>,
    filter: &'a PixelFilter,
    tracer: &'a dyn Tracer,
    /// Whether camera rays are traced eight by eight.
    in_packets: bool,
    integrator: &'a dyn Integrator,
    seed: u32,
    clamp: Option<f32>,
}

/// First hits of the camera rays of eight samples of a pixel.
struct Bundle {
    first: u32,
    hits: [Option<Hit>; RayPacket::LANES],
}

/// What became of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileOutcome {
    /// Rays traced.
    pub rays: RayCounts,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

impl<'a> TileRenderer<'a> {
    /// Pictures of `film`, whose filter is `filter`, through `camera`.
    pub fn new(
        camera: &Camera,
        film: &Film,
        filter: &'a PixelFilter,
        tracer: &'a dyn Tracer,
        integrator: &'a dyn Integrator,
    ) -> Self {
        Self {
            camera: Eye::new(camera, film.width, film.height),
            eye: camera.position,
            view: (camera.projection != Projection::Panorama)
                .then(|| (camera.target - camera.position).normalize_or(Vec3::NEG_Z)),
            filter,
            tracer,
            in_packets: film.spp >= RayPacket::LANES as u32,
            integrator,
            seed: film.seed,
            clamp: film.clamp,
        }
    }

    /// Gives every pixel of `tile` its samples of numbers below `until`. What a pixel becomes depends on nothing but the pixel.
    /// `stop` is asked before every sample; once it says so, the tile is left as it is.
    pub fn render(&self, tile: &mut Frame, until: u32, stop: &dyn Fn() -> bool) -> TileOutcome {
        let mut outcome = TileOutcome {
            rays: RayCounts::default(),
            stopped: false,
        };
        for (index, place) in pixels(tile.window()).enumerate() {
            let mut pixel = tile.pixel(index);
            let mut bundle = None;
            while let Some(sample) = tile.next_sample(&pixel).filter(|&next| next < until) {
                if stop() {
                    outcome.stopped = true;
                    break;
                }
                let hit = self.hit(place, sample, &mut bundle);
                self.sample(place, sample, hit, &mut pixel, tile, &mut outcome.rays);
            }
            tile.set_pixel(index, &pixel);
            if outcome.stopped {
                break;
            }
        }
        outcome
    }

    /// What the camera ray of a pixel's sample meets first. In packets these are the rays of eight samples that follow one another
    /// from a multiple of eight on, always all of them, so that no bit of a hit depends on which are asked for.
    fn hit(&self, place: UVec2, index: u32, bundle: &mut Option<Bundle>) -> Option<Hit> {
        if !self.in_packets {
            return self.tracer.intersect(&self.ray(place, index).0);
        }
        let lane = index % RayPacket::LANES as u32;
        let first = index - lane;
        if bundle.as_ref().is_none_or(|bundle| bundle.first != first) {
            let mut rays = RayPacket::EMPTY;
            for lane in 0..RayPacket::LANES {
                let index = first.saturating_add(lane as u32);
                rays.set(lane, &self.ray(place, index).0);
            }
            *bundle = Some(Bundle {
                first,
                hits: self.tracer.intersect8(&rays),
            });
        }
        bundle.as_ref()?.hits[lane as usize]
    }

    /// The camera ray of a pixel's sample, what it is drawn with, and the sign that it counts with.
    fn ray(&self, place: UVec2, index: u32) -> (Ray, Sampler, i32) {
        let dimension = Dimension::new(0, Purpose::Film);
        let sampler = Sampler::new(place, index, self.seed);
        let placement = self.filter.place(index, sampler.point(dimension));
        let centre = place.as_vec2() + Vec2::splat(0.5);
        let lens = if self.camera.has_lens() {
            sampler.point(Dimension::new(0, Purpose::Lens))
        } else {
            Vec2::ZERO
        };
        let mut ray = self.camera.ray(centre + placement.offset, lens);
        ray.key = sampler.ray_key(dimension);
        (ray, sampler, placement.sign)
    }

    fn sample(
        &self,
        place: UVec2,
        index: u32,
        hit: Option<Hit>,
        pixel: &mut Pixel,
        tile: &Frame,
        rays: &mut RayCounts,
    ) {
        let (ray, sampler, sign) = self.ray(place, index);
        let mut sample = self
            .integrator
            .sample(&CameraRay { ray, hit }, &sampler, rays);
        sample.radiance = clamped(sample.radiance, self.clamp);
        let depth = |hit: FirstHit| self.depth(hit.position);
        let object = |hit: FirstHit| tile.objects().hash(hit.object);
        pixel.add(
            &sample,
            sign,
            sample.first.map_or(0.0, depth),
            sample.first.map_or(0, object),
        );
    }
}

impl TileRenderer<'_> {
    fn depth(&self, position: Vec3) -> f32 {
        let from_eye = position - self.eye;
        self.view
            .map_or_else(|| from_eye.length(), |view| from_eye.dot(view))
    }
}

/// Scaled down to the largest component allowed; the hue stays.
fn clamped(radiance: Vec3, most: Option<f32>) -> Vec3 {
    match most {
        Some(most) if radiance.max_element() > most && radiance.is_finite() => {
            radiance * (most / radiance.max_element())
        }
        _ => radiance,
    }
}

/// The grid of tiles over a window.
#[derive(Clone, Copy, Debug)]
pub struct TileGrid {
    window: Window,
    tile: u32,
}

impl TileGrid {
    /// Tiles of `tile` x `tile` pixels (at least 1) over a window; those at its end are smaller.
    pub fn new(window: Window, tile: u32) -> Self {
        Self { window, tile }
    }

    /// Number of tiles.
    pub fn len(&self) -> usize {
        self.columns() * self.window.size().y.div_ceil(self.tile) as usize
    }

    /// The tile of this index: row by row from the top.
    pub fn tile(&self, index: usize) -> Window {
        // Both are below the number of pixels along a side, which is a u32.
        let column = (index % self.columns()) as u32;
        let row = (index / self.columns()) as u32;
        let start = self.window.start + UVec2::new(column, row) * self.tile;
        let end = start.saturating_add(UVec2::splat(self.tile));
        Window {
            start,
            end: end.min(self.window.end),
        }
    }

    fn columns(&self) -> usize {
        self.window.size().x.div_ceil(self.tile) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Aabb;
    use crate::render::film::{CameraSample, Objects};
    use crate::scene::Filter;

    /// An empty scene that is asked either about single rays or about full packets.
    struct Nothing {
        in_packets: bool,
    }

    const EMPTY: Nothing = Nothing { in_packets: true };

    impl Tracer for Nothing {
        fn intersect(&self, _: &Ray) -> Option<Hit> {
            assert!(!self.in_packets);
            None
        }
        fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
            assert!(self.in_packets && rays.valid() == u8::MAX);
            [None; RayPacket::LANES]
        }
        fn occluded(&self, _: &Ray) -> bool {
            false
        }
        fn bounds(&self) -> Aabb {
            Aabb::EMPTY
        }
        fn bvh_bytes(&self) -> usize {
            0
        }
        fn name(&self) -> String {
            "nothing".into()
        }
    }

    #[test]
    fn camera_rays_go_in_full_packets_where_there_are_eight_samples() {
        for spp in [1, 7, 8, 13] {
            let film = Film { spp, ..film() };
            let in_packets = spp >= 8;
            let mut frame = Frame::new(&film, 0..spp, Objects::default());
            let (filter, tracer) = (PixelFilter::new(film.filter), Nothing { in_packets });
            TileRenderer::new(&Camera::default(), &film, &filter, &tracer, &Broken).render(
                &mut frame,
                spp,
                &|| false,
            );
            assert!(frame.is_complete());
        }
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height, size) in [(1, 1, 32), (33, 64, 32), (100, 7, 16), (5, 5, 1)] {
            let window = Window {
                start: UVec2::new(3, 10),
                end: UVec2::new(3 + width, 10 + height),
            };
            let grid = TileGrid::new(window, size);
            let mut seen = vec![0; window.pixels()];
            for tile in (0..grid.len()).map(|i| grid.tile(i)) {
                for pixel in pixels(tile) {
                    seen[window.index(pixel).unwrap()] += 1;
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
        }
    }

    /// Radiance 1, but NaN for a part of the rays.
    struct Broken;

    impl Integrator for Broken {
        fn sample(&self, camera: &CameraRay, _: &Sampler, rays: &mut RayCounts) -> CameraSample {
            rays.camera += 1;
            CameraSample::background(match camera.ray.key % 3 {
                0 => Vec3::new(1.0, f32::NAN, 1.0),
                1 => Vec3::new(1.0, 1.0, f32::INFINITY),
                _ => Vec3::ONE,
            })
        }
    }

    fn film() -> Film {
        Film {
            width: 8,
            height: 8,
            spp: 32,
            seed: 3,
            ..Film::default()
        }
    }

    #[test]
    fn a_broken_sample_is_counted_and_never_spreads() {
        let film = film();
        let mut frame = Frame::new(&film, 0..32, Objects::default());
        let filter = PixelFilter::new(film.filter);
        let outcome = TileRenderer::new(&Camera::default(), &film, &filter, &EMPTY, &Broken)
            .render(&mut frame, 32, &|| false);
        assert!(frame.radiance().iter().all(|&p| p == Vec3::ONE));
        assert_eq!(outcome.rays.camera, 8 * 8 * 32);
        assert!(frame.is_complete() && !outcome.stopped);
        let expected = 8.0 * 8.0 * 32.0 * 2.0 / 3.0;
        assert!((frame.dropped() as f64 / expected - 1.0).abs() < 0.1);
    }

    #[test]
    fn a_stopped_tile_goes_on_to_the_same_bits() {
        let film = film();
        let filter = PixelFilter::new(film.filter);
        let renderer = TileRenderer::new(&Camera::default(), &film, &filter, &EMPTY, &Broken);
        let mut whole = Frame::new(&film, 0..32, Objects::default());
        let mut stopped = whole.clone();
        renderer.render(&mut whole, 32, &|| false);
        let mut rounds = 0;
        while !stopped.is_complete() {
            let left = std::cell::Cell::new(101);
            renderer.render(&mut stopped, 32, &|| {
                left.set(left.get() - 1);
                left.get() == 0
            });
            rounds += 1;
        }
        assert_eq!(rounds, (8 * 8 * 32_usize).div_ceil(100));
        assert_eq!(stopped, whole);
    }

    #[test]
    fn depth_is_along_the_view_but_for_panoramas() {
        let mut camera = Camera::default();
        let aside = Vec3::new(3.0, 0.0, -4.0);
        let (film, filter) = (film(), PixelFilter::new(Filter::default()));
        let depth = |camera: &Camera| {
            TileRenderer::new(camera, &film, &filter, &EMPTY, &Broken).depth(aside)
        };
        assert_eq!(depth(&camera), 4.0);
        camera.projection = Projection::Panorama;
        assert_eq!(depth(&camera), 5.0);
    }

    #[test]
    fn a_firefly_is_scaled_down_and_keeps_its_hue() {
        let bright = Vec3::new(10.0, 20.0, 5.0);
        assert_eq!(clamped(bright, Some(4.0)), Vec3::new(2.0, 4.0, 1.0));
        assert_eq!(clamped(bright, Some(20.0)), bright);
        assert_eq!(clamped(bright, None), bright);
        assert!(!clamped(Vec3::new(f32::INFINITY, 1.0, 1.0), Some(4.0)).is_finite());
        assert!(!clamped(Vec3::new(9.0, f32::NAN, 1.0), Some(4.0)).is_finite());
    }
}
