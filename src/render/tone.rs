//! From linear radiance to an 8-bit sRGB picture: exposure, curve, encoding.

use glam::Vec3;

use crate::image::srgb_encode;
use crate::scene::ToneCurve;

/// Radiance beyond this is white on any curve; it keeps infinities out of the arithmetic.
const WHITE: f32 = 1.0e6;

/// One linear radiance as an 8-bit sRGB pixel: multiplied by 2^`exposure`, put through `curve`, encoded,
/// rounded to nearest. Negative values and NaN become 0.
pub fn to_srgb8(radiance: Vec3, exposure: f32, curve: ToneCurve) -> [u8; 3] {
    radiance
        .to_array()
        .map(|x| (srgb_encode(tone_map(x * exposure.exp2(), curve)) * 255.0).round() as u8)
}

/// A linear value through `curve`: 0 stays 0, increasing, at most 1.
pub fn tone_map(x: f32, curve: ToneCurve) -> f32 {
    let x = if x.is_nan() { 0.0 } else { x.clamp(0.0, WHITE) };
    match curve {
        ToneCurve::Filmic => filmic(x),
        ToneCurve::Standard => x.min(1.0),
    }
}

/// Narkowicz's rational fit to the ACES reference curve ("ACES Filmic Tone Mapping Curve", 2016), with its
/// input scaled so that middle grey (0.18) stays middle grey.
fn filmic(x: f32) -> f32 {
    const MIDDLE_GREY: f32 = 0.7232;
    let x = MIDDLE_GREY * x;
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneCurve; 2] = [ToneCurve::Filmic, ToneCurve::Standard];

    #[test]
    fn zero_stays_zero_and_the_curve_rises_to_at_most_one() {
        for curve in CURVES {
            assert_eq!(tone_map(0.0, curve), 0.0);
            let mut last = 0.0;
            for i in 0..4000 {
                let y = tone_map(1.005_f32.powi(i - 2000), curve);
                assert!((last..=1.0).contains(&y), "{curve:?} {i}");
                last = y;
            }
            assert_eq!(last, 1.0);
        }
    }

    #[test]
    fn filmic_keeps_middle_grey() {
        assert!((tone_map(0.18, ToneCurve::Filmic) - 0.18).abs() < 1e-4);
    }

    #[test]
    fn odd_numbers_give_a_colour() {
        for curve in CURVES {
            let odd = Vec3::new(f32::NAN, f32::NEG_INFINITY, f32::INFINITY);
            assert_eq!(to_srgb8(odd, 0.0, curve), [0, 0, 255]);
            assert_eq!(to_srgb8(Vec3::ONE, 1000.0, curve), [255; 3]);
            assert_eq!(to_srgb8(Vec3::ONE, -1000.0, curve), [0; 3]);
        }
    }

    #[test]
    fn one_stop_doubles() {
        let grey = |x: f32, exposure| to_srgb8(Vec3::splat(x), exposure, ToneCurve::Standard)[0];
        assert_eq!(grey(0.25, 1.0), grey(0.5, 0.0));
        // 0.5 encodes to 0.7354 (IEC 61966-2-1).
        assert_eq!(grey(0.5, 0.0), 188);
    }
}
