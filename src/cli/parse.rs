//! Values of options, checked as they are parsed.

use crate::scene::{MAX_SIDE, STEP_TEXELS, too_many_pixels};

/// `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

/// `640x480`.
pub fn size(text: &str) -> Result<Size, String> {
    let expected = || format!("expected WIDTHxHEIGHT, like 640x480, each from 1 to {MAX_SIDE}");
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let (width, height) = (side(width), side(height));
    let (Some(width), Some(height)) = (width, height) else {
        return Err(expected());
    };
    match too_many_pixels(width, height) {
        Some((found, most)) => Err(format!("{found}; expected at most {most} pixels")),
        None => Ok(Size { width, height }),
    }
}

/// A finite number.
pub fn finite(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| x.is_finite());
    number.ok_or_else(|| "expected a finite number".into())
}

/// A displacement scale.
pub fn scale(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|&x| x != 0.0);
    number.ok_or_else(|| "expected a finite number other than 0".into())
}

/// A march step in texels.
pub fn texels(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| STEP_TEXELS.contains(x));
    number.ok_or_else(|| {
        let (low, high) = (STEP_TEXELS.start(), STEP_TEXELS.end());
        format!("expected texels per step, from {low} to {high}")
    })
}

/// The angle of a pixel.
pub fn spread(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| (0.0..=1.0).contains(x));
    number.ok_or_else(|| "expected radians from 0 to 1".into())
}

/// A length above zero.
pub fn length(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|&x| x > 0.0);
    number.ok_or_else(|| "expected a length above 0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_in_range() {
        let size_of = |width, height| Ok(Size { width, height });
        assert_eq!(size("640x480"), size_of(640, 480));
        assert_eq!(size("1X65536"), size_of(1, 65536));
        for bad in [
            "",
            "x",
            "640",
            "0x480",
            "640x0",
            "-1x1",
            "65537x1",
            "1x2x3",
            "65536x65536",
        ] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_are_finite_and_fit() {
        assert_eq!(scale("-0.5"), Ok(-0.5));
        for bad in ["0", "nan", "inf", "1e50", "one", ""] {
            assert!(scale(bad).is_err(), "{bad}");
        }
        assert_eq!(texels("0.25"), Ok(0.25));
        assert!(texels("0").is_err() && texels("-1").is_err() && texels("1e-9").is_err());
        assert_eq!(length("1e-3"), Ok(1e-3));
        assert!(length("0").is_err() && length("nan").is_err());
    }
}
