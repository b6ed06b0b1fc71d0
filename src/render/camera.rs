//! From a point on the film and one on the lens to a ray.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{Vec2, Vec3};

use super::basis::Basis;
use crate::ray::Ray;
use crate::scene::{Camera, Lens, Projection};

/// A camera over a film of some size.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    origin: Vec3,
    forward: Vec3,
    /// Unit vectors of the film: to the right and down.
    right: Vec3,
    down: Vec3,
    /// Pixels.
    size: Vec2,
    shift: Vec2,
    projection: Projection,
    /// Half the height of the film at distance 1, or of an orthographic one.
    half_height: f32,
    lens: Option<Lens>,
}

impl Eye {
    /// The camera over a film of `width` x `height` square pixels; field of view and orthographic height span its
    /// height, or more where it is narrower than the camera's aspect.
    ///
    /// An `up` parallel to the view leaves the roll open; some roll is chosen.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let forward = (camera.target - camera.position).normalize_or(Vec3::NEG_Z);
        let right = forward
            .cross(camera.up)
            .try_normalize()
            .unwrap_or_else(|| Basis::around(forward).x);
        Self {
            origin: camera.position,
            forward,
            right,
            down: forward.cross(right),
            size: Vec2::new(width as f32, height as f32),
            shift: camera.shift,
            projection: camera.projection,
            half_height: camera.half_height(width, height),
            lens: camera.lens,
        }
    }

    /// The ray through a film point in pixels: (0, 0) is the top left corner, (width, height) the bottom
    /// right one; points outside are fine. `u` is a uniform point for the lens. The direction is of unit length.
    pub fn ray(&self, film: Vec2, u: Vec2) -> Ray {
        let from_middle =
            (2.0 * film - self.size) / self.size.y + 2.0 * self.shift * Vec2::new(1.0, -1.0);
        let plane = self.half_height * (from_middle.x * self.right + from_middle.y * self.down);
        match self.projection {
            Projection::Orthographic { .. } => Ray::new(self.origin + plane, self.forward),
            Projection::Panorama => Ray::new(self.origin, self.around(film / self.size)),
            Projection::Perspective => match &self.lens {
                None => Ray::new(self.origin, (self.forward + plane).normalize()),
                Some(lens) => self.through_lens(lens, self.forward + plane, u),
            },
        }
    }

    /// Whether rays start all over a lens, so that [`Self::ray`] makes use of its `u`.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// From the lens to where the pinhole's ray meets the plane that is sharp.
    fn through_lens(&self, lens: &Lens, pinhole: Vec3, u: Vec2) -> Ray {
        let at = lens.radius * aperture(lens, u);
        let offset = at.x * self.right - at.y * self.down;
        Ray::new(
            self.origin + offset,
            (lens.focus * pinhole - offset).normalize(),
        )
    }

    /// The direction of a point of an equirectangular picture, from (0, 0) top left to (1, 1).
    fn around(&self, at: Vec2) -> Vec3 {
        let (sin, cos) = ((at.x - 0.5) * TAU).sin_cos();
        let (up, level) = ((0.5 - at.y) * PI).sin_cos();
        level * (cos * self.forward + sin * self.right) - up * self.down
    }
}

/// A uniform point of the aperture, its corners at distance 1.
fn aperture(lens: &Lens, u: Vec2) -> Vec2 {
    if lens.blades < 3 {
        return concentric_disk(u);
    }
    // One of the triangles around the middle, and a uniform point of it.
    let blade = u.x * lens.blades as f32;
    let corner = |i: f32| Vec2::from_angle(lens.rotation + TAU * i / lens.blades as f32);
    let (first, second) = (corner(blade.floor()), corner(blade.floor() + 1.0));
    let outward = u.y.sqrt();
    outward * first.lerp(second, blade.fract())
}

/// Shirley and Chiu, "A Low Distortion Map Between Disk and Square", Journal of Graphics Tools 2(3), 1997.
fn concentric_disk(u: Vec2) -> Vec2 {
    let square = 2.0 * u - 1.0;
    if square == Vec2::ZERO {
        return Vec2::ZERO;
    }
    if square.x.abs() > square.y.abs() {
        square.x * Vec2::from_angle(FRAC_PI_4 * square.y / square.x)
    } else {
        square.y * Vec2::from_angle(FRAC_PI_2 - FRAC_PI_4 * square.x / square.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::testing::{Fineness, Random, assert_samples_follow};

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(1.0, 2.0, -7.0),
            fov: FRAC_PI_2,
            ..Camera::default()
        }
    }

    fn ray(camera: &Camera, film: Vec2) -> Ray {
        Eye::new(camera, 200, 100).ray(film, Vec2::splat(0.5))
    }

    #[test]
    fn corners_and_centre() {
        let cases = [
            (Vec2::new(100.0, 50.0), Vec3::new(0.0, 0.0, -1.0)),
            (Vec2::new(0.0, 0.0), Vec3::new(-2.0, 1.0, -1.0)),
            (Vec2::new(200.0, 0.0), Vec3::new(2.0, 1.0, -1.0)),
            (Vec2::new(0.0, 100.0), Vec3::new(-2.0, -1.0, -1.0)),
            (Vec2::new(200.0, 100.0), Vec3::new(2.0, -1.0, -1.0)),
        ];
        for (film, direction) in cases {
            let ray = ray(&camera(), film);
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
        let ray = ray(&above, Vec2::new(100.0, 50.0));
        assert!(ray.is_valid());
        assert!(ray.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    }

    #[test]
    fn parallel_rays_span_the_height() {
        let camera = Camera {
            projection: Projection::Orthographic { height: 4.0 },
            ..camera()
        };
        let [top, bottom] = [0.0, 100.0].map(|y| ray(&camera, Vec2::new(100.0, y)));
        assert_eq!(
            (top.direction, bottom.direction),
            (Vec3::NEG_Z, Vec3::NEG_Z)
        );
        assert!((top.origin - bottom.origin).abs_diff_eq(Vec3::new(0.0, 4.0, 0.0), 1e-6));
    }

    #[test]
    fn a_panorama_looks_all_around() {
        let camera = Camera {
            projection: Projection::Panorama,
            ..camera()
        };
        let cases = [
            (Vec2::new(100.0, 50.0), Vec3::NEG_Z),
            (Vec2::new(150.0, 50.0), Vec3::X),
            (Vec2::new(0.0, 50.0), Vec3::Z),
            (Vec2::new(30.0, 0.0), Vec3::Y),
            (Vec2::new(30.0, 100.0), Vec3::NEG_Y),
        ];
        for (film, direction) in cases {
            assert!(
                ray(&camera, film).direction.abs_diff_eq(direction, 1e-6),
                "{film}"
            );
        }
    }

    #[test]
    fn shift_moves_the_picture_without_turning_it() {
        let camera = Camera {
            shift: Vec2::new(0.5, 0.25),
            ..camera()
        };
        // The middle of the film sees what was half a height to the right and a quarter up.
        let found = ray(&camera, Vec2::new(100.0, 50.0)).direction;
        let plain = ray(&self::camera(), Vec2::new(150.0, 25.0)).direction;
        assert!(found.abs_diff_eq(plain, 1e-6));
    }

    #[test]
    fn rays_of_a_point_in_focus_meet_and_fill_the_aperture() {
        for blades in [0, 3, 6] {
            let lens = Lens {
                radius: 0.5,
                focus: 4.0,
                blades,
                rotation: 0.3,
            };
            let camera = Camera {
                lens: Some(lens),
                ..camera()
            };
            let eye = Eye::new(&camera, 200, 100);
            let film = Vec2::new(40.0, 80.0);
            let sharp = ray(&self::camera(), film);
            let at = sharp.at(4.0 / sharp.direction.dot(Vec3::NEG_Z));
            let mut random = Random::new(1);
            let mut mean = Vec2::ZERO;
            for _ in 0..2000 {
                let ray = eye.ray(film, random.point());
                let t = (at - ray.origin).dot(ray.direction);
                assert!(ray.at(t).abs_diff_eq(at, 1e-4), "{blades}");
                let on_lens = (ray.origin - camera.position).truncate();
                assert!(on_lens.length() <= 0.5 + 1e-5);
                mean += on_lens / 2000.0;
            }
            assert!(mean.length() < 0.03, "{mean}");
        }
    }

    #[test]
    fn the_aperture_is_sampled_uniformly_by_chi_square() {
        let fineness = Fineness {
            samples: 40_000,
            cells: [14, 14],
            points: 32,
        };
        for blades in [0, 3, 5, 6, 11] {
            let lens = Lens {
                radius: 0.5,
                focus: 4.0,
                blades,
                rotation: 0.3,
            };
            let camera = Camera {
                lens: Some(lens),
                ..camera()
            };
            let eye = Eye::new(&camera, 200, 100);
            let sides = if blades == 0 { 1 } else { blades };
            let turn = TAU / sides as f32;
            // Half planes: where the middle of each side is, and how far out.
            let [reach, area] = match blades {
                0 => [1.0, PI],
                n => [(0.5 * turn).cos(), 0.5 * n as f32 * turn.sin()],
            };
            let is_inside = |at: Vec2| {
                let sides = (0..sides).map(|k| lens.rotation + (k as f32 + 0.5) * turn);
                match blades {
                    0 => at.length() <= reach,
                    _ => sides
                        .into_iter()
                        .all(|angle| at.dot(Vec2::from_angle(angle)) <= reach),
                }
            };
            assert_samples_follow(
                &format!("{blades} blades"),
                fineness,
                |random| {
                    let origin = eye.ray(Vec2::new(40.0, 80.0), random.point()).origin;
                    let at = (origin - camera.position).truncate() / lens.radius;
                    Some(0.5 * (at + 1.0))
                },
                // The square covers an area of 4.
                |at| {
                    if is_inside(2.0 * at - 1.0) {
                        4.0 / area
                    } else {
                        0.0
                    }
                },
            );
        }
    }
}
