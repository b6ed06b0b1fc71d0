//! A measured or painted surrounding: an equirectangular HDR picture, sampled by its brightness.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::color::luminance;
use super::sphere_distribution::SphereDistribution;
use super::{InfiniteLight, LightSample, latlong};
use crate::image::EnvironmentImage;

/// An equirectangular picture as a light, looked up bilinearly.
#[derive(Clone, Debug)]
pub struct Environment {
    image: Arc<EnvironmentImage>,
    /// (sin, cos) of the rotation about +Y.
    rotation: (f32, f32),
    strength: f32,
    distribution: SphereDistribution,
}

impl Environment {
    /// `image` turned counter-clockwise about +Y by `rotation` radians and multiplied by `strength`.
    pub fn new(image: Arc<EnvironmentImage>, rotation: f32, strength: f32) -> Self {
        // The density of a pixel is the mean over it of the bilinear picture, (1 6 1) / 8 each way: never 0
        // where the picture is not black, although a dark pixel has light bleeding in from its neighbours.
        let distribution = SphereDistribution::new(image.width, image.height, |column, row| {
            let mut sum = 0.0;
            for (dy, wy) in [(-1, 1.0), (0, 6.0), (1, 1.0)] {
                for (dx, wx) in [(-1, 1.0), (0, 6.0), (1, 1.0)] {
                    let pixel = pixel(&image, column as isize + dx, row as isize + dy);
                    sum += wx * wy / 64.0 * luminance(pixel);
                }
            }
            sum
        });
        Self {
            image,
            rotation: rotation.sin_cos(),
            strength,
            distribution,
        }
    }

    fn to_picture(&self, v: Vec3) -> Vec3 {
        let (sin, cos) = self.rotation;
        Vec3::new(cos * v.x - sin * v.z, v.y, sin * v.x + cos * v.z)
    }

    fn to_world(&self, v: Vec3) -> Vec3 {
        let (sin, cos) = self.rotation;
        Vec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x)
    }
}

/// A pixel; columns wrap around, rows end at the poles.
fn pixel(image: &EnvironmentImage, column: isize, row: isize) -> Vec3 {
    let column = column.rem_euclid(image.width as isize) as usize;
    let row = row.clamp(0, image.height as isize - 1) as usize;
    image.pixels[row * image.width + column]
}

fn bilinear(image: &EnvironmentImage, at: Vec2) -> Vec3 {
    let corner = (at - 0.5).floor();
    let f = at - 0.5 - corner;
    let (x, y) = (corner.x as isize, corner.y as isize);
    let upper = pixel(image, x, y).lerp(pixel(image, x + 1, y), f.x);
    let lower = pixel(image, x, y + 1).lerp(pixel(image, x + 1, y + 1), f.x);
    upper.lerp(lower, f.y)
}

impl InfiniteLight for Environment {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        let local = self.to_picture(direction);
        let point = latlong::point(local);
        let polar = point.y.acos() / PI;
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        self.strength * bilinear(&self.image, Vec2::new(point.x, polar) * size)
    }

    fn sample(&self, _normal: Vec3, u: Vec2) -> LightSample {
        let (local, pdf) = self.distribution.sample(u);
        let direction = self.to_world(local);
        LightSample::far(direction, self.radiance(direction), pdf)
    }

    fn brightness(&self) -> f32 {
        self.strength * self.distribution.integral()
    }

    fn pdf(&self, _normal: Vec3, direction: Vec3) -> f32 {
        self.distribution.pdf(self.to_picture(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, f: impl Fn(usize, usize) -> Vec3) -> Environment {
        rotated(width, height, 0.0, f)
    }

    fn rotated(
        width: usize,
        height: usize,
        rotation: f32,
        f: impl Fn(usize, usize) -> Vec3,
    ) -> Environment {
        let pixels = (0..width * height)
            .map(|i| f(i % width, i / width))
            .collect();
        let image = EnvironmentImage {
            width,
            height,
            pixels,
        };
        Environment::new(Arc::new(image), rotation, 1.0)
    }

    #[test]
    fn directions_read_the_pixels_they_should() {
        let light = picture(8, 4, |column, row| {
            Vec3::new(column as f32, row as f32, 1.0)
        });
        // The middle of the picture looks along -Z, between columns 3 and 4 and rows 1 and 2.
        assert!(
            light
                .radiance(Vec3::NEG_Z)
                .abs_diff_eq(Vec3::new(3.5, 1.5, 1.0), 1e-4)
        );
        assert!((light.radiance(Vec3::X).x - 5.5).abs() < 1e-4);
        assert!(light.radiance(Vec3::Y).y < 1e-4);
        assert!((light.radiance(Vec3::NEG_Y).y - 3.0).abs() < 1e-4);
    }

    #[test]
    fn rotation_turns_the_picture_counter_clockwise_seen_from_above() {
        let f = |column: usize, _| Vec3::splat(column as f32);
        let quarter = rotated(8, 4, 0.5 * PI, f);
        // What was along -Z stands along -X after a quarter turn about +Y.
        let expected = picture(8, 4, f).radiance(Vec3::NEG_Z);
        assert!(quarter.radiance(Vec3::NEG_X).abs_diff_eq(expected, 1e-3));
        let d = Vec3::new(0.5, 0.1, 0.7).normalize();
        assert!(quarter.to_picture(quarter.to_world(d)).abs_diff_eq(d, 1e-6));
    }

    #[test]
    fn one_bright_pixel_is_found_and_its_light_is_exact() {
        let light = picture(64, 32, |column, row| {
            Vec3::splat(if (column, row) == (20, 9) {
                1000.0
            } else {
                0.0
            })
        });
        let n = 20_000;
        let mut power = 0.0;
        for i in 0..n {
            let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / n as f32);
            let s = light.sample(Vec3::Y, u);
            assert!(s.pdf > 0.0);
            power += s.radiance.x / s.pdf / n as f32;
        }
        // The bilinear bump of one pixel integrates to the pixel's solid angle (up to the change of
        // sin(theta) over its three rows).
        let border = |row: usize| (PI * row as f32 / 32.0).cos();
        let expected = 1000.0 * 2.0 * PI / 64.0 * (border(9) - border(10));
        assert!((power / expected - 1.0).abs() < 0.02, "{power} {expected}");
    }
}
