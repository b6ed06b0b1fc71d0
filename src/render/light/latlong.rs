//! The sphere as a picture: azimuth across, cosine of the polar angle up.
//!
//! The azimuth is a part of the full turn: 0.5, the middle column, looks along -Z and it grows towards +X, so
//! that a panorama is seen from inside with its left at the left. With the cosine as the other coordinate the
//! map keeps areas: a uniform point gives a uniform direction.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

/// The unit vector at (azimuth in turns, cosine of the angle to +Y).
pub fn direction(point: Vec2) -> Vec3 {
    let (sin, cos) = ((point.x - 0.5) * TAU).sin_cos();
    let radius = (1.0 - point.y * point.y).max(0.0).sqrt();
    Vec3::new(radius * sin, point.y, -radius * cos)
}

/// The inverse of [`direction`]; the azimuth is in [0, 1].
pub fn point(direction: Vec3) -> Vec2 {
    let azimuth = direction.x.atan2(-direction.z) / TAU + 0.5;
    Vec2::new(azimuth, direction.y.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_directions() {
        for (turns, along) in [(0.5, Vec3::NEG_Z), (0.75, Vec3::X), (0.25, Vec3::NEG_X)] {
            assert!(direction(Vec2::new(turns, 0.0)).abs_diff_eq(along, 1e-6));
            assert!((point(along).x - turns).abs() < 1e-6);
        }
        assert!(direction(Vec2::new(0.1, 1.0)).abs_diff_eq(Vec3::Y, 1e-6));
    }

    #[test]
    fn round_trip() {
        for i in 0..100 {
            let at = Vec2::new(i as f32 / 100.0 + 0.003, 0.99 - i as f32 / 51.0);
            assert!(point(direction(at)).abs_diff_eq(at, 1e-5), "{at}");
        }
    }
}
