//! The pixel filter, by filter importance sampling: instead of weighting samples, they are placed with the
//! filter's density, so that a sample belongs to one pixel alone and tiles need no borders.
//!
//! Source: Ernst, Stamminger, Greiner, "Filter Importance Sampling", IEEE Symposium on Interactive Ray
//! Tracing, 2006. The filter is the four-term Blackman-Harris window (Harris, Proc. IEEE 66(1), 1978),
//! separable: nearly a Gaussian, positive, exactly 0 at its ends.

use std::f64::consts::TAU;

use glam::Vec2;

/// Half the filter's width in pixels.
const RADIUS: f32 = 1.5;

/// Intervals of the tabulated inverse distribution; enough that the filter's thin ends stay thin.
const INTERVALS: usize = 2048;

/// Maps uniform numbers to film offsets distributed as the filter.
#[derive(Clone, Debug)]
pub struct PixelFilter {
    /// Offset in pixels at cumulative probability i / `INTERVALS`.
    inverse: Box<[f32; INTERVALS + 1]>,
}

impl PixelFilter {
    /// The Blackman-Harris filter.
    pub fn blackman_harris() -> Self {
        let mut inverse = Box::new([0.0; INTERVALS + 1]);
        for (i, offset) in inverse.iter_mut().enumerate() {
            let x = invert(cumulative, i as f64 / INTERVALS as f64);
            *offset = RADIUS * (2.0 * x - 1.0) as f32;
        }
        Self { inverse }
    }

    /// The offset from the pixel's centre, in pixels, for a uniform point in [0, 1)^2.
    pub fn offset(&self, u: Vec2) -> Vec2 {
        Vec2::new(self.offset_1d(u.x), self.offset_1d(u.y))
    }

    fn offset_1d(&self, u: f32) -> f32 {
        let at = u * INTERVALS as f32;
        let i = (at as usize).min(INTERVALS - 1);
        let fraction = at - i as f32;
        self.inverse[i] + fraction * (self.inverse[i + 1] - self.inverse[i])
    }
}

/// The window's normalised integral from 0 to `x`, for `x` in [0, 1].
fn cumulative(x: f64) -> f64 {
    const A: [f64; 4] = [0.35875, -0.48829, 0.14128, -0.01168];
    let harmonic = |k: usize| A[k] * (TAU * k as f64 * x).sin() / (TAU * k as f64);
    x + (harmonic(1) + harmonic(2) + harmonic(3)) / A[0]
}

/// The `x` in [0, 1] at which the increasing `f` with f(0) = 0 and f(1) = 1 is `y`, by bisection.
fn invert(f: fn(f64) -> f64, y: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if f(middle) < y {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_symmetric_increasing_and_bounded() {
        let filter = PixelFilter::blackman_harris();
        let mut last = f32::NEG_INFINITY;
        for i in 0..1024 {
            let u = i as f32 / 1024.0;
            let offset = filter.offset_1d(u);
            assert!(offset >= last && offset.abs() <= RADIUS);
            assert!((offset + filter.offset_1d(1.0 - u)).abs() < 1e-5);
            last = offset;
        }
        assert!(filter.offset(Vec2::splat(0.5)).length() < 1e-6);
    }

    #[test]
    fn variance_is_that_of_the_window() {
        // integral of x^2 w(x) over [-1/2, 1/2] with w = 1 + sum c_k cos(2 pi k x):
        // 1/12 + sum c_k (-1)^k / (2 pi^2 k^2), c = (0.48829, 0.14128, 0.01168) / 0.35875.
        let c = [0.48829, 0.14128, 0.01168].map(|a: f64| a / 0.35875);
        let variance =
            1.0 / 12.0 + (-c[0] + c[1] / 4.0 - c[2] / 9.0) / (2.0 * std::f64::consts::PI.powi(2));
        let expected = variance * f64::from(2.0 * RADIUS).powi(2);
        let filter = PixelFilter::blackman_harris();
        let n = 100_000;
        let measured = (0..n)
            .map(|i| f64::from(filter.offset_1d((i as f32 + 0.5) / n as f32)).powi(2))
            .sum::<f64>()
            / f64::from(n);
        assert!(
            (measured - expected).abs() < 0.005 * expected,
            "{measured} {expected}"
        );
    }
}
