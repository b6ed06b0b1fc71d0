//! Between the colour spaces of the daylight model and the renderer's linear sRGB.

use glam::{Mat3, Vec3};

/// Luminance weights of linear sRGB (Rec. 709 primaries).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of linear sRGB.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(LUMINANCE)
}

/// CIE XYZ to linear sRGB (IEC 61966-2-1); colours outside its gamut are clipped at 0.
pub fn xyz_to_rgb(xyz: Vec3) -> Vec3 {
    const RGB_FROM_XYZ: Mat3 = Mat3::from_cols_array_2d(&[
        [3.240_625, -0.968_931, 0.055_71],
        [-1.537_208, 1.875_756, -0.204_021],
        [-0.498_629, 0.041_518, 1.056_996],
    ]);
    (RGB_FROM_XYZ * xyz).max(Vec3::ZERO)
}

/// CIE xyY to XYZ. A chromaticity outside the diagram (y <= 0) has no colour: black.
pub fn xyy_to_xyz(x: f32, y: f32, luminance: f32) -> Vec3 {
    if y <= 0.0 {
        return Vec3::ZERO;
    }
    Vec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance
}

/// The CIE 1931 colour matching functions at a wavelength in nanometres: the multi-lobe fit of Wyman,
/// Sloan, Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013.
pub fn matching_functions(wavelength: f32) -> Vec3 {
    let lobe = |scale: f32, centre: f32, below: f32, above: f32| {
        let slope = if wavelength < centre { below } else { above };
        scale * (-0.5 * ((wavelength - centre) * slope).powi(2)).exp()
    };
    Vec3::new(
        lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_white_point_is_white() {
        let white = xyz_to_rgb(xyy_to_xyz(0.3127, 0.3290, 1.0));
        assert!(white.abs_diff_eq(Vec3::ONE, 1e-3), "{white}");
        assert!((luminance(white) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn equal_energy_has_equal_tristimulus_values() {
        let sum: Vec3 = (360..=830).map(|nm| matching_functions(nm as f32)).sum();
        // The tables integrate to 106.9 each; the fit is within a percent.
        for value in sum.to_array() {
            assert!((value - 106.9).abs() < 1.1, "{sum}");
        }
    }
}
