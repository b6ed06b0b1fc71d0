//! The pinhole camera: from a point on the film to a ray.

use glam::{Vec2, Vec3};

use super::basis::Basis;
use crate::ray::Ray;
use crate::scene::Camera;

/// A pinhole camera over a film of some size.
#[derive(Clone, Copy, Debug)]
pub struct PinholeCamera {
    origin: Vec3,
    /// To the film's top left corner, at distance 1 along the view.
    corner: Vec3,
    /// One pixel to the right.
    right: Vec3,
    /// One pixel down.
    down: Vec3,
}

impl PinholeCamera {
    /// The camera over a film of `width` x `height` square pixels; its field of view spans the height.
    ///
    /// An `up` parallel to the view leaves the roll open; some roll is chosen.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let forward = (camera.target - camera.position).normalize_or(Vec3::NEG_Z);
        let right = forward
            .cross(camera.up)
            .try_normalize()
            .unwrap_or_else(|| Basis::around(forward).x);
        let down = forward.cross(right);
        let half_height = (0.5 * camera.fov).tan();
        let pixel = 2.0 * half_height / height as f32;
        Self {
            origin: camera.position,
            corner: forward - 0.5 * pixel * (width as f32 * right + height as f32 * down),
            right: pixel * right,
            down: pixel * down,
        }
    }

    /// The ray through a film point in pixels: (0, 0) is the top left corner, (width, height) the bottom
    /// right one; points outside are fine. The direction is of unit length.
    pub fn ray(&self, film: Vec2) -> Ray {
        let direction = self.corner + film.x * self.right + film.y * self.down;
        Ray::new(self.origin, direction.normalize())
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use super::*;

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(1.0, 2.0, -7.0),
            up: Vec3::Y,
            fov: FRAC_PI_2,
        }
    }

    #[test]
    fn corners_and_centre() {
        let camera = PinholeCamera::new(&camera(), 200, 100);
        let cases = [
            (Vec2::new(100.0, 50.0), Vec3::new(0.0, 0.0, -1.0)),
            (Vec2::new(0.0, 0.0), Vec3::new(-2.0, 1.0, -1.0)),
            (Vec2::new(200.0, 0.0), Vec3::new(2.0, 1.0, -1.0)),
            (Vec2::new(0.0, 100.0), Vec3::new(-2.0, -1.0, -1.0)),
            (Vec2::new(200.0, 100.0), Vec3::new(2.0, -1.0, -1.0)),
        ];
        for (film, direction) in cases {
            let ray = camera.ray(film);
            assert_eq!(ray.origin, Vec3::new(1.0, 2.0, 3.0));
            assert!(ray.direction.abs_diff_eq(direction.normalize(), 1e-6));
        }
    }

    #[test]
    fn looking_along_up_still_gives_rays() {
        let above = Camera {
            target: Vec3::new(1.0, -5.0, 3.0),
            ..camera()
        };
        let ray = PinholeCamera::new(&above, 10, 10).ray(Vec2::splat(5.0));
        assert!(ray.is_valid());
        assert!(ray.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    }
}
