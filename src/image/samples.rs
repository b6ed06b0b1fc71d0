//! Samples of pictures in the type of their file, and what they are as heights.

use half::f16;

use crate::surface::Texels;

/// Samples of one type, row by row from the top, channel by channel within a pixel.
pub(super) enum Samples {
    /// 0 ..= 2^8 - 1.
    U8(Vec<u8>),
    /// 0 ..= 2^16 - 1.
    U16(Vec<u16>),
    /// 0 ..= 2^32 - 1.
    U32(Vec<u32>),
    /// 0 ..= 2^64 - 1.
    U64(Vec<u64>),
    /// As stored.
    I8(Vec<i8>),
    /// As stored.
    I16(Vec<i16>),
    /// As stored.
    I32(Vec<i32>),
    /// As stored.
    I64(Vec<i64>),
    /// As stored.
    F16(Vec<f16>),
    /// As stored.
    F32(Vec<f32>),
    /// As stored.
    F64(Vec<f64>),
}

/// `$body` for the samples `$s` of whatever type `$samples` holds.
macro_rules! each_type {
    ($samples:expr, $s:ident => $body:expr) => {
        match $samples {
            Samples::U8($s) => $body,
            Samples::U16($s) => $body,
            Samples::U32($s) => $body,
            Samples::U64($s) => $body,
            Samples::I8($s) => $body,
            Samples::I16($s) => $body,
            Samples::I32($s) => $body,
            Samples::I64($s) => $body,
            Samples::F16($s) => $body,
            Samples::F32($s) => $body,
            Samples::F64($s) => $body,
        }
    };
}
pub(super) use each_type;

/// Samples of the same type by `$body` for the samples `$s` of whatever type `$samples` holds.
macro_rules! map_each {
    ($samples:expr, $s:ident => $body:expr) => {
        match $samples {
            Samples::U8($s) => Samples::U8($body),
            Samples::U16($s) => Samples::U16($body),
            Samples::U32($s) => Samples::U32($body),
            Samples::U64($s) => Samples::U64($body),
            Samples::I8($s) => Samples::I8($body),
            Samples::I16($s) => Samples::I16($body),
            Samples::I32($s) => Samples::I32($body),
            Samples::I64($s) => Samples::I64($body),
            Samples::F16($s) => Samples::F16($body),
            Samples::F32($s) => Samples::F32($body),
            Samples::F64($s) => Samples::F64($body),
        }
    };
}
pub(super) use map_each;

impl Samples {
    /// Whether they are fractions of their largest value, as codes of colours are.
    pub fn are_fractions(&self) -> bool {
        matches!(
            self,
            Self::U8(_) | Self::U16(_) | Self::U32(_) | Self::U64(_)
        )
    }
}

/// One sample.
pub(super) trait Sample: Copy {
    /// Unsigned integers are fractions of their largest value, all others stand for themselves; the nearest f32.
    fn height(self) -> f32;

    /// Whether it is the value that means "no data", told in its own type.
    fn is(self, number: &Number) -> bool;

    /// Whether colour channels with these samples in one pixel are grey there.
    fn agrees(self, other: Self) -> bool;

    /// A plane of them as texels, without loss where there is such a texel.
    fn texels(plane: Vec<Self>) -> Texels {
        Texels::F32(plane.into_iter().map(Self::height).collect())
    }
}

macro_rules! integer_sample {
    ($type:ty, $height:expr $(, $texels:path)?) => {
        impl Sample for $type {
            fn height(self) -> f32 {
                $height(self)
            }

            fn is(self, number: &Number) -> bool {
                number.integer == Some(i128::from(self))
            }

            fn agrees(self, other: Self) -> bool {
                self == other
            }

            $(
                fn texels(plane: Vec<Self>) -> Texels {
                    $texels(plane)
                }
            )?
        }
    };
}

integer_sample!(u8, |x| f32::from(x) / 255.0, Texels::U8);
integer_sample!(u16, |x| f32::from(x) / 65535.0, Texels::U16);
integer_sample!(u32, |x| (f64::from(x) / f64::from(u32::MAX)) as f32);
integer_sample!(u64, |x| (x as f64 / u64::MAX as f64) as f32);
integer_sample!(i8, f32::from);
integer_sample!(i16, f32::from);
integer_sample!(i32, |x| x as f32);
integer_sample!(i64, |x| x as f32);

macro_rules! float_sample {
    ($type:ty, $height:expr, $nearest:expr $(, $texels:path)?) => {
        impl Sample for $type {
            fn height(self) -> f32 {
                $height(self)
            }

            fn is(self, number: &Number) -> bool {
                let value: Self = $nearest(number.float);
                self == value || self.is_nan() && value.is_nan()
            }

            /// To half precision, since lossy EXR compression treats each channel for itself. Two that are no heights
            /// agree: their texel is named later.
            fn agrees(self, other: Self) -> bool {
                let (a, b) = (self.height(), other.height());
                a == b
                    || (a - b).abs() <= a.abs().max(b.abs()) / 1024.0
                    || !(a.is_finite() && b.is_finite())
            }

            $(
                fn texels(plane: Vec<Self>) -> Texels {
                    $texels(plane)
                }
            )?
        }
    };
}

float_sample!(f16, f16::to_f32, f16::from_f64);
float_sample!(f32, |x| x, |x| x as f32, Texels::F32);
float_sample!(f64, |x| x as f32, |x| x);

/// A number as text, to be compared with samples of any type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number {
    /// The whole number that it is, if it is one.
    pub integer: Option<i128>,
    /// The nearest f64.
    pub float: f64,
}

impl Number {
    /// Decimal, also with a comma, or one of the names that C libraries have for NaN and infinity.
    pub fn parse(text: &str) -> Option<Self> {
        /// Beyond, an f64 is whole, but a text with an exponent means no certain integer.
        const EXACT: f64 = (1u128 << 100) as f64;
        let text = text.trim().replace(',', ".").to_ascii_lowercase();
        if let Ok(integer) = text.parse::<i128>() {
            return Some(Self {
                integer: Some(integer),
                float: integer as f64,
            });
        }
        let bare = text.trim_start_matches(['+', '-']);
        let float = match text.parse::<f64>() {
            Ok(float) => float,
            Err(_) if bare.starts_with("nan") => f64::NAN,
            Err(_) if bare.ends_with("#qnan") || bare.ends_with("#ind") => f64::NAN,
            Err(_) => return None,
        };
        let whole = float.fract() == 0.0 && float.abs() < EXACT;
        Some(Self {
            integer: whole.then_some(float as i128),
            float,
        })
    }
}

/// A value that a file declares to stand for "no data".
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NoData {
    /// As the file writes it.
    pub text: String,
    /// Compared with the samples; `None` for a text that is no number.
    pub number: Option<Number>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str) -> Number {
        Number::parse(text).unwrap()
    }

    #[test]
    fn unsigned_samples_are_fractions_and_others_stand_for_themselves() {
        assert_eq!(u8::MAX.height(), 1.0);
        assert_eq!(u16::MAX.height(), 1.0);
        assert_eq!(u32::MAX.height(), 1.0);
        assert_eq!((1u32 << 31).height(), 0.5);
        assert_eq!(u64::MAX.height(), 1.0);
        assert_eq!((-7i8).height(), -7.0);
        assert_eq!(i16::MIN.height(), -32768.0);
        assert_eq!(16_777_217i32.height(), 16_777_216.0);
        assert_eq!(f16::from_f32(0.5).height(), 0.5);
        assert_eq!(1e-3f64.height(), 1e-3);
    }

    #[test]
    fn a_number_is_compared_in_the_sample_s_own_type() {
        assert!((-9999i16).is(&number("-9999")));
        assert!((-9999i16).is(&number(" -9.999000e+03 ")));
        assert!(!0i16.is(&number("-9999.5")));
        assert!(!u8::MAX.is(&number("-1")));
        assert!(i32::MIN.is(&number("-2147483648")));
        assert!(!(i32::MIN + 1).is(&number("-2147483648")));
        assert!(i64::MAX.is(&number("9223372036854775807")));
        assert!(!(i64::MAX - 1).is(&number("9223372036854775807")));
        assert!(f32::MIN.is(&number("-3.4028234663852886e+38")));
        assert!(f32::MIN.is(&number("-3.40282346638529e+38")));
        assert!(0.1f32.is(&number("0.1")) && 0.1f64.is(&number("0,1")));
        assert!(f16::from_f32(-9999.0).is(&number("-9999")));
        assert!((-9999.0f64).is(&number("-9999")));
    }

    #[test]
    fn nan_is_nan_by_any_name() {
        for name in [
            "nan",
            "NaN",
            "-nan",
            "nan(0x8000000000000)",
            "1.#QNAN",
            "-1.#IND",
        ] {
            assert!(f32::NAN.is(&number(name)), "{name}");
            assert!(!0f32.is(&number(name)), "{name}");
            assert!(!0u8.is(&number(name)), "{name}");
        }
        assert!(f32::NEG_INFINITY.is(&number("-inf")));
        assert_eq!(Number::parse("none"), None);
        assert_eq!(Number::parse(""), None);
    }
}
