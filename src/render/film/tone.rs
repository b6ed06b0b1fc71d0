//! From linear radiance to an 8-bit sRGB picture: exposure, curve, encoding.

use glam::Vec3;

use crate::image::srgb_encode;
use crate::scene::ToneCurve;

/// Radiance beyond this is white on any curve; it keeps infinities out of the arithmetic.
const WHITE: f32 = 1.0e6;

/// One linear radiance as an 8-bit sRGB pixel: multiplied by 2^`exposure`, put through `curve`, encoded,
/// rounded to nearest. Negative values and NaN become 0.
pub fn to_srgb8(radiance: Vec3, exposure: f32, curve: ToneCurve) -> [u8; 3] {
    tone_map(radiance * exposure.exp2(), curve)
        .to_array()
        .map(|x| (srgb_encode(x) * 255.0).round() as u8)
}

/// Linear radiance through `curve`: black stays black, greys stay grey and keep their order, at most 1.
fn tone_map(radiance: Vec3, curve: ToneCurve) -> Vec3 {
    let sound = |x: f32| if x.is_nan() { 0.0 } else { x.clamp(0.0, WHITE) };
    let radiance = Vec3::from_array(radiance.to_array().map(sound));
    match curve {
        ToneCurve::Filmic => radiance.map(filmic),
        ToneCurve::Agx => agx(radiance),
        ToneCurve::Standard => radiance.min(Vec3::ONE),
    }
}

/// After the idea of AgX (Sobotka, "AgX", 2022): colours are drawn towards grey before a sigmoid over stops and back after it,
/// so that bright saturated ones end in white. Not its matrices: both ways keep Rec. 709 luminance.
fn agx(radiance: Vec3) -> Vec3 {
    const DRAWN: f32 = 0.15;
    let grey = |rgb: Vec3| Vec3::splat(rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
    let drawn = radiance.lerp(grey(radiance), DRAWN);
    let curved = drawn.map(sigmoid);
    let back = (curved - DRAWN * grey(curved)) / (1.0 - DRAWN);
    back.clamp(Vec3::ZERO, Vec3::ONE)
}

/// From 10 stops below middle grey to 6.5 above it; middle grey stays as it is. Either limb is x / (1 + x^p)^(1/p), scaled to
/// leave middle grey with the slope and to end in the corner.
fn sigmoid(x: f32) -> f32 {
    const BELOW: f32 = 10.0;
    const ABOVE: f32 = 6.5;
    const SLOPE: f32 = 2.4;
    const POWER: f32 = 1.5;
    const DISPLAY: f32 = 2.2;
    const MIDDLE_GREY: f32 = 0.18;
    let middle = MIDDLE_GREY.powf(1.0 / DISPLAY);
    let stops = (x / MIDDLE_GREY).log2().min(ABOVE);
    if stops <= -BELOW {
        return 0.0;
    }
    let (side, end, room) = if stops < 0.0 {
        (-1.0, BELOW, middle)
    } else {
        (1.0, ABOVE, 1.0 - middle)
    };
    let rise = |stops: f32| SLOPE * stops / (BELOW + ABOVE);
    let scale = rise(end) / ((rise(end) / room).powf(POWER) - 1.0).powf(1.0 / POWER);
    let at = rise(stops.abs()) / scale;
    let limb = scale * at / (1.0 + at.powf(POWER)).powf(1.0 / POWER);
    (middle + side * limb).clamp(0.0, 1.0).powf(DISPLAY)
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

    const CURVES: [ToneCurve; 3] = [ToneCurve::Filmic, ToneCurve::Agx, ToneCurve::Standard];

    fn grey(x: f32, curve: ToneCurve) -> f32 {
        tone_map(Vec3::splat(x), curve).y
    }

    #[test]
    fn zero_stays_zero_and_the_curve_rises_to_at_most_one() {
        for curve in CURVES {
            assert_eq!(grey(0.0, curve), 0.0);
            let mut last = 0.0;
            for i in 0..4000 {
                let y = grey(1.005_f32.powi(i - 2000), curve);
                assert!((last - 1e-6..=1.0).contains(&y), "{curve:?} {i}");
                last = y;
            }
            assert!(last > 1.0 - 1e-6, "{curve:?}");
        }
    }

    #[test]
    fn middle_grey_stays_and_greys_stay_grey() {
        for curve in CURVES {
            assert!((grey(0.18, curve) - 0.18).abs() < 1e-4, "{curve:?}");
            for x in [0.001, 0.1, 0.5, 3.0] {
                let [r, g, b] = tone_map(Vec3::splat(x), curve).to_array();
                assert!(
                    (r - g).abs() < 1e-5 && (b - g).abs() < 1e-5,
                    "{curve:?} {x}"
                );
            }
        }
    }

    #[test]
    fn agx_fades_bright_colours_to_white_and_keeps_dim_ones() {
        let red = |x: f32| tone_map(Vec3::new(x, 0.0, 0.0), ToneCurve::Agx);
        assert!(red(0.18).x > 8.0 * red(0.18).y);
        assert!(red(1000.0).min_element() > 0.8);
        assert_eq!(
            tone_map(Vec3::new(1000.0, 0.0, 0.0), ToneCurve::Standard).y,
            0.0
        );
    }

    #[test]
    fn odd_numbers_give_a_colour() {
        for curve in CURVES {
            let odd = Vec3::new(f32::NAN, f32::NEG_INFINITY, f32::INFINITY);
            let expected = match curve {
                ToneCurve::Agx => [255; 3],
                ToneCurve::Filmic | ToneCurve::Standard => [0, 0, 255],
            };
            assert_eq!(to_srgb8(odd, 0.0, curve), expected);
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
