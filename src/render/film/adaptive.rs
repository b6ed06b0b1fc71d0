//! When a pixel has had samples enough.
//!
//! The error is the one of Dammertz, Hanika, Keller, Lensch, "A Hierarchical Automatic Stopping Condition for Monte
//! Carlo Global Illumination", WSCG 2010: the deviation of the mean, over the square root of brightness, as the eye
//! has it. A pixel is judged by its own samples alone, at fixed counts: any tiling takes the same samples. The price
//! is a bias where rare bright samples have not been seen by the first look.

use super::pixel::Pixel;
use super::slot::{DEVIATIONS, MEANS};
use crate::scene::Adaptive;

/// Brightness below this is as good as black.
const DARKEST: f64 = 1e-4;

/// Whether `pixel` needs no more samples. Asked before every sample; looks only at multiples of `min_spp`.
pub fn converged(pixel: &Pixel, adaptive: &Adaptive) -> bool {
    let taken = pixel.counts.taken();
    taken > 0 && taken.is_multiple_of(adaptive.min_spp) && error(pixel) <= adaptive.threshold.into()
}

fn error(pixel: &Pixel) -> f64 {
    let samples = f64::from(pixel.counts.samples);
    if samples < 2.0 {
        return f64::INFINITY;
    }
    let deviation = |squares: &f64| (squares / (samples - 1.0) / samples).sqrt();
    let spread: f64 = pixel.sums[DEVIATIONS..].iter().map(deviation).sum();
    let brightness: f64 = pixel.sums[MEANS..DEVIATIONS].iter().sum();
    spread / brightness.max(DARKEST).sqrt()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::sample::CameraSample;
    use super::*;

    const ADAPTIVE: Adaptive = Adaptive {
        threshold: 0.1,
        min_spp: 8,
    };

    fn pixel(count: u32, radiance: impl Fn(u32) -> f32) -> Pixel {
        let mut pixel = Pixel::default();
        for i in 0..count {
            let sample = CameraSample::background(Vec3::splat(radiance(i)));
            pixel.add(&sample, 1, 0.0, 0);
        }
        pixel
    }

    #[test]
    fn a_flat_pixel_ends_at_the_first_look_and_never_before() {
        for count in 0..20 {
            let ends = converged(&pixel(count, |_| 0.7), &ADAPTIVE);
            assert_eq!(ends, count == 8 || count == 16, "{count}");
        }
    }

    #[test]
    fn a_noisy_pixel_ends_when_its_mean_is_known() {
        // Half of the samples are 0 and half are 2: the error is 3 / sqrt(n - 1) / sqrt(3).
        let ends = |count| converged(&pixel(count, |i| 2.0 * (i % 2) as f32), &ADAPTIVE);
        let expected = |count: u32| (3.0 / f64::from(count - 1)).sqrt() <= 0.1;
        for count in (8..800).step_by(8) {
            assert_eq!(ends(count), expected(count), "{count}");
        }
    }

    #[test]
    fn broken_samples_do_not_end_a_pixel() {
        assert!(!converged(&pixel(8, |_| f32::NAN), &ADAPTIVE));
    }
}
