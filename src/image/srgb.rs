//! The sRGB transfer curve (IEC 61966-2-1).

use std::sync::LazyLock;

/// Linear light of an sRGB-encoded value in [0, 1].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB encoding of linear light in [0, 1].
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear light of each 8-bit code.
pub(super) static DECODE_8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_decode(code as f32 / 255.0)));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_the_standard_s_known_values() {
        assert_eq!(srgb_decode(0.0), 0.0);
        assert_eq!(srgb_decode(1.0), 1.0);
        assert!((srgb_decode(0.5) - 0.214_041).abs() < 1e-6);
        assert!((srgb_encode(0.18) - 0.461_356).abs() < 1e-5);
    }

    #[test]
    fn encoding_inverts_decoding() {
        for code in 0..=255 {
            let back = srgb_encode(DECODE_8[code]) * 255.0;
            assert_eq!(back.round() as usize, code);
        }
    }
}
